"""The nodes on the wall clock: their CPU, the loop's latency and its missed ticks; and their start.

    python bench/nodes.py [--rates 100 200 500 1000] [--duration 20]
    python bench/nodes.py --start

The processes are those of run_demo on climber.yaml: three nodes and a recorder. Latency is from an
odometry's arrival at the recorder to that of its torque; a tick is missed if the torque arrives
after the next odometry is due, or never. Beside it is how punctual the machine is by itself: how
often a process that does nothing but wake up once a period, alone, woke more than a period late.
"""

import argparse
import compileall
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import climber_uk
from climber_uk.bags.recorded_run import read_run

BIN = Path(sys.executable).parent
CONFIG = Path(__file__).parents[1] / "config" / "climber.yaml"
NODES = "trajectory_publisher", "uk_torque_controller", "plant_simulator"
RATES = [100, 200, 500, 1000]  # [Hz]
SETTLING = 5.0  # [s] after the start of the processes that does not count
START = """
import sys, time
import numpy, rclpy, rclpy.experimental, yaml
import rclpy.lifecycle, diagnostic_msgs.msg, geometry_msgs.msg, nav_msgs.msg, rosgraph_msgs.msg
import sensor_msgs.msg, std_msgs.msg, std_srvs.srv, trajectory_msgs.msg
others = time.time()
from climber_uk.nodes.{module} import {name}
from climber_uk.ros.transport import use_udp
ours = time.time()
use_udp()
rclpy.init(args=["--ros-args", "--params-file", sys.argv[1]])
{name}()
print(others, ours, time.time())
"""
STARTED = "TrajectoryPublisher", "UkTorqueController", "PlantSimulator"


def at_rate(rate: int, directory: Path) -> Path:
    """Parameter file of climber.yaml with another rate of odometry [Hz]."""
    period = 1.0 / rate
    text = CONFIG.read_text()
    text = re.sub(r"control_period: .*", f"control_period: {period!r}", text)
    text = re.sub(r"integration_step: .*", f"integration_step: {min(period, 0.0025)!r}", text)
    file = directory / f"{rate}.yaml"
    file.write_text(text)
    return file


def used(process: int) -> dict[str, float]:
    """CPU time [s] of each child of a process so far, by its executable's name."""
    listed = subprocess.run(
        ["ps", "-ww", "-o", "pid=,args=", "--ppid", str(process)], capture_output=True, text=True
    ).stdout
    times = {}
    for line in listed.splitlines():
        pid, command = line.split(maxsplit=1)
        name = next((word for word in (*NODES, "record_bag") if f"/{word}" in command), None)
        if name is not None:
            fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
            times[name] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    return times


def loop(rate: int, duration: float) -> str:
    """Row of a run at a rate [Hz]."""
    with tempfile.TemporaryDirectory() as scratch:
        directory = Path(scratch)
        command = [BIN / "run_demo", "--config", at_rate(rate, directory), "--clock", "wall"]
        command += ["--output", directory / "run", "--duration", str(duration + SETTLING)]
        demo = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        time.sleep(SETTLING)
        before, begin = used(demo.pid), time.monotonic()
        time.sleep(duration - SETTLING)
        after, passed = used(demo.pid), time.monotonic() - begin
        if demo.wait() != 0:
            sys.exit(f"run_demo ended with status {demo.returncode}")
        run = read_run(directory / "run" / "bag")
    latency = run.latency[run.seconds(run.commands) > 1.0]
    missed = int(np.sum(latency > 1 / rate)) + len(run.time) - len(run.torques)
    percent = [100 * (after[name] - before[name]) / passed for name in NODES]
    quantiles = 1e3 * np.quantile(latency, [0.5, 0.9, 0.99, 0.999, 1.0])
    figures = [*(f"{p:6.1f}" for p in percent), *(f"{q:6.2f}" for q in quantiles)]
    return " ".join([f"{rate:5d}", *figures, f"{missed:6d} of {len(run.time)}"])


def late_alone(rate: int, duration: float) -> str:
    """How often a process that only wakes up at a rate [Hz] was more than a period late."""
    begin, late, ticks = time.monotonic(), 0, round(duration * rate)
    for tick in range(1, ticks + 1):
        due = begin + tick / rate
        time.sleep(max(0.0, due - time.monotonic()))
        late += time.monotonic() - due > 1 / rate
    return f"{late:6d} of {ticks}"


def start() -> None:
    """Print how long each node takes to start, and what importing this package is of that."""
    environment = {**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    compileall.compile_dir(climber_uk.__path__[0], quiet=1)  # as every installation does
    print(f"{'[ms]':24s} Python, rclpy   climber_uk     node      all    climber_uk")
    for module, name in zip(NODES, STARTED, strict=True):
        code, times = START.format(module=module, name=name), []
        for _ in range(11):
            begin = time.time()
            command = [sys.executable, "-c", code, CONFIG]
            said = subprocess.run(command, capture_output=True, text=True, env=environment)
            times.append([begin, *map(float, said.stdout.split())])
        parts = np.median(np.diff(1e3 * np.array(times)), axis=0)
        figures = "".join(f"{part:12.0f}" for part in (*parts, parts.sum()))
        print(f"{module:24s}{figures}{100 * parts[1] / parts.sum():10.1f} %")


def loops(rates: Sequence[int], duration: float) -> None:
    """Print a row for each rate."""
    print(
        "   Hz  CPU [%]: planner, controller, plant; latency [ms]: 50, 90, 99, 99.9, 100 %; "
        "missed; late alone"
    )
    for rate in rates:
        print(loop(rate, duration), late_alone(rate, duration), flush=True)


def compare(rounds: int) -> None:
    """Print both tables; a run of `rounds` seconds at each rate."""
    start()
    loops(RATES, max(rounds, 2 * SETTLING))


def main() -> None:
    """Print the table that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--rates", nargs="+", type=int, default=RATES, help="[Hz]")
    parser.add_argument("--duration", type=float, default=20.0, help="[s] of each run")
    parser.add_argument("--start", action="store_true", help="how long the nodes take to start")
    options = parser.parse_args()
    if options.start:
        start()
    else:
        loops(options.rates, options.duration)


if __name__ == "__main__":
    main()
