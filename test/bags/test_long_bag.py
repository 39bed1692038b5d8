"""An hour at 200 Hz: `pytest -m soak -s test/bags/test_long_bag.py` tells time and memory."""

import json
import subprocess
import sys

import numpy as np
import pytest
from made_bag import (
    BEGAN,
    JOINTS,
    ODOMETRY,
    REFERENCE,
    SECOND,
    START,
    STORE,
    WRENCH,
    Made,
    message,
    on_circle,
)

from climber_uk.bags.bag_writer import BagWriter
from climber_uk.messages.cdr_layout import Layout

pytestmark = [pytest.mark.soak, pytest.mark.timeout(900)]

HOUR, RATE = 3600, 200  # [s], [Hz]
BY_FLUSH = 2000  # odometry messages
# how many s of CPU and of the wall clock, and MiB, a command took; getrusage counts what its parent
# had as well
MEASURED = """
import re, sys, time
begin = time.monotonic()
from pathlib import Path
from climber_uk.report.analyze_bag import main
sys.argv.pop(0)
try:
    main()
finally:
    peak = re.search("VmHWM:.*?([0-9]+) kB", Path("/proc/self/status").read_text())[1]
    print(time.process_time(), time.monotonic() - begin, int(peak) / 1024)
"""
TOPICS = {
    "/odom": ODOMETRY,
    "/wheel_torques": JOINTS,
    "/joint_states": JOINTS,
    "/uk_torque_controller/constraint_force": WRENCH,
    "/reference": REFERENCE,
}


def filled(type_name, sample, stamps, **columns):
    """Messages as the sample, with stamps and some columns of numbers of their own."""
    data = bytes(STORE.serialize_cdr(sample, type_name))
    layout = Layout(data, lambda name: STORE.fielddefs[name][1])
    layout.walk(type_name)
    rows = np.tile(np.frombuffer(data, np.uint8), (len(stamps), 1)).view(layout.numbers)[:, 0]
    rows["header.stamp.sec"], rows["header.stamp.nanosec"] = divmod(stamps, SECOND)
    for path, values in columns.items():
        rows[path.replace("__", ".")] = values
    return [row.tobytes() for row in rows]


def part(stamps):
    """Serialised messages of four topics, with an error of 1 mm to the left."""
    pose, _, _ = on_circle((stamps - START) / SECOND)
    x, y, heading = pose.T
    names = ["left_wheel_joint", "right_wheel_joint"]
    pair = {"name": names, "effort": np.ones(2)}
    moving = {**pair, "position": np.zeros(2), "velocity": np.ones(2)}
    return {
        "/odom": filled(
            ODOMETRY,
            message(ODOMETRY, 0, child_frame_id="base_link", twist__twist__linear__x=1.0),
            stamps,
            pose__pose__position__x=x - 1e-3 * np.sin(heading),
            pose__pose__position__y=y + 1e-3 * np.cos(heading),
            pose__pose__orientation__z=np.sin(heading / 2),
            pose__pose__orientation__w=np.cos(heading / 2),
        ),
        "/wheel_torques": filled(
            JOINTS, message(JOINTS, 0, name=["left", "right"], effort=np.ones(2)), stamps
        ),
        "/joint_states": filled(JOINTS, message(JOINTS, 0, **moving), stamps),
        "/uk_torque_controller/constraint_force": filled(WRENCH, message(WRENCH, 0), stamps),
    }


def write(path, storage):
    references = Made(n=1)
    references.add_reference(0.0, HOUR)
    waiting = [(log_time, made) for _, _, log_time, made in references.messages]
    stamps = START + np.arange(HOUR * RATE) * (SECOND // RATE)
    with BagWriter(path, storage) as writer:
        for topic, type_name in TOPICS.items():
            writer.add_topic(topic, type_name, [])
        for some in np.split(stamps, len(stamps) // BY_FLUSH):
            for topic, messages in part(some).items():
                for stamp, data in zip(some.tolist(), messages, strict=True):
                    writer.write(topic, BEGAN + stamp - START, BEGAN + stamp - START, data)
            while waiting and waiting[0][0] < BEGAN + some[-1] - START:
                log_time, made = waiting.pop(0)
                writer.write(
                    "/reference", log_time, log_time, bytes(STORE.serialize_cdr(made, REFERENCE))
                )
            writer.flush()
        return writer.message_count


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_an_hour_takes_less_than_a_minute_and_a_gibibyte(tmp_path, storage):
    count = write(tmp_path / "bag", storage)
    command = [sys.executable, "-c", MEASURED, "analyze_bag", tmp_path / "bag"]
    *_, said = subprocess.check_output(command, text=True).splitlines()
    seconds, waited, mebibytes = (float(number) for number in said.split())
    times = f"{seconds:.1f} s of CPU in {waited:.1f} s"
    print(f"\n{storage}: {count} messages, {times}, {mebibytes:.0f} MiB")
    (run,) = json.loads((tmp_path / "bag" / "analysis" / "metrics.json").read_text())["runs"]
    assert run["metrics"]["odometry_count"] == HOUR * RATE
    assert run["metrics"]["rms_cross_track"] == pytest.approx(1e-3, rel=1e-9)
    assert seconds < 60
    assert mebibytes < 1024
