"""Bags that are written by hand, read as motions."""

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from climber_uk.bags.bag_writer import BagWriter
from climber_uk.bags.run_reader import RunReader
from climber_uk.bags.topics import Topics
from climber_uk.identification import recorded_motion
from climber_uk.identification.recorded_motion import TOPICS

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
SECOND = 10**9
RIGHT_LEFT = ("wheel_r", "wheel_l")
JOINTS = {"right_wheel_joint": "wheel_r", "left_wheel_joint": "wheel_l"}
TIMES = 2.0 + 0.1 * np.arange(11)  # [s]


def header(time, frame=""):
    stamp = TYPES["builtin_interfaces/msg/Time"](*divmod(round(time * SECOND), SECOND))
    return TYPES["std_msgs/msg/Header"](stamp, frame)


def odometry(time, x, heading, speed, yaw_rate):
    vector, pose = TYPES["geometry_msgs/msg/Vector3"], TYPES["geometry_msgs/msg/Pose"]
    turn = TYPES["geometry_msgs/msg/Quaternion"](0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2))
    at = TYPES["geometry_msgs/msg/Point"](x, 0.0, 0.0)
    twist = TYPES["geometry_msgs/msg/Twist"](vector(speed, 0.0, 0.0), vector(0.0, 0.0, yaw_rate))
    return TYPES["nav_msgs/msg/Odometry"](
        header(time, "odom"),
        "base_link",
        TYPES["geometry_msgs/msg/PoseWithCovariance"](pose(at, turn), np.zeros(36)),
        TYPES["geometry_msgs/msg/TwistWithCovariance"](twist, np.zeros(36)),
    )


def joints(time, effort=(), position=()):
    """Of left and right wheel."""
    values = (np.array(part, float) for part in (position, (), effort))
    return TYPES["sensor_msgs/msg/JointState"](header(time), [*RIGHT_LEFT[::-1]], *values)


def pressure(time, value):
    return TYPES["sensor_msgs/msg/FluidPressure"](header(time), value, 0.0)


def bag_of(directory, messages, storage="mcap"):
    """Bag with (topic, message)."""
    with BagWriter(directory / "bag", storage) as writer:
        for number, (topic, message) in enumerate(messages):
            if topic not in writer:
                writer.add_topic(topic, message.__msgtype__, [])
            data = bytes(STORE.serialize_cdr(message, message.__msgtype__))
            writer.write(topic, number, number, data)
    return directory / "bag"


def read_motion(bag, namespace="", **given):
    return recorded_motion.read_motion(
        *RunReader.read(bag, Topics(), namespace, TOPICS), JOINTS, **given
    )


def driving(prefix="", heading=0.0, speed=0.5):
    """Odometry of a steady drive and the torques that answer it: right 1 N m, left 2 N m."""
    for time in TIMES:
        yield (
            f"{prefix}/odom",
            odometry(time, speed * (time - 2.0), heading + (time - 2.0), speed, 1.0),
        )
        yield f"{prefix}/wheel_torques", joints(time, (2.0, 1.0))


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_motion_is_that_of_odometry_and_of_torques_that_answer_it(tmp_path, storage):
    motion, unfit = read_motion(bag_of(tmp_path, driving(), storage), pressure=2500.0)
    assert unfit == 0
    assert motion.time == pytest.approx(TIMES)
    assert motion.pose[:, 0] == pytest.approx(0.5 * (TIMES - 2.0))
    assert motion.rates == pytest.approx(np.tile([0.5, 1.0], (11, 1)))
    assert motion.impulse == pytest.approx(np.outer(TIMES - 2.0, [1.0, 2.0]), abs=1e-12)
    assert motion.pressure == pytest.approx(np.full(11, 2500.0))
    assert motion.wheel_angles is None


def test_a_delay_moves_the_torques(tmp_path):
    motion, _ = read_motion(bag_of(tmp_path, driving()), delay=0.05)
    assert motion.time == pytest.approx(TIMES[1:])  # at the first none is known
    assert motion.impulse[0] == pytest.approx([0.05, 0.1])


def test_torques_at_the_wheels_are_those_of_the_time_before_and_preferred(tmp_path):
    told = [("/joint_states", joints(t, (4.0, t), (t, 2 * t))) for t in TIMES]
    motion, _ = read_motion(bag_of(tmp_path, [*driving(), *told]))
    right, left = np.diff(motion.impulse, axis=0).T / 0.1
    assert right == pytest.approx(TIMES[1:])
    assert left == pytest.approx(np.full(10, 4.0))
    assert motion.wheel_angles == pytest.approx(np.outer(TIMES, [2.0, 1.0]))


def test_headings_do_not_jump_and_a_pose_alone_has_no_rates(tmp_path):
    messages = []
    for topic, message in driving(heading=3.0):
        if topic == "/odom":
            message.twist.twist.linear.x = message.twist.twist.angular.z = 0.0
        messages.append((topic, message))
    motion, _ = read_motion(bag_of(tmp_path, messages))
    assert motion.pose[:, 2] == pytest.approx(TIMES + 1.0)
    assert motion.rates is None


def test_pressure_and_namespace_are_those_of_the_climber(tmp_path):
    told = [("/b/suction_pressure", pressure(t, 1000.0 * t)) for t in (2.0, 3.0)]
    bag = bag_of(tmp_path, [*driving("/a"), *driving("/b", speed=0.7), *told])
    motion, _ = read_motion(bag, namespace="b")
    assert motion.rates[0, 0] == pytest.approx(0.7)
    assert motion.pressure == pytest.approx(1000.0 * TIMES)


def test_an_absolute_pressure_is_none_of_the_suction(tmp_path):
    told = [("/suction_pressure", pressure(t, 93.0e3)) for t in (2.0, 3.0)]
    motion, unfit = read_motion(bag_of(tmp_path, [*driving(), *told]), pressure=8000.0)
    assert unfit == 2
    assert motion.pressure == pytest.approx(np.full(11, 8000.0))


def test_unfit_messages_are_left_out_and_counted(tmp_path):
    bad = [
        ("/odom", odometry(2.35, np.nan, 0.0, 0.5, 0.0)),
        ("/wheel_torques", joints(2.45, (np.inf, 0.0))),
    ]
    motion, unfit = read_motion(bag_of(tmp_path, [*driving(), *bad]))
    assert unfit == 2
    assert motion.impulse[-1] == pytest.approx([1.0, 2.0])


def test_missing_torques_are_a_gap(tmp_path):
    kept = [m for m in driving() if not (m[0] == "/wheel_torques" and 2.15 < stamp(m[1]) < 2.85)]
    motion, _ = read_motion(bag_of(tmp_path, kept))
    assert motion.stretch[0] == motion.stretch[1] != motion.stretch[5]
    assert motion.stretch[-1] not in (motion.stretch[5], motion.stretch[0])


def stamp(message):
    return message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec


def test_a_bag_without_torques_is_refused_by_name(tmp_path):
    bag = bag_of(tmp_path, [message for message in driving() if message[0] == "/odom"])
    with pytest.raises(ValueError, match="has no message on /wheel_torques"):
        read_motion(bag)
