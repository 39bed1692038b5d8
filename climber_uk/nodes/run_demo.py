"""`run_demo --config FILE`: the nodes and a recorder, in processes of their own, once.

All of it happens on this machine, in a ROS domain of its own unless ROS_DOMAIN_ID is set.
"""

import argparse
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import FluidPressure, JointState
from std_srvs.srv import Trigger

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.parameter import check, parameter
from climber_uk.messages import reading
from climber_uk.nodes.running import ClimberNode
from climber_uk.nodes.transport import use_udp

# One topic of each node that only the recorder subscribes, and does once it has found the node.
FOUND = ("reference_path", "uk_torque_controller/constraint_force", "joint_states")
FELL = "fell off"
Processes = dict[str, "subprocess.Popen[bytes]"]
START_TIMEOUT = 60.0  # [s]
STOP_TIMEOUT = 20.0  # [s]


@dataclass(frozen=True)
class Options:
    """How long the demonstration takes."""

    duration: float = parameter(20.0, "s", "of the trajectory that is run", above=0)

    def __post_init__(self) -> None:
        check(self)


class Demo(ClimberNode):
    """Starts the trajectories once everybody listens, and watches the time go by."""

    def __init__(self, climbers: Sequence[str]) -> None:
        super().__init__("run_demo")
        self.climbers = climbers
        self.processes: Processes = {}  # that have to go on
        self.parameters.declare(Options)
        self.parameters.refuse_unknown()
        self.duration = self.parameters.read(Options).duration
        self.time: float | None = None  # [s] of the plant
        self.fall = ""  # what the plant said of it
        self.subscription(FluidPressure, f"{climbers[0]}/suction_pressure", self.on_pressure)
        self.subscription(DiagnosticArray, "/diagnostics", self.on_diagnostics)
        self.starters = [
            self.create_client(Trigger, f"{climber}/trajectory_publisher/start")
            for climber in climbers
        ]

    def on_pressure(self, message: FluidPressure) -> None:
        """Keep the time of what is published least often."""
        self.time = reading.nanoseconds(message.header.stamp) / SECOND

    def on_diagnostics(self, message: DiagnosticArray) -> None:
        """Note that the climber fell."""
        for status in message.status:
            if FELL in status.message:
                self.fall = status.message

    def recorder_has_found_all(self) -> bool:
        """Whether the recorder knows every node, and there are starts to ask for."""
        topics = [f"{climber}/{topic}" for climber in self.climbers for topic in FOUND]
        return all(starter.service_is_ready() for starter in self.starters) and all(
            self.count_publishers(topic) and self.count_subscribers(topic) for topic in topics
        )

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        """Spin until `condition()`; raise `RuntimeError` if a process ends, or time runs out."""
        until = time.monotonic() + START_TIMEOUT
        while not condition():
            rclpy.spin_once(self, timeout_sec=0.1)
            for name, process in self.processes.items():
                if process.poll() is not None:
                    raise RuntimeError(f"{name} ended with status {process.returncode}")
            if time.monotonic() > until:
                raise RuntimeError(f"waited {START_TIMEOUT:.0f} s in vain for {what}")

    def start(self, simulated: bool) -> None:
        """Start every trajectory, once everybody has found everybody; raises as `wait` does."""
        self.wait(self.recorder_has_found_all, "the recorder to find the nodes")
        for climber in [] if simulated else self.climbers:  # in lock-step none answers before
            answered: list[JointState] = []
            topic = f"{climber}/wheel_torques"
            answers = self.subscription(JointState, topic, answered.append)
            self.wait(partial(has_answered, answered), f"an answer on {topic}")
            self.destroy_subscription(answers)
        started = [starter.call_async(Trigger.Request()) for starter in self.starters]
        self.wait(lambda: all(start.done() for start in started), "the trajectories to start")

    def run(self) -> None:
        """Watch the trajectories for their duration; raises as `wait` does."""
        self.wait(lambda: self.time is not None, "the plant")
        first = self.time or 0.0
        begin = shown = time.monotonic()
        while (passed := (self.time or 0.0) - first) < self.duration and not self.fall:
            self.wait(lambda: (self.time or 0.0) - first > passed or bool(self.fall), "the plant")
            now = time.monotonic()
            if now > shown + 0.5:
                shown = now
                print(f"\r{self.progress(passed, now - begin)}", end="", flush=True)
        print(f"\r{self.progress(passed, time.monotonic() - begin)}")
        if self.fall:
            print(self.fall)

    def progress(self, passed: float, wall_time: float) -> str:
        """Return a line about the time [s] that has passed, and on the wall clock."""
        speed = passed / wall_time
        return f"{passed:6.1f} of {self.duration:.1f} s, {speed:4.1f} × real time"


def has_answered(torques: list[JointState]) -> bool:
    """Whether one of the torques answers an odometry: the safe output without one has stamp 0."""
    return any(reading.nanoseconds(message.header.stamp) for message in torques)


@contextmanager
def running(commands: dict[str, list[str]], logs: Path) -> Iterator[Processes]:
    """Processes of some commands, all ended whatever happens, the first one, a recorder, first."""
    processes: Processes = {}
    try:
        for name, command in commands.items():
            with (logs / f"{name}.log").open("wb") as log:
                # a session of their own: Ctrl-C comes to them from here, in good order
                processes[name] = subprocess.Popen(
                    command, stdout=log, stderr=subprocess.STDOUT, start_new_session=True
                )
        yield processes
    finally:
        recorder, *nodes = processes.values()
        # what a node sent last would be lost where its end is heard of first
        for group in ([recorder], nodes):
            for process in group:
                process.send_signal(signal.SIGTERM)
            for process in group:
                try:
                    process.wait(STOP_TIMEOUT)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()


def executable(name: str, *arguments: str) -> list[str]:
    """Command that starts an executable of this package."""
    return [str(Path(sys.argv[0]).parent / name), *arguments]


def node_commands(climbers: Sequence[str], config: Path, simulated: bool) -> dict[str, list[str]]:
    """Commands of the nodes by the names of their logs; climbers share one plant, and its time."""

    def ros(*parameters: str, namespace: str = "") -> list[str]:
        given = [part for parameter in parameters for part in ("-p", parameter)]
        where = ["-r", f"__ns:={namespace}"] if namespace else []
        return ["--ros-args", "--params-file", str(config), *where, *given]

    use_sim_time = f"use_sim_time:={str(simulated).lower()}"
    # on the wall clock a climber that starts in motion needs everybody ready
    delay = f"start_delay:={0.0 if simulated else 0.2}"
    commands = {}
    for climber in climbers:
        prefix = f"{climber.strip('/')}." if climber else ""
        commands[prefix + "trajectory_publisher"] = executable(
            "trajectory_publisher", *ros(use_sim_time, "autostart:=false", delay, namespace=climber)
        )
        commands[prefix + "uk_torque_controller"] = executable(
            "uk_torque_controller", *ros(use_sim_time, namespace=climber)
        )
    commands["plant_simulator"] = executable(
        "plant_simulator",
        *(["--climbers", *climbers] if any(climbers) else []),
        *ros(f"simulated_time:={str(simulated).lower()}"),
    )
    return commands


def main() -> None:
    """Run the demonstration; the bag is complete however it ends."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", type=Path, required=True, help="parameter file of all nodes")
    parser.add_argument("--output", type=Path, required=True, help="new directory")
    parser.add_argument("--duration", type=float, help="[s] (default: that of the config)")
    parser.add_argument(
        "--climbers", type=int, help="how many, in namespaces climber_1, ... (default: one in none)"
    )
    parser.add_argument("--clock", choices=("sim", "wall"), default="sim", help="lock-step or not")
    options = parser.parse_args()
    if not options.config.is_file():
        sys.exit(f"run_demo: there is no file {options.config}")
    if options.output.exists():
        sys.exit(f"run_demo: {options.output} exists already")
    options.output.mkdir(parents=True)
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    use_udp()  # the nodes and the recorder inherit it
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))

    bag = options.output / "bag"
    simulated = options.clock == "sim"
    climbers = [f"/climber_{number + 1}" for number in range(options.climbers or 0)] or [""]
    commands = {
        "record_bag": executable("record_bag", "--output", str(bag)),
        **node_commands(climbers, options.config, simulated),
    }
    demo = None
    try:
        duration = ["-p", f"duration:={options.duration}"] if options.duration else []
        rclpy.init(args=["--ros-args", "--params-file", str(options.config), *duration])
        demo = Demo(climbers)
        with running(commands, options.output) as processes:
            print(f"{options.config} in ROS domain {os.environ['ROS_DOMAIN_ID']}")
            demo.processes = processes
            demo.start(simulated)
            demo.run()
    except (KeyboardInterrupt, ExternalShutdownException):
        sys.exit(f"\nrun_demo: interrupted; recorded so far: {bag}")
    except (RuntimeError, ValueError) as error:
        sys.exit(f"\nrun_demo: {error}; see the logs in {options.output}")
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if demo is not None:
            demo.destroy_node()
        rclpy.try_shutdown()
    print(f"recorded: {bag}")
