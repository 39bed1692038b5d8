"""What the climber does when a part of it stops, dies, jumps or interferes, and how it recovers."""

import math
import re
import signal
from itertools import pairwise

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3Stamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from test_uk_torque_controller import Loop
from trajectory_msgs.msg import MultiDOFJointTrajectory

from climber_uk.mechanics import SECOND
from climber_uk.messages import reading

pytestmark = pytest.mark.nodes

CONTROLLER, PLANT, PLANNER = "uk_torque_controller", "plant_simulator", "trajectory_publisher"
SHARED = "exclusive is set, and {} has more publishers than one"
CROWDED, WHOSE = "more than one", "publishers of wheel_torques"
LIMIT = 4.0  # [N m] of the configuration
ON_PATH = 0.02  # [m]
QUICK_APPROACH = ["approach_speed:=0.3", "approach_yaw_rate:=1.5"]
WALL_CLOCK = {  # patient, and not often: what is slow here is the machine
    PLANT: ["command_timeout:=1.0", "control_period:=0.02"],
    # a torque that is held up acts for too long, or not at all: the guard is right, and has to
    # forgive it, not to take a wheel for dead, or the climber for stalled, and that to come back
    # from wherever it is then
    CONTROLLER: [
        *("odometry_timeout:=1.0", "reference_timeout:=1.0", "control_period:=0.02"),
        *("guard.attempts:=1000", "guard.response_time:=0.0", "guard.stall_time:=0.0"),
        *("max_start_distance:=1000.0", *QUICK_APPROACH),
    ],
    PLANNER: ["rest_to_rest.ramp_time:=1.0"],
}
LOCK_STEP = {  # at a quarter of the rate, from the moment on that the test listens
    PLANT: [
        *("simulated_time:=true", "lockstep_timeout:=2.0", "control_period:=0.02"),
        "wait_for:=test",
    ],
    CONTROLLER: ["use_sim_time:=true", "control_period:=0.02", *QUICK_APPROACH],
    PLANNER: ["use_sim_time:=true", "rest_to_rest.ramp_time:=1.0"],
}


UNLOGGED = re.compile(r" \[\d+ changes were not logged\]$")


def said(world, name, subject="safe output"):
    """What a node has logged about a subject, a line each."""
    lines = [line.partition(f": {subject}: ") for line in world.log(name).splitlines()]
    return [text for _, found, text in lines if found]


def is_told_and_over(lines, text):
    """Whether a node has said this trouble, and later that all is over; each change once.

    Other troubles may have come and gone: on the wall clock the machine may be slow.
    """
    assert all(line != next_one for line, next_one in pairwise(lines))
    lines = [UNLOGGED.sub("", line) for line in lines]
    return text in lines and "ok again" in lines[lines.index(text) :]


class Climb:
    """The three nodes, each in its process, and what they tell each other."""

    def __init__(self, world, parameters):
        self.world, self.parameters = world, parameters
        self.torques = world.hear(JointState, "wheel_torques")
        self.joints = world.hear(JointState, "joint_states")
        self.odometry = world.hear(Odometry, "odom")
        world.subscribe(MultiDOFJointTrajectory, "reference")  # what the plant waits for
        self.errors = world.hear(Vector3Stamped, f"{CONTROLLER}/tracking_error")
        for name in parameters:
            self.start(name)

    def start(self, name, *others):
        self.world.start_node(name, *self.parameters[name], *others, config="climber.yaml")

    def kill(self, name):
        self.world.end(name, signal.SIGKILL)

    def is_under_way(self):
        self.world.wait(self.is_moving, "motion")
        self.is_on_path()

    def is_moving(self):
        return self.odometry and self.odometry[-1].twist.twist.linear.x > 0.1

    def is_on_path(self):
        """From now on the climber is answered, and comes to its path and stays there."""
        begin = len(self.errors)

        def is_near():
            last = [error.vector for error in self.errors[begin:][-50:]]
            return len(last) == 50 and all(math.hypot(e.x, e.y) < ON_PATH for e in last)

        self.world.wait(is_near, "climber on its path")
        assert all(abs(torque) <= LIMIT for m in self.torques for torque in m.effort)

    def recovers(self, name, text, subject="safe output", begin=0):
        """A node has told of this trouble and that all is over."""
        self.world.wait(
            lambda: is_told_and_over(said(self.world, name, subject)[begin:], text), "ok again"
        )

    def is_told(self, name, text, subject="safe output", begin=0):
        def is_told():
            lines = said(self.world, name, subject)[begin:]
            return text in [UNLOGGED.sub("", line) for line in lines]

        self.world.wait(is_told, text)


def test_odometry_that_stops_gets_the_safe_output_until_it_comes_back(world):
    climb = Climb(world, WALL_CLOCK)
    climb.is_under_way()
    begin = len(said(world, CONTROLLER))
    plant = world.processes[PLANT]
    plant.send_signal(signal.SIGSTOP)
    try:
        climb.is_told(CONTROLLER, "no odometry", begin=begin)
        last = len(climb.torques)
        world.wait(lambda: len(climb.torques) > last, "safe output")
        left, right = climb.torques[-1].effort
        quaternion = climb.odometry[-1].pose.pose.orientation
        assert left == right
        assert left * quaternion.z * quaternion.w > 0  # the weight is held, wherever it is by then
    finally:
        plant.send_signal(signal.SIGCONT)
    climb.is_on_path()
    climb.recovers(CONTROLLER, "no odometry", begin=begin)


def test_odometry_that_jumps_gets_the_safe_output_for_a_few_messages(world):
    loop = Loop(world, "odometry_timeout:=1.0", "max_distance:=2.0")

    def elsewhere(message):
        message.pose.pose.position.y += 1.0

    loop.plan()
    loop.follows()
    begin = len(loop.torques)
    loop.is_safe(spoil=elsewhere)
    loop.until(any, "torque of a controller that follows", spoil=elsewhere)
    efforts = [list(m.effort) for m in loop.torques[begin:]]
    # how many is `settling_messages`; on a busy machine torques that move nothing look like jumps
    assert efforts.count([0.0, 0.0]) > 0
    assert all(abs(torque) <= 20.0 for effort in efforts for torque in effort)
    world.wait(lambda: is_told_and_over(said(world, CONTROLLER), "odometry jumped"), "its end")


def test_odometry_of_the_future_is_refused(world):
    loop = Loop(world, "odometry_timeout:=1.0")
    loop.plan()
    loop.follows()
    loop.is_safe(age=-5 * SECOND)
    loop.follows()
    # by as much as it was when the node heard of it
    refused = re.compile(r"bad odometry \(stamp is -[1-5]\.\d\d s from the clock, too far\)")
    line, *_ = filter(refused.fullmatch, said(world, CONTROLLER))
    world.wait(lambda: is_told_and_over(said(world, CONTROLLER), line), "its end")


def test_odometry_that_was_overtaken_is_ignored(world):
    loop = Loop(world, "odometry_timeout:=1.0")
    loop.plan()
    loop.follows()
    begin = len(loop.torques)
    newer = loop.tell()
    overtaken = loop.tell(at=newer - SECOND // 20)
    last = loop.tell()

    def answered():
        return [reading.nanoseconds(m.header.stamp) for m in loop.torques[begin:]]

    world.wait(lambda: last in answered(), "answer to the last one")
    assert newer in answered()
    assert overtaken not in answered()
    # else it would have been refused; a slow machine may have other troubles
    assert "bad odometry" not in world.log(CONTROLLER)


@pytest.mark.soak  # the controller alone: test_uk_torque_controller.py
def test_a_reference_that_stops_gets_the_safe_output_until_a_new_one_comes(world):
    climb = Climb(world, WALL_CLOCK)
    climb.is_under_way()
    begin = len(said(world, CONTROLLER))
    climb.kill(PLANNER)
    climb.is_told(CONTROLLER, "no reference", begin=begin)
    world.wait(lambda: climb.odometry[-1].twist.twist.linear.x == 0, "rest")
    climb.start(PLANNER)
    climb.is_on_path()
    climb.recovers(CONTROLLER, "no reference", begin=begin)


def test_without_a_controller_the_plant_applies_no_torque_until_there_is_one_again(world):
    climb = Climb(world, WALL_CLOCK)
    climb.is_under_way()
    climb.kill(CONTROLLER)
    world.wait(lambda: list(climb.joints[-1].effort) == [0.0, 0.0], "zero torque")
    climb.start(CONTROLLER)
    climb.is_on_path()
    climb.recovers(PLANT, "stale; zero torque instead", "torque command")


def test_in_lock_step_the_plant_waits_for_a_new_controller(world):
    climb = Climb(world, LOCK_STEP)
    climb.is_under_way()
    begin = len(said(world, PLANT, "lock-step"))
    climb.kill(CONTROLLER)

    def waits():
        stamp = reading.nanoseconds(climb.odometry[-1].header.stamp)
        return f"no torque for the odometry of {stamp / SECOND:.3f} s"

    world.wait(lambda: waits() in said(world, PLANT, "lock-step")[begin:], "word of it")
    told = waits()
    climb.start(CONTROLLER)
    climb.is_on_path()
    assert is_told_and_over(said(world, PLANT, "lock-step")[begin:], told)


def test_a_plant_that_starts_again_is_brought_to_the_path(world):
    climb = Climb(world, WALL_CLOCK)
    climb.is_under_way()
    begin = len(said(world, CONTROLLER))
    climb.kill(PLANT)
    climb.is_told(CONTROLLER, "no odometry", begin=begin)
    climb.start(PLANT)
    climb.is_on_path()
    climb.recovers(CONTROLLER, "no odometry", begin=begin)


def test_in_lock_step_a_plant_whose_time_starts_again_is_brought_to_the_path(world):
    climb = Climb(world, LOCK_STEP)
    climb.is_under_way()
    climb.kill(PLANT)
    heard = climb.odometry, climb.torques, climb.joints, climb.errors

    def is_silent():
        before = [len(messages) for messages in heard]
        world.spin(0.2)
        return before == [len(messages) for messages in heard]

    world.wait(is_silent, "silence of a plant that is dead")
    climb.odometry.clear()
    climb.start(PLANT)
    world.wait(lambda: climb.odometry, "odometry in a new time")
    climb.is_on_path()


@pytest.mark.soak  # of one from outside: test_operating.py
def test_another_path_is_taken_up_from_where_the_climber_is(world):
    climb = Climb(world, LOCK_STEP)
    climb.is_under_way()
    climb.kill(PLANNER)
    circle = ["shape:=circle", "circle.radius:=0.5", "origin_x:=-0.5"]
    climb.start(PLANNER, *circle, "rest_to_rest.rate:=0.4", "rest_to_rest.laps:=9")

    def are_on_circle():
        places = [m.pose.pose.position for m in climb.odometry[-200:]]
        return all(abs(math.hypot(p.x + 0.5, p.y - 3.0) - 0.5) < ON_PATH for p in places)

    world.wait(are_on_circle, "climber on the circle")
    climb.is_on_path()
    assert are_on_circle()


def test_a_flood_of_other_torques_is_survived_and_reported_once(world):
    # pushed forth and back within a period, it may stand at each odometry, and be elsewhere
    unchecked = [*WALL_CLOCK[CONTROLLER], "max_twist_error:=1000.0"]
    climb = Climb(world, {**WALL_CLOCK, CONTROLLER: unchecked})
    climb.is_under_way()
    reports = world.listen(DiagnosticArray, "/diagnostics")
    flood = world.speak(JointState, "wheel_torques")
    names, begin = climb.torques[-1].name, len(climb.torques)

    def is_reported():
        flood.publish(JointState(name=names, effort=[1.0, -1.0]))  # for each message heard
        crowded = [m.status[0].name for m in reports if WHOSE in m.status[0].message]
        return len(climb.torques) > begin + 300 and all(
            crowded.count(f"/{name}") > 3 for name in (CONTROLLER, PLANT)
        )

    world.wait(is_reported, "word of it")
    world.node.destroy_publisher(flood)
    for name in (CONTROLLER, PLANT):
        climb.is_told(name, "ok again", WHOSE)
    climb.is_on_path()
    for name in (CONTROLLER, PLANT):
        assert said(world, name, WHOSE) == [CROWDED, "ok again"]


def test_a_second_publisher_gets_nothing_done_where_the_first_is_to_be_the_only_one(world):
    theirs = -3.9, 3.9  # [N m] left, right
    exclusive = {name: [*given, "exclusive:=true"] for name, given in WALL_CLOCK.items()}
    climb = Climb(world, {**exclusive, PLANNER: WALL_CLOCK[PLANNER]})
    world.wait(lambda: climb.is_moving() and climb.torques, "motion")
    flood = world.speak(JointState, "wheel_torques")
    names, begin = climb.torques[-1].name, len(climb.joints)

    def is_told():
        flood.publish(JointState(name=names, effort=theirs))
        return len(climb.joints) > begin + 200 and said(world, PLANT, "wheel_torques")

    world.wait(is_told, "word of it")
    world.node.destroy_publisher(flood)
    obeyed = [tuple(m.effort) for m in climb.joints[begin:]]
    assert obeyed.count(theirs) <= 1
    assert obeyed.count((0.0, 0.0)) > 100
    refused = "refused, zero torque instead ({})".format(SHARED.format("wheel_torques"))
    climb.recovers(PLANT, refused, "wheel_torques")
    odometry = world.speak(Odometry, "odom")
    climb.is_told(CONTROLLER, refused := "bad odometry ({})".format(SHARED.format("odom")))
    world.node.destroy_publisher(odometry)
    climb.recovers(CONTROLLER, refused)


@pytest.mark.soak
@pytest.mark.parametrize("exclusive", [False, True])
def test_the_example_takes_the_wheels_unless_their_publisher_is_to_be_the_only_one(
    world, exclusive
):
    plant = [*WALL_CLOCK[PLANT], f"exclusive:={str(exclusive).lower()}"]
    climb = Climb(world, {**WALL_CLOCK, PLANT: plant})
    world.wait(lambda: climb.is_moving() and climb.torques, "motion")
    world.start("second_publisher")
    world.wait(lambda: "stranger" in world.log("second_publisher"), "what came of it")
    obeyed, periods = map(int, re.findall(r"\d+", world.log("second_publisher")))
    assert periods > 50
    assert obeyed <= 1 if exclusive else obeyed > periods / 4


def test_simulated_time_without_a_clock_gets_the_safe_output_until_there_is_one(world):
    world.start_node(CONTROLLER, *LOCK_STEP[CONTROLLER], config="climber.yaml")
    torques = world.listen(JointState, "wheel_torques")
    world.wait(lambda: said(world, CONTROLLER), "word of it")
    world.wait(lambda: torques and list(torques[-1].effort) == [0.0, 0.0], "safe output")
    climb = Climb(world, {name: LOCK_STEP[name] for name in (PLANT, PLANNER)})
    climb.is_on_path()
    no_clock = "use_sim_time is true, but there is no clock"
    assert said(world, CONTROLLER) == [no_clock, "ok again"]
