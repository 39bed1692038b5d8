from dataclasses import replace

import numpy as np
import pytest

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import Parts, Physics, Push, SimulatedRobot

CLIMBER = Climber(max_wheel_torque=4.0)
AT_REST = State(np.zeros(3), np.zeros(3))
NONE = np.zeros(2)


def test_by_default_motors_do_as_they_are_told_within_the_limit():
    given = np.array([1.2345, -9.0])
    got = Motors().torques(CLIMBER, AT_REST, NONE, given, 0.0025)
    assert got.tolist() == [1.2345, -4.0]


def test_a_lag_comes_as_near_as_its_exponential():
    motors, torques = Motors(torque_lag=0.02), NONE
    for _ in range(8):  # 20 ms
        torques = motors.torques(CLIMBER, AT_REST, torques, np.array([2.0, -1.0]), 0.0025)
    np.testing.assert_allclose(torques, np.array([2.0, -1.0]) * (1 - np.exp(-1)), rtol=1e-12)


def test_torques_come_in_steps_of_the_resolution():
    got = Motors(torque_resolution=0.05).torques(
        CLIMBER, AT_REST, NONE, np.array([0.374, -0.376]), 0.0025
    )
    np.testing.assert_allclose(got, [0.35, -0.4], rtol=1e-12)


@pytest.mark.parametrize(("v", "drive", "brake"), [(0.0, 4, -4), (0.27, 2, -4), (-0.27, 4, -2)])
def test_a_dc_motor_has_less_torque_the_faster_it_turns(v, drive, brake):
    # 0.27 m/s is 10 rad/s of the wheels
    climber = Climber(max_wheel_torque=4.0, no_load_wheel_rate=20.0)
    state = State.rolling(np.zeros(3), v, 0.0)
    most = Motors().torques(climber, state, NONE, np.array([99.0, -99.0]), 0.0025)
    np.testing.assert_allclose(most, [drive, brake])


@pytest.mark.parametrize(
    "name",
    [
        *("torque_lag", "torque_resolution"),
        *("servo_time_constant", "velocity_resolution", "velocity_dead_band"),
    ],
)
def test_what_cannot_be_is_refused(name):
    with pytest.raises(ValueError, match=f"{name}=-1.0 must be >= 0"):
        Motors(**{name: -1.0})


SERVO = Motors(motors="velocity", servo_time_constant=0.02)
PLANT = Plant(replace(CLIMBER, suction_pressure=8000.0, wheel_load_share=0.8), 0.001)


def run(motors, rims, seconds, robot=None):
    """A robot after some time in which its rims are to have speeds (right, left) [m/s]."""
    robot = robot or SimulatedRobot(Parts(PLANT, motors, Sensors(), Physics()), AT_REST, 0.005)
    for _ in range(round(seconds / PLANT.step)):
        robot.advance(np.array(rims) / CLIMBER.wheel_radius)
    return robot


def rims(robot):
    return CLIMBER.wheel_radius * robot.rates


@pytest.mark.parametrize("heading", [0.0, np.pi / 2, -np.pi / 2], ids=["level", "up", "down"])
def test_a_servo_comes_as_near_as_its_exponential_whatever_it_has_to_carry(heading):
    """Once it turns: seal and weight, which it does not know, are made up for."""
    start = State.rolling(np.array([0.0, 0.0, heading]), 0.1, 0.0)
    robot = SimulatedRobot(Parts(PLANT, SERVO, Sensors(), Physics()), start, 0.005)
    before = rims(run(SERVO, [0.1, 0.1], 0.4, robot))
    np.testing.assert_allclose(before, 0.1, atol=1e-6)
    after = rims(run(SERVO, [0.14, 0.1], 0.02, robot))
    expected = 0.1 + np.array([0.04, 0.0]) * (1 - np.exp(-1))
    np.testing.assert_allclose(after, expected, atol=2e-3)
    at_last = rims(run(SERVO, [0.14, 0.1], 0.3, robot))
    np.testing.assert_allclose(at_last, [0.14, 0.1], atol=1e-4)  # as it turns, its weight changes


def test_a_servo_that_is_to_stand_holds_against_a_push():
    robot = run(SERVO, [0.0, 0.0], 0.1)
    for _ in range(500):
        robot.advance(NONE, Push(np.array([80.0, 0.0, 0.0])))
    assert abs(robot.state.forward_speed) < 1e-6
    assert abs(robot.state.pose[0]) < 1e-3


def test_speeds_come_in_steps_of_the_resolution():
    robot = run(replace(SERVO, velocity_resolution=0.01), [0.104, 0.096], 0.5)
    np.testing.assert_allclose(rims(robot), 0.1, atol=1e-6)


def test_in_its_dead_band_a_wheel_stands():
    robot = run(replace(SERVO, velocity_dead_band=0.02), [0.0199, -0.0201], 0.5)
    np.testing.assert_allclose(rims(robot), [0.0, -0.0201], atol=1e-4)


def test_a_servo_has_no_more_torque_than_its_motor():
    robot, most = run(SERVO, [0.0, 0.0], 0.01), 0.0
    for _ in range(20):
        robot = run(SERVO, [5.0, 5.0], 0.001, robot)
        most = max(most, np.abs(robot.torques).max())
    assert most == CLIMBER.max_wheel_torque
