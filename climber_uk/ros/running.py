"""The base class of all nodes, and how a process runs nodes from start to end."""

import gc
import math
import re
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError  # rclpy exports neither
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.parameter_service import ParameterService
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.service import Service
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.task import Future
from rclpy.time_source import TimeSource
from rclpy.utilities import remove_ros_args

from climber_uk.mechanics import SECOND
from climber_uk.messages import reading, writing
from climber_uk.messages.names import Names
from climber_uk.messages.reading import STAMP
from climber_uk.messages.topics import CLOCK, DIAGNOSTICS
from climber_uk.parameters.declaration import QOS, parameter, parameters
from climber_uk.parameters.parameter_files import ParameterFiles
from climber_uk.ros.leaving import LONGEST_END, leave
from climber_uk.ros.output import Output
from climber_uk.ros.parameters import NodeParameters
from climber_uk.ros.transport import use_udp
from climber_uk.system.command_line import in_words, printable
from climber_uk.system.signals import on_end

# else the first message type would have the generator of message types loaded, and its parser
sys.modules.setdefault("rosidl_generator_py.generate_py_impl", None)  # type: ignore[arg-type]

T = TypeVar("T")
P = ParamSpec("P")
RELIABLE = QoSProfile(depth=10)
# kept for slow subscribers: a recorder may be held up for half a second
SENT = QoSProfile(depth=1000)
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
SIGNAL_PERIOD = 0.1  # [s]
PUBLISH_PERIOD = SECOND // 20  # [ns] of topics that need not be published every time
WALL_CLOCK = Clock(clock_type=ClockType.STEADY_TIME)
LONGEST_START = 10  # [s] from a signal to end, for a node that is starting
LONGEST_LINE = 1000  # [characters] of what is logged of others
TYPES_PERIOD = 2.0  # [s] in which topics are looked at for publishers of another type
LINES, LINES_PERIOD = 6, 10.0  # most lines of the log on one subject, in so many [s]
EPILOG = (
    "Parameters, which docs/parameters.md lists, come after --ros-args: --params-file FILE, or -p "
    "NAME:=VALUE."
)
ROS_OPTIONS = {"--params-file", "-p", "--param", "-r", "--remap"}
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@parameters
class Sharing:
    """Whether others may publish what a node obeys."""

    exclusive: bool = parameter(
        False,
        "",
        "refuse what comes on a topic that this node obeys while it has more publishers than one; "
        "one that was killed counts for some 20 s more",
    )


class Ration:
    """Rate limit: allows `number` calls in each `period` [s] of the wall clock."""

    def __init__(self, number: int, period: float) -> None:
        self.period, self.times = period, deque([-math.inf] * number)

    def __call__(self) -> bool:
        """Whether one more is allowed now."""
        now = WALL_CLOCK.now().nanoseconds / SECOND
        if now - self.times[0] < self.period:
            return False
        self.times.popleft()
        self.times.append(now)
        return True


class Throttle:
    """Throttle: true for the first stamp of each `period` [ns]."""

    def __init__(self, period: int) -> None:
        self.period, self.number = period, -1

    def __call__(self, stamp: int) -> bool:
        """Whether `stamp` [ns] is of another period than the one before it."""
        before, self.number = self.number, stamp // self.period
        return before != self.number


class ClimberNode(Node):
    """A node with checked parameters, and topics whose QoS parameters can override.

    `arguments` are those that rclpy was initialized with.
    """

    def __init__(
        self, name: str, namespace: str = "", arguments: Sequence[str] | None = None
    ) -> None:
        super().__init__(name, namespace=namespace)
        arguments = sys.argv if arguments is None else arguments
        self.parameters = NodeParameters(self, arguments, self.on_parameters)
        self.parameters.declare(Names)
        self.names = self.parameters.read(Names).within(self.get_namespace())
        self._troubles: dict[str, tuple[str, bool]] = {}
        self._lines: dict[str, Ration] = {}  # that are logged on each subject
        self._unlogged: dict[str, tuple[str, int]] = {}  # detail, and how many came before it
        self._alone_on: Sequence[str] = ()
        self.exclusive = False  # whether what it obeys has to come from one publisher
        self._values: Callable[[], Mapping[str, object]] = dict
        self._diagnostics: Publisher | None = None

    def create_subscription(
        self, kind: type, topic: str, callback: Callable[..., None], *rest: Any, **options: Any
    ) -> Subscription:
        """As rclpy, but a time that is none does not end the node: rclpy's own callback raises."""
        if isinstance(getattr(callback, "__self__", None), TimeSource):
            callback = partial(self._take_time, callback)
        return super().create_subscription(kind, topic, callback, *rest, **options)

    def _take_time(self, take: Callable[[Any], None], message: Any) -> None:
        def take_checked() -> None:
            reading.check_stamp(reading.nanoseconds(message.clock))
            take(message)

        self.checked(CLOCK, take_checked)

    def create_service(
        self, kind: type, name: str, callback: Callable[..., Any], **options: Any
    ) -> Service:
        """As rclpy, but a request that its parameter services cannot read does not end the node."""
        if isinstance(getattr(callback, "__self__", None), ParameterService):
            callback = partial(self._serve, callback)
        return super().create_service(kind, name, callback, **options)

    def _serve(self, serve: Callable[[Any, Any], Any], request: Any, response: Any) -> Any:
        try:
            response = serve(request, response)
        except (ValueError, TypeError, ParameterException) as error:  # as for a type of 77
            refused = SetParametersResult(successful=False, reason=in_a_line(error))
            if isinstance(response, SetParameters.Response):
                lacking = len(request.parameters) - len(response.results)
                response.results = [*response.results, *[refused] * lacking]
            elif isinstance(response, SetParametersAtomically.Response):
                response.result = refused
            self.report("request for parameters", "refused", refused.reason)
            return response
        self.report("request for parameters", "")
        return response

    def on_parameters(self) -> None:
        """Called when parameters have changed."""

    def summary(self) -> str:
        """What this node does, in a few numbers, for the log."""
        return ""

    def be_exclusive(self) -> None:
        """Declare and read the parameter `exclusive`."""
        self.parameters.declare(Sharing)
        self.exclusive = self.parameters.read(Sharing).exclusive

    def check_alone(self, topic: str) -> None:
        """Raise `ValueError` if a topic has more publishers than one.

        The graph knows of a publisher before its first message comes.
        """
        if self.count_publishers(topic) > 1:
            raise ValueError(f"exclusive is set, and {topic} has more publishers than one")

    def introduce(self) -> None:
        """Log in a line where the parameters are from, and the summary; warn of doubtful ones."""
        about = self.summary()
        self.get_logger().info(self.parameters.origin + (about and f"; {about}"))
        for remark in [*self.parameters.remarks, *self._idle_overrides()]:
            self.get_logger().warning(clipped(remark))
        self.create_timer(TYPES_PERIOD, self.check_types, clock=WALL_CLOCK)

    def check_types(self) -> None:
        """Report topics on which something of another type is published: none of it arrives."""
        for subscription in self.subscriptions:
            topic, kind = subscription.topic_name, subscription.msg_type
            wanted = f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}"
            found = {of.topic_type for of in self.get_publishers_info_by_topic(topic)} - {wanted}
            trouble = f"{', '.join(sorted(found))} is published, not {wanted}" if found else ""
            self.report(f"type of {topic}", trouble, is_fault=False)

    def _idle_overrides(self) -> list[str]:
        """Lines about `qos_overrides` that no publisher or subscription of this node has used."""
        given = [name for name in self._parameter_overrides if name.startswith(QOS)]
        idle = [name for name in given if not self.has_parameter(name)]
        return [f"{name} overrides nothing{self.parameters.like(name)}" for name in idle]

    def publisher(self, kind: type, topic: str, qos: QoSProfile = SENT) -> Publisher:
        """Publisher whose QoS the parameters `qos_overrides.<topic>.publisher.*` override."""
        return self._overridden(partial(self.create_publisher, kind, topic, qos))

    def output(
        self, topic: str, message: Any, numbers: Iterable[str], stamp: tuple[str, str] = STAMP
    ) -> Output:
        """Topic of messages that differ from `message` in their stamp and `numbers` only."""
        return Output(self.publisher(type(message), topic), message, numbers, stamp)

    def subscription(
        self,
        kind: type,
        topic: str,
        callback: Callable[..., None],
        qos: QoSProfile = RELIABLE,
        raw: bool = False,
    ) -> Subscription:
        """Subscription whose QoS the parameters `qos_overrides.<topic>.subscription.*` override."""
        create = partial(self.create_subscription, kind, topic, callback, qos, raw=raw)
        return self._overridden(create)

    def _overridden(self, create: partial[Any]) -> Any:
        """What `create` makes; `ValueError` if parameters have its QoS wrong."""
        for name, given in self._parameter_overrides.items():
            if name.startswith(QOS) and isinstance(given.value, int) and given.value < 0:
                raise ValueError(f"{name}={given.value} must be >= 0")  # of which rcl says 25 lines
        try:
            return create(qos_overriding_options=QoSOverridingOptions.with_default_policies())
        except (ParameterException, RuntimeError) as error:
            raise ValueError(f"qos_overrides of {create.args[1]}: {error}") from None

    def report(self, subject: str, trouble: str, detail: str = "", is_fault: bool = True) -> None:
        """Log a trouble of a subject, or that it is over (''), when it changes.

        In diagnostics it is an error if `is_fault`, else a warning. Of troubles that come and go
        faster than `LINES` in `LINES_PERIOD`, most are only counted; the last one is logged later.
        """
        if trouble == self._troubles.get(subject, ("", True))[0]:
            return
        self._troubles[subject] = trouble, is_fault
        _, before = self._unlogged.get(subject, ("", -1))
        self._unlogged[subject] = clipped(detail), before + 1
        self._log(subject)

    def checked(
        self, subject: str, read: Callable[P, T], *arguments: P.args, **options: P.kwargs
    ) -> T | None:
        """What `read` makes of a message; None, and a report, if it raises `ValueError`."""
        try:
            found = read(*arguments, **options)
        except ValueError as error:
            self.report(subject, "refused", str(error))
            return None
        self.report(subject, "")
        return found

    def _log(self, subject: str) -> None:
        """Log how things are with a subject, unless there have been too many lines on it."""
        if not self._lines.setdefault(subject, Ration(LINES, LINES_PERIOD))():
            return
        (detail, before), (trouble, _) = self._unlogged.pop(subject), self._troubles[subject]
        more = f" [{before} changes were not logged]" if before else ""
        if trouble:
            self.get_logger().warning(f"{subject}: {trouble}{detail and f' ({detail})'}{more}")
        else:
            self.get_logger().info(f"{subject}: ok again{more}")
        self.diagnose()

    def start_diagnostics(
        self, values: Callable[[], Mapping[str, object]], alone_on: Sequence[str] = ()
    ) -> None:
        """Publish troubles and `values` on /diagnostics, every second and when troubles change.

        On the topics `alone_on` there should be no more than one publisher.
        """
        self._values, self._alone_on = values, alone_on
        self._diagnostics = self.publisher(DiagnosticArray, DIAGNOSTICS)
        self.create_timer(1.0, self.check_publishers, clock=WALL_CLOCK)

    def check_publishers(self) -> None:
        """Report topics that have more publishers than one, and publish diagnostics.

        Also what could not be logged when it was reported.
        """
        for subject in list(self._unlogged):
            self._log(subject)
        for topic in self._alone_on:
            is_crowded = self.count_publishers(topic) > 1
            self.report(
                f"publishers of {topic}", "more than one" if is_crowded else "", is_fault=False
            )
        self.diagnose()

    def diagnose(self) -> None:
        """Publish a status with all troubles and values, if diagnostics have started."""
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


def run(
    make_nodes: Callable[..., Sequence[ClimberNode]],
    about: str | None,
    options: Mapping[str, Mapping[str, Any]] | None = None,
) -> None:
    """Spin nodes until a signal to end; exit with one line if they cannot start.

    `make_nodes` gets those of `options`, rules of `argparse` by name, that the command line has.

    rclpy's own signal handling takes the publishers away from under a running callback. Here the
    callback is finished first. The executor is the one that takes half the CPU; its `spin` never
    ends in rclpy 7.1, and it sees signals only between callbacks, hence the idle timer.
    """
    nodes: Sequence[ClimberNode] = ()
    end, is_asked = Future(), False

    def stop(*_: object) -> None:
        nonlocal is_asked
        if is_asked:  # once more, maybe while `end` is locked
            return
        is_asked = True
        # by the kernel: a callback may hang in the middleware, and a start may have no end
        signal.alarm(LONGEST_END if nodes else LONGEST_START)
        end.set_result(None)

    on_end(stop)
    try:
        ParameterFiles(sys.argv, "")  # raises with the line that is wrong, unlike rcl
        chosen = parse(remove_ros_args(sys.argv)[1:], about, options or {})
        use_udp()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        nodes = make_nodes(**chosen)
        nodes[0].create_timer(SIGNAL_PERIOD, lambda: None, clock=WALL_CLOCK)
        executor = EventsExecutor()
        for node in nodes:
            node.introduce()
            executor.add_node(node)
        gc.freeze()  # to look through all that was imported would halt the loop for 20 ms
        while not end.done():
            executor.spin_until_future_complete(end, timeout_sec=3600.0)
    except (ValueError, OSError, ParameterException, RCLError, UnknownROSArgsError) as error:
        if nodes:
            raise
        sys.exit(f"{Path(sys.argv[0]).name}: {in_a_line(error)}")
    finally:
        signal.alarm(0)
        leave(int(sys.exc_info()[0] is not None), *nodes)


def parse(
    words: Sequence[str], about: str | None, options: Mapping[str, Mapping[str, Any]]
) -> dict[str, Any]:
    """Values of `options` by name, from the words of a command line that are not for ROS."""
    if not words:
        return {}
    from climber_uk.system.command_line import Parser  # most starts have nothing to parse

    if ROS_OPTIONS.intersection(words):
        raise ValueError(f"{words[0]} must come after --ros-args")
    parser = Parser(Path(sys.argv[0]).name, about, EPILOG)
    for name, rules in options.items():
        parser.add_argument(name, **rules)
    return vars(parser.arguments(words))


def in_a_line(error: Exception) -> str:
    """Message of an error in one line that is safe to print, without rcl's file names."""
    if isinstance(error, UnknownROSArgsError):
        return f"not known after --ros-args: {str(error).strip('[]')}"
    said = " ".join(in_words(error).split()) or type(error).__name__
    said = re.sub(r", at /[^, ]*:\d+", "", said)
    return clipped(said)


def clipped(text: str) -> str:
    """Text of a user or a message that is safe to print, and has an end."""
    return printable(text[:LONGEST_LINE]) + "…" * (len(text) > LONGEST_LINE)
