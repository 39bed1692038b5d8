"""Numbers of serialised messages, in place: as rclpy has them, or refused."""

import re
from dataclasses import fields as fields_of_dataclass
from operator import attrgetter

import numpy as np
import pytest
from geometry_msgs.msg import Transform, Twist, Vector3Stamped, WrenchStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from reference_points import reference_point
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import FluidPressure, JointState
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from climber_uk.mechanics.reference import Reference
from climber_uk.messages import in_place, reading, writing
from climber_uk.messages.in_place import MOST_LAYOUTS, NumberReader, NumberWriter, laid_out
from climber_uk.messages.references import PreviewReader, ReferenceWriter, preview

ANYTHING = settings(deadline=None)
STORE = get_typestore(Stores.ROS2_JAZZY)

numbers = st.floats(allow_nan=False)
texts = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=20)
seconds, nanoseconds = st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**32 - 1)


def filled(message, paths, values):
    """The message with values at some paths."""
    for path, value in zip(paths, values, strict=True):
        parent, _, name = path.rpartition(".")
        setattr(attrgetter(parent)(message) if parent else message, name, value)
    return message


@st.composite
def odometries(draw):
    paths, strings = reading.ODOMETRY
    values = [draw(seconds), draw(nanoseconds), *(draw(numbers) for _ in paths[2:])]
    return filled(Odometry(), [*paths, *strings], [*values, draw(texts), draw(texts)])


@st.composite
def joint_states(draw):
    message = JointState(name=draw(st.lists(texts, max_size=4)))
    message.header.frame_id = draw(texts)
    for name in ("position", "velocity", "effort"):
        setattr(message, name, draw(st.lists(numbers, max_size=4)))
    filled(message, reading.STAMP, (draw(seconds), draw(nanoseconds)))
    return message


MESSAGES = {
    Odometry: (odometries(), reading.ODOMETRY),
    JointState: (joint_states(), reading.JOINT_STATE),
}


def plain(fields):
    """With lists for sequences of any kind."""
    return [list(field) if not isinstance(field, (str, int, float)) else field for field in fields]


def other_end_first(message):
    """Serialised as by a machine that has the most significant byte first."""
    name = in_place.type_name(type(message))
    of_store = STORE.deserialize_cdr(whole(serialize_message(message), type(message)), name)
    return bytes(STORE.serialize_cdr(of_store, name, little_endian=False))


def whole(data, kind):
    """Without the bytes that rclpy may leave behind the last field."""
    return data[: laid_out(data, kind).place]


@ANYTHING
@given(st.data())
@pytest.mark.parametrize("kind", MESSAGES, ids=lambda kind: kind.__name__)
def test_what_is_read_in_place_is_what_rclpy_reads(kind, data):
    """Any strings, any numbers, one reader for all of them; either order of the bytes."""
    messages, (paths, strings) = MESSAGES[kind]
    reader = NumberReader(kind, paths, strings)
    reader_of_others = NumberReader(kind, paths, strings)
    for message in data.draw(st.lists(messages, min_size=1, max_size=5)):
        expected = plain(attrgetter(*paths, *strings)(message))
        for _ in range(2):
            assert plain(reader(serialize_message(message))) == expected
            assert plain(reader_of_others(other_end_first(message))) == expected


def test_more_layouts_than_are_looked_for_are_read_as_well():
    reader = NumberReader(JointState, *reading.JOINT_STATE)
    for number in [*range(3 * MOST_LAYOUTS), *range(5)]:
        message = JointState(name=["wheel"] * number, effort=[0.5] * number)
        assert plain(reader(serialize_message(message))) == [0, 0, [0.5] * number, message.name]


@ANYTHING
@given(st.data())
@pytest.mark.parametrize("kind", MESSAGES, ids=lambda kind: kind.__name__)
def test_damaged_bytes_are_refused_or_read(kind, data):
    """A `ValueError` or fields, nothing else."""
    messages, (paths, strings) = MESSAGES[kind]
    serialized = bytearray(serialize_message(data.draw(messages)))
    reader = NumberReader(kind, paths, strings)
    reader(bytes(serialized))
    for place in data.draw(st.lists(st.integers(0, len(serialized) - 1), max_size=4)):
        serialized[place] = data.draw(st.integers(0, 255))
    damaged = bytes(serialized[: data.draw(st.integers(0, len(serialized)))])
    refused, fields = "", []
    try:
        fields = reader(damaged)
    except ValueError as error:
        refused = str(error)
    assert kind.__name__ in refused or len(fields) == len(paths) + len(strings)


WRITTEN = {
    "odometry": (Odometry(child_frame_id="base"), writing.ODOMETRY, False),
    "torques": (
        JointState(name=["l", "right"], velocity=[0.0] * 2, effort=[0.0] * 2),
        writing.WHEEL_COMMAND,
        True,
    ),
    "wrench": (WrenchStamped(), writing.WRENCH, False),
    "vector": (Vector3Stamped(), writing.VECTOR, False),
    "pressure": (FluidPressure(), ("fluid_pressure",), False),
}


@ANYTHING
@given(st.data())
@pytest.mark.parametrize("name", WRITTEN)
def test_what_is_written_in_place_is_what_rclpy_writes(name, data):
    message, paths, pairs = WRITTEN[name]
    message.header.frame_id = data.draw(texts)
    paths = [*reading.STAMP, *paths]
    writer = NumberWriter(message, paths)
    value = st.lists(numbers, min_size=2, max_size=2) if pairs else numbers
    for _ in range(2):
        values = [data.draw(seconds), data.draw(nanoseconds)]
        values += [data.draw(value) for _ in paths[2:]]
        written = deserialize_message(writer(*values), type(message))
        assert written == filled(message, paths, values)


def test_the_types_of_messages_are_what_the_tools_for_bags_know():
    """The same fields, in the same order, of the same kinds, for every type that is exchanged."""
    seen = set()
    waiting = [in_place.type_name(kind) for kind in (*MESSAGES, MultiDOFJointTrajectory)]
    waiting += [in_place.type_name(type(message)) for message, *_ in WRITTEN.values()]
    while waiting:
        name = waiting.pop()
        ours, theirs = in_place.fields_of(name), STORE.fielddefs[name][1]
        assert [(field, kind) for field, (kind, _) in ours] == [
            (field, kind) for field, (kind, _) in theirs
        ]
        for (_, ours_is), (_, theirs_is) in zip(ours, theirs, strict=True):
            assert shape(ours_is) == shape(theirs_is), name
        seen.add(name)
        used = (what[1] if kind >= 3 else what for _, (kind, what) in ours if kind != 1)
        waiting += [what for what in used if isinstance(what, str) and what not in seen]


def shape(description):
    """Of a field, without how long its strings may be."""
    kind, what = description
    if kind == in_place.BASE:
        return what[0]
    if kind == in_place.NAME:
        return what
    element, length = what
    return shape(element), length if kind == in_place.ARRAY else None


@st.composite
def trajectories(draw):
    """Of points that a controller could follow, mostly with one of each part."""
    number = draw(st.integers(0, 30))
    points = []
    for i in range(number):
        amounts = [draw(st.sampled_from([1] * 30 + [0, 2])) for _ in range(3)]
        point = MultiDOFJointTrajectoryPoint(
            transforms=[Transform() for _ in range(amounts[0])],
            velocities=[Twist() for _ in range(amounts[1])],
            accelerations=[Twist() for _ in range(amounts[2])],
        )
        for transform in point.transforms:
            heading = draw(st.floats(-10, 10))
            transform.translation.x = draw(st.floats(-1e7, 1e7))
            transform.rotation = writing.quaternion(heading)
        for twist in (*point.velocities, *point.accelerations):
            twist.linear.x, twist.angular.z = draw(numbers), draw(numbers)
        point.time_from_start.nanosec = 1000 * i
        points.append(point)
    names = draw(st.lists(texts, max_size=2))
    message = MultiDOFJointTrajectory(joint_names=names, points=points)
    message.header.frame_id = draw(st.sampled_from(["odom", "odo", "map"]))
    message.header.stamp.sec = draw(st.integers(0, 2**31 - 1))
    return message


@ANYTHING
@given(st.lists(trajectories(), min_size=1, max_size=4))
def test_a_reference_is_read_in_place_as_rclpy_reads_it(messages):
    """The same preview to the last bit, or the same words."""
    reader = PreviewReader()
    for message in messages:
        try:
            expected, said = preview(message, "odom"), ""
        except ValueError as error:
            expected, said = None, str(error)
        for _ in range(2):
            if said:
                with pytest.raises(ValueError, match=re.escape(said)):
                    reader(serialize_message(message), "odom")
                continue
            found = reader(serialize_message(message), "odom")
            for field in fields_of_dataclass(found):
                name = field.name
                np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def test_a_reference_of_very_many_points_is_not_laid_out():
    """It would take longer than to deserialise it."""
    points = [MultiDOFJointTrajectoryPoint(transforms=[Transform()]) for _ in range(500)]
    with pytest.raises(ValueError, match="more than"):
        laid_out(serialize_message(MultiDOFJointTrajectory(points=points)), MultiDOFJointTrajectory)


def test_a_reference_of_very_many_points_is_written_all_the_same():
    point = Reference(np.ones(3), np.ones(3), np.ones(3), np.zeros(3)), 0.5
    written = ReferenceWriter("odom", "base")([writing.reference_numbers(*point)] * 1400, 7)
    expected = writing.reference([reference_point(*point)] * 1400, 7, "odom", "base")
    assert deserialize_message(written, MultiDOFJointTrajectory) == expected


@settings(deadline=None, max_examples=10)
@given(st.data(), st.integers(1, 40))
def test_a_reference_is_written_in_place_as_rclpy_writes_it(data, number):
    write = ReferenceWriter("odom", "base_link")
    for _ in range(2):
        start, points = data.draw(st.integers(0, 2**60)), []
        for i in range(number):
            pose, velocity, acceleration = (
                np.array([data.draw(st.floats(-1e6, 1e6)) for _ in range(3)]) for _ in range(3)
            )
            points.append((Reference(pose, velocity, acceleration, np.zeros(3)), 0.05 * i))
        rows = [writing.reference_numbers(*point) for point in points]
        expected = writing.reference(
            [reference_point(*point) for point in points], start, "odom", "base_link"
        )
        written = deserialize_message(write(rows, start), MultiDOFJointTrajectory)
        assert written == expected
