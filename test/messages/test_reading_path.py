"""A path's places, as rclpy reads them, or what is wrong in words."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("rclpy")
from geometry_msgs.msg import Point, PoseStamped
from nav_msgs.msg import Path
from rclpy.serialization import serialize_message

from climber_uk.messages.reading_path import message_points, path_points

PLACES = st.lists(st.tuples(*[st.floats(-1e5, 1e5)] * 2), min_size=2, max_size=9)


def message(places, frame="odom", frames=None):
    path = Path()
    path.header.frame_id = frame
    for number, (x, y, *z) in enumerate(places):
        pose = PoseStamped()
        pose.header.frame_id = frames[number % len(frames)] if frames else frame
        pose.pose.position = Point(x=float(x), y=float(y), z=float(*z))
        pose.pose.orientation.w = math.nan  # it is not read
        path.poses.append(pose)
    return path


@given(PLACES, st.sampled_from(["odom", "climber_12/odom", "", "o"]), st.booleans())
def test_it_reads_what_was_written_whatever_the_frames_length(places, frame, mixed):
    path = message(places, frame, [frame, ""] if mixed else None)
    np.testing.assert_array_equal(path_points(serialize_message(path), frame), places)
    np.testing.assert_array_equal(message_points(path, frame), places)


@pytest.mark.parametrize(
    ("path", "why"),
    [
        (message([(0, 0), (1, 1)], "map"), "frame_id='map' must be 'odom'"),
        (message([(0, 0), (1, 1)], "odom", ["odom", "map"]), "pose 2: frame_id='map' must be"),
        (message([(0, 0), (1, math.nan)]), r"pose 2 at \(1, nan, 0\) is not finite"),
        (message([(0, 0), (1, 1), (math.inf, 0)]), r"pose 3 at \(inf, 0, 0\) is not finite"),
        (message([(0, 0), (1, 1, math.nan)]), r"pose 2 at \(1, 1, nan\) is not finite"),
        (message([(0, 0, 2), (1, 0, 2), (1, 0, 1)]), "pose 3 has z=1, pose 1 z=2 m: a path is"),
        (message([(0, 0), (2e6, 0)]), r"pose 2 at \(2e\+06, 0\) must be within 1e\+06 m"),
        (message([]), r"0 pose\(s\), want 2 to 50000"),
        (message([(0, 0)]), r"1 pose\(s\), want 2 to 50000"),
    ],
)
def test_what_is_wrong_is_said_with_place_and_number(path, why):
    with pytest.raises(ValueError, match=why):
        path_points(serialize_message(path), "odom")
    with pytest.raises(ValueError, match=why):
        message_points(path, "odom")


@given(st.integers(0, 300), st.binary(max_size=40))
def test_damaged_bytes_are_refused_or_read_and_nothing_else(cut, garbage):
    whole = bytes(serialize_message(message([(0, 0), (1, 1), (2, 0)])))
    for data in (whole[:cut], garbage, whole[:cut] + garbage):
        said = "one line"
        try:
            assert path_points(data, "odom").shape[1] == 2
        except ValueError as error:
            said = str(error)
        assert "\n" not in said
