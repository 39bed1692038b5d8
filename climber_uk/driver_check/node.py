"""Keeps all odometry that comes, and answers it with the torques of a trial."""

import time
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from climber_uk.driver_check.evidence import Arrival, Evidence, ExpectedDriver
from climber_uk.driver_check.graph import graph, others_commanding
from climber_uk.driver_check.trial import Bounds, Trial
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber
from climber_uk.messages import reading, writing
from climber_uk.messages.topics import CLOCK, ODOMETRY, TORQUES
from climber_uk.ros.running import ClimberNode

MANY = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
SILENT, PATIENT = 0.5, 5.0  # [s] without odometry: no torque more; no trial more
RECENT = 100  # messages that tell the period


class DriverNode(ClimberNode):
    """Listens to odometry and, where it is on it to do so, answers."""

    def __init__(self, arguments: Sequence[str] | None = None) -> None:
        super().__init__("check_driver", arguments=arguments)
        for kind in (Climber, ExpectedDriver, Bounds):
            self.parameters.declare(kind)
        self.parameters.refuse_unknown()
        self.arrivals: list[Arrival] = []
        self.simulated: list[tuple[int, int]] = []  # [ns] when it came, what /clock said
        self.heard_at = 0  # [ns] on the steady clock
        self.trial: Trial | None = None
        self.torques: Publisher | None = None  # only once it is clear that nobody else commands
        self.answer: JointState | None = None
        self.odometry = self.subscription(Odometry, ODOMETRY, self.on_odometry, MANY)
        self.subscription(Clock, CLOCK, self.on_clock, MANY)

    def on_clock(self, message: Clock, info: dict[str, int]) -> None:
        """Keep the simulated time."""
        self.simulated.append((info["received_timestamp"], reading.nanoseconds(message.clock)))

    def on_odometry(self, message: Odometry, info: dict[str, int]) -> None:
        """Keep an odometry, and answer it if it is on this node to do so.

        It came when the middleware received it: how long it then waited for this node is no
        property of the driver.
        """
        self.heard_at = time.monotonic_ns()
        came = info["received_timestamp"]
        boot = self.heard_at - (time.time_ns() - came)
        self.arrivals.append(Arrival(message, came, boot, simulated=0))
        if self.torques is not None:
            self.tell(message)

    def tell(self, message: Odometry) -> None:
        """Answer an odometry, and the same one with the same."""
        stamp = reading.nanoseconds(message.header.stamp)
        if self.answer is None or stamp != reading.nanoseconds(self.answer.header.stamp):
            torques = self.decide(message, stamp)
            self.answer = None if torques is None else self.message(torques, stamp)
        if self.torques is not None and self.answer is not None:
            self.torques.publish(self.answer)

    def message(self, torques: Array, stamp: int) -> JointState:
        """Command of torques (right, left)."""
        left, right = self.names.left_wheel_joint, self.names.right_wheel_joint
        return writing.wheel_torques(torques, stamp, left, right)

    def decide(self, message: Odometry, stamp: int) -> Array | None:
        """Torques of now (right, left); none while there is no trial, but in simulated time."""
        if self.trial is None:
            return np.zeros(2) if self.has_clock() else None
        try:
            state = reading.state(message, message.header.frame_id, message.child_frame_id)
        except ValueError as error:
            self.trial.stop(str(error))
            return np.zeros(2)
        return self.trial.torques(stamp, self.get_clock().now().nanoseconds, state)

    def has_clock(self) -> bool:
        """Whether somebody publishes simulated time."""
        return bool(self.count_publishers(CLOCK))

    @property
    def hears(self) -> bool:
        """Whether odometry comes, and the simulated time if there is one."""
        return bool(self.arrivals) and (bool(self.simulated) or not self.has_clock())

    @property
    def simulated_for(self) -> float:
        """How much simulated time the stamps have passed through [s]."""
        if not (self.arrivals and self.has_clock()):
            return 0.0
        first, last = (self.arrivals[i].message.header.stamp for i in (0, -1))
        return (reading.nanoseconds(last) - reading.nanoseconds(first)) / SECOND

    def speak(self) -> None:
        """Be the one who commands, unless another is."""
        if self.torques is None and not others_commanding(self):
            self.torques = self.publisher(JointState, TORQUES)

    @property
    def disturbs(self) -> bool:
        """Whether another commands as well, who was found late."""
        return self.torques is not None and bool(others_commanding(self))

    def hush(self) -> None:
        """Command no more, and forget what was heard meanwhile."""
        self.destroy_publisher(self.torques)
        self.torques = None
        self.arrivals.clear()

    @property
    def is_heard(self) -> bool:
        """Whether somebody receives what this node commands."""
        return self.torques is not None and self.torques.get_subscription_count() > 0

    def begin_trial(self) -> Trial:
        """Begin one, or not: then its `trouble` says why."""
        stamps = [reading.nanoseconds(a.message.header.stamp) for a in self.arrivals[-RECENT:]]
        period = float(np.median(np.diff(np.unique(stamps)))) / SECOND
        climber, bounds = self.parameters.read(Climber), self.parameters.read(Bounds)
        self.trial = Trial(climber, bounds, self.arrivals, period, not self.use_sim_time)
        self.watch(self.trial)
        return self.trial

    def watch(self, trial: Trial) -> None:
        """Stop a trial if others command, nobody listens, or odometry has stopped."""
        if others := others_commanding(self):
            trial.stop(f"{', '.join(others)} publishes wheel_torques")
        elif not self.is_heard:
            trial.stop("nobody receives wheel_torques")
        silent = (time.monotonic_ns() - self.heard_at) / SECOND
        if silent > PATIENT:
            trial.stop(f"no odometry for {PATIENT:g} s")
        elif silent > SILENT and not self.use_sim_time:
            self.release()

    def release(self) -> None:
        """Command no torque."""
        if self.torques is not None and self.trial is not None:
            stamp = reading.nanoseconds(self.arrivals[-1].message.header.stamp)
            self.torques.publish(self.message(np.zeros(2), stamp))

    def let_go(self) -> None:
        """Command no torque, as the last word."""
        self.release()
        if self.torques is not None:
            self.torques.wait_for_all_acked(Duration(seconds=1.0))

    def clocked_arrivals(self) -> list[Arrival]:
        """All that arrived, each with the simulated time that had come before it."""
        came = [came for came, _ in self.simulated]
        told = [0, *(told for _, told in self.simulated)]
        return [a._replace(simulated=told[bisect_right(came, a.wall)]) for a in self.arrivals]

    def evidence(self) -> Evidence:
        """All that was seen until now."""
        return Evidence(
            climber=self.parameters.read(Climber),
            expected=self.parameters.read(ExpectedDriver),
            frames=(self.names.odom_frame, self.names.base_frame),
            use_sim_time=self.use_sim_time,
            graph=graph(self, self.odometry.topic_name),
            arrivals=self.clocked_arrivals(),
            trial=self.trial.record() if self.trial else None,
        )

    @property
    def use_sim_time(self) -> bool:
        """Whether this node's clock, as the controller's, is to be /clock."""
        return bool(self.get_parameter("use_sim_time").value)
