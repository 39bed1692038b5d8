"""Wheels among other joints: found by their names, or refused in words."""

import math
from dataclasses import replace

import numpy as np
import pytest
from made_bag import RADIUS, RATE, Made, a_run

from climber_uk.bags.recorded_run import read_run, read_runs
from climber_uk.bags.topics import Topics
from climber_uk.mechanics.climber import Climber
from climber_uk.report.metrics import Case, evaluate

LEFT, RIGHT = "left_wheel_joint", "right_wheel_joint"
NAN = math.nan
# what is told of the wheels: 3 rad/s at 1.5 N m right, -4 rad/s at 2 N m left
RIGHT_POWER, LEFT_POWER = 4.5, -8.0


def told(*joints, later=0):
    """A publisher of joints, each a name, a rate and a torque."""
    names, rates, torques = zip(*joints, strict=True)
    return names, rates, torques, later


right, left = (RIGHT, 3, 1.5), (LEFT, -4, 2)
brush, arm = ("brush_joint", 90, 7), ("left_arm_joint", 50, 6)
FOREIGN = {
    "right comes first": [told(right, left)],
    "a brush between them": [told(left, brush, right)],
    "an arm whose name has a side": [told(arm, left, right)],
    "four wheels, of which these are named": [
        told(("rear_left", 9, 9), left, ("rear_right", 9, 9), right)
    ],
    "a gripper's messages between": [told(right, left), told(brush, arm, later=1_000_000)],
    "messages of one wheel each": [told(right), told(left)],
    "messages of one wheel each at other times": [told(left), told(right, later=2_000_000)],
    "a wheel beside an arm": [told(right, brush), told(arm, left, later=500_000)],
    "another publisher that has positions only": [
        ((LEFT, RIGHT), (), (), 0),
        told(left, right),
    ],
    "another publisher of rates without torques": [
        told(left, right),
        ((LEFT, RIGHT), (0, 0), (), 0),
    ],
}


@pytest.mark.parametrize("published", FOREIGN.values(), ids=FOREIGN)
def test_other_joints_leave_the_wheels_power_and_work_as_they_are(tmp_path, published):
    made = a_run(400)
    for names, rates, torques, later in published:
        made.add_joint_states(names, rates, torques, later)
    made.add_parameters(left_wheel_joint=LEFT, right_wheel_joint=RIGHT)
    (run,), said = read_runs(made.write(tmp_path / "bag"), Topics())
    got = evaluate(Case(run))
    assert said == ["/wheel_torques: not used, " + NOT_THESE]  # made_bag calls them left and right
    assert got["mean_power_right"] == pytest.approx(RIGHT_POWER)
    assert got["mean_power_left"] == pytest.approx(LEFT_POWER)
    lasted = got["duration"]  # less a period where messages come between those of the odometry
    assert got["energy_right"] == pytest.approx(RIGHT_POWER * lasted, rel=1.1 / 399)
    assert got["energy_left"] == pytest.approx(LEFT_POWER * lasted, rel=1.1 / 399)


NOT_THESE = (
    f"no {RIGHT} and no {LEFT} among the joints left, right: right_wheel_joint and "
    "left_wheel_joint in a --params file say what they are called"
)


def test_the_names_are_those_of_the_parameters_whatever_they_are(tmp_path):
    """Even if they are misleading."""
    made = Made()
    made.add_odometry()
    made.add_joint_states(["left", "right", "w1", "w0"], [9, 9, 3, -4], [9, 9, 1.5, 2])
    made.add_joint_states(["w0", "left", "w1"], [], [5, 6, 7], topic="wheel_torques")
    bag = made.write(tmp_path / "bag")
    names = {"right_wheel_joint": "w1", "left_wheel_joint": "w0"}
    (run,), said = read_runs(bag, Topics(), parameters=lambda _: names)
    assert said == []
    assert run.torques[0].tolist() == [7, 5]
    got = evaluate(Case(run))
    assert (got["mean_power_right"], got["mean_power_left"]) == (RIGHT_POWER, LEFT_POWER)


def test_of_several_wheels_of_a_side_torques_are_added_and_rates_averaged(tmp_path):
    made = Made()
    made.add_odometry()
    joints = ["front_left", "front_right", "rear_left", "rear_right"]
    made.add_joint_states(joints, [-3, 2, -5, 4], [0.5, 1, 1.5, 0.5])
    made.add_joint_states(joints, [], [1, 2, 3, 4], topic="wheel_torques")
    bag = made.write(tmp_path / "bag")
    names = {
        "left_wheel_joint": "front_left, rear_left",
        "right_wheel_joint": "front_right, rear_right",
    }
    (run,), said = read_runs(bag, Topics(), parameters=lambda _: names)
    assert said == []
    assert run.torques[0].tolist() == [6, 4]
    got = evaluate(Case(run))
    assert (got["mean_power_right"], got["mean_power_left"]) == (RIGHT_POWER, LEFT_POWER)


def test_names_that_nobody_told_are_those_with_a_side_if_it_is_clear(tmp_path):
    made = Made()
    made.add_odometry()
    made.add_joint_states(["WheelLeft", "Brush", "WheelRight"], [-4, 9, 3], [2, 9, 1.5])
    got = evaluate(Case(read_run(made.write(tmp_path / "bag"))))
    assert (got["mean_power_right"], got["mean_power_left"]) == (RIGHT_POWER, LEFT_POWER)


REFUSED = {
    "other names": ((["wheel_r", "wheel_l"], [3, -4], [1, 2]), "among the joints wheel_l, wheel_r"),
    "no names": (([], [3, -4], [1, 2]), "velocity has 2 values for 0 names"),
    "four, of which none is named": (
        (["front_left", "front_right", "rear_left", "rear_right"], [1] * 4, [1] * 4),
        f"no {RIGHT} and no {LEFT} among the joints front_left, front_right, rear_left, rear_right",
    ),
    "one of them": (
        ([LEFT, "brush"], [3, -4], [1, 2]),
        f"no {RIGHT} among the joints brush, {LEFT}",
    ),
    "a name twice": (([LEFT, RIGHT, LEFT], [1] * 3, [1] * 3), "a name twice"),
    "no effort": (([LEFT, RIGHT], [3, -4], []), f"no effort of {RIGHT}"),
    "effort that is not a number": (([LEFT, RIGHT], [3, -4], [NAN] * 2), f"no effort of {RIGHT}"),
    "no velocity": (([LEFT, RIGHT], [], [1, 2]), f"no velocity of {RIGHT}"),
    "one effort": (([LEFT, RIGHT], [3, -4], [1]), "effort has 1 values for 2 names"),
}


@pytest.mark.parametrize(("states", "why"), REFUSED.values(), ids=REFUSED)
def test_what_does_not_tell_of_the_wheels_is_refused_in_words(tmp_path, states, why):
    """The power is then that of torques and odometry."""
    made = a_run()
    made.messages = [m for m in made.messages if m[0] != "/wheel_torques"]
    made.add_joint_states([RIGHT, LEFT], [], [1, 1], topic="wheel_torques")
    made.add_joint_states(*states)
    (run,), said = read_runs(made.write(tmp_path / "bag"), Topics())
    (line,) = said
    assert line.startswith("/joint_states: ")
    assert why in line
    got = evaluate(Case(replace(run, parameters=vars(Climber()))))
    assert got["mean_power_right"] == pytest.approx((RADIUS * RATE + 0.3 * RATE) / 0.027)
    assert math.isnan(evaluate(Case(run))["mean_power_right"])  # the radius is not known


@pytest.mark.parametrize(
    ("names", "torques", "why"),
    [
        (["wheel_l", "wheel_r"], [1, 2], "among the joints wheel_l, wheel_r"),
        ([LEFT, RIGHT], [], "no message has effort"),
        ([LEFT, RIGHT], [1, 2, 3], "effort has 3 values for 2 names"),
    ],
)
def test_commands_that_cannot_be_told_apart_are_refused_in_words(tmp_path, names, torques, why):
    made = Made()
    made.add_odometry()
    made.add_joint_states(names, [], torques, topic="wheel_torques")
    (run,), said = read_runs(made.write(tmp_path / "bag"), Topics())
    assert len(run.torques) == 0
    (line,) = said
    assert line.startswith("/wheel_torques: ")
    assert why in line
    assert math.isnan(evaluate(Case(run))["peak_torque"])


def test_each_wheel_commanded_in_messages_of_its_own_is_refused_in_words(tmp_path):
    made = Made()
    made.add_odometry()
    for name in (LEFT, RIGHT):
        made.add_joint_states([name], [], [1], topic="wheel_torques")
    _, (line,) = read_runs(made.write(tmp_path / "bag"), Topics())
    assert line == f"/wheel_torques: not used, no message has {RIGHT} and {LEFT}"


def test_commands_are_taken_by_the_names_whatever_their_order(tmp_path):
    made = Made(60)
    made.add_odometry()
    made.add_joint_states(["right_wheel_joint", "left_wheel_joint"], [], [1, 2], 0, "wheel_torques")
    run = read_run(made.write(tmp_path / "bag"))
    np.testing.assert_array_equal(run.torques, np.tile([1.0, 2.0], (60, 1)))
