"""Messages of an IMU and of fixes: templates, and the paths of the numbers that go into them."""

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from sensor_msgs.msg import Imu

from climber_uk.mechanics import Array
from climber_uk.messages.reading_sensors import UNMEASURED
from climber_uk.messages.writing import planar_covariance

IMU = (
    *(f"linear_acceleration.{axis}" for axis in "xyz"),
    "angular_velocity.z",
)
POSE = (
    *("pose.pose.position.x", "pose.pose.position.y"),
    *("pose.pose.orientation.z", "pose.pose.orientation.w"),
)


def imu(frame: str, yaw_rate_variance: float, force_variance: float) -> Imu:
    """A sample without an orientation; variances [(rad/s)²], [(m/s²)²] of each axis."""
    message = Imu()
    message.header.frame_id = frame
    message.orientation_covariance = np.diag([-1.0, 0.0, 0.0]).ravel()
    message.angular_velocity_covariance = (yaw_rate_variance * np.eye(3)).ravel()
    message.linear_acceleration_covariance = (force_variance * np.eye(3)).ravel()
    return message


def pose(
    frame: str, position_variance: float, heading_variance: float
) -> PoseWithCovarianceStamped:
    """A fix; a heading variance of 0: that is not measured."""
    message = PoseWithCovarianceStamped()
    message.header.frame_id = frame
    heading = heading_variance or 2 * UNMEASURED[2]
    planar: Array = np.diag([position_variance, position_variance, heading])
    message.pose.covariance = planar_covariance(planar)
    return message
