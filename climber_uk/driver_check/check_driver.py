"""Checks the driver that publishes `odom`, row by row, and with `--move` how it takes torques.

Parameters are those of the controller: its sections of the parameter files hold here as well.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields
from itertools import pairwise
from pathlib import Path
from tempfile import NamedTemporaryFile

import rclpy
from rclpy._rclpy_pybind11 import RCLError, UnknownROSArgsError
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from climber_uk.closed_loop.node_parameters import names_of
from climber_uk.driver_check import checks, report
from climber_uk.driver_check.evidence import ExpectedDriver
from climber_uk.driver_check.graph import is_known, others_commanding
from climber_uk.driver_check.node import DriverNode
from climber_uk.driver_check.trial import Bounds
from climber_uk.mechanics.climber import Climber
from climber_uk.messages.names import Names
from climber_uk.messages.topics import CONTROLLER, ODOMETRY
from climber_uk.parameters.changed_parameters import write_sections
from climber_uk.parameters.parameter_file import Section, nothing_for, read_sections, refuse_unknown
from climber_uk.parameters.parameter_files import ParameterFiles, paths
from climber_uk.ros.leaving import leave
from climber_uk.ros.running import in_a_line
from climber_uk.ros.transport import use_udp
from climber_uk.system.command_line import Parser, between
from climber_uk.system.signals import Interrupted, on_end

NODE, FILE = "check_driver", "--params-file"
DISCOVERY_TIMEOUT = 10.0  # [s] for a publisher to be found
COPIES = 3  # of an odometry that waits for torques
FLUSH_TIME = 0.2  # [s] in which odometry from before the trial is received


@contextmanager
def as_the_controller(arguments: Sequence[str]) -> Iterator[list[str]]:
    """ROS arguments in which a file with the controller's parameters replaces the parameter files.

    Raises `OSError`, or `ValueError` if a file has none for this node or the controller.
    """
    known = {field.name for kind in (Names, Climber, ExpectedDriver) for field in fields(kind)}
    as_controller: list[Section] = []
    own: list[Section] = []
    files = list(paths(arguments))
    for path in files:
        sections = read_sections(path)
        for section in sections:
            where, _, node = section.name.rpartition("/")
            if node == CONTROLLER:
                refuse_unknown(section.values, names_of(CONTROLLER), CONTROLLER)
                given = {name: value for name, value in section.values.items() if name in known}
                as_controller.append(Section(f"{where}/{NODE}", given))
            elif node == NODE or section.is_shared:
                own.append(section)
        if not (as_controller or own):
            raise ValueError(nothing_for(CONTROLLER, path, sections))
    with NamedTemporaryFile("w", suffix=".yaml") as file:
        write_sections([*as_controller, *own], Path(file.name))
        first = ["--ros-args", FILE, file.name, "--"] if files else []
        others = (w for before, w in pairwise(["", *arguments]) if FILE not in (before, w))
        yield [*first, *others]


class Spinner:
    """Spins a node; raises `Interrupted` once `ended()`."""

    def __init__(self, node: DriverNode, ended: Callable[[], bool]) -> None:
        self.executor, self.ended = SingleThreadedExecutor(), ended
        self.executor.add_node(node)

    def once(self) -> None:
        """Spin for one callback, or 0.1 s."""
        self.executor.spin_once(timeout_sec=0.1)
        if self.ended():
            raise Interrupted

    def until(self, condition: Callable[[], bool], timeout: float) -> None:
        """Spin until a condition holds, at most for `timeout` [s]."""
        begin = time.monotonic()
        while not condition() and time.monotonic() < begin + timeout:
            self.once()


def check(
    options: argparse.Namespace, node: DriverNode, ended: Callable[[], bool]
) -> report.Report:
    """Report after listening and, with `--move`, a trial; raises `Interrupted`."""
    for remark in node.parameters.remarks:
        say(remark)
    spin = Spinner(node, ended)
    try:
        if options.move:
            say(plan(node.parameters.read(Climber), node.parameters.read(Bounds)))
        listen(node, spin, options)
        if options.move and checks.may_move(checks.report(node.evidence())):
            move(node, spin)
        return checks.report(node.evidence())
    finally:
        node.end_with_zero()
        spin.executor.shutdown()


def listen(node: DriverNode, spin: Spinner, options: argparse.Namespace) -> None:
    """Collect odometry for `options.duration` [s] of the wall clock, or of its stamps."""
    spin.until(lambda: bool(node.count_publishers(ODOMETRY)), DISCOVERY_TIMEOUT)
    if not node.count_publishers(ODOMETRY):
        return
    spin.until(lambda: node.hears, DISCOVERY_TIMEOUT / 2)
    node.arrivals.clear()  # their times of arrival are of no use
    if options.move and node.has_clock():
        spin.until(
            lambda: node.simulated_for > 0 or len(node.arrivals) > COPIES, DISCOVERY_TIMEOUT / 2
        )
        if node.simulated_for == 0:  # in lock-step, and no torque comes
            node.start_commanding()
    duration = options.duration
    longest = max(duration, DISCOVERY_TIMEOUT / 2) if node.has_clock() else duration
    spin.until(lambda: node.simulated_for > duration or node.has_rival, longest)
    if node.has_rival:
        node.stop_commanding()
        spin.until(lambda: node.simulated_for > duration, longest)


def move(node: DriverNode, spin: Spinner) -> None:
    """Run the trial."""
    if node.torques is None and node.simulated_for > 0:  # another commander may not be found yet
        spin.until(lambda: any(is_known(n) for n in others_commanding(node)), DISCOVERY_TIMEOUT / 2)
    node.start_commanding()
    spin.until(lambda: node.is_heard, DISCOVERY_TIMEOUT / 2)
    spin.until(lambda: False, FLUSH_TIME)
    trial = node.begin_trial()
    while trial.stage is not None:
        spin.once()
        node.watch(trial)


def plan(climber: Climber, bounds: Bounds) -> str:
    """Announcement of the trial, for the user."""
    return (
        "the climber is going to turn left, drive forward, back and turn right, some 0.1 rad and "
        f"1 cm, by torques that rise until it moves, to {bounds.torque_share:g} of "
        f"{climber.max_wheel_torque:g} N m at most, or if it takes speeds by 0.05 m/s, 2 cm. "
        f"It is stopped at {bounds.max_travel:g} m or "
        f"{bounds.max_turn:g} rad. Ctrl-C stops it at once."
    )


def say(text: str) -> None:
    """Print a line beside the report."""
    print(f"check_driver: {text}", file=sys.stderr, flush=True)


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Options of the command line."""
    parser = Parser(
        "check_driver",
        __doc__,
        "Exit status: 0 nothing failed, 1 something did, 2 it could not be checked.",
    )
    parser.add_argument("--move", action="store_true", help="try small torques: the climber moves")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    parser.add_argument(
        "--duration",
        type=between(0.01, 1e6),
        default=3.0,
        metavar="SECONDS",
        help="to listen (default: %(default)s)",
    )
    return parser.arguments(arguments)


def main() -> None:
    """Print the report and exit with its status."""
    caught: list[int] = []
    on_end(lambda number, _: caught.append(number))
    node, status = None, 2
    try:
        use_udp()
        ParameterFiles(sys.argv, "")  # raises with the line that is wrong, unlike rcl
        options = parse(remove_ros_args(sys.argv)[1:])
        with as_the_controller(sys.argv) as arguments:
            rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
            node = DriverNode(arguments)
            found = check(options, node, lambda: bool(caught))
        print(report.as_json(found) if options.json else report.as_text(found))
        status = int(report.has_failed(found))
    except Interrupted:
        say("interrupted")
    except (ValueError, OSError, ParameterException, RCLError, UnknownROSArgsError) as error:
        say(in_a_line(error))
    leave(status, node)
    sys.exit(status)
