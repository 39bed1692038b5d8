"""Messages to data; no ROS needed: any object with the fields of a message is taken.

Everything is checked here, and trusted inside: `ValueError` names what is unfit, and its value.
Stamps are integers in nanoseconds. Messages have wheels by name; arrays have (right, left).
"""

import math
from collections.abc import Sequence
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.elementary import arctan2, sqrt
from climber_uk.mechanics.quantities import Motion, State, Torques
from climber_uk.messages.names import WheelJoints, listed

if TYPE_CHECKING:
    from builtin_interfaces.msg import Duration, Time
    from geometry_msgs.msg import WrenchStamped
    from nav_msgs.msg import Odometry
    from rcl_interfaces.msg import ParameterEvent
    from sensor_msgs.msg import FluidPressure, JointState


STAMP = "header.stamp.sec", "header.stamp.nanosec"
LAST_STAMP = 2**31 * SECOND - 1  # [ns] that a message can tell
LARGEST = 1e6  # of any quantity of a climber, in SI units
NORM_TOLERANCE = 0.01  # of a quaternion's norm, which is 1; the same as tf2's
MOST_TILT = 0.1  # of a unit quaternion's hypot(x, y): 11.5° off a rotation about z


def nanoseconds(time: "Time | Duration") -> int:
    """Nanoseconds of a stamp or a duration."""
    return int(time.sec) * SECOND + int(time.nanosec)


def check_stamp(stamp: int) -> None:
    """Raise `ValueError` for a stamp [ns] that no answer could have: nanosec may be 4e9."""
    if not -LAST_STAMP <= stamp <= LAST_STAMP:
        raise ValueError(f"stamp {stamp / SECOND:.0f} must be within ± 2**31 [s]")


def check_frame(frame: str, wanted: str, name: str = "frame_id", by: str = "") -> None:
    """Raise `ValueError` naming the field of a message unless it has the frame that is wanted.

    `by` are the parameters that say which one it is.
    """
    if frame != wanted:
        raise ValueError(f"{name}={frame!r} must be {wanted!r}" + (by and f": see {by}"))


class OdometryFields(NamedTuple):
    """What is read of an Odometry; pose and twist in the frames that the strings name."""

    sec: int
    nanosec: int
    x: float  # [m]
    y: float
    z: float  # off the wall: no part of a motion
    q_x: float  # orientation, a quaternion
    q_y: float
    q_z: float
    q_w: float
    v_x: float  # [m/s] forwards
    v_y: float
    yaw_rate: float  # [rad/s]
    frame: str
    child_frame: str

    @classmethod
    def of(cls, message: "Odometry") -> "OdometryFields":
        """Those of a message."""
        return cls(*_odometry(message))

    @property
    def stamp(self) -> int:
        """In nanoseconds."""
        return self.sec * SECOND + self.nanosec


class JointFields(NamedTuple):
    """What is read of a JointState: its efforts, or its velocities."""

    sec: int
    nanosec: int
    values: Sequence[float]  # [N m], or [rad/s]
    names: Sequence[str]  # of their joints

    @classmethod
    def of(cls, message: "JointState") -> "JointFields":
        """Those of a message, with its efforts."""
        return cls(*_joint_state(message))

    @property
    def stamp(self) -> int:
        """In nanoseconds."""
        return self.sec * SECOND + self.nanosec


# the paths of these fields: numbers, then strings
ODOMETRY = (
    (
        *STAMP,
        *(f"pose.pose.position.{axis}" for axis in "xyz"),
        *(f"pose.pose.orientation.{axis}" for axis in "xyzw"),
        *("twist.twist.linear.x", "twist.twist.linear.y", "twist.twist.angular.z"),
    ),
    ("header.frame_id", "child_frame_id"),
)
JOINT_STATE = (*STAMP, "effort"), ("name",)
JOINT_RATES = (*STAMP, "velocity"), ("name",)
_odometry, _joint_state = (attrgetter(*sum(paths, ())) for paths in (ODOMETRY, JOINT_STATE))


def motion(message: "Odometry", odom_frame: str, base_frame: str) -> Motion:
    """Motion of a message, as `motion_of`."""
    return motion_of(OdometryFields.of(message), odom_frame, base_frame)


def state(message: "Odometry", odom_frame: str, base_frame: str) -> State:
    """State of a message in `odom_frame`; with its side slip, unlike its `motion`."""
    fields = OdometryFields.of(message)
    return State.moving(motion_of(fields, odom_frame, base_frame), fields.v_y)


def motion_of(fields: OdometryFields, odom_frame: str, base_frame: str) -> Motion:
    """Motion of the climber in `odom_frame`, the wall's, from a twist in `base_frame`."""
    check_frame(fields.frame, odom_frame, by="odom_frame, prefix_frames")
    check_frame(fields.child_frame, base_frame, "child_frame_id", "base_frame, prefix_frames")
    _, _, x, y, _, q_x, q_y, q_z, q_w, v_x, v_y, yaw_rate, _, _ = fields
    check_stamp(fields.stamp)
    heading = heading_of(q_x, q_y, q_z, q_w)
    if not all(abs(number) <= LARGEST for number in (x, y, v_x, v_y, yaw_rate)):
        check_size(position=[x, y], twist=[v_x, v_y, yaw_rate])
    return Motion(x, y, heading, math.cos(heading), math.sin(heading), v_x, yaw_rate)


Told = Literal["efforts", "velocities"]


def wheel_torques(fields: JointFields, joints: WheelJoints, what: Told = "efforts") -> Torques:
    """Torques [N m] of the sides, or their rates [rad/s]: `what` the fields' values are.

    The torque of a side is the sum of its wheels', its rate their mean.
    """
    names, values = list(fields.names), list(fields.values)
    if names != joints.all and sorted(names) != sorted(joints.all):
        raise ValueError(f"names {names} must be {listed(joints.all)}")
    if len(values) != len(names):
        raise ValueError(f"{len(values)} {what} must be {len(names)}")
    if not all(map(math.isfinite, values)):
        raise ValueError(f"{what} {[float(value) for value in values]} must be finite")
    told = dict(zip(names, values, strict=True))
    left, right = (sum(told[name] for name in side) for side in joints)
    if what == "velocities":
        return Torques(right / len(joints.right), left / len(joints.left))
    return Torques(right, left)


def pressure(message: "FluidPressure", most: float = LARGEST) -> float:
    """Pressure difference of the suction [Pa], from 0 to `most`, and to `LARGEST`."""
    pressure, most = float(message.fluid_pressure), min(most, LARGEST)
    if not 0 <= pressure <= most:
        raise ValueError(
            f"fluid_pressure={pressure:g} must be from 0 to {most:g} [Pa], a difference"
        )
    return pressure


def wrench(message: "WrenchStamped", odom_frame: str, base_frame: str) -> tuple[Array, bool]:
    """Planar wrench (3,) x, y [N], about z [N m]; and whether its frame is `base_frame`."""
    frame = message.header.frame_id
    if frame not in (odom_frame, base_frame):
        raise ValueError(f"frame_id={frame!r} must be {odom_frame!r} or {base_frame!r}")
    force, torque = message.wrench.force, message.wrench.torque
    planar = np.array([force.x, force.y, torque.z])
    check_size(wrench=planar)
    return planar, frame == base_frame


def parameters(message: "ParameterEvent") -> dict[str, bool | int | float | str]:
    """Values, by name, of all parameters that are a bool, a number or a string."""
    kinds = {1: "bool_value", 2: "integer_value", 3: "double_value", 4: "string_value"}
    pairs = [(changed.name, changed.value) for changed in message.new_parameters]
    return {name: getattr(value, kinds[value.type]) for name, value in pairs if value.type in kinds}


def check_size(**vectors: "Array | Sequence[float] | Sequence[Sequence[float]]") -> None:
    """Raise `ValueError` naming the vector that is not finite, or beyond ± `LARGEST`."""
    for name, vector in vectors.items():
        if not (np.abs(vector) <= LARGEST).all():
            raise ValueError(f"{name} {vector} is not finite, or above {LARGEST:g} in SI units")


def heading_of(x: float, y: float, z: float, w: float) -> float:
    """Heading in [-π, π] [rad]; `ValueError` unless it is a unit quaternion (nearly) about z."""
    heading, norm, tilted, is_unit, is_planar = rotation_about_z(x, y, z, w)
    if not (is_unit and is_planar):
        raise ValueError(
            f"orientation ({x}, {y}, {z}, {w}) must be a unit turn about z: "
            f"norm {norm:.4g} from {1 - NORM_TOLERANCE} to {1 + NORM_TOLERANCE}, "
            f"hypot(x, y) {tilted:.4g} < {MOST_TILT}"
        )
    return float(heading)


def rotation_about_z(x: Any, y: Any, z: Any, w: Any) -> tuple[Any, Any, Any, Any, Any]:
    """Heading of a quaternion, or of many (n,); its norm, its tilt, and whether both are fit."""
    norm, tilted = sqrt(x * x + y * y + z * z + w * w), sqrt(x * x + y * y)
    is_unit, is_planar = abs(norm - 1) <= NORM_TOLERANCE, tilted < MOST_TILT * norm
    return arctan2(2 * w * z, w * w - z * z), norm, tilted, is_unit, is_planar
