"""Makes odometry of what climbers carry: wheels' encoders, an IMU, and fixes that come late.

An odometry answers each message of the encoders. Until heading and position are known there is
none: a controller then waits.
"""

import math

import numpy as np
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from sensor_msgs.msg import Imu, JointState

from climber_uk.localization import models
from climber_uk.localization.gate import Fix
from climber_uk.localization.localizer import Localizer, Located
from climber_uk.localization.options import LocalizationOptions
from climber_uk.localization.sensor_frames import SensorFrames
from climber_uk.localization.smoothing import between
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import State
from climber_uk.messages import reading_sensors, writing
from climber_uk.messages.topics import IMU, JOINTS, LOCALIZATION, ODOMETRY, POSE
from climber_uk.ros.running import (
    BEST_EFFORT,
    PUBLISH_PERIOD,
    WALL_CLOCK,
    ClimberNode,
    Throttle,
    run,
)

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # it comes with a ROS installation, not with the wheels
    TFMessage = None

PLANAR_POSE = (
    *("pose.position.x", "pose.position.y"),
    *("pose.orientation.z", "pose.orientation.w"),
)
PATIENCE = 0.05  # [s] of the wall clock that encoders wait for an IMU's sample, at least
NOWHERE = State(np.zeros(3), np.zeros(3))


class WallOdometry(ClimberNode):
    """Passes messages to a `Localizer`, and what it locates on."""

    def __init__(self) -> None:
        super().__init__(LOCALIZATION)
        self.parameters.declare(LocalizationOptions)
        self.parameters.declare(SensorFrames)
        self.parameters.refuse_unknown()
        self.options = self.parameters.read(LocalizationOptions)
        self.frames = self.parameters.read(SensorFrames)
        self.localizer = Localizer(self.options)
        self.waiting: tuple[int, float, float] | None = None  # encoders, for the IMU
        self.waited: tuple[int, float, float] | None = None  # the same, a `PATIENCE` ago
        self.last_remark = ""

        names = self.names
        odometry = writing.odometry(NOWHERE, 0, names.odom_frame, names.base_frame)
        self.odometry = self.output(ODOMETRY, odometry, writing.LOCATED)
        here = PoseStamped()
        here.header.frame_id = self.frames.map_frame
        self.map_to_odom = self.output("~/map_to_odom", here, PLANAR_POSE)
        has_tf = TFMessage and self.frames.publish_tf
        self.transform = self.publisher(TFMessage, "/tf") if has_tf else None
        self.is_map_due = Throttle(PUBLISH_PERIOD)
        self.subscription(JointState, JOINTS, self.on_joints, BEST_EFFORT)
        self.subscription(Imu, IMU, self.on_imu, BEST_EFFORT)
        self.subscription(PoseWithCovarianceStamped, POSE, self.on_pose, BEST_EFFORT)
        self.create_timer(PATIENCE, self.lose_patience, clock=WALL_CLOCK)
        self.start_diagnostics(self.values, alone_on=(ODOMETRY, JOINTS, IMU))

    def summary(self) -> str:
        """Wall, and what is known at the start, for the log."""
        options = self.options
        heading = "unknown"
        if options.initial_heading_deviation <= options.initial_heading_limit:
            heading = f"{options.initial_heading:.3g} rad"
        pull = options.gravity_along_wall
        return f"gravity along the wall {pull:.3g} m/s², heading at the start {heading}"

    # Messages

    def on_joints(self, message: JointState) -> None:
        """Take the wheels' angles, once the IMU's sample of the same time is there."""
        try:
            angles = reading_sensors.wheel_angles(message, self.names.wheels)
            stamp = reading_sensors.stamp_of(message)
        except ValueError as error:
            self.report(JOINTS, "refused", str(error))
            return
        self.go_on()  # with those before: the IMU is late
        self.waiting = (stamp, *angles)
        if not self.localizer.imu.is_due(stamp):
            self.go_on()

    def on_imu(self, message: Imu) -> None:
        """Take yaw rate and specific force, turned into the climber's frame."""
        frame = self.frames.imu_frame or self.names.base_frame
        sample = self.checked(IMU, reading_sensors.imu, message, frame)
        if sample is None:
            return
        self.localizer.on_imu(sample.stamp, sample.yaw_rate, *self.frames.force(*sample.force))
        if self.waiting is not None and not self.localizer.imu.is_due(self.waiting[0]):
            self.go_on()

    def on_pose(self, message: PoseWithCovarianceStamped) -> None:
        """Take the parts of a pose that are measured."""
        fix = self.checked(POSE, self.read_fix, message)
        if fix is not None:
            self.localizer.on_fix(fix)
            self.tell_remarks()

    def read_fix(self, message: PoseWithCovarianceStamped) -> Fix:
        """Fix of a message, in odom_frame; `ValueError` if it is unfit."""
        pose = reading_sensors.pose(message, self.frames.pose_frame or self.names.odom_frame)
        return self.frames.fix(Fix(*pose))

    def lose_patience(self) -> None:
        """Go on without the IMU where its sample has not come."""
        if self.waited is self.waiting:
            self.go_on()
        self.waited = self.waiting

    def go_on(self) -> None:
        """Locate at the encoders that wait, and publish."""
        if self.waiting is None:
            return
        waiting, self.waiting = self.waiting, None
        try:
            located = self.localizer.on_encoders(*waiting)
            self.report(JOINTS, "")
        except ValueError as error:
            self.report(JOINTS, "refused", str(error))
            return
        self.tell_remarks()
        self.tell_what_is_missing(waiting[0])
        if located is not None:
            self.publish(located)

    # Outputs

    def publish(self, located: Located) -> None:
        """Publish an odometry."""
        x, y, heading, *_, speed, yaw_rate = located.motion
        speed_variance, yaw_variance = located.twist_variances
        twist = np.diag([speed_variance, speed_variance, yaw_variance])
        self.odometry.publish(
            located.stamp,
            *(x, y, math.sin(heading / 2), math.cos(heading / 2), speed, located.aside, yaw_rate),
            writing.planar_covariance(located.pose_covariance),
            writing.planar_covariance(twist),
        )
        if self.is_map_due(located.stamp):
            self.publish_map(located)

    def publish_map(self, located: Located) -> None:
        """Publish where odom_frame is in map_frame, in which corrections act at once."""
        motion = located.motion
        output = np.array([motion.x, motion.y, motion.heading])
        x, y, angle = between(self.localizer.estimate.mean[:3], output)
        self.map_to_odom.publish(located.stamp, x, y, math.sin(angle / 2), math.cos(angle / 2))
        if self.transform is not None and self.transform.get_subscription_count():
            frames = self.frames.map_frame, self.names.odom_frame
            message = writing.transform((x, y, angle), located.stamp, *frames)
            self.transform.publish(TFMessage(transforms=[message]))

    def tell_remarks(self) -> None:
        """Report what the localizer says of fixes and stamps; that of a good fix ends it."""
        remarks, self.localizer.remarks = self.localizer.remarks, []
        for remark in remarks:
            self.last_remark = remark
            subject, _, detail = remark.partition(": ")
            self.report("localization", subject, detail, is_fault=False)
        if not remarks and self.localizer.last_was_taken:
            self.report("localization", "")

    def tell_what_is_missing(self, stamp: int) -> None:
        """Report an IMU and fixes that are not there, and what is not known: at first, or later."""
        localizer, options = self.localizer, self.options
        absent = not localizer.imu.is_there(stamp)
        self.report("samples of imu", "none: yaw rate by the wheels" * absent, "", is_fault=False)
        doubts = localizer.doubts
        self.report("fixes", "they have stopped" * doubts.have_stopped(stamp), "", is_fault=False)
        self.report("location", "not known any more" * bool(doubts.unknown), doubts.said)
        missing = []
        if localizer.located is None and not localizer.knows_heading:
            missing.append(f"heading to {options.initial_heading_limit:g} rad")
        if localizer.located is None and not localizer.knows_position:
            missing.append(f"position to {options.initial_position_limit:g} m")
        self.report("start", "waits" * bool(missing), f"for {' and '.join(missing)}")

    def values(self) -> dict[str, object]:
        """Values for diagnostics."""
        localizer, estimate = self.localizer, self.localizer.estimate
        counts, stamp, fixed = localizer.counts, localizer.stamp, localizer.fixed
        age = (stamp - fixed) / SECOND if stamp is not None and fixed is not None else math.inf

        def with_deviation(part: int) -> str:
            return f"{estimate.mean[part]:.4g} ± {estimate.deviation(part):.2g}"

        return {
            "x [m]": with_deviation(models.X),
            "y [m]": with_deviation(models.Y),
            "heading [rad]": with_deviation(models.HEADING),
            "bias of the gyro [rad/s]": with_deviation(models.BIAS),
            "bias of the accelerometer, forwards [m/s²]": with_deviation(models.FORWARD_BIAS),
            "bias of the accelerometer, left [m/s²]": with_deviation(models.LEFT_BIAS),
            "scale error of the encoders": with_deviation(models.SCALE),
            "creep": with_deviation(models.CREEP),
            "scrub [m]": with_deviation(models.SCRUB),
            "pivot [m]": with_deviation(models.PIVOT),
            "slip by drag": with_deviation(models.DRAG_SLIP),
            "slip by weight": with_deviation(models.WEIGHT_SLIP),
            "gravity along the wall [m/s²]": self.options.gravity_along_wall,
            "output less estimate [m, m, rad]": [f"{o:.3g}" for o in localizer.smoothing.offset],
            "fixes taken": counts.taken,
            "fixes refused": counts.refused,
            "fixes believed against the estimate": counts.believed,
            "last fix taken, age [s]": age,
            "last innovation, of what may be": localizer.gate.ratio,
            "last remark": self.last_remark,
        }


def main() -> None:
    """Run the node."""
    run(lambda: [WallOdometry()], __doc__)
