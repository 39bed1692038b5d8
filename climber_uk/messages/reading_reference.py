"""Messages of the reference to data, as `reading`; apart, as not every node reads them."""

from typing import TYPE_CHECKING

import numpy as np

from climber_uk.mechanics.preview import Preview
from climber_uk.messages.reading import check_size, heading_of, nanoseconds

if TYPE_CHECKING:
    from geometry_msgs.msg import Twist
    from trajectory_msgs.msg import MultiDOFJointTrajectory


def preview(message: "MultiDOFJointTrajectory", odom_frame: str) -> Preview:
    """Preview of a trajectory of one joint, in `odom_frame`; `ValueError` if it is unfit."""
    if message.header.frame_id != odom_frame:
        raise ValueError(f"frame_id={message.header.frame_id!r} must be {odom_frame!r}")
    poses, velocities, accelerations = [], [], []
    for number, point in enumerate(message.points, start=1):
        if not len(point.transforms) == len(point.velocities) == len(point.accelerations) == 1:
            raise ValueError(f"point {number} must have one transform, velocity and acceleration")
        place = point.transforms[0].translation
        poses.append([place.x, place.y, heading_of(point.transforms[0].rotation)])
        velocities.append(_planar(point.velocities[0]))
        accelerations.append(_planar(point.accelerations[0]))
    check_size(pose=poses, velocity=velocities, acceleration=accelerations)
    start = nanoseconds(message.header.stamp)
    return Preview(
        times=np.array(
            [start + nanoseconds(point.time_from_start) for point in message.points], np.int64
        ),
        pose=np.array(poses),
        velocity=np.array(velocities),
        acceleration=np.array(accelerations),
    )


def _planar(twist: "Twist") -> list[float]:
    return [twist.linear.x, twist.linear.y, twist.angular.z]
