"""Messages of encoders, IMU and fixes to data, as `reading` does: checked here, trusted inside."""

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.messages.names import WheelJoints
from climber_uk.messages.reading import (
    check_frame,
    check_size,
    check_stamp,
    heading_of,
    nanoseconds,
)

if TYPE_CHECKING:
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from sensor_msgs.msg import BatteryState, Imu, JointState

PLANAR = 0, 1, 5  # x, y and about z, in the six rows of a covariance
# variances of x and y [m²], and of the heading [rad²], from which on they are not measured
UNMEASURED = 1e4, 1e4, math.pi**2
LARGEST_YAW_RATE = 40.0  # [rad/s]
LEAST_FORCE, LARGEST_FORCE = 2.0, 200.0  # [m/s²]: 1 where it is told by g, 0 without gravity


class ImuFields(NamedTuple):
    """What is read of an Imu, in its own frame."""

    stamp: int  # [ns]
    yaw_rate: float  # [rad/s]
    force: tuple[float, float]  # [m/s²] along x and y


class PoseFields(NamedTuple):
    """What is read of a PoseWithCovarianceStamped: the parts of the pose that it measures."""

    stamp: int  # [ns]
    parts: tuple[int, ...]  # of (x, y, heading)
    values: Array  # (n,) [m], [rad]
    noise: Array  # (n, n)


def battery(message: "BatteryState") -> tuple[float, float]:
    """Charge, 0 to 1, and voltage [V] of a battery; nan if that is not measured."""
    charge, voltage = float(message.percentage), float(message.voltage)
    if charge < 0 or charge > 1:
        raise ValueError(f"percentage={charge:g} must be from 0 to 1")
    return charge, voltage


def stamp_of(message: "Imu | JointState | PoseWithCovarianceStamped") -> int:
    """Stamp of a message [ns], which has to be there."""
    stamp = nanoseconds(message.header.stamp)
    if stamp <= 0:
        raise ValueError(f"stamp {stamp} must be > 0 [ns]")
    check_stamp(stamp)
    return stamp


def wheel_angles(message: "JointState", joints: WheelJoints) -> tuple[float, float]:
    """Angles of the right and the left side's wheels [rad]; other joints may be there, too."""
    names, angles = list(message.name), list(message.position)
    if len(angles) != len(names):
        raise ValueError(f"{len(angles)} positions of {len(names)} names")
    for joint in joints.all:
        if names.count(joint) != 1:
            raise ValueError(f"names {names} must have {joint!r} once")
    left, right = (
        float(sum(angles[names.index(joint)] for joint in side) / len(side)) for side in joints
    )
    check_size(position=[left, right])
    return right, left


def imu(message: "Imu", frame: str) -> ImuFields:
    """Yaw rate and specific force, in `frame`."""
    check_frame(message.header.frame_id, frame)
    if (
        message.angular_velocity_covariance[0] == -1
        or message.linear_acceleration_covariance[0] == -1
    ):
        raise ValueError("a covariance begins with -1: no yaw rate, or no acceleration")
    yaw_rate, force = float(message.angular_velocity.z), message.linear_acceleration
    if not abs(yaw_rate) <= LARGEST_YAW_RATE:
        raise ValueError(
            f"angular_velocity.z={yaw_rate} must be within ± {LARGEST_YAW_RATE} [rad/s]"
        )
    size = math.hypot(force.x, force.y, force.z)
    if not LEAST_FORCE <= size <= LARGEST_FORCE:
        raise ValueError(
            f"linear_acceleration of {size:.3g} must be from {LEAST_FORCE} to {LARGEST_FORCE} "
            "[m/s²]: gravity is part of it"
        )
    return ImuFields(stamp_of(message), yaw_rate, (float(force.x), float(force.y)))


def pose(message: "PoseWithCovarianceStamped", frame: str) -> PoseFields:
    """The parts of a pose in `frame` whose variances are below `UNMEASURED`."""
    check_frame(message.header.frame_id, frame)
    covariance = np.array(message.pose.covariance).reshape(6, 6)[np.ix_(PLANAR, PLANAR)]
    variances = np.diagonal(covariance)
    if not (variances > 0).all():
        raise ValueError(f"variances {variances.tolist()} of x, y, heading must be > 0")
    parts = tuple(int(part) for part in np.flatnonzero(variances < UNMEASURED))
    if not parts:
        raise ValueError(f"variances {variances.tolist()} of x, y, heading: none is measured")
    noise = covariance[np.ix_(parts, parts)]
    if not np.isfinite(noise).all() or not (np.linalg.eigvalsh((noise + noise.T) / 2) > 0).all():
        raise ValueError(f"covariance {noise.tolist()} must be positive definite")
    position, q = message.pose.pose.position, message.pose.pose.orientation
    heading = heading_of(q.x, q.y, q.z, q.w) if 2 in parts else 0.0
    values = np.array([position.x, position.y, heading])[list(parts)]
    check_size(pose=values)
    return PoseFields(stamp_of(message), parts, values, (noise + noise.T) / 2)
