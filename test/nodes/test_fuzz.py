"""Random messages on every topic: the nodes live, stay finite, and go on working.

Some hundred here, two thousand with `make soak`.
"""

import importlib
import itertools
import math
from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from reference_points import reference_point
from sensor_msgs.msg import FluidPressure, JointState
from std_srvs.srv import Trigger
from test_uk_torque_controller import CIRCLE, Loop
from trajectory_msgs.msg import MultiDOFJointTrajectory
from world import TIMEOUT

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import State
from climber_uk.messages import reading, writing
from climber_uk.messages.names import Names

pytestmark = pytest.mark.nodes

SIZE = 24
SOME, MANY = 8, 84  # batches: 192 messages, 2016 messages
HOW_MANY = pytest.mark.parametrize(
    "batches", [SOME, pytest.param(MANY, marks=pytest.mark.soak)], ids=["some", "many"]
)
# a good one ends each batch and fills the history: only then is it acknowledged at once
DEEP = QoSProfile(depth=SIZE + 1)
DEEP_SUBSCRIPTIONS = [  # so that no message of a batch is lost
    f"qos_overrides./{topic}.subscription.{policy}"
    for topic in ("odom", "reference", "suction_pressure", "wheel_torques")
    for policy in ("reliability:=reliable", f"depth:={SIZE + 1}")
]
NUMBERS = st.one_of(
    st.floats(-2.0, 2.0),
    st.floats(),
    st.sampled_from([math.nan, math.inf, -math.inf, 0.0, 5e-324, 1e6, 1e150, -1.7e308]),
)
TEXTS = st.one_of(
    st.sampled_from(["", "odom", "base_link", "left_wheel_joint", "right_wheel_joint", "x" * 9999]),
    st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=20),
)
SIMPLE = {
    "double": NUMBERS,
    "string": TEXTS,
    "int32": st.one_of(st.integers(-1, 2), st.integers(-(2**31), 2**31 - 1)),
    "uint32": st.one_of(st.integers(0, SECOND), st.integers(0, 2**32 - 1)),
}
LAST = 2**31 * SECOND - 1  # [ns] that a stamp can tell
AGES = st.one_of(  # [ns] of a stamp
    st.just(0),
    st.integers(-SECOND // 100, SECOND // 5),
    st.sampled_from([SECOND, -SECOND, 2 * LAST, -2 * LAST]),
    st.integers(-2 * LAST, 2 * LAST),
)


@cache
def values(kind):
    """Strategy for a field, whose type is given as messages give it."""
    if kind in SIMPLE:
        return SIMPLE[kind]
    if kind.startswith("sequence<"):
        elements = values(kind.removeprefix("sequence<").removesuffix(">"))
        return st.one_of(st.lists(elements, max_size=3), elements.map(lambda value: [value] * 200))
    if kind.endswith("]"):
        element, _, size = kind.removesuffix("]").partition("[")
        return values(element).map(lambda value: [value] * int(size))
    package, _, name = kind.partition("/")
    make = getattr(importlib.import_module(f"{package}.msg"), name)
    return changes(make(), most=9).map(lambda made: changed(make(), made))


def leaves(message, path=()):
    """The way to each field that holds no message, and a strategy for its values."""
    for field, kind in message.get_fields_and_field_types().items():
        value, way = getattr(message, field), (*path, field)
        if hasattr(value, "get_fields_and_field_types"):
            yield from leaves(value, way)
        else:
            yield way, values(kind)
            if "/" in kind:
                for number, element in enumerate(value):
                    yield from leaves(element, (*way, number))


def changes(template, most):
    """Strategy for lists of ways into a message with what to put there."""
    one = st.one_of([st.tuples(st.just(way), value) for way, value in leaves(template)])
    return st.lists(one, max_size=most)


def changed(message, changes):
    """The message after all of its changes, the innermost first."""
    for way, value in sorted(changes, key=lambda change: -len(change[0])):
        holder = message
        for step in way[:-1]:
            holder = holder[step] if isinstance(step, int) else getattr(holder, step)
        setattr(holder, way[-1], value)
    return message


def storm(template, send, batches):
    """Send batches of (age of the stamp, what to change in a good message)."""
    sent = []
    anything = st.one_of(changes(template, most=2), changes(template, most=30))

    @settings(
        max_examples=batches,
        deadline=None,
        derandomize=True,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(st.lists(st.tuples(AGES, anything), min_size=SIZE, max_size=SIZE))
    def send_batch(batch):
        send(batch)
        sent.extend(batch)

    send_batch()
    assert len(sent) >= batches * SIZE


def stamp(message):
    return reading.nanoseconds(message.header.stamp)


def later(message, age):
    """The message with its stamp moved into the past."""
    message.header.stamp = writing.time(max(-LAST, min(stamp(message) - age, LAST)))
    return message


def spoilt(good, now, batch):
    """The messages of a batch, and a good one."""
    return [*(changed(later(good(now), age), made) for age, made in batch), good(now)]


def speak(world, kind, topic):
    """Publisher that keeps a batch of messages for the one who listens."""
    publisher = world.node.create_publisher(kind, topic, DEEP)
    world.wait(publisher.get_subscription_count, f"subscriber of {topic}")
    return publisher


def publish(publisher, messages):
    """Publish messages, and wait until all are received."""
    for message in messages:
        publisher.publish(message)
    assert publisher.wait_for_all_acked(Duration(seconds=TIMEOUT))


def efforts_are_finite(messages):
    return all(math.isfinite(effort) for message in messages for effort in message.effort)


def odometry_is_finite(messages):
    return all(
        math.isfinite(number)
        for m in messages
        for number in (
            m.pose.pose.position.x,
            m.pose.pose.position.y,
            m.pose.pose.orientation.z,
            m.pose.pose.orientation.w,
            m.twist.twist.linear.x,
            m.twist.twist.linear.y,
            m.twist.twist.angular.z,
        )
    )


def good_odometry(now):
    return writing.odometry(
        State(CIRCLE.at(0.0).pose, CIRCLE.at(0.0).velocity), now, "odom", "base_link"
    )


def good_reference(now):
    times = [0.25 * number for number in range(6)]
    points = [reference_point(CIRCLE.at(time), time) for time in times]
    return writing.reference(points, now - SECOND // 4, "odom", "base_link")


def good_pressure(now):
    message = FluidPressure(fluid_pressure=2500.0)
    message.header.stamp = writing.time(now)
    return message


@HOW_MANY
@pytest.mark.parametrize(
    ("kind", "topic", "good"),
    [
        (Odometry, "odom", good_odometry),
        (MultiDOFJointTrajectory, "reference", good_reference),
        (FluidPressure, "suction_pressure", good_pressure),
    ],
    ids=["odom", "reference", "suction_pressure"],
)
def test_the_controller_survives_whatever_it_is_told_and_follows_again(
    world, kind, topic, good, batches
):
    timeouts = "odometry_timeout:=0.1", "reference_timeout:=0.05"
    # a twist that was wrong would be a fault until the climber rests, which this one never does
    loop = Loop(world, *timeouts, "max_twist_error:=1000.0", *DEEP_SUBSCRIPTIONS)
    publisher = speak(world, kind, topic)
    loop.plan()
    loop.follows()

    def send(batch):
        begin, told = len(loop.torques), set()
        now = loop.now()
        publish(publisher, spoilt(good, now, batch))

        def is_answered():
            told.add(loop.tell())
            return any(stamp(message) in told for message in loop.torques[begin:])

        world.wait(is_answered, "answer after a batch")
        assert efforts_are_finite(loop.torques[begin:])

    storm(good(loop.now()), send, batches)
    speak(world, FluidPressure, "suction_pressure").publish(good_pressure(loop.now()))
    loop.begin = loop.now()
    loop.plan()
    loop.follows()
    assert "Traceback" not in world.log("uk_torque_controller")


def good_torques(now, torque=1.0):
    return writing.wheel_torques(np.array([torque, torque]), now, Names().wheels)


@HOW_MANY
def test_the_plant_survives_whatever_it_is_told_and_obeys_again(world, batches):
    world.start_node("plant_simulator", *DEEP_SUBSCRIPTIONS)
    joints, odometry = world.listen(JointState, "joint_states"), world.listen(Odometry, "odom")
    publisher = speak(world, JointState, "wheel_torques")
    torques = itertools.count(1)

    def send(batch):
        now = world.node.get_clock().now().nanoseconds
        publish(publisher, spoilt(good_torques, now, batch))
        torque = next(torques) / 1000

        def acts():
            publisher.publish(good_torques(now, torque))
            return joints and joints[-1].effort[0] == torque

        world.wait(acts, "torque to act")

    storm(good_torques(0), send, batches)
    assert odometry_is_finite(odometry)
    assert efforts_are_finite(joints)
    assert "Traceback" not in world.log("plant_simulator")


@HOW_MANY
def test_the_plant_in_lock_step_survives_whatever_it_is_told_and_steps_again(world, batches):
    world.start_node("plant_simulator", "simulated_time:=true", *DEEP_SUBSCRIPTIONS)
    odometry = world.listen(Odometry, "odom")
    publisher = speak(world, JointState, "wheel_torques")
    world.wait(lambda: odometry, "odometry")

    def send(batch):
        now = stamp(odometry[-1])
        publish(publisher, spoilt(good_torques, now, batch))

        def is_a_step_further():
            publisher.publish(good_torques(stamp(odometry[-1])))
            return stamp(odometry[-1]) > now

        world.wait(is_a_step_further, "step")

    storm(good_torques(0), send, batches)
    assert odometry_is_finite(odometry)
    assert "Traceback" not in world.log("plant_simulator")


@HOW_MANY
def test_the_trajectory_publisher_survives_whatever_it_is_told_and_starts_again(world, batches):
    world.start_node("trajectory_publisher", "autostart:=false", *DEEP_SUBSCRIPTIONS)
    references = world.listen(MultiDOFJointTrajectory, "reference")
    publisher = world.node.create_publisher(Odometry, "odom", DEEP)

    told = set()

    def start(batch=()):
        begin, now = len(references), world.node.get_clock().now().nanoseconds
        assert world.call(Trigger, "trajectory_publisher/start", Trigger.Request()).success
        world.wait(publisher.get_subscription_count, "subscriber of odom")
        publish(publisher, spoilt(good_odometry, now, batch))

        def goes_on():
            if len(references) == begin:  # all may have been too old when they came
                told.add(world.node.get_clock().now().nanoseconds)
                publisher.publish(good_odometry(max(told)))
            return len(references) >= begin + 3  # of its timer, too

        world.wait(goes_on, "previews")
        told.add(now)

    storm(good_odometry(0), start, batches)
    told.clear()
    start()

    def is_started():  # it may have to come to rest before
        told.add(world.node.get_clock().now().nanoseconds)
        publisher.publish(good_odometry(max(told)))
        return stamp(references[-1]) in told

    world.wait(is_started, "previews of the last start")
    assert "Traceback" not in world.log("trajectory_publisher")


@pytest.mark.parametrize("sec", [-(2**31), 2**31 - 1], ids=["past", "future"])
def test_the_trajectory_publisher_survives_the_first_and_the_last_stamp(world, sec):
    world.start_node("trajectory_publisher", "start_delay:=1.0", *DEEP_SUBSCRIPTIONS)
    references = world.listen(MultiDOFJointTrajectory, "reference")
    publisher = speak(world, Odometry, "odom")
    publisher.publish(good_odometry(sec * SECOND))
    # it may take the stamp or refuse it, but lives to start at a good one
    assert world.call(Trigger, "trajectory_publisher/start", Trigger.Request()).success
    told = set()

    def is_started():
        told.add(world.node.get_clock().now().nanoseconds)
        publisher.publish(good_odometry(max(told)))
        return references and stamp(references[-1]) - SECOND in told

    world.wait(is_started, "start")
