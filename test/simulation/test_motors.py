import numpy as np
import pytest

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.motors import Motors

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


@pytest.mark.parametrize("name", ["torque_lag", "torque_resolution"])
def test_what_cannot_be_is_refused(name):
    with pytest.raises(ValueError, match=f"{name}=-1.0 must be >= 0"):
        Motors(**{name: -1.0})
