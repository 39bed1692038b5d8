"""The plant as a driver with one planted fault: `faulty_driver.py FAULT`."""

import math
import time
from collections import deque

import numpy as np
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from climber_uk.mechanics import SECOND
from climber_uk.messages import reading, writing
from climber_uk.nodes.plant_simulator import PlantSimulator
from climber_uk.ros.running import BEST_EFFORT, run
from climber_uk.simulation.command_buffer import CommandBuffer


class Driver(PlantSimulator):
    """Spoils what comes in and what goes out, or itself."""

    is_ready = False  # until all is in place: the first odometry, too, has the fault

    def __init__(self, fault):
        super().__init__()
        self.count = 0
        self.late = deque()
        self.into, self.out = TORQUES.get(fault), ODOMETRY.get(fault)
        if fault in SELF:
            SELF[fault](self)
        self.topics.odometry.publish, self.is_ready = self.spoil, True

    def on_torques(self, serialized):
        if self.into is not None:
            message = deserialize_message(serialized, JointState)
            obeyed = "velocity" if self.take_speeds else "effort"
            left, right = getattr(message, obeyed)
            setattr(message, obeyed, [float(number) for number in self.into(self, left, right)])
            serialized = serialize_message(message)
        super().on_torques(serialized)

    def publish_odometry(self):
        if self.is_ready:
            super().publish_odometry()

    def spoil(self, stamp, *numbers):
        self.count += 1
        odometry = self.topics.odometry
        message = deserialize_message(
            odometry.serialized(*divmod(stamp, SECOND), *numbers), Odometry
        )
        said = None if self.out is None else self.out(self, message)
        for one in [message] if said is None else said:
            odometry.publisher.publish(one)


def heading(message):
    orientation = message.pose.pose.orientation
    return 2 * math.atan2(orientation.z, orientation.w)


def face(message, angle):
    message.pose.pose.orientation.z = math.sin(angle / 2)
    message.pose.pose.orientation.w = math.cos(angle / 2)


def stamp(message, nanoseconds):
    message.header.stamp = writing.time(nanoseconds)


def stamped(message):
    return reading.nanoseconds(message.header.stamp)


def every(number, spoil):
    """Spoils one of some messages."""

    def spoils(driver, message):
        if driver.count % number == 0:
            spoil(message)

    return spoils


def in_world_frame(_, message):
    linear, angle = message.twist.twist.linear, heading(message)
    linear.x, linear.y = linear.x * math.cos(angle), linear.x * math.sin(angle)


def covariance(value):
    def spoils(_, message):
        message.pose.covariance = message.twist.covariance = np.full(36, value)

    return spoils


def not_a_number(message):
    message.twist.twist.linear.x = math.nan


def no_orientation(_, message):
    message.pose.pose.orientation.z = message.pose.pose.orientation.w = 0.0


def no_twist(_, message):
    message.twist.twist.linear.x = message.twist.twist.angular.z = 0.0


def twist_in_degrees(_, message):
    message.twist.twist.angular.z = math.degrees(message.twist.twist.angular.z)


def in_centimetres(_, message):
    message.pose.pose.position.x *= 100.0
    message.pose.pose.position.y *= 100.0


def sideways(_, message):
    """What a climber tells whose wheels are 20 degrees askew."""
    linear = message.twist.twist.linear
    linear.x, linear.y = linear.x * math.cos(0.35), linear.x * math.sin(0.35)
    face(message, heading(message) - 0.35)


def late(driver, left, right):
    driver.late.append((left, right))
    return driver.late.popleft() if len(driver.late) > 10 else (0.0, 0.0)


TORQUES = {
    "swapped wheels": lambda _, left, right: (right, left),
    "wrong sign": lambda _, left, right: (-left, -right),
    "swapped wheels and wrong sign": lambda _, left, right: (-right, -left),
    "right wheel reversed": lambda _, left, right: (left, -right),
    "left wheel reversed": lambda _, left, right: (-left, right),
    "right wheel dead": lambda _, left, right: (left, 0.0),
    "left wheel dead": lambda _, left, right: (0.0, right),
    "no torque": lambda _, left, right: (0.0, 0.0),
    "twice the torque": lambda _, left, right: (2 * left, 2 * right),
    "half the torque": lambda _, left, right: (left / 2, right / 2),
    "late torque": late,
}

ODOMETRY = {
    "degrees": lambda _, m: face(m, math.degrees(heading(m))),
    "clockwise": lambda _, m: face(m, -heading(m)),
    "world-frame twist": in_world_frame,
    "no twist": no_twist,
    "degrees per second": twist_in_degrees,
    "centimetres": in_centimetres,
    "sideways": sideways,
    "stale stamps": lambda _, m: stamp(m, stamped(m) - 1_000_000_000),
    "stamps of the future": lambda _, m: stamp(m, stamped(m) + 1_000_000_000),
    "zero stamps": lambda _, m: stamp(m, 0),
    "stamps since boot": lambda _, m: stamp(m, time.monotonic_ns()),
    "stuck stamps": lambda d, m: stamp(m, d.origin),
    "stamps that go back": lambda d, m: stamp(m, stamped(m) - 20_000_000 * (d.count % 10 == 0)),
    "uneven stamps": lambda d, m: stamp(m, stamped(m) + 4_000_000 * (d.count % 2)),
    "half the rate": lambda d, m: [m] if d.count % 2 else [],
    "not a number": every(7, not_a_number),
    "no orientation": no_orientation,
    "no covariance": covariance(0.0),
    "negative covariance": covariance(-1.0),
    "covariance not a number": covariance(math.nan),
    "wrong frame": lambda _, m: setattr(m.header, "frame_id", "map"),
    "wrong child frame": lambda _, m: setattr(m, "child_frame_id", "base_footprint"),
}


def no_watchdog(driver):
    driver.commands = CommandBuffer(0)


def wrong_type(driver):
    driver.destroy_publisher(driver.topics.odometry.publisher)
    driver.topics.odometry.publisher = driver.create_publisher(PoseStamped, "odom", 10)
    driver.out = lambda driver, message: [PoseStamped()]


def two_publishers(driver):
    driver.second = driver.create_publisher(Odometry, "odom", 10)


def best_effort(driver):
    driver.destroy_publisher(driver.topics.odometry.publisher)
    driver.topics.odometry.publisher = driver.create_publisher(Odometry, "odom", BEST_EFFORT)


def listens_to(kind, **qos):
    def spoils(driver):
        torques = next(s for s in driver.subscriptions if s.topic_name == "/wheel_torques")
        driver.destroy_subscription(torques)
        if kind is not None:
            driver.create_subscription(kind, "wheel_torques", print, QoSProfile(depth=10, **qos))

    return spoils


SELF = {
    "no watchdog": no_watchdog,
    "wrong type": wrong_type,
    "two publishers": two_publishers,
    "best effort": best_effort,
    "nobody listens": listens_to(None),
    "listens to another type": listens_to(Float64MultiArray),
    "listens to latched torques": listens_to(
        JointState, durability=DurabilityPolicy.TRANSIENT_LOCAL
    ),
}

if __name__ == "__main__":
    run(lambda fault: [Driver(fault)], __doc__, {"fault": {"help": "what is wrong with it"}})
