import dataclasses
from dataclasses import replace

import numpy as np
import pytest

from climber_uk.mechanics.adhesion import NoAdhesion
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import MEASURING, Odometer, Sensors
from climber_uk.simulation.simulated_robot import Parts, Physics, SimulatedRobot

CLIMBER = Climber()
START = State.rolling(np.array([1.0, 2.0, 0.5]), 0.3, 0.2)
PERIOD = 0.005


def told(sensors, states):
    """(stamp's period, state) of each odometry, the one at the start included."""
    odometer = Odometer(sensors, CLIMBER, PERIOD, START)
    result = [odometer.latest()]
    for state in states:
        odometer.measure(state, state, np.zeros(2))
        result.append(odometer.latest())
    return result


def moved(x):
    return State(START.pose + np.array([x, 0.0, 0.0]), START.velocity)


def test_by_default_odometry_is_the_truth_itself():
    states = [moved(1.0), moved(2.0)]
    assert told(Sensors(), states) == [(0, START), (1, states[0]), (2, states[1])]


def test_late_odometry_has_the_stamp_at_which_it_was_measured():
    states = [moved(1.0), moved(2.0), moved(3.0)]
    late = told(Sensors(odometry_delay=0.01), states)
    assert [number for number, _ in late] == [-2, -1, 0, 1]
    assert [state.pose[0] for _, state in late] == [1.0, 1.0, 1.0, 2.0]


def test_a_delay_between_two_periods_is_refused():
    with pytest.raises(ValueError, match=r"odometry_delay=0.007 must be a multiple of"):
        told(Sensors(odometry_delay=0.007), [])


def test_noise_has_the_size_that_was_asked_for_and_no_mean():
    sizes = {"position": 0.01, "heading": 0.02, "speed": 0.03, "yaw_rate": 0.04}
    sensors = Sensors(**{f"{name}_noise": size for name, size in sizes.items()})
    found = [state for _, state in told(sensors, [START] * 4000)]
    columns = [
        [s.pose[0] - START.pose[0] for s in found],
        [s.heading - START.heading for s in found],
        [s.forward_speed - START.forward_speed for s in found],
        [s.yaw_rate - START.yaw_rate for s in found],
    ]
    np.testing.assert_allclose(np.std(columns, axis=1), list(sizes.values()), rtol=0.05)
    assert (np.abs(np.mean(columns, axis=1)) < np.array(list(sizes.values())) / 15).all()


def test_the_same_seed_makes_the_same_noise_and_another_another():
    sensors = Sensors(position_noise=0.01)
    one, again = (told(sensors, [START] * 5) for _ in range(2))
    other = told(replace(sensors, seed=1), [START] * 5)
    for (_, a), (_, b), (_, c) in zip(one, again, other, strict=True):
        np.testing.assert_array_equal(a.pose, b.pose)
        assert (a.pose[:2] != c.pose[:2]).all()


def test_biases_are_added():
    sensors = Sensors(x_bias=0.1, y_bias=-0.2, heading_bias=0.3, speed_bias=0.4, yaw_rate_bias=0.5)
    (_, state), *_ = told(sensors, [])
    np.testing.assert_allclose(state.pose - START.pose, [0.1, -0.2, 0.3])
    assert state.forward_speed == pytest.approx(0.7)
    assert state.yaw_rate == pytest.approx(0.7)
    assert state.side_slip == pytest.approx(0, abs=1e-15)


WHEELS = Sensors(odometry_source="wheels")


def reckoned(plant, torques, sensors=WHEELS, periods=200):
    """Truth and odometry after 1 s of torques."""
    parts = Parts(plant, Motors(), sensors, Physics())
    robot = SimulatedRobot(parts, State.rolling(np.zeros(3), 0.2, 0.3), PERIOD)
    for _ in range(periods):
        robot.advance(torques)
        robot.advance(torques)
        robot.measure()
    return robot.state, robot.odometer.latest()[1]


FLOOR = replace(CLIMBER, inclination=0.0)
ON_WEIGHT = Contact(adhesion=NoAdhesion())


def test_wheels_that_roll_count_the_way_and_those_that_slip_drift():
    gentle, harsh = np.array([0.1, 0.12]), np.array([1.5, 1.5])
    truth, told = reckoned(Plant(FLOOR, 0.0025, ON_WEIGHT, slip=True), gentle)
    assert np.abs(truth.pose - told.pose).max() < 1e-4
    assert told.forward_speed == pytest.approx(truth.forward_speed, rel=1e-9)
    truth, told = reckoned(Plant(FLOOR, 0.0025, ON_WEIGHT, slip=True), harsh)
    assert np.hypot(*told.pose[:2]) > np.hypot(*truth.pose[:2]) + 10
    assert told.forward_speed > truth.forward_speed + 10


def test_sensors_are_ideal_only_if_no_error_of_any_kind_is_added():
    motion, noise = State.rolling(np.zeros(3), 0.2, 0.1).motion, [1.0] * 5
    assert Sensors().is_ideal
    assert Sensors().corrupted(motion, noise) == motion
    for field in dataclasses.fields(Sensors):
        if field.name not in MEASURING:
            sensors = Sensors(**{field.name: 0.25})
            assert not sensors.is_ideal
            assert sensors.corrupted(motion, noise) != motion  # it is not read by nobody
            assert sensors.ideal == Sensors()


@pytest.mark.parametrize("resolution", [0.0, 1e-6])
def test_wheels_that_scrub_reckon_turns_by_their_effective_half_track(resolution):
    sensors = Sensors(
        odometry_source="wheels", encoder_resolution=resolution, effective_half_track=0.36
    )
    wheels = State.rolling(np.zeros(3), 0.0, 0.6)  # as half_track, 0.3 m, has it
    odometer = Odometer(sensors, Climber(), 0.1, State(np.zeros(3), np.zeros(3)))
    odometer.measure(wheels, wheels, np.array([1.0, -1.0]) * 0.3 * 0.06 / Climber().wheel_radius)
    _, told = odometer.latest()
    assert told.heading == pytest.approx(0.05, abs=1e-6)
    assert told.yaw_rate == pytest.approx(0.5, abs=1e-3)


def test_an_encoder_counts_whole_steps():
    step = 0.01  # [rad]
    sensors = Sensors(odometry_source="wheels", encoder_resolution=step)
    truth, told = reckoned(Plant(FLOOR, 0.0025, ON_WEIGHT), np.array([0.1, 0.1]), sensors)
    assert 0 < np.abs(truth.pose - told.pose).max() < 2e-3
    assert told.forward_speed / 0.027 / step * PERIOD * 2 == pytest.approx(
        round(told.forward_speed / 0.027 / step * PERIOD * 2), abs=1e-6
    )
