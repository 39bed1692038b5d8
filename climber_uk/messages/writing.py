"""Data to messages: pure functions. Stamps are integers in nanoseconds.

Arrays of two wheels are (right, left), messages have (left, right): `left_right` swaps them.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from builtin_interfaces.msg import Duration, Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import (
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    Vector3,
    Vector3Stamped,
    WrenchStamped,
)
from nav_msgs.msg import Odometry, Path
from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState, TimeReference
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.quantities import State

if TYPE_CHECKING:
    from climber_uk.mechanics.reference import Reference

ROUNDING_COVARIANCE = np.diag([1e-12] * 6).ravel()
ROUNDING_COVARIANCE.setflags(write=False)  # messages share it
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


def time(nanoseconds: int) -> Time:
    """Message of a stamp [ns]."""
    return Time(sec=nanoseconds // SECOND, nanosec=nanoseconds % SECOND)


def odometry(state: State, stamp: int, odom_frame: str, base_frame: str) -> Odometry:
    """Odometry of a state that is known exactly, but for rounding: covariances 1e-12."""
    message = Odometry(child_frame_id=base_frame)
    message.header.stamp = time(stamp)
    message.header.frame_id = odom_frame
    message.pose.pose.position.x = float(state.pose[0])
    message.pose.pose.position.y = float(state.pose[1])
    message.pose.pose.orientation = quaternion(float(state.heading))
    message.twist.twist.linear.x = float(state.forward_speed)
    message.twist.twist.linear.y = float(state.side_slip)
    message.twist.twist.angular.z = float(state.velocity[2])
    message.pose.covariance = message.twist.covariance = ROUNDING_COVARIANCE
    return message


def transform(odometry: Odometry) -> TransformStamped:
    """Transform of an odometry's pose."""
    message = TransformStamped(header=odometry.header, child_frame_id=odometry.child_frame_id)
    position = odometry.pose.pose.position
    message.transform.translation = Vector3(x=position.x, y=position.y)
    message.transform.rotation = odometry.pose.pose.orientation
    return message


def wheel_torques(torques: Array, stamp: int, left_joint: str, right_joint: str) -> JointState:
    """Message of torques (2,) (right, left) [N m]; `stamp` is that of the odometry they answer."""
    message = JointState(name=[left_joint, right_joint])
    message.effort = left_right(torques)
    message.header.stamp = time(stamp)
    return message


def left_right(pair: Array) -> list[float]:
    """Numbers of the wheels in the order of messages, from an array (2,) (right, left)."""
    right, left = map(float, pair)
    return [left, right]


def reference_point(reference: "Reference", time: float) -> MultiDOFJointTrajectoryPoint:
    """Point of a trajectory message: a reference `time` [s] after the trajectory's start."""
    x, y, heading = reference.pose.tolist()
    point = MultiDOFJointTrajectoryPoint()
    point.transforms = [Transform(translation=Vector3(x=x, y=y), rotation=quaternion(heading))]
    point.velocities = [_twist(reference.velocity)]
    point.accelerations = [_twist(reference.acceleration)]
    since = round(time * SECOND)
    point.time_from_start = Duration(sec=since // SECOND, nanosec=since % SECOND)
    return point


def reference(
    points: Iterable[MultiDOFJointTrajectoryPoint], start: int, odom_frame: str, base_frame: str
) -> MultiDOFJointTrajectory:
    """Preview message: points of a trajectory that started at `start` [ns]."""
    message = MultiDOFJointTrajectory(joint_names=[base_frame], points=list(points))
    message.header.stamp = time(start)
    message.header.frame_id = odom_frame
    return message


def time_reference(reference: int, stamp: int, source: str) -> TimeReference:
    """Time of the reference [ns] that is followed at `stamp` [ns]; `source` is the mode."""
    message = TimeReference(time_ref=time(reference), source=source)
    message.header.stamp = time(stamp)
    return message


def path(poses: Array, stamp: int, odom_frame: str) -> Path:
    """Path message through poses (n, 3) [m, rad]."""
    path = Path()
    path.header.stamp = time(stamp)
    path.header.frame_id = odom_frame
    for x, y, heading in poses.tolist():
        pose = PoseStamped(header=path.header)
        pose.pose.position.x, pose.pose.position.y = x, y
        pose.pose.orientation = quaternion(heading)
        path.poses.append(pose)
    return path


def vector(vector: Iterable[Array | float], stamp: int, frame: str) -> Vector3Stamped:
    """Message of three numbers with a stamp [ns] and a frame."""
    x, y, z = (float(component) for component in vector)
    message = Vector3Stamped(vector=Vector3(x=x, y=y, z=z))
    message.header.stamp = time(stamp)
    message.header.frame_id = frame
    return message


def wrench(planar: Sequence[float] | Array, stamp: int, frame: str) -> WrenchStamped:
    """Message of a planar wrench (3,): x, y [N], about z [N m]."""
    message = WrenchStamped()
    message.wrench.force.x, message.wrench.force.y = float(planar[0]), float(planar[1])
    message.wrench.torque.z = float(planar[2])
    message.header.stamp = time(stamp)
    message.header.frame_id = frame
    return message


def diagnostics(
    name: str, level: bytes, trouble: str, values: Mapping[str, object], stamp: int
) -> DiagnosticArray:
    """Diagnostics message of one status; an empty `trouble` reads ok."""
    status = DiagnosticStatus(
        name=name,
        level=level,
        message=trouble or "ok",
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
    )
    message = DiagnosticArray(status=[status])
    message.header.stamp = time(stamp)
    return message


def parameters(values: Mapping[str, object], node: str, stamp: int) -> ParameterEvent:
    """Message of parameters of a node, by name, with their values."""
    named = [Parameter(name, value=value) for name, value in values.items()]
    message = ParameterEvent(stamp=time(stamp), node=node)
    message.new_parameters = [parameter.to_parameter_msg() for parameter in named]
    return message


def quaternion(heading: float) -> Quaternion:
    """Quaternion of a rotation about z by `heading` [rad]."""
    return Quaternion(z=math.sin(heading / 2), w=math.cos(heading / 2))


def _twist(planar: Array) -> Twist:
    x, y, yaw = planar.tolist()
    return Twist(linear=Vector3(x=x, y=y), angular=Vector3(z=yaw))
