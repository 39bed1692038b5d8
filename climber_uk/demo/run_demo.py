"""`run_demo --config FILE`: run the nodes and a recorder, in processes of their own, once.

They run on this computer, in a ROS domain of their own unless ROS_DOMAIN_ID is set.
"""

import argparse
import math
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import chain
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import FluidPressure, JointState
from std_srvs.srv import Trigger

from climber_uk.closed_loop.node_parameters import PARAMETERS as NODE_PARAMETERS
from climber_uk.closed_loop.node_parameters import doubts, read_planner
from climber_uk.closed_loop.start import begun_there, other_climber, start_elsewhere
from climber_uk.demo.corners import write_for_corners
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.messages import reading
from climber_uk.messages.topics import (
    CONTROLLER,
    DIAGNOSTICS,
    FELL,
    JOINTS,
    LOCALIZATION,
    NODES,
    PARAMETERS,
    PLANNER,
    PLANT,
    PROGRESS,
    REFERENCE_PATH,
)
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.parameter_file import Values, given, read_file, read_sections
from climber_uk.ros.leaving import leave
from climber_uk.ros.running import ClimberNode
from climber_uk.ros.transport import free_domain, use_udp
from climber_uk.simulation.options import SimulationOptions
from climber_uk.system.command_line import Parser, between, in_words, whole
from climber_uk.system.processes import die_with, dies_with_me, end
from climber_uk.system.signals import Interrupted, on_end

# One topic of each node that is published before the trajectory starts; not the second by a
# controller of somebody else. The first two are latched: the recorder subscribes them last, so what
# comes after their message is not lost.
RECORDED = REFERENCE_PATH, PARAMETERS, JOINTS
COUNT = re.compile(r"^ +name: (\S+)$.*?^ +message_count: (\d+)$", re.MULTILINE | re.DOTALL)
Processes = dict[str, "subprocess.Popen[bytes]"]
MOST_CLIMBERS = 100
START_TIMEOUT = 60.0  # [s]
ENDLESS = 20.0  # [s] of a path without end
STOP_TIMEOUT = 20.0  # [s] for the recorder, and then for the nodes
HURRIED_TIMEOUTS = 3.8, 1.0  # [s] of recorder and nodes, after more than one signal


class Ended(RuntimeError):  # noqa: N818 - it is what happened
    """A process that should go on has ended; `name` is the key of its log."""

    def __init__(self, name: str, status: int) -> None:
        super().__init__(f"{name} ended with status {status}")
        self.name = name


@parameters
class DemoOptions:
    """How long the demonstration lasts."""

    duration: float = parameter(
        0.0,
        "s",
        "time of the trajectory; 0: as long as its path takes, or 20 s of one without end; too "
        "short: it is cut off",
        at_least=0,
    )


class Demo(ClimberNode):
    """Starts the trajectories once all nodes are connected, and waits for their duration."""

    def __init__(
        self,
        climbers: Sequence[str],
        signals: Sequence[int],
        arguments: Sequence[str],
        has_our_controller: bool = True,
    ) -> None:
        super().__init__("run_demo", arguments=arguments)
        self.climbers, self.signals = climbers, signals
        self.topics = [topic for topic in RECORDED if has_our_controller or topic != PARAMETERS]
        self.processes: Processes = {}  # that have to go on
        self.has_begun = False
        self.parameters.declare(DemoOptions)
        self.parameters.refuse_unknown()
        self.duration = self.parameters.read(DemoOptions).duration
        self.time: float | None = None  # [s] of the plant
        self.fall = ""  # diagnostics of a fall
        self.left: dict[str, float] = {}  # [s] of each climber's path, as its planner tells
        self.subscription(FluidPressure, f"{climbers[0]}/suction_pressure", self.on_pressure)
        self.subscription(DiagnosticArray, DIAGNOSTICS, self.on_diagnostics)
        for climber in climbers:
            hear = partial(self.on_progress, climber)
            self.subscription(DiagnosticArray, f"{climber}/{PROGRESS}", hear)
        self.starters = [
            self.create_client(Trigger, f"{climber}/trajectory_publisher/start")
            for climber in climbers
        ]

    def on_pressure(self, message: FluidPressure) -> None:
        """Keep the plant's time, by a topic that is not published often."""
        self.time = reading.nanoseconds(message.header.stamp) / SECOND

    def on_diagnostics(self, message: DiagnosticArray) -> None:
        """Keep the message of a fall."""
        for status in message.status:
            if FELL in status.message:
                self.fall = status.message

    def on_progress(self, climber: str, message: DiagnosticArray) -> None:
        """Keep how long the path of a climber still takes: infinitely, if it has no end."""
        values = {pair.key: pair.value for pair in message.status[0].values}
        self.left[climber] = float(values["time_left"])

    def planned(self) -> float:
        """How long it takes from now until all paths are done [s]; NaN until planners tell."""
        told = [self.left.get(climber, math.nan) for climber in self.climbers]
        return math.nan if any(map(math.isnan, told)) else max(told)

    def records_all(self, bag: Path) -> bool:
        """Whether messages of every node are recorded, and the services to start are there."""
        wanted = {f"{climber}/{topic}" for climber in self.climbers for topic in self.topics}
        ready = all(starter.service_is_ready() for starter in self.starters)
        return ready and wanted <= recorded_topics(bag)

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        """Spin until `condition()`.

        Raises `RuntimeError` if a process ends, or time runs out; `Interrupted` by a signal.
        """
        until = time.monotonic() + START_TIMEOUT
        while not condition():
            rclpy.spin_once(self, timeout_sec=0.1)
            if self.signals:
                raise Interrupted
            for name, process in self.processes.items():
                if process.poll() is not None:
                    raise Ended(name, process.returncode)
            if time.monotonic() > until:
                raise RuntimeError(f"waited {START_TIMEOUT:.0f} s in vain for {what}")

    def start(self, simulated: bool, bag: Path) -> None:
        """Start every trajectory, once all nodes are recorded; raises as `wait` does."""
        self.wait(lambda: self.records_all(bag), "the recorder to find the nodes")
        for climber in [] if simulated else self.climbers:  # in lock-step none answers before
            answered: list[JointState] = []
            topic = f"{climber}/wheel_torques"
            answers = self.subscription(JointState, topic, answered.append)
            self.wait(partial(has_answered, answered), f"an answer on {topic}")
            self.destroy_subscription(answers)
        started = [starter.call_async(Trigger.Request()) for starter in self.starters]
        self.has_begun = True
        self.wait(lambda: all(start.done() for start in started), "the trajectories to start")

    def run(self) -> None:
        """Wait for the duration, or a fall, and show the progress; raises as `wait` does."""
        # one that fell before this was heard of tells no time any more
        self.wait(lambda: self.time is not None or bool(self.fall), "the plant")
        first = self.time or 0.0
        if not self.duration:
            self.wait(
                lambda: (
                    not math.isnan(self.planned())
                    or (self.time or 0.0) > first + 1.0
                    or bool(self.fall)
                ),
                "the plant",
            )
            lasts = (self.time or 0.0) - first + self.planned() + 1.5
            self.duration = math.ceil(lasts) if math.isfinite(lasts) else ENDLESS
        begin = shown = time.monotonic()
        in_place, due = sys.stdout.isatty(), 0.0  # where it is no terminal, ten lines in all
        while (passed := (self.time or 0.0) - first) < self.duration and not self.fall:
            self.wait(lambda: (self.time or 0.0) - first > passed or bool(self.fall), "the plant")
            now = time.monotonic()
            if now > shown + 0.5 and (in_place or passed >= due):
                shown, due = now, passed + self.duration / 10
                end_of_line = "\r" if in_place else "\n"
                print(self.progress(passed, now - begin), end=end_of_line, flush=True)
        print(self.progress(passed, time.monotonic() - begin))
        if self.fall:
            print(self.fall)
        left = max((left for left in self.left.values() if math.isfinite(left)), default=0.0)
        if left > 0.0 and not self.fall:
            print(
                f"The path was not finished: {left:.0f} s of it are left after {self.duration:g} s "
                "(--duration, or `duration` of run_demo in the parameter file)"
            )

    def progress(self, passed: float, wall_time: float) -> str:
        """Line of progress, by the plant's time [s] and the wall clock's [s]."""
        speed = passed / wall_time
        return f"{passed:6.1f} of {self.duration:.1f} s, {speed:4.1f} × real time"


def has_answered(torques: list[JointState]) -> bool:
    """Whether one of the torques answers an odometry; the safe output without odometry: stamp 0."""
    return any(reading.nanoseconds(message.header.stamp) for message in torques)


@contextmanager
def running(
    commands: dict[str, list[str]], logs: Path, signals: Sequence[int], killed: list[str]
) -> Iterator[Processes]:
    """Processes of commands by name; at the end all are stopped, the first, the recorder, first.

    Names of those that did not end, and had to be killed, are added to `killed`.
    """
    processes: Processes = {}
    try:
        for name, command in commands.items():
            with log_of(name, logs).open("wb") as log:
                # a session of their own: Ctrl-C comes to them from here, in good order
                processes[name] = subprocess.Popen(
                    command,
                    stdout=log,
                    stderr=subprocess.STDOUT,
                    start_new_session=True,
                    preexec_fn=dies_with_me(),
                )
        yield processes
    finally:
        # else a node's last messages would be lost, where its end is known before them
        groups = [*processes][:1], [*processes][1:]
        for group, hurried in zip(groups, HURRIED_TIMEOUTS, strict=True):
            remaining = {name: processes[name] for name in group}
            killed += end(remaining, partial(patience, signals, hurried))


def patience(signals: Sequence[int], hurried: float) -> float:
    """Time [s] for processes to end: `hurried` if more than one signal has come."""
    return hurried if len(signals) > 1 else STOP_TIMEOUT


def recorded_topics(bag: Path) -> set[str]:
    """Topics of which a bag that is being written has messages, by its metadata.yaml."""
    metadata = bag / "metadata.yaml"
    counts = COUNT.findall(metadata.read_text()) if metadata.is_file() else []
    return {name for name, count in counts if int(count)}


def log_of(name: str, logs: Path) -> Path:
    """File with the output of a process."""
    return logs / f"{name}.log"


def executable(name: str, *arguments: str) -> list[str]:
    """Command of an executable of this package, with its arguments."""
    return [str(Path(sys.argv[0]).parent / name), *arguments]


def node_commands(
    climbers: Sequence[str], config: Path, simulated: bool, controller: Sequence[str]
) -> dict[str, list[str]]:
    """Commands of the nodes, by names of their logs; climbers share one plant, and its time.

    `controller` is the command of one that takes our controller's place, if it is not empty.
    `wall_odometry` is one of them where the configuration has parameters for it.
    """

    def ros(*parameters: str, namespace: str = "") -> list[str]:
        given = [part for parameter in parameters for part in ("-p", parameter)]
        where = ["-r", f"__ns:={namespace}"] if namespace else []
        return ["--ros-args", "--params-file", str(config), *where, *given]

    use_sim_time = f"use_sim_time:={str(simulated).lower()}"
    # on the wall clock a climber that starts in motion needs all nodes ready
    delay = f"start_delay:={0.0 if simulated else 0.2}"
    commands = {}
    for climber in climbers:
        prefix = f"{climber.strip('/')}." if climber else ""
        commands[prefix + PLANNER] = executable(
            PLANNER, *ros(use_sim_time, "autostart:=false", delay, namespace=climber)
        )
        localizes = given(read_sections(config), f"{climber}/{LOCALIZATION}")
        for node in (CONTROLLER, LOCALIZATION) if localizes else (CONTROLLER,):
            program = controller if controller and node == CONTROLLER else executable(node)
            commands[prefix + node] = [*program, *ros(use_sim_time, namespace=climber)]
    commands[PLANT] = executable(
        PLANT,
        *(["--climbers", *climbers] if any(climbers) else []),
        *ros(f"simulated_time:={str(simulated).lower()}"),
    )
    return commands


def doubts_on(config: Path, climber: str) -> Iterator[str]:
    """Lines on what can hardly be meant in a file; raises as `read_file` does."""
    for node in NODES:
        values = read_file(config, f"{climber}/{node}")
        yield from doubts(config, values, NODE_PARAMETERS, f"{node}.")


def remarks_on(config: Path, climber: str, is_refused: bool) -> list[str]:
    """Lines on a climber that is not where its path begins, or other than its controller has it.

    Raises `ValueError` if the controller would refuse the path. Where the parameters make no path
    or plant, the nodes say why.
    """
    controller, plant = (Values(read_file(config, f"{climber}/{n}")) for n in (CONTROLLER, PLANT))
    try:
        trajectory = build_trajectory(Values(read_planner(config, f"{climber}/{PLANNER}")).read)
        trajectory = begun_there(trajectory, plant.read(SimulationOptions))
        elsewhere, is_too_far = start_elsewhere(trajectory, controller, plant)
        said = other_climber(controller, plant), elsewhere
    except ValueError:
        return []
    if is_too_far and is_refused:
        raise ValueError(f"{config}: {elsewhere}")
    return [f"{config}: {line}" for line in said if line]


def tell(remarks: Iterable[Iterable[str]]) -> None:
    """Print remarks on the parameters of several climbers, each once."""
    for line in dict.fromkeys(chain.from_iterable(remarks)):
        print(f"run_demo: {line}", file=sys.stderr)


def parse() -> argparse.Namespace:
    """Options of the command line."""
    parser = Parser("run_demo", __doc__)
    parser.add_argument("--config", type=Path, required=True, help="parameter file of all nodes")
    parser.add_argument(
        "--corners", type=Path, help="of an area, as lanes.area: drive lanes over that one instead"
    )
    parser.add_argument("--output", "-o", type=Path, required=True, help="new directory")
    parser.add_argument(
        "--duration",
        type=between(1e-3, 1e9),
        help="[s] (default: that of the config, or as long as its path takes)",
    )
    parser.add_argument(
        "--climbers",
        type=whole(1, MOST_CLIMBERS),
        help="how many, in namespaces climber_1, ... (default: one in none)",
    )
    parser.add_argument(
        "--controller",
        type=_words,
        default=[],
        help="command of a controller of yours, in the place of uk_torque_controller",
    )
    parser.add_argument("--clock", choices=("sim", "wall"), default="sim", help="lock-step or not")
    parser.add_argument(
        "--with-parent", action="store_true", help="end when what started it does, as make demo"
    )
    return parser.arguments()


def _words(command: str) -> list[str]:
    try:
        return shlex.split(command)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{command!r}: {error}") from None


def main() -> None:
    """Run the demonstration; the bag is complete however it ends."""
    options = parse()
    signals: list[int] = []
    on_end(lambda number, _: signals.append(number))
    if options.with_parent:
        die_with(os.getppid())
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    use_udp()  # the nodes and the recorder inherit it
    if "ROS_DOMAIN_ID" not in os.environ:
        domain, _reserved = free_domain()  # as long as this lasts
        os.environ["ROS_DOMAIN_ID"] = str(domain)
    climbers = [f"/climber_{number + 1}" for number in range(options.climbers or 0)] or [""]
    try:
        tell(doubts_on(options.config, climber) for climber in climbers)
        options.output.mkdir(parents=True)
        try:
            if options.corners:
                written = options.output / "corners.yaml"
                write_for_corners(options.config, options.corners, written)
                options.config = written
            is_refused = not options.controller
            tell(remarks_on(options.config, climber, is_refused) for climber in climbers)
        except (ValueError, OSError):
            shutil.rmtree(options.output)
            raise
    except ValueError as error:
        sys.exit(f"run_demo: {error}")
    except OSError as error:
        sys.exit(f"run_demo: {error.strerror}: {error.filename}")
    demo, trouble = record(options, climbers, signals)
    if trouble:
        print(trouble, file=sys.stderr)
    else:
        print(f"recorded: {options.output / 'bag'}")
    leave(int(bool(trouble)), demo)
    sys.exit(int(bool(trouble)))


def record(
    options: argparse.Namespace, climbers: Sequence[str], signals: Sequence[int]
) -> tuple[Demo | None, str]:
    """Run nodes and recorder into a new directory; remove it if no trajectory was started.

    Returns its own node, and what went wrong in words.
    """
    bag, simulated = options.output / "bag", options.clock == "sim"
    commands = {
        "record_bag": executable("record_bag", "--output", str(bag)),
        **node_commands(climbers, options.config, simulated, options.controller),
    }
    duration = ["-p", f"duration:={options.duration}"] if options.duration else []
    arguments = ["--ros-args", "--params-file", str(options.config), *duration]
    demo, said = None, ""
    killed: list[str] = []
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        demo = Demo(climbers, signals, arguments, not options.controller)
        with running(commands, options.output, signals, killed) as demo.processes:
            print(f"{options.config} in ROS domain {os.environ['ROS_DOMAIN_ID']}", flush=True)
            demo.start(simulated, bag)
            demo.run()
    except Interrupted:
        said = "interrupted"
    except Ended as error:
        lines = log_of(error.name, options.output).read_text(errors="replace").splitlines()
        said = f"{error}: {lines[-1] if lines else 'its log is empty: is the disk full?'}"
    except (RuntimeError, ValueError, OSError) as error:
        said = in_words(error)
    if killed:
        said = f"{said + ', and ' if said else ''}{', '.join(killed)} did not end, and was killed"
    if not said:
        return demo, ""
    if demo is not None and demo.has_begun:
        return demo, f"\nrun_demo: {said}; recorded so far, and the logs: {options.output}"
    shutil.rmtree(options.output)
    return demo, f"run_demo: {said}"
