"""How long the loop is without a torque while other processes of its domain come and go.

    python bench/neighbours.py [--transports UDPv4 DEFAULT] [--times 20]

Three nodes on the wall clock, at 200 Hz, and one process after another that only subscribes, as
`ros2 topic echo` does, with the transports that ROS has by default: it is killed, stopped for a
second and killed, or ended, 0.4 to 1.8 s after its start. Every other one is in another domain,
where it costs the machine the same: what is longer than there is the middleware's doing. Longest
times from one torque to the next [ms] while such a process lived, median and largest of all, and
how many were longer than the largest beside strangers by 50 ms. DEFAULT is what Fast DDS chooses by
itself, shared memory.
"""

import argparse
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import JointState

from climber_uk.ros.transport import RANGE, TRANSPORTS

Process = subprocess.Popen[bytes]
BIN = Path(sys.executable).parent
CONFIG = Path(__file__).parents[1] / "config" / "climber.yaml"
NODES = {
    "trajectory_publisher": ["-p", "rest_to_rest.laps:=1000"],
    "uk_torque_controller": [],
    "plant_simulator": [],
}
OWN, STRANGE = 60 + os.getpid() % 20, 80 + os.getpid() % 20  # domains
NEIGHBOUR = """
import rclpy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
rclpy.init()
node = rclpy.create_node("neighbour")
for kind, topic in (Odometry, "odom"), (JointState, "wheel_torques"), (JointState, "joint_states"):
    node.create_subscription(kind, topic, lambda message: None, 10)
rclpy.spin(node)
"""


def stopped(process: Process) -> None:
    """SIGSTOP for a second."""
    process.send_signal(signal.SIGSTOP)
    time.sleep(1.0)
    process.send_signal(signal.SIGCONT)
    time.sleep(0.3)


ENDS: dict[str, Callable[[Process], None]] = {
    "killed": Process.kill,
    "stopped": stopped,
    "ended": Process.terminate,
}


def start(command: list[str], domain: int, **chosen: str) -> Process:
    """Process that has of all choices of the middleware only those given."""
    unset = RANGE, TRANSPORTS
    environment = {name: value for name, value in os.environ.items() if name not in unset}
    environment |= {"ROS_DOMAIN_ID": str(domain), **chosen}
    return subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)


def longest(times: list[float], end: Callable[[Process], None], domain: int, life: float) -> float:
    """Longest time [ms] without a torque, of those at `times`, beside a process in a domain."""
    begin = time.monotonic()
    neighbour = start([sys.executable, "-c", NEIGHBOUR], domain)
    time.sleep(life)
    end(neighbour)
    time.sleep(0.3)
    neighbour.kill()
    neighbour.wait()
    time.sleep(0.5)
    during = [begin, *(time for time in times[:] if time > begin), time.monotonic()]
    return 1e3 * float(np.diff(during).max())


def rows(transport: str, times: list[float], number: int) -> None:
    """Print a row for each end, once the torques of three nodes come in at `times`."""
    nodes = [
        start(
            [str(BIN / name), "--ros-args", "--params-file", str(CONFIG), *others],
            OWN,
            **{TRANSPORTS: transport},
        )
        for name, others in NODES.items()
    ]
    try:
        while len(times) < 1000:
            time.sleep(0.1)
        for name, end in ENDS.items():
            lives = [random.Random(one).uniform(0.4, 1.8) for one in range(number)]
            own, strange = np.array(
                [[longest(times, end, domain, life) for domain in (OWN, STRANGE)] for life in lives]
            ).T
            figures = "".join(f"{np.median(g):9.1f}{g.max():9.1f}" for g in (own, strange))
            late = np.count_nonzero(own > strange.max() + 50.0)
            print(f"{transport:10s}{name:8s}{figures}{late:6d} of {number}", flush=True)
    finally:
        for node in nodes:
            node.kill()


def listen(times: list[float]) -> None:
    """Note when torques come, until the end."""
    node = rclpy.create_node("bench")
    note = lambda message: times.append(time.monotonic())  # noqa: E731
    node.create_subscription(JointState, "wheel_torques", note, 100)
    with suppress(ExternalShutdownException):
        rclpy.spin(node)
    node.destroy_node()


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--transports", nargs="+", default=["UDPv4", "DEFAULT"])
    parser.add_argument("--times", type=int, default=20)
    options = parser.parse_args()
    print("transport its end  beside them: 50, 100 %  strangers: 50, 100 %  late")
    for transport in options.transports:
        os.environ[TRANSPORTS] = transport
        rclpy.init(domain_id=OWN)
        times: list[float] = []
        listener = threading.Thread(target=listen, args=(times,))
        listener.start()
        try:
            rows(transport, times, options.times)
        finally:
            rclpy.shutdown()
            listener.join()


if __name__ == "__main__":
    main()
