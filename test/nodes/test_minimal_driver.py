"""The example driver against a board that the test plays, and with the firmware's stand-in."""

import importlib
import math
import os
import pty
import re
import select
import signal
import tty

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory
from world import CONFIG, EXAMPLES, TIMEOUT

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.preview import joined
from climber_uk.messages import reading, writing
from climber_uk.messages.references import preview

pytestmark = pytest.mark.nodes

DRIVER, BOARD = "minimal_driver", "firmware_stand_in"
NAMES = ["left_wheel_joint", "right_wheel_joint"]


def line(content):
    """Line with its CRC-16/XMODEM, found bit by bit."""
    crc = 0
    for byte in content.encode():
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ (0x1021 if crc & 0x8000 else 0)) & 0xFFFF
    return f"${content}*{crc:04X}\n".encode()


def test_the_lines_in_the_documents_have_their_checksums():
    text = (CONFIG.parent / "docs" / "hardware.md").read_text()
    contents = re.findall(r"`\$(.*?)\*[0-9A-F]{4}`", text)
    assert {content[0] for content in contents} == {"E", "C", "V"}
    assert all(line(content).decode().strip() in text for content in contents)


def stamp(message):
    return reading.nanoseconds(message.header.stamp)


def now(world):
    return world.node.get_clock().now().nanoseconds


class Board:
    """A motor board that the test plays, and the driver that runs on it."""

    kind = "C "  # of the commands that it takes

    def __init__(self, world, *parameters, namespace=""):
        self.world = world
        self.port, self.line = pty.openpty()
        tty.setraw(self.line)
        self.received, self.seen = b"", 0
        self.time = 0  # [µs]
        given = [part for value in parameters for part in ("-p", value)]
        device = f"device:={os.ttyname(self.line)}"
        where = f"__ns:={namespace or '/'}"
        world.start(DRIVER, "--ros-args", "-r", where, "-p", device, *given)
        self.odometry = world.listen(Odometry, f"{namespace}/odom")
        self.joints = world.listen(JointState, f"{namespace}/joint_states")

    def send(self, *numbers, time=5000):
        """Send a frame, `time` [µs] after the last one."""
        self.time = (self.time + time) % 2**32
        os.write(self.port, line(f"E {self.time} {' '.join(map(str, numbers))}"))

    def tell(self, *numbers, time=5000, again=False):
        """Odometry of a frame, sent `again` until the driver has found this test."""
        before = {stamp(message) for message in self.odometry}
        self.send(*numbers, time=time)

        def are_heard():
            if again and not (self.odometry and self.joints):
                self.send(*numbers, time=0)
            told = {stamp(message) for message in self.joints} - before
            return self.odometry and stamp(self.odometry[-1]) in told

        self.world.wait(are_heard, "odometry and joint states")
        return self.odometry[-1]

    def commands(self):
        """Currents [mA], or speeds [counts/s], that have been received, left and right."""
        if select.select([self.port], [], [], 0)[0]:
            self.received += os.read(self.port, 4096)
        lines = self.received.splitlines(keepends=True)
        contents = [text.decode().strip("$").partition("*")[0] for text in lines]
        assert lines == [line(content) for content in contents]
        return [tuple(map(int, content.removeprefix(self.kind).split())) for content in contents]

    def gets(self, *currents):
        """Wait for a command that has not been waited for."""
        self.world.wait(lambda: currents in self.commands()[self.seen :], f"command {currents}")
        self.seen = len(self.commands())

    def says(self, text):
        """Wait for the driver to log something."""
        self.world.wait(lambda: text in self.world.log(DRIVER), text)


class Controlled(Board):
    """The same, with torques that the test commands."""

    def __init__(self, world, *parameters):
        super().__init__(world, *parameters)
        self.torques = world.speak(JointState, "wheel_torques")
        self.tell(0, 0, 0, 0, 0, 0, again=True)
        self.world.wait(lambda: self.answer(1.25, 1.25) or self.commands(), "first command")

    def answer(self, *efforts, names=NAMES, age=0):
        """Torques for a new odometry, or for one that is `age` [ns] older."""
        message = self.command(names, efforts)
        message.header.stamp = writing.time(stamp(self.tell(0, 0, 0, 0, 0, 0)) - age)
        self.torques.publish(message)

    def command(self, names, values):
        return JointState(name=names, effort=values)


class TakesSpeeds(Controlled):
    """The same, of a board that takes speeds."""

    kind = "V "

    def __init__(self, world):
        super().__init__(world, "motors:=velocity", "encoder_counts:=1000")

    def command(self, names, values):
        return JointState(name=names, velocity=values, effort=[math.nan] * len(values))


def test_a_frame_that_is_late_has_the_stamp_of_one_that_is_not(monkeypatch):
    """On a slow machine one between processes may be late by more than a clock that was set."""
    monkeypatch.syspath_prepend(EXAMPLES)
    clock = importlib.import_module(DRIVER).BoardClock(simulated=False)
    begin = 7 * SECOND
    assert clock.stamp(2**32 - 6000, begin) == begin
    late = clock.stamp(4000, begin + SECOND // 10)  # its counter has overflowed
    assert late == pytest.approx(begin + SECOND // 100, abs=2000)


def test_odometry_is_what_the_encoders_say_when_they_say_it(world):
    begin = now(world)
    board = Board(
        world,
        *("wheel_radius:=0.1", "half_track:=0.5", "encoder_counts:=1000"),
        *("initial_x:=1.0", "initial_y:=2.0", "initial_heading:=0.5"),
        namespace="/north",
    )
    # counters of 32 bits overflow; the right motor is mounted the other way round
    board.time = 2**32 - 6000
    first = board.tell(2**31 - 50, -(2**31) + 100, 0, 0, 0, 0, time=0, again=True)
    assert begin < stamp(first) < now(world)
    second = board.tell(-(2**31) + 50, 2**31 - 200, 400, -800, 0, 0, time=10_000)
    assert stamp(first) < stamp(second) < now(world)
    begin = now(world)
    ahead = (begin - stamp(second)) // 1000 + 500_000  # of a clock that is half a second ahead
    third = board.tell(-(2**31) + 50, 2**31 - 200, 0, 0, 0, 0, time=ahead)
    assert begin < stamp(third) < now(world)  # no frame comes before it is measured

    # by hand: wheels of 0.2 π m around, 1000 counts each; 100 counts left, 300 right, 1 m apart
    way = turn = 0.04 * math.pi
    start, end, rest = (
        reading.state(message, "north/odom", "north/base_link")
        for message in (first, second, third)
    )
    np.testing.assert_allclose(start.pose, [1.0, 2.0, 0.5], atol=1e-12)
    # the arc that it rolled has a radius of 1 m; the midpoint rule is off by way turn² / 24
    arc = 1 + math.sin(0.5 + turn) - math.sin(0.5), 2 + math.cos(0.5) - math.cos(0.5 + turn)
    np.testing.assert_allclose(end.pose, [*arc, 0.5 + turn], atol=way * turn**2 / 24 * 1.01)
    assert end.forward_speed == pytest.approx(way / 0.01)
    assert end.yaw_rate == pytest.approx(turn / 0.01)
    assert end.side_slip == pytest.approx(0.0, abs=1e-12)
    assert not start.velocity.any()
    assert not rest.velocity.any()
    for covariance in (first.pose.covariance, second.twist.covariance):
        assert (covariance[::7] > 0).all()
        assert np.count_nonzero(covariance) == 6
    moved = next(message for message in board.joints if stamp(message) == stamp(second))
    wheels = np.pi * np.array([0.2, 0.6])  # [rad]
    np.testing.assert_allclose(moved.position, wheels)
    np.testing.assert_allclose(moved.velocity, wheels / 0.01)
    np.testing.assert_allclose(moved.effort, [0.5, 1.0])  # 0.4 and 0.8 A of 1.25 N m/A

    # a board that starts anew goes on from here
    fourth = board.tell(0, 0, 0, 0, 0, 0, time=-(10**7))
    assert stamp(fourth) > stamp(third)
    assert fourth.pose.pose == third.pose.pose
    # garbage, a spoilt line, one of the wrong length, and a torn one, right before a good one
    spoilt = line(f"E {board.time + 5000} 10 -10 0 0 0 3").replace(b"10", b"11")
    os.write(board.port, b"\x00\xff$*\n" + spoilt + line("E 1 2 3") + b"$E 12 3")
    fifth = board.tell(100, -100, 0, 0, 0, 3, time=5000)
    assert fifth.twist.twist.linear.x == pytest.approx(0.02 * math.pi / 0.005)
    assert fifth.twist.twist.angular.z == 0.0
    count = "serial line: spoilt: 3 lines from the board, 3 to it"
    world.wait(lambda: count in world.log(DRIVER), "count of spoilt lines")


def test_torques_become_currents_and_those_that_are_unfit_become_zero(world):
    board = Controlled(world)
    board.answer(1.25, 2.5)
    board.gets(1000, -2000)  # 1.25 N m/A; the right motor turns the other way
    board.answer(-100.0, 0.5, names=NAMES[::-1])
    board.gets(400, 3200)  # the limit
    for why, efforts, how in [
        ("not finite", (math.nan, 1.0), {}),
        ("not finite", (1.0, math.inf), {}),
        ("not one for each wheel", (1.0,), {}),
        ("not one for each wheel", (1.0, 1.0), {"names": ["left", "right"]}),
        ("stale", (1.0, 1.0), {"age": SECOND}),
        ("stale", (1.0, 1.0), {"age": -SECOND}),
    ]:
        board.answer(1.25, 1.25)
        board.gets(1000, -1000)
        for _ in range(2):
            board.answer(*efforts, **how)
            board.gets(0, 0)
        board.says(f"wheel_torques: {why}; zero torque instead")
    board.answer(1.25, 1.25)
    board.gets(1000, -1000)
    for why in ("not finite", "not one for each wheel", "stale"):  # one line for each time
        assert world.log(DRIVER).count(f"wheel_torques: {why}") == 2


def test_speeds_become_counts_a_second_and_those_that_are_unfit_become_zero(world):
    board = TakesSpeeds(world)
    board.answer(math.pi, 2 * math.pi)
    board.gets(500, -1000)  # 1000 counts in a turn; the right motor turns the other way
    board.answer(math.nan, 1.0)
    board.gets(0, 0)
    board.says("wheel_torques: not finite; zero speed instead")
    board.answer(math.pi, math.pi)
    board.gets(500, -500)
    late = "wheel_torques: none for 0.1 s; zero speed instead"
    world.wait(lambda: board.tell(0, 0, 0, 0, 1, 0) and late in world.log(DRIVER), late)
    board.gets(0, 0)
    world.processes[DRIVER].send_signal(signal.SIGINT)
    assert world.end(DRIVER, signal.SIGINT) == 0
    assert board.commands()[-1] == (0, 0)


def test_of_several_wheels_of_a_side_the_board_gets_the_sum_and_tells_each_its_share(world):
    sides = "left_wheel_joint:=fl, rl", "right_wheel_joint:=fr, rr"
    board = Board(world, *sides, "half_track:=0.3", "effective_half_track:=0.36")
    commands = world.speak(JointState, "wheel_torques")
    board.tell(0, 0, 0, 0, 0, 0, again=True)
    message = JointState(name=["fl", "fr", "rl", "rr"], effort=[0.5, 1.0, 0.75, 0.25])

    def arrives():
        message.header.stamp = board.tell(0, 0, 0, 0, 0, 0).header.stamp
        commands.publish(message)
        return (1000, -1000) in board.commands()

    world.wait(arrives, "both sums: 1.25 N m, of 1.25 N m/A")
    told = board.tell(-41, -41, 1000, -1000, 0, 0)  # it turns to the right... as wheels tell
    joints = next(m for m in board.joints if stamp(m) == stamp(told))
    assert list(joints.name) == ["fl", "rl", "fr", "rr"]
    assert list(joints.effort) == pytest.approx([0.625] * 4)
    rim = 41 / 4096 * 2 * math.pi * 0.027 / 0.005
    assert told.twist.twist.angular.z == pytest.approx(2 * rim / (2 * 0.36))


def test_torques_that_do_not_come_any_more_are_dropped(world):
    board = Controlled(world)
    board.answer(1.25, 1.25)
    board.gets(1000, -1000)
    world.wait(lambda: board.tell(0, 0, 0, 0, 1, 0) and (0, 0) in board.commands(), "zero currents")
    board.says("wheel_torques: none for 0.1 s; zero torque instead")
    board.says("board: no command, currents cut")
    board.says("frames: none for 1 s")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_end_sends_zero_currents_even_if_the_signal_comes_twice(world, number):
    board = Controlled(world)
    board.answer(1.25, 1.25)
    board.gets(1000, -1000)
    world.processes[DRIVER].send_signal(number)
    assert world.end(DRIVER, number) == 0
    assert board.commands()[-1] == (0, 0)
    assert "Traceback" not in world.log(DRIVER)


def test_a_board_that_is_unplugged_is_told_in_one_line_and_a_failure(world):
    board = Controlled(world)
    os.close(board.line)
    os.close(board.port)
    assert world.processes.pop(DRIVER).wait(TIMEOUT) == 1
    said = world.log(DRIVER)
    assert said.splitlines()[-1].startswith("minimal_driver: the board is lost: ")
    assert "Traceback" not in said


@pytest.mark.parametrize(
    ("parameter", "line"),
    [
        ("device:=/dev/nothing", "No such file or directory: '/dev/nothing'"),
        ("device:=/dev/null", "Inappropriate ioctl for device: '/dev/null'"),
        ("half_track:=-0.3", "half_track=-0.3 must be from 0.001 to 10"),
        ("wheel_radius:=.nan", "wheel_radius=nan must be from 0.001 to 1"),
        ("motors:=speed", "motors='speed' must be torque or velocity"),
        ("max_current:=3", "'max_current' to '3' of type 'INTEGER', expecting type 'DOUBLE'"),
    ],
)
def test_what_it_cannot_start_with_is_said_in_one_line(world, parameter, line):
    assert world.start_node(DRIVER, parameter).wait(TIMEOUT) == 1
    (said,) = world.log(DRIVER).splitlines()
    assert said.startswith("minimal_driver: ")
    assert line in said
    del world.processes[DRIVER]


class StandIn:
    """The firmware's stand-in and the driver on it."""

    def __init__(self, world, simulated=False, heading=math.pi / 4, config="climber.yaml"):
        self.config = config
        self.world, self.truth = world, world.directory / "truth.csv"
        world.start_node(
            BOARD,
            f"simulated_time:={str(simulated).lower()}",
            f"initial_heading:={heading}",
            f"truth:={self.truth}",
            config=config,
        )
        said = world.wait(lambda: world.log(BOARD), "device")
        self.device = said.strip().removeprefix("device: ")
        self.driver = [
            f"use_sim_time:={str(simulated).lower()}",
            f"device:={self.device}",
            f"initial_heading:={heading}",
        ]
        self.start_driver()
        # all of it, even if this test is slower than the driver
        self.odometry = world.hear(Odometry, "odom", 20_000)

    def start_driver(self):
        self.world.start_node(DRIVER, *self.driver, config=self.config)

    def rows(self):
        """Rows (n, 6) of the truth: time, x, y, heading, left and right torque."""
        *rows, _ = self.truth.read_text().split("\n")  # the last one may be half written
        return np.array([[float(number) for number in row.split(",")] for row in rows[1:]])


def test_the_board_cuts_the_torque_of_a_driver_that_dies_and_takes_up_with_the_next(world):
    board = StandIn(world)
    torques = world.speak(JointState, "wheel_torques")

    def is_driven():
        if board.odometry:
            message = JointState(name=NAMES, effort=[1.0, 1.0])  # too little to move
            message.header.stamp = board.odometry[-1].header.stamp
            torques.publish(message)
        return (board.rows()[-1:, 4:] == 1.0).any()

    world.wait(is_driven, "torque")
    with open(board.device, "wb") as noise:
        noise.write(b"garbage\n$C 12*\n")
    world.wait(
        lambda: "lines from the board, 2 to it" in world.log(DRIVER), "count of spoilt lines"
    )
    world.wait(is_driven, "torque")
    world.end(DRIVER, signal.SIGKILL)
    died = len(board.rows())
    world.wait(lambda: not board.rows()[-1, 4:].any(), "cut")
    assert np.count_nonzero(board.rows()[died:, 4]) <= 22  # 0.1 s, and a command on its way
    board.start_driver()
    world.wait(is_driven, "torque")


ELLIPSE = [
    *("shape:=ellipse", "ellipse.semi_axis_x:=0.3", "ellipse.semi_axis_y:=0.2"),
    *("origin_y:=2.8", "rest_to_rest.rate:=1.0", "rest_to_rest.ramp_time:=1.0"),
]


@pytest.mark.parametrize(
    ("config", "planner", "heading", "duration", "width"),
    [
        ("climber.yaml", ELLIPSE, 0.0, 3.0, 0.3),  # half of it
        pytest.param("velocity.yaml", ELLIPSE, 0.0, 3.0, 0.3, marks=pytest.mark.soak),
        pytest.param("climber.yaml", [], math.pi / 4, 55.4, 3.0, marks=pytest.mark.soak),
    ],
    ids=["ellipse", "ellipse, by speeds", "climber.yaml"],
)
def test_in_the_plants_place_it_stays_within_5_mm_rms(
    world, config, planner, heading, duration, width
):
    """Of the odometry, and of the truth; `pytest -rP` tells how much it is."""
    board = StandIn(world, simulated=True, heading=heading, config=config)
    simulated = "use_sim_time:=true"
    world.start_node("trajectory_publisher", simulated, "autostart:=false", *planner, config=config)
    world.start_node("uk_torque_controller", simulated, config=config)
    previews = world.listen(MultiDOFJointTrajectory, "reference")
    diagnostics = world.listen(DiagnosticArray, "/diagnostics")
    world.wait(lambda: any(map(stamp, diagnostics)), "clock of the controller")
    # simulated time goes faster than discovery: what was not heard cannot be looked at
    world.wait(lambda: board.odometry, "odometry")
    world.call(Trigger, "trajectory_publisher/start", Trigger.Request())
    world.wait(lambda: previews, "reference")
    start = stamp(previews[0])
    times = range(start, start + round(duration * SECOND), SECOND // 200)
    world.wait(lambda: board.odometry and stamp(board.odometry[-1]) > times[-1], "end of the lap")

    reference = joined(preview(message, "odom") for message in previews)
    rows = board.rows()
    told = {stamp(m): reading.state(m, "odom", "base_link").pose for m in board.odometry}
    true = {round(row[0] * 1e3) * (SECOND // 1000): row[1:4] for row in rows}
    for name, poses in (("odometry", told), ("truth", true)):
        heard = [time for time in times if time in poses]
        assert len(heard) > 0.99 * len(times)
        off = np.array([poses[time] - reference.at(time).pose for time in heard])
        distance = np.hypot(*off[:, :2].T)
        rms = np.sqrt(np.mean(distance**2))
        print(f"{name}: RMS {1e3 * rms:.4f} mm, maximum {1e3 * distance.max():.4f} mm")
        assert rms <= 5e-3
    assert np.ptp(rows[:, 1]) == pytest.approx(width, abs=0.01)  # it has been there
