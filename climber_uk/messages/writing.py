"""Data to messages: pure functions. Stamps are integers in nanoseconds.

Arrays of two wheels are (right, left), messages have (left, right): `left_right` swaps them.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import (
    PoseStamped,
    Quaternion,
    TransformStamped,
    Vector3,
    Vector3Stamped,
    WrenchStamped,
)
from nav_msgs.msg import Odometry, Path
from rcl_interfaces.msg import ParameterEvent
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.quantities import State
from climber_uk.messages.names import WheelJoints

if TYPE_CHECKING:
    from climber_uk.mechanics.reference import Reference

UNKNOWN = 1e-6  # variance of what a wall leaves no freedom: z, roll and pitch, in SI units
ROUNDING_COVARIANCE = np.diag([1e-12] * 6).ravel()
ROUNDING_COVARIANCE.setflags(write=False)  # messages share it
OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR


def time(nanoseconds: int) -> Time:
    """Message of a stamp [ns]."""
    return Time(sec=nanoseconds // SECOND, nanosec=nanoseconds % SECOND)


# paths of the numbers in messages whose others stay the same; their strings do, too
ODOMETRY = (
    *("pose.pose.position.x", "pose.pose.position.y"),
    *("pose.pose.orientation.z", "pose.pose.orientation.w"),
    *("twist.twist.linear.x", "twist.twist.linear.y", "twist.twist.angular.z"),
)
WHEEL_COMMAND = "velocity", "effort"
JOINT_STATE = "position", "velocity", "effort"
TWIST = "twist.linear.x", "twist.angular.z"
VECTOR = "vector.x", "vector.y", "vector.z"
TIME_REFERENCE = "time_ref.sec", "time_ref.nanosec"
WRENCH = "wrench.force.x", "wrench.force.y", "wrench.torque.z"


def odometry(state: State, stamp: int, odom_frame: str, base_frame: str) -> Odometry:
    """Odometry of a state that is known exactly, but for rounding: covariances 1e-12."""
    message = Odometry(child_frame_id=base_frame)
    message.header.stamp = time(stamp)
    message.header.frame_id = odom_frame
    position, orientation = message.pose.pose.position, message.pose.pose.orientation
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    position.x, position.y, orientation.z, orientation.w, *twist = odometry_numbers(state)
    linear.x, linear.y, angular.z = twist
    message.pose.covariance = message.twist.covariance = ROUNDING_COVARIANCE
    return message


# paths of the numbers that `located_numbers` has, for those of `ODOMETRY` with covariances
LOCATED = (*ODOMETRY, "pose.covariance", "twist.covariance")


def planar_covariance(covariance: Array) -> list[float]:
    """The 36 of a message from that (3, 3) of x, y and about z; of the others `UNKNOWN`."""
    whole = [0.0] * 36
    whole[14] = whole[21] = whole[28] = UNKNOWN
    whole[0:2], whole[6:8], whole[30:32] = covariance[:, :2].tolist()
    whole[5], whole[11], whole[35] = covariance[:, 2].tolist()
    return whole


def odometry_numbers(state: State) -> tuple[float, ...]:
    """Numbers of a state, for the paths of `ODOMETRY`."""
    x, y, heading, cosine, sine, speed, yaw_rate = state.motion
    v_x, v_y, _ = state.velocity.tolist()
    slip = v_y * cosine - v_x * sine
    return x, y, math.sin(heading / 2), math.cos(heading / 2), speed, slip, yaw_rate


def transform(pose: Sequence[float], stamp: int, frame: str, child_frame: str) -> TransformStamped:
    """Transform to `child_frame`, whose `pose` (3,) is x, y [m], heading [rad] in `frame`."""
    x, y, heading = pose
    message = TransformStamped(child_frame_id=child_frame)
    message.header.stamp = time(stamp)
    message.header.frame_id = frame
    message.transform.translation = Vector3(x=x, y=y)
    message.transform.rotation = quaternion(heading)
    return message


def wheel_torques(torques: Array, stamp: int, joints: WheelJoints) -> JointState:
    """Message of torques (2,) (right, left) [N m]; `stamp` is that of the odometry they answer."""
    message = JointState(name=joints.all)
    message.effort = joints.torques(*left_right(torques))
    message.header.stamp = time(stamp)
    return message


def left_right(pair: Array) -> list[float]:
    """Numbers of the wheels in the order of messages, from an array (2,) (right, left)."""
    right, left = map(float, pair)
    return [left, right]


def reference_numbers(reference: "Reference", time: float) -> tuple[float, ...]:
    """Numbers of a reference `time` [s] after its start, for the paths of `references.POINT`."""
    x, y, heading = reference.pose.tolist()
    rotation = 0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2)
    twists = *reference.velocity.tolist(), *reference.acceleration.tolist()
    return x, y, *rotation, *twists, *divmod(round(time * SECOND), SECOND)


def reference(
    points: Iterable[MultiDOFJointTrajectoryPoint], start: int, odom_frame: str, base_frame: str
) -> MultiDOFJointTrajectory:
    """Preview message: points of a trajectory that started at `start` [ns]."""
    message = MultiDOFJointTrajectory(joint_names=[base_frame], points=list(points))
    message.header.stamp = time(start)
    message.header.frame_id = odom_frame
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


def progress(name: str, values: Mapping[str, Any], stamp: int) -> DiagnosticArray:
    """Progress of the node `name`: its `state` as the message, what else there is by name."""
    numbers = {key: value for key, value in values.items() if key != "state"}
    return diagnostics(name, DiagnosticStatus.OK, values["state"], numbers, stamp)


def parameters(values: Mapping[str, object], node: str, stamp: int) -> ParameterEvent:
    """Message of parameters of a node, by name, with their values."""
    named = [Parameter(name, value=value) for name, value in values.items()]
    message = ParameterEvent(stamp=time(stamp), node=node)
    message.new_parameters = [parameter.to_parameter_msg() for parameter in named]
    return message


def quaternion(heading: float) -> Quaternion:
    """Quaternion of a rotation about z by `heading` [rad]."""
    return Quaternion(z=math.sin(heading / 2), w=math.cos(heading / 2))
