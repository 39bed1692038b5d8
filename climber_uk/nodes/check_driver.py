"""Checks whatever publishes `odom`, row by row, and with `--move` how it takes torques.

Parameters are those of the controller: its sections of the parameter files hold here as well.
"""

import argparse
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np
import rclpy
import yaml
from nav_msgs.msg import Odometry
from rclpy._rclpy_pybind11 import RCLError
from rclpy.duration import Duration, Infinite
from rclpy.executors import SingleThreadedExecutor
from rclpy.publisher import Publisher
from rclpy.qos import (
    LivelinessPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)
from rclpy.signals import SignalHandlerOptions
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rclpy.utilities import remove_ros_args
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from climber_uk.analysis.driver import checks, listening, report
from climber_uk.analysis.driver.evidence import Arrival, Endpoint, Evidence, Expected, Graph
from climber_uk.analysis.driver.trial import Bounds, Trial
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.preview import SECOND
from climber_uk.messages import reading, writing
from climber_uk.nodes.running import BEST_EFFORT, ClimberNode, Names

# the controller's offer, as the middleware knows it
OFFERED = QoSProfile(
    depth=10,
    deadline=Infinite,
    liveliness=LivelinessPolicy.AUTOMATIC,
    liveliness_lease_duration=Infinite,
)
MANY = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)
PATIENCE = 10.0  # [s] for a publisher to be found
CATCH_UP = 0.2  # [s] to hear what came while the first report was made
SILENT = 1.0  # [s] without odometry at which a trial is stopped


class Interrupted(Exception):  # noqa: N818
    """A signal came."""


class CheckDriver(ClimberNode):
    """Listens to odometry and, in a trial, answers it."""

    def __init__(self) -> None:
        super().__init__("check_driver")
        for kind in (Climber, Expected, Bounds):
            self.parameters.declare(kind)
        self.parameters.refuse_unknown()
        self.arrivals: list[Arrival] = []
        self.simulated = self.heard_at = 0  # [ns] of /clock; on the steady clock
        self.trial: Trial | None = None
        self.torques: Publisher | None = None  # only once it is clear that nobody else commands
        self.answer: JointState | None = None
        self.odometry = self.subscription(Odometry, "odom", self.on_odometry, MANY)
        self.subscription(Clock, "/clock", self.on_clock, BEST_EFFORT)

    def on_clock(self, message: Clock) -> None:
        """Keep the simulated time."""
        self.simulated = reading.nanoseconds(message.clock)

    def on_odometry(self, message: Odometry) -> None:
        """Keep an odometry, and answer it if it is on this node to do so."""
        self.heard_at = time.monotonic_ns()
        self.arrivals.append(Arrival(message, time.time_ns(), self.heard_at, self.simulated))
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
        return bool(self.count_publishers("/clock"))

    # Who is there

    def graph(self) -> Graph:
        """Who publishes and subscribes what."""
        odometry = self.get_publishers_info_by_topic("odom")
        commanded = self.get_subscriptions_info_by_topic("wheel_torques")
        topic = self.odometry.topic_name
        return Graph(
            topic=topic,
            odometry=[_endpoint(info, info.qos_profile, BEST_EFFORT) for info in odometry],
            commanded=[_endpoint(info, OFFERED, info.qos_profile) for info in commanded],
            commanding=self.commanding(),
            elsewhere=[
                name
                for name, kinds in self.get_topic_names_and_types()
                if listening.ODOMETRY in kinds and name != topic
            ],
            has_clock=self.has_clock(),
        )

    def commanding(self) -> list[str]:
        """Nodes besides this one that publish torques."""
        ends = self.get_publishers_info_by_topic("wheel_torques")
        return [_full_name(end) for end in ends if _full_name(end) != self.full_name]

    @property
    def full_name(self) -> str:
        """Name with its namespace."""
        return str(self.get_fully_qualified_name())

    def evidence(self) -> Evidence:
        """All that was seen until now."""
        return Evidence(
            climber=self.parameters.read(Climber),
            expected=self.parameters.read(Expected),
            frames=(self.names.odom_frame, self.names.base_frame),
            use_sim_time=self.use_sim_time,
            graph=self.graph(),
            arrivals=list(self.arrivals),
            trial=self.trial.record() if self.trial else None,
        )

    @property
    def use_sim_time(self) -> bool:
        """Whether this node's clock, as the controller's, is to be /clock."""
        return bool(self.get_parameter("use_sim_time").value)

    # What happens

    def listen(self, spin: Callable[[], None], duration: float, move: bool) -> None:
        """Hear odometry for a while [s], by the clock or by its stamps."""
        begin = time.monotonic()
        while not self.count_publishers("odom") and time.monotonic() < begin + PATIENCE:
            spin()
        begin = time.monotonic()
        while not self.arrivals and time.monotonic() < begin + max(1.0, duration):
            spin()
        if move and not self.commanding():
            self.torques = self.publisher(JointState, "wheel_torques")
        begin = time.monotonic()
        while time.monotonic() < begin + duration and not self.has_heard(duration):
            spin()

    def has_heard(self, duration: float) -> bool:
        """Whether simulated time [s] has passed."""
        if not (self.arrivals and self.has_clock()):
            return False
        first, last = (self.arrivals[i].message.header.stamp for i in (0, -1))
        return reading.nanoseconds(last) - reading.nanoseconds(first) >= duration * SECOND

    def move(self, spin: Callable[[], None]) -> None:
        """Try the driver, if it is fit for that."""
        seen = self.evidence()
        if not checks.may_move(checks.report(seen)):
            return
        period = float(np.median(np.diff(seen.motion.time)))
        with_silence = not self.use_sim_time
        bounds = self.parameters.read(Bounds)
        begin = time.monotonic()
        while time.monotonic() < begin + CATCH_UP:  # what came meanwhile is old
            spin()
        self.trial = Trial(seen.climber, bounds, self.arrivals, period, with_silence)
        while self.trial.stage is not None:
            spin()
            if others := self.commanding():
                self.trial.stop(f"{', '.join(others)} publishes wheel_torques")
            if time.monotonic_ns() - self.heard_at > SILENT * SECOND:
                self.trial.stop(f"no odometry for {SILENT:g} s")

    def let_go(self) -> None:
        """Command no torque, as the last word."""
        if self.torques is None or self.trial is None:
            return
        stamp = reading.nanoseconds(self.arrivals[-1].message.header.stamp)
        self.torques.publish(self.message(np.zeros(2), stamp))
        self.torques.wait_for_all_acked(Duration(seconds=1.0))


def _full_name(info: TopicEndpointInfo) -> str:
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"


def _endpoint(info: TopicEndpointInfo, offered: QoSProfile, wanted: QoSProfile) -> Endpoint:
    return Endpoint(
        node=_full_name(info),
        kind=info.topic_type,
        fits=qos_check_compatible(offered, wanted)[0] != QoSCompatibility.ERROR,
        reliable=info.qos_profile.reliability == ReliabilityPolicy.RELIABLE,
    )


@contextmanager
def as_the_controller(arguments: Sequence[str]) -> Iterator[list[str]]:
    """Arguments of ROS before which those parameters come that the controller's sections give."""
    known = {field.name for kind in (Names, Climber, Expected) for field in fields(kind)}
    sections: dict[str, Any] = {}
    for option, path in pairwise(arguments):
        if option == "--params-file":
            for name, section in (yaml.safe_load(Path(path).read_text()) or {}).items():
                where, _, node = name.rpartition("/")
                if node == "uk_torque_controller":
                    given = section.get("ros__parameters", {})
                    values = {key: value for key, value in given.items() if key in known}
                    sections[f"{where}/check_driver"] = {"ros__parameters": values}
    with NamedTemporaryFile("w", suffix=".yaml") as file:
        yaml.safe_dump(sections, file)
        file.flush()
        first = ["--ros-args", "--params-file", file.name, "--"] if sections else []
        yield [*first, *arguments]


def check(options: argparse.Namespace, ended: Callable[[], bool]) -> report.Report:
    """Listen, move if wanted, and look at what was seen; raises `Interrupted`."""
    node = CheckDriver()
    executor = SingleThreadedExecutor()
    executor.add_node(node)

    def spin() -> None:
        executor.spin_once(timeout_sec=0.1)
        if ended():
            raise Interrupted

    try:
        if options.move:
            print(
                plan(node.parameters.read(Climber), node.parameters.read(Bounds), options),
                file=sys.stderr,
            )
        node.listen(spin, options.duration, options.move)
        if options.move:
            node.move(spin)
        return checks.report(node.evidence())
    finally:
        node.let_go()
        executor.shutdown()
        node.destroy_node()


def plan(climber: Climber, bounds: Bounds, options: argparse.Namespace) -> str:
    """What is going to happen to the climber."""
    return (
        f"In {options.duration:g} s it turns left, drives forward, back and turns right, some 0.1 "
        f"rad and 1 cm each, by torques that rise until it moves, to {bounds.torque_share:g} of "
        f"{climber.max_wheel_torque:g} N m at most. It is stopped at {bounds.max_travel:g} m or "
        f"{bounds.max_turn:g} rad. Ctrl-C stops it at once."
    )


def positive(text: str) -> float:
    """Number above zero."""
    if not 0 < (value := float(text)) < float("inf"):
        raise ValueError
    return value


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(
        "check_driver",
        description=__doc__,
        epilog="Exit status: 0 nothing failed, 1 something did, 2 it could not be checked.",
    )
    parser.add_argument("--move", action="store_true", help="try small torques: the climber moves")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    parser.add_argument(
        "--duration", type=positive, default=3.0, metavar="SECONDS", help="to listen (default: 3)"
    )
    return parser.parse_args(arguments)


def main() -> None:
    """Print the report and exit with its status."""
    options = parse(remove_ros_args(sys.argv)[1:])
    caught: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: caught.append(number))
    try:
        with as_the_controller(sys.argv) as arguments:
            rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        found = check(options, lambda: bool(caught))
    except Interrupted:
        print("check_driver: interrupted", file=sys.stderr)
        sys.exit(2)
    except (ValueError, OSError, yaml.YAMLError, RCLError) as error:
        print(f"check_driver: {error}", file=sys.stderr)
        sys.exit(2)
    finally:
        rclpy.try_shutdown()
    print(report.as_json(found) if options.json else report.as_text(found))
    sys.exit(int(report.has_failed(found)))
