"""`run_demo --config FILE`: the three nodes and a recorder, in processes of their own, once.

All of it happens on this machine, in a ROS domain of its own unless ROS_DOMAIN_ID is set.
"""

import argparse
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import FluidPressure, JointState
from std_srvs.srv import Trigger

from climber_uk.mechanics.parameter import check, parameter
from climber_uk.mechanics.preview import SECOND
from climber_uk.messages import reading
from climber_uk.nodes.running import ClimberNode

# One topic of each node that only the recorder subscribes, and does once it has found the node.
FOUND = ("reference_path", "uk_torque_controller/constraint_force", "joint_states")
FELL = "fell off"
START_TIMEOUT = 60.0  # [s]
STOP_TIMEOUT = 20.0  # [s]


@dataclass(frozen=True)
class Options:
    """How long the demonstration takes."""

    duration: float = parameter(20.0, "s", "of the trajectory that is run", above=0)

    def __post_init__(self) -> None:
        check(self)


class Demo(ClimberNode):
    """Starts the trajectory once everybody listens, and watches the time go by."""

    def __init__(self) -> None:
        super().__init__("run_demo")
        self.parameters.declare(Options)
        self.parameters.refuse_unknown()
        self.duration = self.parameters.read(Options).duration
        self.time: float | None = None  # [s] of the plant
        self.fall = ""  # what the plant said of it
        self.subscription(FluidPressure, "suction_pressure", self.on_pressure)
        self.subscription(DiagnosticArray, "/diagnostics", self.on_diagnostics)
        self.starter = self.create_client(Trigger, "trajectory_publisher/start")

    def on_pressure(self, message: FluidPressure) -> None:
        """Keep the time of what is published least often."""
        self.time = reading.nanoseconds(message.header.stamp) / SECOND

    def on_diagnostics(self, message: DiagnosticArray) -> None:
        """Note that the climber fell."""
        for status in message.status:
            if FELL in status.message:
                self.fall = status.message

    def recorder_has_found_all(self) -> bool:
        """Whether the recorder knows every node, and there is a start to ask for."""
        return self.starter.service_is_ready() and all(
            self.count_publishers(topic) and self.count_subscribers(topic) for topic in FOUND
        )

    def run(self, processes: dict[str, subprocess.Popen[bytes]], simulated: bool) -> None:
        """Run the trajectory for its duration; raise `RuntimeError` if a process ends early."""

        def wait(condition: Callable[[], bool], what: str, timeout: float) -> None:
            until = time.monotonic() + timeout
            while not condition():
                rclpy.spin_once(self, timeout_sec=0.1)
                for name, process in processes.items():
                    if process.poll() is not None:
                        raise RuntimeError(f"{name} ended with status {process.returncode}")
                if time.monotonic() > until:
                    raise RuntimeError(f"waited {timeout:.0f} s in vain for {what}")

        wait(self.recorder_has_found_all, "the recorder to find the nodes", START_TIMEOUT)
        if not simulated:  # in simulated time nobody answers before the start
            answered: list[JointState] = []
            answers = self.subscription(JointState, "wheel_torques", answered.append)
            wait(lambda: has_answered(answered), "the controller to find the plant", START_TIMEOUT)
            self.destroy_subscription(answers)
        started = self.starter.call_async(Trigger.Request())
        wait(started.done, "the trajectory to start", START_TIMEOUT)
        wait(lambda: self.time is not None, "the plant", START_TIMEOUT)
        first = self.time or 0.0
        begin = shown = time.monotonic()
        while (passed := (self.time or 0.0) - first) < self.duration and not self.fall:
            wait(
                lambda: (self.time or 0.0) - first > passed or bool(self.fall),
                "the plant",
                START_TIMEOUT,
            )
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
def running(
    commands: dict[str, list[str]], logs: Path
) -> Iterator[dict[str, "subprocess.Popen[bytes]"]]:
    """Processes of some commands, all ended whatever happens, the first one last."""
    processes: dict[str, subprocess.Popen[bytes]] = {}
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
        for group in (nodes, [recorder]):  # it records what the others say to the end
            for process in group:
                process.send_signal(signal.SIGTERM)
            for process in group:
                try:
                    process.wait(STOP_TIMEOUT)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()


def main() -> None:
    """Run the demonstration; the bag is complete however it ends."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--config", type=Path, required=True, help="parameter file of all nodes")
    parser.add_argument("--output", type=Path, required=True, help="new directory")
    parser.add_argument("--duration", type=float, help="[s] (default: that of the config)")
    parser.add_argument("--clock", choices=("sim", "wall"), default="sim", help="lock-step or not")
    options = parser.parse_args()
    if not options.config.is_file():
        sys.exit(f"run_demo: there is no file {options.config}")
    if options.output.exists():
        sys.exit(f"run_demo: {options.output} exists already")
    options.output.mkdir(parents=True)
    # over shared memory, discovery takes seconds longer now and then
    os.environ.setdefault("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))

    bag = options.output / "bag"
    ros = ["--ros-args", "--params-file", str(options.config)]
    simulated = options.clock == "sim"
    use_sim_time = ["-p", f"use_sim_time:={str(simulated).lower()}"]
    # on the wall clock a climber that starts in motion needs everybody ready
    extra = {
        "record_bag": ["--output", str(bag)],
        "trajectory_publisher": [
            *(*ros, *use_sim_time, "-p", "autostart:=false"),
            *("-p", f"start_delay:={0.0 if simulated else 0.2}"),
        ],
        "uk_torque_controller": [*ros, *use_sim_time],
        "plant_simulator": [*ros, "-p", f"simulated_time:={str(simulated).lower()}"],
    }
    here = Path(sys.argv[0]).parent
    commands = {name: [str(here / name), *arguments] for name, arguments in extra.items()}
    demo = None
    try:
        duration = ["-p", f"duration:={options.duration}"] if options.duration else []
        rclpy.init(args=[*ros, *duration])
        demo = Demo()
        with running(commands, options.output) as processes:
            print(f"{options.config} in ROS domain {os.environ['ROS_DOMAIN_ID']}")
            demo.run(processes, simulated)
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
