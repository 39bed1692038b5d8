"""What is taken of encoders, an IMU and fixes, and what is refused, with its value and bound."""

import math
from copy import deepcopy
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.messages import reading_sensors
from climber_uk.messages.names import wheel_joints

NAN = math.nan


def namespace(fields):
    """An object whose fields may be objects."""
    return SimpleNamespace(
        **{
            name: namespace(value) if isinstance(value, dict) else value
            for name, value in fields.items()
        }
    )


def header(frame=""):
    return {"stamp": {"sec": 3, "nanosec": 5}, "frame_id": frame}


JOINTS = {"header": header(), "name": ["left", "arm", "right"], "position": [1.0, 9.0, 2.0]}
IMU = {
    "header": header("imu_link"),
    "angular_velocity": {"x": 0.0, "y": 0.0, "z": 0.5},
    "angular_velocity_covariance": [0.0] * 9,
    "linear_acceleration": {"x": 1.0, "y": 9.7, "z": 0.1},
    "linear_acceleration_covariance": [0.0] * 9,
}
POSE = {
    "header": header("map"),
    "pose": {
        "pose": {
            "position": {"x": 1.0, "y": 2.0, "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(0.2), "w": math.cos(0.2)},
        },
        "covariance": np.diag([0.01, 0.02, 1e-6, 1e-6, 1e-6, 0.03]).ravel(),
    },
}
READ = {
    "joints": (JOINTS, lambda m: reading_sensors.wheel_angles(m, wheel_joints("left", "right"))),
    "imu": (IMU, lambda m: reading_sensors.imu(m, "imu_link")),
    "pose": (POSE, lambda m: reading_sensors.pose(m, "map")),
}


def read(kind, path="", value=None):
    """What is read of a message of a kind with another value at a path."""
    fields, reads = READ[kind]
    fields = deepcopy(fields)
    *above, last = path.split(".")
    inner = fields
    for name in above:
        inner = inner[name]
    if last:
        inner[last] = value
    return reads(namespace(fields))


def test_what_is_sound_is_taken():
    assert read("joints") == (2.0, 1.0)  # right, left
    assert read("imu") == (3_000_000_005, 0.5, (1.0, 9.7))
    stamp, parts, values, noise = read("pose")
    assert (stamp, parts) == (3_000_000_005, (0, 1, 2))
    np.testing.assert_allclose(values, [1.0, 2.0, 0.4])
    np.testing.assert_allclose(noise, np.diag([0.01, 0.02, 0.03]))


def test_a_part_with_a_large_variance_is_not_measured_whatever_it_says():
    covariance = np.diag([0.01, 1e9, 1, 1, 1, math.inf])
    pose = deepcopy(POSE)
    pose["pose"]["covariance"] = covariance.ravel()
    pose["pose"]["pose"]["orientation"]["w"] = 0.0  # no rotation at all
    _, parts, values, noise = reading_sensors.pose(namespace(pose), "map")
    assert (parts, values.tolist(), noise.tolist()) == ((0,), [1.0], [[0.01]])


def covariance(*rows):
    """36 numbers with these (3, 3) of x, y and about z."""
    whole = np.zeros((6, 6))
    whole[np.ix_((0, 1, 5), (0, 1, 5))] = rows
    return whole.ravel()


REFUSED = [
    ("joints", "name", ["left", "arm", "wheel"], "must have 'right' once"),
    ("joints", "name", ["left", "right", "right"], "must have 'right' once"),
    ("joints", "position", [], "0 positions of 3 names"),
    ("joints", "position", [1.0, 0.0, NAN], "not finite"),
    ("imu", "header.frame_id", "base_link", "frame_id='base_link' must be 'imu_link'"),
    ("imu", "header.stamp", {"sec": 0, "nanosec": 0}, "stamp 0 must be > 0"),
    ("imu", "header.stamp", {"sec": 2**31 - 1, "nanosec": 2**32 - 1}, "stamp 2147483651 must be"),
    ("imu", "angular_velocity.z", 57.0, "angular_velocity.z=57.0 must be within"),
    ("imu", "angular_velocity.z", NAN, "angular_velocity.z=nan must be within"),
    ("imu", "linear_acceleration", {"x": 0.0, "y": 1.0, "z": 0.0}, "gravity is part of it"),
    ("imu", "linear_acceleration", {"x": 0.0, "y": NAN, "z": 0.0}, "linear_acceleration of nan"),
    ("imu", "linear_acceleration.x", 9810.0, "linear_acceleration of 9.81e"),
    ("imu", "angular_velocity_covariance", [-1.0] * 9, "begins with -1: no yaw rate"),
    ("pose", "header.frame_id", "odom", "frame_id='odom' must be 'map'"),
    ("pose", "pose.covariance", [0.0] * 36, "variances .* must be > 0"),
    ("pose", "pose.covariance", [NAN] * 36, "variances .* must be > 0"),
    ("pose", "pose.covariance", covariance((9e9, 0, 0), (0, 9e9, 0), (0, 0, 99)), "none is"),
    ("pose", "pose.covariance", covariance((1, 2, 0), (2, 1, 0), (0, 0, 1)), "positive definite"),
    ("pose", "pose.pose.position.x", 1e9, "pose .* not finite, or above"),
    ("pose", "pose.pose.orientation.w", 0.0, "must be a unit turn about z"),
]


@pytest.mark.parametrize(("kind", "path", "value", "said"), REFUSED)
def test_what_is_not_is_refused_in_a_line(kind, path, value, said):
    with pytest.raises(ValueError, match=said) as error:
        read(kind, path, value)
    assert "\n" not in str(error.value)


@given(diagonal=st.lists(st.floats(), min_size=3, max_size=3), off=st.floats())
def test_whatever_a_covariance_is_a_fix_that_is_taken_has_a_sound_one(diagonal, off):
    rows = np.diag(diagonal)
    rows[0, 1] = rows[1, 0] = off
    try:
        _, parts, _, noise = read("pose", "pose.covariance", covariance(*rows))
    except ValueError:
        return
    assert noise.shape == (len(parts), len(parts))
    assert (np.linalg.eigvalsh(noise) > 0).all()
