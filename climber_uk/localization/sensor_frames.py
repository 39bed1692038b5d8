"""Frames of the sensors: how the IMU is turned, and where the frame of the fixes is."""

import math

from climber_uk.localization.gate import Fix
from climber_uk.parameters.declaration import parameter, parameters


@parameters
class SensorFrames:
    """Frames of the sensors, and how the IMU is mounted."""

    imu_frame: str = parameter("", "", "frame of imu; empty: base_frame")
    imu_yaw: float = parameter(
        0.0,
        "rad",
        "angle from the climber's x to the IMU's, anticlockwise; both have z off the wall",
    )
    pose_frame: str = parameter("", "", "frame of pose; empty: odom_frame")
    pose_frame_x: float = parameter(0.0, "m", "where pose_frame's origin is in odom_frame: x")
    pose_frame_y: float = parameter(0.0, "m", "where pose_frame's origin is in odom_frame: y")
    pose_frame_yaw: float = parameter(
        0.0,
        "rad",
        "angle from the x of odom_frame to that of pose_frame, anticlockwise; both have z "
        "off the wall",
    )
    pose_x: float = parameter(
        0.0,
        "m",
        "where the point that `pose` tells of (a tag, a prism) is in base_frame: forwards of "
        "the centre",
    )
    pose_y: float = parameter(
        0.0, "m", "where the point that `pose` tells of is in base_frame: to the left of the centre"
    )
    map_frame: str = parameter(
        "map", "", "frame in which the estimate is right at once; see docs/localization.md"
    )

    def force(self, x: float, y: float) -> tuple[float, float]:
        """Specific force forwards and to the left, of one along the IMU's x and y."""
        cosine, sine = math.cos(self.imu_yaw), math.sin(self.imu_yaw)
        return x * cosine - y * sine, x * sine + y * cosine

    def fix(self, fix: Fix) -> Fix:
        """A fix in the wall's frame; raises as `Fix.moved` does."""
        moved = fix.moved(self.pose_frame_x, self.pose_frame_y, self.pose_frame_yaw)
        return moved._replace(lever=(self.pose_x, self.pose_y))
