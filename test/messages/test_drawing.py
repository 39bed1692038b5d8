import math

import numpy as np
import pytest

pytest.importorskip("rclpy")
from visualization_msgs.msg import Marker

from climber_uk.messages.drawing import Drawing, colour_of, place

UP = np.array([2.0, 3.0, math.pi / 2])  # a climber at (2, 3) that goes up the wall
RED, BLUE = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 1.0)


def places(marker):
    return [(point.x, point.y, point.z) for point in marker.points]


@pytest.mark.parametrize(
    ("margin", "red", "green"),
    [(0.0, 1, 0), (1.0, 1, 0), (1.5, 1, 0.5), (2.0, 1, 1), (2.5, 0.5, 1), (3.0, 0, 1), (100, 0, 1)],
)
def test_a_margin_is_red_where_it_slips_then_yellow_then_green(margin, red, green):
    assert colour_of(margin) == (red, green, 0, 1)


def test_a_margin_that_is_no_number_is_red():
    assert colour_of(math.nan) == (1, 0, 0, 1)


@pytest.mark.parametrize(
    ("heading", "expected"),
    [(0, (2.5, 3.3)), (math.pi / 2, (1.7, 3.5)), (math.pi / 6, (2 + 0.283, 3 + 0.51))],
)
def test_a_place_on_the_climber_turns_with_it(heading, expected):
    x, y, off_wall = place(np.array([2.0, 3.0, heading]), 0.5, 0.3, 0.05)
    assert ((x, y), off_wall) == (pytest.approx(expected, abs=1e-3), 0.05)


def test_a_box_is_moved_and_turned_with_the_climber():
    drawing = Drawing(1_500_000_000, "odom")
    drawing.box("body", UP, (0.1, 0.0, -0.04), (0.3, 0.6, 0.01), RED)
    (box,) = drawing.array.markers
    position, turn = box.pose.position, box.pose.orientation
    np.testing.assert_allclose([position.x, position.y, position.z], [2, 3.1, -0.04])
    np.testing.assert_allclose([turn.z, turn.w], [math.sqrt(0.5)] * 2)
    assert (box.scale.x, box.scale.y, box.scale.z) == (0.3, 0.6, 0.01)
    assert (box.type, box.action) == (Marker.CUBE, Marker.ADD)
    assert (box.header.frame_id, box.header.stamp.sec, box.header.stamp.nanosec) == (
        "odom",
        1,
        500_000_000,
    )
    assert (box.color.r, box.color.a) == (1, 1)


def test_an_arrow_reaches_from_its_start_along_its_vector():
    drawing = Drawing(0, "odom")
    drawing.arrow("force", UP, (0.0, 0.3, 0.05), (-0.2, 0.1), BLUE)
    (arrow,) = drawing.array.markers
    np.testing.assert_allclose(places(arrow), [(1.7, 3, 0.05), (1.6, 2.8, 0.05)])


def test_the_outline_is_closed_and_its_tip_is_ahead():
    drawing = Drawing(0, "odom")
    drawing.outline("reference", UP, 0.3, BLUE)
    corners = np.array(places(drawing.array.markers[0]))
    np.testing.assert_array_equal(corners[0], corners[-1])
    np.testing.assert_allclose(corners[corners[:, 1].argmax(), :2], [2, 3 + 0.9 * 0.3])


def test_wheels_are_drawn_where_they_are():
    drawing = Drawing(0, "odom")
    drawing.climber("climber", UP, 0.3, 0.027, RED)
    plate, _, *wheels = drawing.array.markers
    assert [round(wheel.pose.position.x, 9) for wheel in wheels] == [1.7, 2.3]
    assert {wheel.scale.z for wheel in wheels} == {0.054}
    assert plate.scale.y > 0.6  # so that its colour is seen beside a robot model


def test_each_marker_of_a_message_has_a_name_of_its_own_that_begins_with_the_prefix():
    drawing = Drawing(0, "odom", prefix="climber_1/")
    drawing.line("way", [(0.0, 0.0, 0.0)], RED)
    for torque in (0.1, 0.2):
        drawing.arrow("torques", UP, (0.0, 0.0, 0.0), (torque, 0.0), RED)
    names = [(marker.ns, marker.id) for marker in drawing.array.markers]
    assert names == [("climber_1/way", 0), ("climber_1/torques", 0), ("climber_1/torques", 1)]
