"""A driver for an imaginary motor board, to be copied and adapted, one part after the other.

Part 1 speaks the board's protocol, part 2 makes odometry of its encoders, part 3 is the node: from
torque to current, or from rate to counts, and what is to happen when something goes wrong. It needs
rclpy and messages, nothing else. docs/hardware.md tells what every driver has to do, and this
board's protocol.
"""

import binascii
import math
import os
import select
import signal
import sys
import termios
import threading
import tty
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, NamedTuple

import rclpy
from builtin_interfaces.msg import Time
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState

SECOND = 1_000_000_000  # [ns]
PARAMETERS: dict[str, tuple[Any, tuple[float, float] | None, str]] = {  # default, bounds, meaning
    "device": ("/dev/ttyACM0", None, "serial port of the board"),
    "prefix_frames": (True, None, "put the node's namespace before both frames"),
    "wheel_radius": (0.027, (1e-3, 1.0), "radius of the wheels [m]"),
    "half_track": (0.3, (1e-3, 10.0), "distance of a wheel from the centre [m]"),
    "effective_half_track": (0.0, (0.0, 10.0), "by which wheels reckon turns; 0: half_track [m]"),
    "left_wheel_joint": ("left_wheel_joint", None, "of several of the side, front to rear: a, b"),
    "right_wheel_joint": ("right_wheel_joint", None, "the same of the right side"),
    "encoder_counts": (4096, (4, 1e8), "counts in a turn of a wheel"),
    "motor_constant": (0.025, (1e-4, 10.0), "torque of a motor for a current [N m/A]"),
    "gear_ratio": (50.0, (1e-2, 1e4), "turns of a motor in a turn of its wheel"),
    "motors": ("torque", None, "what the board takes, torque or velocity"),
    "max_current": (3.2, (1e-3, 1e3), "limit of each motor's current [A]"),
    "command_timeout": (0.1, (1e-3, 10.0), "age at which a torque is stale [s]"),
    "initial_x": (0.0, (-1e4, 1e4), "x at the start [m]"),
    "initial_y": (0.0, (-1e4, 1e4), "y at the start [m]"),
    "initial_heading": (0.0, (-7.0, 7.0), "heading at the start [rad]"),
}


# Part 1: the board, and the serial line to it

MOUNTED = (1, -1)  # how the left and the right motor turn when the climber drives forward
FLAGS = {1: "no command, currents cut", 2: "current at its limit", 4: "motor fault"}


class Frame(NamedTuple):
    """What the board tells again and again; pairs are left and right, positive is forward."""

    time: int  # [µs] of measuring, by the board's clock
    counts: tuple[float, float]  # of the encoders
    currents: tuple[float, float]  # [A] that flow
    flags: int  # see FLAGS
    refused: int  # lines that the board could not read


def forward(left: float, right: float) -> tuple[float, float]:
    """What the motors turn, as the wheels do; and the other way round."""
    return MOUNTED[0] * left, MOUNTED[1] * right


def packed(content: str) -> bytes:
    """Line with its checksum, a CRC-16/XMODEM."""
    return f"${content}*{binascii.crc_hqx(content.encode(), 0):04X}\n".encode()


def unpacked(line: bytes, kind: str) -> list[int]:
    """Numbers of a line of a kind; `ValueError` if it is another, torn, or spoilt."""
    content, _, _ = line.rpartition(b"$")[2].decode("ascii").partition("*")
    if not content.startswith(kind) or not (line + b"\n").endswith(packed(content)):
        raise ValueError(f"{line!r} is not a line of kind {kind}")
    return [int(word) for word in content.split()[1:]]


class Transport:
    """Frames from the board and currents to it; `OSError` if it is not there (any more)."""

    def __init__(self, device: str) -> None:
        self.spoilt = 0  # lines that could not be read
        self.stopped = False
        self.port = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            tty.setraw(self.port)
            mode = termios.tcgetattr(self.port)
            mode[2] |= termios.CLOCAL
            mode[4] = mode[5] = termios.B921600
            termios.tcsetattr(self.port, termios.TCSANOW, mode)
            termios.tcflush(self.port, termios.TCIFLUSH)  # what came before is old
        except termios.error as error:
            raise OSError(*error.args, device) from None

    def frames(self) -> Iterator[Frame]:
        """Frames as they arrive, until it is stopped."""
        rest = b""
        while not self.stopped:
            if not select.select([self.port], [], [], 0.1)[0]:
                continue
            received = os.read(self.port, 4096)
            if not received:
                raise OSError(0, "hung up")
            *lines, rest = (rest[-100:] + received).split(b"\n")  # no line is longer
            for line in lines:
                try:
                    time, left, right, left_mA, right_mA, flags, refused = unpacked(line, "E")
                except ValueError:
                    self.spoilt += 1
                    continue
                currents = forward(1e-3 * left_mA, 1e-3 * right_mA)
                yield Frame(time, forward(left, right), currents, flags, refused)

    def command(self, kind: str, left: float, right: float) -> None:
        """Send currents [mA], of kind C, or speeds [counts/s], of kind V."""
        numbers = map(round, forward(left, right))
        with suppress(OSError):  # full or dead: the board's watchdog acts, and `frames` ends
            os.write(self.port, packed("{} {} {}".format(kind, *numbers)))

    def stop(self) -> None:
        """Have `frames` end, and wait until all is sent."""
        self.stopped = True
        with suppress(termios.error):  # it may be dead
            termios.tcdrain(self.port)


# Part 2: from encoders to odometry


def difference(later: float, earlier: float) -> float:
    """How far a counter of 32 bits has come, which may have overflowed meanwhile."""
    return (later - earlier + 2**31) % 2**32 - 2**31


class BoardClock:
    """Turns the board's time into ROS time: the frame that was least late tells the offset.

    A frame may be late, but not all of them: where they are, the computer's clock was set forward.
    """

    DRIFT = 1e-4  # of a quartz
    JUMP = SECOND  # [ns] by which only a clock that was set, or a new start, changes the offset
    LATE = SECOND // 100  # [ns] by which a frame is later than the line explains
    PATIENCE = SECOND // 4  # [ns] for which all of them may be

    def __init__(self, simulated: bool) -> None:
        self.simulated = simulated  # then the board's time is ROS time
        self.last, self.time, self.offset = 0, 0, 0  # [µs], [ns] without overflow, [ns]
        self.punctual, self.least = 0, 0  # [ns] last time that one was, least offset after it

    def stamp(self, time: int, now: int) -> int:
        """ROS time [ns] at which the board's was `time` [µs]; it is `now` [ns] by now."""
        passed = 1000 * difference(time, self.last)
        self.last, self.time = time, self.time + round(passed)
        if self.simulated:
            return self.time
        offset = now - self.time
        if offset - self.offset < self.LATE:
            self.punctual, self.least = self.time, offset + self.JUMP
        else:
            self.least = min(self.least, offset)
        if self.time - self.punctual > self.PATIENCE:
            offset, self.punctual = self.least, self.time
        elif abs(offset - self.offset) < self.JUMP:
            offset = min(offset, self.offset + round(self.DRIFT * passed))
        self.offset = offset
        return self.time + offset


class DeadReckoning:
    """Where the climber is by how far its wheels have rolled, by the midpoint rule."""

    DRIFT = 0.01  # standard deviation of a wheel's way, as a share of it: measure yours

    def __init__(self, count: float, half_track: float, pose: tuple[float, float, float]) -> None:
        self.count, self.half_track = count, half_track  # [m] that a wheel rolls in a count, [m]
        self.x, self.y, self.heading = pose
        self.period, self.travelled = 0.005, 0.0  # [s] from frame to frame, [m]
        self.rolled = self.speeds = (0.0, 0.0)  # [m] since the start, [m/s]; left and right
        self.last: Frame | None = None

    def take(self, frame: Frame) -> None:
        """Go on to where the encoders are now; a board that has started anew goes on from here."""
        last, self.last = self.last, frame
        passed = difference(frame.time, last.time) * 1e-6 if last else 0.0
        if last is None or not 0 < passed < 60:
            return
        left, right = (self.count * way for way in map(difference, frame.counts, last.counts))
        way, turn = (right + left) / 2, (right - left) / (2 * self.half_track)
        self.x += way * math.cos(self.heading + turn / 2)
        self.y += way * math.sin(self.heading + turn / 2)
        self.heading += turn
        self.travelled += abs(way)
        self.rolled = self.rolled[0] + left, self.rolled[1] + right
        self.period, self.speeds = passed, (left / passed, right / passed)

    def fill(self, message: Odometry) -> None:
        """Write pose, twist (in the body's frame) and variances into a message."""
        pose, twist, (left, right) = message.pose.pose, message.twist.twist, self.speeds
        pose.position.x, pose.position.y = self.x, self.y
        pose.orientation.z = math.sin(self.heading / 2)
        pose.orientation.w = math.cos(self.heading / 2)
        twist.linear.x = (right + left) / 2
        twist.angular.z = (right - left) / (2 * self.half_track)
        # of the mean of two wheels, whose counts are rounded; by half the track, of the turn
        way = self.count**2 / 12 + (self.DRIFT * self.travelled) ** 2 / 2
        speed = self.count**2 / 12 / self.period**2
        turn, yaw_rate = way / self.half_track**2, speed / self.half_track**2
        # the wall leaves no height, roll and pitch, and the wheels do not slip
        message.pose.covariance[::7] = [way, way, 1e-6, 1e-6, 1e-6, turn]
        message.twist.covariance[::7] = [speed, 1e-6, 1e-6, 1e-6, 1e-6, yaw_rate]


# Part 3: the node


class Driver(Node):
    """Publishes what the board tells, and sends it the currents for torques that are fit for it.

    The serial line has a thread of its own, which publishes; the executor's sends commands.
    """

    def __init__(self, end: threading.Event) -> None:
        super().__init__("minimal_driver")
        self.end, self.failure = end, ""
        value = {name: self.value(name, *rule) for name, rule in PARAMETERS.items()}
        self.radius, self.timeout = value["wheel_radius"], value["command_timeout"]
        angle = 2 * math.pi / value["encoder_counts"]  # [rad] of a count
        if value["motors"] not in ("torque", "velocity"):
            raise ValueError(f"motors={value['motors']!r} must be torque or velocity")
        self.takes_speeds, self.counts = value["motors"] == "velocity", 1 / angle
        self.torque = value["motor_constant"] * value["gear_ratio"]  # [N m] at a wheel for 1 A
        self.max_current = value["max_current"]
        start = value["initial_x"], value["initial_y"], value["initial_heading"]
        turning = value["effective_half_track"] or value["half_track"]
        self.reckoning = DeadReckoning(self.radius * angle, turning, start)
        names = value["left_wheel_joint"], value["right_wheel_joint"]
        self.left, self.right = ([joint.strip() for joint in side.split(",")] for side in names)
        self.board_clock = BoardClock(self.get_parameter("use_sim_time").value)
        prefix = f"{self.get_namespace()}/".lstrip("/") if value["prefix_frames"] else ""
        self.odom_frame, self.base_frame = prefix + "odom", prefix + "base_link"
        self.stamp = self.answered = 0  # [ns] of the last odometry, of the last torque
        self.looked_at = 0  # [ns] of the last odometry by the last look
        self.acting = False  # whether that torque is sent, and not yet too old
        self.refused = 0  # lines that the board could not read
        self.instead = "zero speed instead" if self.takes_speeds else "zero torque instead"
        self.troubles: dict[str, str] = {}

        self.odometry = self.create_publisher(Odometry, "odom", 10)
        self.joint_states = self.create_publisher(JointState, "joint_states", 10)
        self.transport = Transport(value["device"])
        self.create_subscription(JointState, "wheel_torques", self.on_torques, 10)
        self.create_timer(1.0, self.look)
        self.listener = threading.Thread(target=self.listen)
        self.listener.start()

    def value(
        self, name: str, default: Any, bounds: tuple[float, float] | None, meaning: str
    ) -> Any:
        """Value of one of PARAMETERS; `ValueError` beyond its bounds."""
        rule = ParameterDescriptor(description=meaning, read_only=True)
        value = self.declare_parameter(name, default, rule).value
        if bounds and not bounds[0] <= value <= bounds[1]:
            lowest, highest = bounds
            raise ValueError(f"{name}={value} must be from {lowest:g} to {highest:g}: {meaning}")
        return value

    def say(self, subject: str, trouble: str) -> None:
        """Log a trouble, or that it is over (''), once each time it changes."""
        if trouble != self.troubles.get(subject, ""):
            self.troubles[subject] = trouble
            self.get_logger().warning(f"{subject}: {trouble or 'ok again'}")

    # From the board

    def listen(self) -> None:
        """Publish frame by frame, until the line is stopped or broken."""
        try:
            for frame in self.transport.frames():
                self.on_frame(frame)
        except OSError as error:
            self.failure = f"minimal_driver: the board is lost: {error.strerror}"
        finally:
            self.end.set()

    def on_frame(self, frame: Frame) -> None:
        """Publish what the board has measured, with the time at which it did."""
        self.say("board", ", ".join(word for bit, word in FLAGS.items() if frame.flags & bit))
        self.refused = frame.refused
        self.reckoning.take(frame)
        now = self.get_clock().now().nanoseconds
        self.stamp = stamp = self.board_clock.stamp(frame.time, now)
        if self.acting and stamp - self.answered > self.timeout * SECOND:
            self.say("wheel_torques", f"none for {self.timeout:g} s; {self.instead}")
            self.let_go()  # when this driver has stopped, too, the board does it
        odometry, joints = Odometry(), JointState(name=self.left + self.right)
        time = Time(sec=stamp // SECOND, nanosec=stamp % SECOND)
        odometry.header.stamp = joints.header.stamp = time
        odometry.header.frame_id, odometry.child_frame_id = self.odom_frame, self.base_frame
        self.reckoning.fill(odometry)
        self.odometry.publish(odometry)  # first: the controller waits for it
        angles, rates = (
            [way / self.radius for way in pair]
            for pair in (self.reckoning.rolled, self.reckoning.speeds)
        )
        left, right = (self.torque * current for current in frame.currents)
        joints.position, joints.velocity = self.of_each(*angles), self.of_each(*rates)
        joints.effort = self.of_each(left / len(self.left), right / len(self.right))
        self.joint_states.publish(joints)

    # To the board

    def on_torques(self, message: JointState) -> None:
        """Send what the board takes of a command, or zero if that is not fit to be applied."""
        stamp = message.header.stamp.sec * SECOND + message.header.stamp.nanosec
        fault = self.fault(message, stamp)
        self.say("wheel_torques", fault and f"{fault}; {self.instead}")
        if fault:
            self.let_go()
        elif stamp != self.answered:  # else it was sent twice
            self.answered, self.acting = stamp, True
            told = dict(zip(message.name, self.obeyed(message), strict=True))
            left, right = (sum(told[joint] for joint in side) for side in (self.left, self.right))
            if self.takes_speeds:  # the mean of a side's wheels; of their torques the sum
                left, right = left / len(self.left), right / len(self.right)
            self.send(left, right)

    def of_each(self, left: float, right: float) -> list[float]:
        """Number of each joint, where all of a side have the same."""
        return [left] * len(self.left) + [right] * len(self.right)

    def obeyed(self, message: JointState) -> Any:
        """Torques [N m], or rates [rad/s] for a board that takes speeds."""
        return message.velocity if self.takes_speeds else message.effort

    def send(self, left: float, right: float) -> None:
        """Send currents for torques [N m], or speeds for rates [rad/s]."""
        if self.takes_speeds:
            self.transport.command("V", self.counts * left, self.counts * right)
        else:
            self.transport.command("C", 1e3 * self.current(left), 1e3 * self.current(right))

    def fault(self, message: JointState, stamp: int) -> str:
        """What is wrong with a command; '' if nothing is."""
        joints = sorted(self.left + self.right)
        if sorted(message.name) != joints or len(self.obeyed(message)) != len(joints):
            return "not one for each wheel"
        if not all(map(math.isfinite, self.obeyed(message))):
            return "not finite"
        return "stale" if abs(self.stamp - stamp) > self.timeout * SECOND else ""

    def current(self, torque: float) -> float:
        """Current for a torque at a wheel [N m], within the limit [A]."""
        return max(-self.max_current, min(torque / self.torque, self.max_current))

    def let_go(self) -> None:
        """Send zero currents, or zero speeds."""
        self.acting = False
        self.send(0.0, 0.0)

    def look(self) -> None:
        """Log that there are no frames, and how many lines have not arrived as they were sent."""
        self.say("frames", "none for 1 s" if self.stamp == self.looked_at else "")
        self.looked_at = self.stamp
        if self.transport.spoilt or self.refused:
            spoilt = f"{self.transport.spoilt} lines from the board, {self.refused} to it"
            self.say("serial line", f"spoilt: {spoilt}")

    def stop(self) -> None:
        """Stop the wheels, and the thread."""
        self.let_go()
        self.transport.stop()
        self.listener.join()


def main() -> None:
    """Run the driver until a signal to end, or the loss of the board."""
    end = threading.Event()
    # terminal and launch may both send one
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: end.set())
    # over shared memory a killed process would hold up the odometry
    os.environ.setdefault("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")
    try:
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        driver = Driver(end)
    except (ValueError, RuntimeError, OSError, ParameterException) as error:
        sys.exit(f"minimal_driver: {error}")
    executor = SingleThreadedExecutor()
    executor.add_node(driver)
    try:
        while not end.is_set():
            executor.spin_once(timeout_sec=0.1)
    finally:
        driver.let_go()
        signal.alarm(5)  # [s] then the kernel ends it: now and then Fast DDS never comes back
        driver.stop()  # its thread may be publishing
        driver.destroy_node()
        rclpy.shutdown()
        signal.alarm(0)
    sys.exit(driver.failure or 0)


if __name__ == "__main__":
    main()
