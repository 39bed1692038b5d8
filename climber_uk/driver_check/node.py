"""The node of check_driver: collects odometry, and answers it with the torques of a trial."""

import time
from bisect import bisect_right
from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState

from climber_uk.driver_check.evidence import (
    NOTHING,
    PLANAR,
    Arrival,
    Evidence,
    ExpectedDriver,
    SensorStamps,
    WheelCommand,
    WheelRates,
)
from climber_uk.driver_check.graph import graph, others_commanding
from climber_uk.driver_check.trial import AGAIN, Bounds, Trial
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber
from climber_uk.messages import reading, writing
from climber_uk.messages.topics import CLOCK, IMU, JOINTS, ODOMETRY, POSE, TORQUES
from climber_uk.ros.running import ClimberNode

MANY = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
ZERO_AFTER, STOP_AFTER = 0.5, 5.0  # [s] without odometry: zero torque; end of the trial
PERIOD_MESSAGES = 100  # by which the period is estimated


class DriverNode(ClimberNode):
    """Collects odometry and, once it commands, answers each with torques."""

    def __init__(self, arguments: Sequence[str] | None = None) -> None:
        super().__init__("check_driver", arguments=arguments)
        for kind in (Climber, ExpectedDriver, Bounds):
            self.parameters.declare(kind)
        self.parameters.refuse_unknown()
        self.arrivals: list[Arrival] = []
        self.simulated: list[tuple[int, int]] = []  # [ns] when it came, what /clock said
        self.heard_at = 0  # [ns] on the steady clock
        self.trial: Trial | None = None
        self.torques: Publisher | None = None  # only once no other node commands
        self.answer: JointState | None = None
        self.turning: list[WheelRates] = []
        self.subscription(JointState, JOINTS, self.on_joints, MANY)
        self.odometry = self.subscription(Odometry, ODOMETRY, self.on_odometry, MANY)
        self.subscription(Clock, CLOCK, self.on_clock, MANY)
        self.imu: list[tuple[int, int, str, list[float]]] = []
        self.fixes: list[tuple[int, int, str, list[float]]] = []
        self.subscription(Imu, IMU, self.on_imu, MANY)
        self.subscription(PoseWithCovarianceStamped, POSE, self.on_fix, MANY)

    def on_imu(self, message: Imu) -> None:
        """Keep a sample; nobody has to publish any."""
        rates, forces = message.angular_velocity, message.linear_acceleration
        values = [rates.x, rates.y, rates.z, forces.x, forces.y, forces.z]
        self.imu.append((*self.times(message), values))

    def on_fix(self, message: PoseWithCovarianceStamped) -> None:
        """Keep a fix; nobody has to publish any."""
        place, covariance = message.pose.pose.position, message.pose.covariance
        values = [place.x, place.y, *(float(covariance[i]) for i in PLANAR)]
        self.fixes.append((*self.times(message), values))

    def times(self, message: Imu | PoseWithCovarianceStamped) -> tuple[int, int, str]:
        """Stamp [ns], arrival by this node's clock, and frame of a message."""
        header = message.header
        return (
            reading.nanoseconds(header.stamp),
            self.get_clock().now().nanoseconds,
            header.frame_id,
        )

    def on_clock(self, message: Clock, info: dict[str, int]) -> None:
        """Keep a simulated time, and when it was received."""
        self.simulated.append((info["received_timestamp"], reading.nanoseconds(message.clock)))

    def on_joints(self, message: JointState) -> None:
        """Keep the wheels' rates, if they are told; nobody has to."""
        stamp = reading.nanoseconds(message.header.stamp)
        fields = reading.JointFields(*divmod(stamp, SECOND), message.velocity, message.name)
        with suppress(ValueError):
            right, left = reading.wheel_torques(fields, self.names.wheels, "velocities")
            self.turning.append(WheelRates(stamp, right, left))

    def on_odometry(self, message: Odometry, info: dict[str, int]) -> None:
        """Keep an odometry, and answer it if this node commands.

        Its arrival is when the middleware received it: how long it then waited for this node is no
        property of the driver.
        """
        self.heard_at = time.monotonic_ns()
        came = info["received_timestamp"]
        boot = self.heard_at - (time.time_ns() - came)
        self.arrivals.append(Arrival(message, came, boot, simulated=0))
        if self.torques is not None:
            self.command(message)

    def command(self, message: Odometry) -> None:
        """Answer an odometry with torques; a repeated one with the same torques."""
        stamp = reading.nanoseconds(message.header.stamp)
        if self.answer is None or stamp != reading.nanoseconds(self.answer.header.stamp):
            command = self.decide(message, stamp)
            self.answer = None if command is None else self.message(command, stamp)
        if self.torques is not None and self.answer is not None:
            self.torques.publish(self.answer)

    def message(self, command: WheelCommand, stamp: int) -> JointState:
        """Message of a command that answers the odometry of `stamp` [ns]."""
        joints = self.names.wheels
        message = writing.wheel_torques(command.torques, stamp, joints)
        message.velocity = joints.rates(*writing.left_right(command.rates))
        return message

    def decide(self, message: Odometry, stamp: int) -> WheelCommand | None:
        """What is commanded, or None; before a trial 0 in simulated time only."""
        nothing = WheelCommand(stamp, NOTHING)
        if self.trial is None:
            return nothing if self.has_clock() else None
        try:
            state = reading.state(message, message.header.frame_id, message.child_frame_id)
        except ValueError as error:
            self.trial.stop(str(error))
            return nothing
        return self.trial.command(stamp, self.get_clock().now().nanoseconds, state)

    def has_clock(self) -> bool:
        """Whether /clock is published."""
        return bool(self.count_publishers(CLOCK))

    @property
    def hears(self) -> bool:
        """Whether odometry has come, and a simulated time if there is one."""
        return bool(self.arrivals) and (bool(self.simulated) or not self.has_clock())

    @property
    def simulated_for(self) -> float:
        """Simulated time [s] between the first and the last stamp; 0 without."""
        if not (self.arrivals and self.has_clock()):
            return 0.0
        first, last = (self.arrivals[i].message.header.stamp for i in (0, -1))
        return (reading.nanoseconds(last) - reading.nanoseconds(first)) / SECOND

    def start_commanding(self) -> None:
        """Begin to publish torques, unless another node does."""
        if self.torques is None and not others_commanding(self):
            self.torques = self.publisher(JointState, TORQUES)

    @property
    def has_rival(self) -> bool:
        """Whether another node commands as well, which was discovered late."""
        return self.torques is not None and bool(others_commanding(self))

    def stop_commanding(self) -> None:
        """End publishing torques, and drop the odometry of meanwhile."""
        self.destroy_publisher(self.torques)
        self.torques = None
        self.arrivals.clear()

    @property
    def is_heard(self) -> bool:
        """Whether this node's torques have a subscription."""
        return self.torques is not None and self.torques.get_subscription_count() > 0

    def begin_trial(self) -> Trial:
        """Begin a trial; if it may not begin, its `trouble` says why."""
        stamps = [
            reading.nanoseconds(a.message.header.stamp) for a in self.arrivals[-PERIOD_MESSAGES:]
        ]
        period = float(np.median(np.diff(np.unique(stamps)))) / SECOND
        climber, bounds = self.parameters.read(Climber), self.parameters.read(Bounds)
        self.trial = Trial(climber, bounds, self.arrivals, period, not self.use_sim_time)
        self.watch(self.trial)
        return self.trial

    def watch(self, trial: Trial) -> None:
        """Stop a trial if others command, nothing receives torques, or odometry has stopped."""
        if others := others_commanding(self):
            hint = f"stop all that commands it besides, {AGAIN}"
            trial.stop(f"{', '.join(others)} publishes wheel_torques", hint)
        elif not self.is_heard:
            trial.stop("nobody receives wheel_torques")
        silent = (time.monotonic_ns() - self.heard_at) / SECOND
        if silent > STOP_AFTER:
            trial.stop(f"no odometry for {STOP_AFTER:g} s")
        elif silent > ZERO_AFTER and not self.use_sim_time:
            self.release()

    def release(self) -> None:
        """Command zero torque."""
        if self.torques is not None and self.trial is not None:
            stamp = reading.nanoseconds(self.arrivals[-1].message.header.stamp)
            self.torques.publish(self.message(WheelCommand(stamp, NOTHING), stamp))

    def end_with_zero(self) -> None:
        """Command zero torque, and wait until it is received."""
        self.release()
        if self.torques is not None:
            self.torques.wait_for_all_acked(Duration(seconds=1.0))

    def clocked_arrivals(self) -> list[Arrival]:
        """All arrivals, each with the latest simulated time before it."""
        came = [came for came, _ in self.simulated]
        clock = [0, *(now for _, now in self.simulated)]
        return [a._replace(simulated=clock[bisect_right(came, a.wall)]) for a in self.arrivals]

    def evidence(self) -> Evidence:
        """Evidence collected until now."""
        return Evidence(
            climber=self.parameters.read(Climber),
            expected=self.parameters.read(ExpectedDriver),
            frames=(self.names.odom_frame, self.names.base_frame),
            use_sim_time=self.use_sim_time,
            graph=graph(self, self.odometry.topic_name),
            arrivals=self.clocked_arrivals(),
            turning=self.turning,
            trial=self.trial.record() if self.trial else None,
            imu=SensorStamps.of(self.imu, 6),
            fixes=SensorStamps.of(self.fixes, 5),
        )

    @property
    def use_sim_time(self) -> bool:
        """Whether /clock is this node's clock, and so the controller's."""
        return bool(self.get_parameter("use_sim_time").value)
