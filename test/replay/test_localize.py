"""`localize` over bags that were made of a climber's known way."""

import json
import math

import numpy as np
import pytest
from made_bag import ODOMETRY, SECOND, message, turn, write

from climber_uk.bags.bag import open_bag
from climber_uk.localization.sensor_frames import SensorFrames
from climber_uk.mechanics.climber import GRAVITY
from climber_uk.messages.names import Names
from climber_uk.replay import localize
from climber_uk.replay.recorded_sensors import read_sensors

IMU, JOINTS = "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState"
POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
PERIOD, SPEED, HEADING, CREEP = 0.02, 0.2, 0.5, 0.05
RADIUS = 0.027


def a_bag(path, seconds=20.0, late=0.3, has_imu=True, runs=1, stray=("", 0, 0.0)):
    """A climber that goes straight and sags; fixes of 2 cm, five a second, that come late.

    One message of a topic, by its number, has a stamp that is off [s].
    """
    random, messages = np.random.default_rng(0), []
    for number in range(round(seconds / PERIOD)):
        time = number * PERIOD
        stamp = 10 * SECOND + round(time * SECOND)
        way = SPEED * time
        x, y = way * math.cos(HEADING), way * math.sin(HEADING) - CREEP * way
        angles = np.full(2, way / RADIUS)
        names = ["left_wheel_joint", "right_wheel_joint"]
        joints = message(JOINTS, stamp, "base_link", name=names, position=angles)
        noise = random.normal(0, 0.02, 3)
        imu = message(
            IMU,
            stamp,
            "base_link",
            angular_velocity__z=0.01 + noise[0],
            linear_acceleration__x=GRAVITY * math.sin(HEADING) + noise[1],
            linear_acceleration__y=GRAVITY * math.cos(HEADING) + noise[2],
        )
        truth = message(ODOMETRY, stamp, pose__pose__position__x=x, pose__pose__position__y=y)
        truth.pose.pose.orientation = turn(HEADING)
        messages.append(("/joint_states", JOINTS, stamp, joints))
        messages.append(("/ground_truth", ODOMETRY, stamp, truth))
        if has_imu:
            messages.append(("/imu", IMU, stamp, imu))
        if number % 10 == 0:
            off = random.normal(0, 0.02, 2)
            fix = message(
                POSE, stamp, pose__pose__position__x=x + off[0], pose__pose__position__y=y + off[1]
            )
            fix.pose.pose.orientation = turn(0.0)
            fix.pose.covariance = np.diag([4e-4, 4e-4, 1.0, 1.0, 1.0, 100.0]).ravel()
            messages.append(("/pose", POSE, stamp + round(late * SECOND), fix))
    topic, place, off = stray
    of_topic = [one for name, _, _, one in messages if name == topic]
    if of_topic:
        of_topic[place].header.stamp.sec += round(off)
    later = range(0, 100 * runs * SECOND, 100 * SECOND)
    return write(path, [(*what, when + at, one) for at in later for *what, when, one in messages])


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the command; return what it said, and why it failed, if it did."""

    def run(*arguments):
        monkeypatch.setattr("sys.argv", ["localize", *map(str, arguments)])
        status = 0
        try:
            localize.main()
        except SystemExit as ended:
            status = ended.code
        said = capsys.readouterr()
        assert (status, len(said.err.splitlines())) in [(0, 0), (2, 1)]
        return said.out, said.err

    return run


def test_a_bag_is_localized_forwards_and_backwards(tmp_path, run):
    bag = a_bag(tmp_path / "bag")
    given = ["-p", "acceleration_bias_deviation:=0.0", "-p", "creep_deviation:=0.1"]
    said, status = run(bag, *given, "-o", tmp_path / "out")
    assert not status
    files = ["forward.tum", "localization.json", "localization.png", "smoothed.tum"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == files
    numbers = json.loads((tmp_path / "out" / "localization.json").read_text())["numbers"]
    assert numbers["fixes taken"] >= 95
    assert numbers["creep"] == pytest.approx(CREEP, abs=0.01)
    assert numbers["bias of the gyro [rad/s]"] == pytest.approx(0.01, abs=0.003)
    forward, backward = (
        numbers[f"distance from the truth, {name}, RMS [m]"] for name in ("forwards", "smoothed")
    )
    assert backward < 0.01
    assert backward < 0.8 * forward
    assert f"{numbers['creep']:.4g}" in said
    lines = (tmp_path / "out" / "smoothed.tum").read_text().splitlines()
    assert len(lines) == numbers["samples of the encoders"]
    assert lines[-1].startswith("29.98")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-p", "wheel_radios:=1.0"], "wheel_radios is no parameter of wall_odometry"),
        (["-p", "wheel_radius:=-1.0"], "wheel_radius=-1.0 must be > 0"),
        (["-p", "left_wheel_joint:=other"], "must have 'other' once"),
        (["-p", "inclination:=0.0"], "heading never known"),
        (["--namespace", "robot"], "has no message on /robot/joint_states"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, run, arguments, said):
    _, message = run(a_bag(tmp_path / "bag", seconds=0.5), *arguments)
    assert said in message
    assert message.startswith("localize: ")
    assert not (tmp_path / "bag" / "localization").exists()


def test_two_runs_are_not_taken_for_one(tmp_path, run):
    _, message = run(a_bag(tmp_path / "bag", seconds=0.5, runs=2))
    assert "/joint_states: time starts again, there are 2 runs: want one" in message


@pytest.mark.parametrize("topic", ["/joint_states", "/imu", "/pose", "/ground_truth"])
@pytest.mark.parametrize(("place", "off"), [(0, 9.0), (1, 2.0), (-1, 5e8), (-3, -9.0)])
def test_a_message_with_a_stray_stamp_is_left_out_and_said(tmp_path, topic, place, off):
    # in the beginning a stamp ahead makes all that comes after it look like a second run
    names, frames = Names(), SensorFrames()
    with open_bag(a_bag(tmp_path / "bag", 1.4, stray=(topic, place, off))) as bag:
        sensors = read_sensors(bag, "", names, frames)
    assert sensors.refused == {f"{topic[1:]}: a stamp far off those around it": 1}
    first, last = 10 * SECOND, round(11.4 * SECOND)
    for left in (sensors.encoders, sensors.imu, sensors.fixes, sensors.true):
        assert all(first <= message[0] <= last for message in left)
