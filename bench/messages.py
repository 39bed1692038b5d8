"""What messages cost: the three nodes in lock-step beside processes that only exchange messages.

    [FASTDDS_BUILTIN_TRANSPORTS=DEFAULT] python bench/messages.py [--seconds 5] [--rounds 3]

A ping-pong is two processes: an Odometry one way, a JointState the other, and nothing computed.
`typed` makes message objects, as most nodes do, in rclpy's default executor; `bytes` are passed on
as they come, in the executor that our nodes use; the one in C is built by gcc on the same
middleware, and what no Python can beat. Ours are planner, controller and plant on climber.yaml, as
fast as they go. In turns; a ratio is to the first row of the same round.
"""

import argparse
import ctypes
import os
import subprocess
import sys
import sysconfig
import tempfile
import time
import timeit
from copy import deepcopy
from functools import partial
from pathlib import Path
from statistics import median

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Transform, Twist
from nav_msgs.msg import Odometry
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental import EventsExecutor
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.task import Future
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from climber_uk.mechanics.quantities import State
from climber_uk.messages import writing
from climber_uk.messages.in_place import NumberReader
from climber_uk.messages.reading import ODOMETRY
from climber_uk.messages.references import PreviewReader
from climber_uk.ros.transport import use_udp

HERE = Path(__file__)
CONFIG = HERE.parents[1] / "config" / "climber.yaml"
RATE = 200  # [Hz] of its odometry
BIN = Path(sys.executable).parent
NODES = "uk_torque_controller", "plant_simulator", "trajectory_publisher"
LIBRARIES = "rcl", "rmw_fastrtps_cpp", "rmw", "rcutils", "rosidl_runtime_c"
TYPES = "nav_msgs", "sensor_msgs"
SILENCE = 0.5  # [s] after which the end that answers goes


def end(kind: str, leads: bool, seconds: float) -> None:
    """One end of a ping-pong; prints round trips a second and µs of the processor for each."""
    if kind.startswith("C"):
        pingpong = ctypes.CDLL(os.environ["PINGPONG"]).pingpong
        pingpong.argtypes = [ctypes.c_int, ctypes.c_double]
        pingpong(leads, seconds)
        return
    raw, events = "bytes" in kind, "events" in kind
    rclpy.init()
    node, done = rclpy.create_node("leads" if leads else "answers"), Future()
    odometry = Odometry(child_frame_id="base_link")
    odometry.header.frame_id = "odom"
    torques = JointState(name=["left_wheel_joint", "right_wheel_joint"], effort=[0.0, 0.0])
    ours, theirs = (odometry, torques) if leads else (torques, odometry)
    sent = serialize_message(ours) if raw else ours
    topics = ["ping", "pong"] if leads else ["pong", "ping"]
    publisher = node.create_publisher(type(ours), topics[0], 10)
    trips, begin, used, last = 0, 0.0, 0.0, time.monotonic()

    def answer(_: object) -> None:
        nonlocal trips, begin, used, last
        publisher.publish(sent)
        last = time.monotonic()
        if trips == 0:
            begin, used = last, time.process_time()
        trips += 1
        if leads and last - begin > seconds:
            done.set_result(None)

    def look() -> None:
        silent = time.monotonic() - last
        if leads and silent > SILENCE / 5:
            publisher.publish(sent)
        elif trips and silent > SILENCE:
            done.set_result(None)

    node.create_subscription(type(theirs), topics[1], answer, 10, raw=raw)
    node.create_timer(SILENCE / 5, look)
    executor = EventsExecutor() if events else SingleThreadedExecutor()
    executor.add_node(node)
    executor.spin_until_future_complete(done, timeout_sec=seconds + 20)
    print(trips / (last - begin), 1e6 * (time.process_time() - used) / trips)


def pingpong(kind: str, seconds: float) -> list[float]:
    """Round trips a second, and µs of the processor for each at either end."""
    command = [sys.executable, HERE, "--end", kind, "--seconds", str(seconds)]
    answers = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    leads = subprocess.run([*command, "--leads"], stdout=subprocess.PIPE, text=True, check=True)
    rate, by_leader = map(float, leads.stdout.split())
    _, by_other = map(float, answers.communicate()[0].split())
    return [rate, by_leader, by_other]


def processor(process: subprocess.Popen[bytes]) -> float:
    """Seconds of the processor that a process has used."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def ours(kind: str, seconds: float) -> list[float]:
    """Steps a second of the three nodes, and µs of the processor for each: controller and plant."""
    lock_step = ["-p", "simulated_time:=true", "-p", "real_time_factor:=0.0"]
    settings = {name: ["-p", "use_sim_time:=true"] for name in NODES} | {
        "plant_simulator": lock_step
    }
    options = ["--ros-args", "--params-file", CONFIG]
    scratch = tempfile.mkdtemp()
    nodes = [
        subprocess.Popen([BIN / name, *options, *settings[name]], stderr=subprocess.DEVNULL)
        for name in NODES
    ]
    if "recorder" in kind:
        recorder = [BIN / "record_bag", "--output", f"{scratch}/bag"]
        nodes.append(subprocess.Popen(recorder, stderr=subprocess.DEVNULL))
    rclpy.init()
    listener, told = rclpy.create_node("listens"), []

    def listen(message: DiagnosticArray) -> None:
        for status in message.status:
            values = {value.key: value.value for value in status.values}
            if status.name.endswith("plant_simulator") and "time [s]" in values:
                used = [processor(node) for node in nodes[:2]]
                told.append((time.monotonic(), float(values["time [s]"]), *used))

    listener.create_subscription(DiagnosticArray, "/diagnostics", listen, 10)
    try:
        while not told or told[-1][0] - told[0][0] < seconds:
            rclpy.spin_once(listener, timeout_sec=60.0)
            told = [row for row in told if row[1] > 2.0]  # [s] by when all have found each other
    finally:
        for node in nodes:
            node.terminate()
        for node in nodes:
            node.wait()
        rclpy.shutdown()
    passed, simulated, *used = (b - a for a, b in zip(told[0], told[-1], strict=True))
    steps = simulated * RATE
    return [steps / passed, *(1e6 * part / steps for part in reversed(used))]


def reading() -> None:
    """Print what it costs to read a message, by rclpy and in place."""
    point = MultiDOFJointTrajectoryPoint(
        transforms=[Transform()], velocities=[Twist()], accelerations=[Twist()]
    )
    points = [deepcopy(point) for _ in range(26)]
    for number, each in enumerate(points):
        each.time_from_start.nanosec = number
    trajectory = writing.reference(points, 0, "odom", "base_link")
    odometry = writing.odometry(State(np.zeros(3), np.zeros(3)), 0, "odom", "base_link")
    read, preview = NumberReader(Odometry, *ODOMETRY), PreviewReader()
    whole = {Odometry: odometry, MultiDOFJointTrajectory: trajectory}
    in_place = {Odometry: read, MultiDOFJointTrajectory: lambda data: preview(data, "odom")}
    for kind, message in whole.items():
        data, other = serialize_message(message), in_place[kind]
        typed, ours = (
            1e6 * min(timeit.repeat(run, number=200, repeat=9)) / 200
            for run in (partial(deserialize_message, data, kind), partial(other, data))
        )
        print(f"{kind.__name__:24} deserialised {typed:7.1f}   in place {ours:7.1f}")


def build(directory: str) -> str:
    """The shared library of pingpong.c."""
    library, root = f"{directory}/pingpong.so", Path(sysconfig.get_path("data"))
    include = [f"-I{path}" for path in (root / "include").iterdir() if path.is_dir()]
    parts = ("rosidl_typesupport_c", "rosidl_generator_c")
    needed = [*LIBRARIES, *(f"{kind}__{part}" for kind in TYPES for part in parts)]
    command = ["gcc", "-O2", "-shared", "-fPIC", "-o", library, HERE.with_name("pingpong.c")]
    command += [*include, f"-L{root / 'lib'}", *(f"-l{name}" for name in needed)]
    subprocess.run(command, check=True)
    return library


def compare(rounds: int, seconds: float = 5.0, c: bool = True) -> None:
    """Print the table."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    use_udp()
    ways = dict.fromkeys(("typed", "typed, events", "bytes", "bytes, events"), pingpong)
    with tempfile.TemporaryDirectory() as scratch:
        if c:
            os.environ["PINGPONG"] = build(scratch)
            ways["C"] = pingpong
        ways |= {"three nodes": ours, "three nodes, recorder": ours}
        found = {name: [] for name in ways}
        for _ in range(rounds):
            for name, way in ways.items():
                found[name].append(way(name, seconds))
    print(f"{'':24}    round trips/s   ratio   CPU [µs]: leads, answers; plant, controller")
    first = found["typed"]
    for name, rows in found.items():
        rate, *used = (median(column) for column in zip(*rows, strict=True))
        ratio = median(row[0] / other[0] for row, other in zip(rows, first, strict=True))
        print(f"{name:24} {rate:16.0f} {ratio:7.2f}   " + " ".join(f"{us:8.0f}" for us in used))


def main() -> None:
    """Print the table, or be one end."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--seconds", type=float, default=5.0, help="of each run (default: 5)")
    parser.add_argument("--rounds", type=int, default=3, help="(default: 3)")
    parser.add_argument("--no-c", action="store_true", help="without gcc")
    parser.add_argument("--reading", action="store_true", help="only what it costs to read them")
    parser.add_argument("--end", help=argparse.SUPPRESS)
    parser.add_argument("--leads", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.end:
        end(options.end, options.leads, options.seconds)
    elif options.reading:
        reading()
    else:
        compare(options.rounds, options.seconds, not options.no_c)


if __name__ == "__main__":
    main()
