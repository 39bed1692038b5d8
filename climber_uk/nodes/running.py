"""What every node of this package shares: how it starts, talks and ends."""

import gc
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy._rclpy_pybind11 import RCLError
from rclpy.clock import Clock, ClockType
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.task import Future

from climber_uk.mechanics import SECOND
from climber_uk.messages import writing
from climber_uk.messages.names import Names
from climber_uk.nodes.parameters import Parameters
from climber_uk.nodes.transport import use_udp

RELIABLE = QoSProfile(depth=10)
# what is kept for those who are behind: a recorder that the machine held up for half a second
SENT = QoSProfile(depth=1000)
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
SIGNAL_PERIOD = 0.1  # [s]
SLOW = SECOND // 20  # [ns] from one message to the next of what need not be told each time
WALL_CLOCK = Clock(clock_type=ClockType.STEADY_TIME)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Rhythm:
    """Says of the first stamp in each `period` [ns] that it is."""

    def __init__(self, period: int) -> None:
        self.period, self.number = period, -1

    def __call__(self, stamp: int) -> bool:
        """Whether no stamp of its period came right before."""
        before, self.number = self.number, stamp // self.period
        return before != self.number


class ClimberNode(Node):
    """A node with checked parameters, and topics whose QoS parameters can override."""

    def __init__(self, name: str, namespace: str = "") -> None:
        super().__init__(name, namespace=namespace)
        self.parameters = Parameters(self, self.on_parameters)
        self.parameters.declare(Names)
        self.names = self.parameters.read(Names).within(self.get_namespace())
        self._troubles: dict[str, tuple[str, bool]] = {}
        self._alone_on: Sequence[str] = ()
        self._values: Callable[[], Mapping[str, object]] = dict
        self._diagnostics: Publisher | None = None

    def on_parameters(self) -> None:
        """Take up changed parameters."""

    def publisher(self, kind: type, topic: str, qos: QoSProfile = SENT) -> Publisher:
        """Publisher whose QoS the parameters `qos_overrides.<topic>.publisher.*` override."""
        options = QoSOverridingOptions.with_default_policies()
        return self.create_publisher(kind, topic, qos, qos_overriding_options=options)

    def subscription(
        self, kind: type, topic: str, callback: Callable[..., None], qos: QoSProfile = RELIABLE
    ) -> Subscription:
        """Subscription whose QoS the parameters `qos_overrides.<topic>.subscription.*` override."""
        options = QoSOverridingOptions.with_default_policies()
        return self.create_subscription(kind, topic, callback, qos, qos_overriding_options=options)

    def say(self, subject: str, trouble: str, detail: str = "", is_fault: bool = True) -> None:
        """Log a trouble, or that it is over (''), once each time the trouble changes.

        In diagnostics it is an error if `is_fault`, else a warning.
        """
        if trouble == self._troubles.get(subject, ("", True))[0]:
            return
        self._troubles[subject] = trouble, is_fault
        if trouble:
            self.get_logger().warning(f"{subject}: {trouble}{detail and f' ({detail})'}")
        else:
            self.get_logger().info(f"{subject}: ok again")
        self.diagnose()

    def start_diagnostics(
        self, values: Callable[[], Mapping[str, object]], alone_on: Sequence[str] = ()
    ) -> None:
        """Publish troubles and `values` on /diagnostics, every second and when troubles change.

        On the topics `alone_on` there should be no more than one publisher.
        """
        self._values, self._alone_on = values, alone_on
        self._diagnostics = self.publisher(DiagnosticArray, "/diagnostics")
        self.create_timer(1.0, self.look_around, clock=WALL_CLOCK)

    def look_around(self) -> None:
        """Say where others publish what only one should, and how it goes."""
        for topic in self._alone_on:
            is_crowded = self.count_publishers(topic) > 1
            self.say(
                f"publishers of {topic}", "more than one" if is_crowded else "", is_fault=False
            )
        self.diagnose()

    def diagnose(self) -> None:
        """Publish troubles and values."""
        troubles = {about: said for about, said in self._troubles.items() if said[0]}
        level = DiagnosticStatus.WARN if troubles else DiagnosticStatus.OK
        if any(is_fault for _, is_fault in troubles.values()):
            level = DiagnosticStatus.ERROR
        text = "; ".join(f"{about}: {trouble}" for about, (trouble, _) in troubles.items())
        self.publish_status("", level, text, self._values())

    def publish_status(
        self, about: str, level: bytes, text: str, values: Mapping[str, object]
    ) -> None:
        """Publish one status of this node on /diagnostics, once these have started."""
        if self._diagnostics is not None:
            name = self.get_fully_qualified_name() + (f": {about}" if about else "")
            now = self.get_clock().now().nanoseconds
            self._diagnostics.publish(writing.diagnostics(name, level, text, values, now))


def run(make_nodes: Callable[[], Sequence[Node]]) -> None:
    """Spin nodes until SIGINT or SIGTERM; exit with one line and status 1 if they cannot start.

    rclpy's own signal handling takes the publishers away from under a running callback. Here the
    callback is finished first. The executor is the one that takes half the CPU; its `spin` never
    ends in rclpy 7.1, and it sees signals only between callbacks, hence the idle timer.
    """
    nodes: Sequence[Node] = ()
    end = Future()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: end.set_result(None))
    try:
        use_udp()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        nodes = make_nodes()
        nodes[0].create_timer(SIGNAL_PERIOD, lambda: None, clock=WALL_CLOCK)
        executor = EventsExecutor()
        for node in nodes:
            executor.add_node(node)
        gc.freeze()  # to look through all that was imported would halt the loop for 20 ms
        while not end.done():
            executor.spin_until_future_complete(end, timeout_sec=3600.0)
    except (ValueError, RCLError) as error:
        if nodes:
            raise
        sys.exit(f"{Path(sys.argv[0]).name}: {error}")
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):  # the terminal and launch may both send one
            signal.signal(number, signal.SIG_IGN)
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()
