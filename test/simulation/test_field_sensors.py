"""Encoders, an IMU and fixes of a simulated robot: exact by default, else as wrong as was asked."""

import math

import numpy as np
import pytest

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.field_sensors import (
    EncoderErrors,
    FieldSensors,
    FixErrors,
    Fixes,
    Imu,
    ImuErrors,
    WheelEncoders,
)
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import Parts, Physics, SimulatedRobot

PERIOD = 0.005
UPRIGHT = Plant(Climber(), PERIOD)


def at(heading, speed=0.0, yaw_rate=0.0):
    return State.rolling(np.array([1.0, 2.0, heading]), speed, yaw_rate)


def test_by_default_wheels_are_told_exactly_and_nothing_else_is():
    sensors = FieldSensors(ImuErrors(), EncoderErrors(), FixErrors(), PERIOD, at(0.0))
    angles = np.array([1 / 3, -2 / 7])
    measured = sensors.measure(SECOND, at(0.0), UPRIGHT, angles)
    assert measured.angles is angles
    assert measured.imu is None
    assert measured.fixes == []


@pytest.mark.parametrize("heading", np.linspace(-3, 3, 7).tolist())
@pytest.mark.parametrize("inclination", [0.0, 30.0, 90.0, 180.0])
def test_at_rest_an_imu_shows_what_holds_the_climber_against_its_weight(heading, inclination):
    plant = Plant(Climber(inclination=inclination), PERIOD)
    sample = Imu(ImuErrors(), PERIOD, at(heading)).measure(at(heading), plant)
    pull = GRAVITY * math.sin(math.radians(inclination))
    off_wall = GRAVITY * math.cos(math.radians(inclination))
    expected = pull * math.sin(heading), pull * math.cos(heading), off_wall
    np.testing.assert_allclose(sample.force, expected, atol=1e-12)


def test_moving_it_shows_the_accelerations_of_the_motion_too():
    before, after = at(0.3, 0.2, 0.5), at(0.3 + 0.5 * PERIOD, 0.2 + 0.4 * PERIOD, 0.5)
    imu = Imu(ImuErrors(gyro_bias=0.01), PERIOD, before)
    sample = imu.measure(after, Plant(Climber(inclination=0.0), PERIOD))
    assert sample.yaw_rate == pytest.approx(0.51)
    np.testing.assert_allclose(sample.force[:2], [0.4, 0.2 * 0.5], atol=1e-3)


def test_an_imu_away_from_the_centre_shows_what_turning_does_to_it_in_its_own_axes():
    before, after = at(0.0), at(0.0, 0.0, 2.0 * PERIOD)  # which turns ever faster, by 2 rad/s²
    level = Plant(Climber(inclination=0.0), PERIOD)
    sample = Imu(ImuErrors(x=0.1, y=0.05), PERIOD, before).measure(after, level)
    np.testing.assert_allclose(sample.force[:2], [-0.1, 0.2], atol=1e-4)
    turning = at(0.0, 0.0, 3.0)
    for yaw, expected in ((0.0, (-0.9, -0.45)), (math.pi / 2, (-0.45, 0.9))):
        imu = Imu(ImuErrors(x=0.1, y=0.05, yaw=yaw), PERIOD, turning)
        np.testing.assert_allclose(imu.measure(turning, level).force[:2], expected, atol=1e-9)


def test_noise_of_an_imu_has_the_size_that_was_asked_for_at_any_rate():
    errors = ImuErrors(gyro_noise=0.002, acceleration_noise=0.004, forward_bias=0.1)
    for period in (0.005, 0.02):
        imu = Imu(errors, period, at(0.0))
        samples = [imu.measure(at(0.0), UPRIGHT) for _ in range(4000)]
        rates = np.array([sample.yaw_rate for sample in samples])
        forces = np.array([sample.force for sample in samples])
        assert rates.std() * math.sqrt(period) == pytest.approx(0.002, rel=0.05)
        np.testing.assert_allclose(forces.std(axis=0) * math.sqrt(period), 0.004, rtol=0.05)
        assert forces[:, 0].mean() == pytest.approx(0.1, abs=0.004)


def test_encoders_count_down_to_the_last_full_count():
    encoders = WheelEncoders(EncoderErrors(resolution=0.1), PERIOD)
    np.testing.assert_allclose(encoders.measure(np.array([0.27, -0.01])), [0.2, -0.1])


def test_slip_has_the_size_that_was_asked_for_and_is_told_over_the_whole_way():
    encoders = WheelEncoders(EncoderErrors(slip=0.01, slip_time=0.5), PERIOD)
    told = np.array([encoders.measure(np.array([n, -n])) for n in range(1, 20_001)])
    shares = np.diff(told[:, 0]) - 1
    assert shares.std() == pytest.approx(0.01, rel=0.1)
    np.testing.assert_allclose(told[:, 1], -told[:, 0])
    later = round(0.5 / PERIOD)
    together = np.corrcoef(shares[:-later], shares[later:])[0, 1]
    assert together == pytest.approx(math.exp(-1), abs=0.1)


def test_fixes_come_at_their_rate_with_the_stamp_at_which_they_were_measured():
    fixes = Fixes(FixErrors(period=0.1, delay=0.03, position_noise=1e-9))
    arrived = {}
    for number in range(100):
        stamp = SECOND + round(number * PERIOD * SECOND)
        for fix in fixes.measure(stamp, State(np.array([number, 0.0, 0.0]), np.zeros(3))):
            arrived[stamp] = fix
    assert [(now - fix.stamp) / SECOND for now, fix in arrived.items()] == [0.03] * 5
    assert [fix.pose[0] for fix in arrived.values()] == pytest.approx([0, 20, 40, 60, 80], abs=1e-6)


def test_a_tag_away_from_the_centre_turns_with_the_climber():
    (fix,) = Fixes(FixErrors(period=0.1, position_noise=1e-9, x=0.3, y=0.1)).measure(
        SECOND, State(np.array([2.0, 1.0, math.pi / 2]), np.zeros(3))
    )
    np.testing.assert_allclose(fix.pose, (1.9, 1.3, math.pi / 2), atol=1e-6)


def test_some_fixes_are_off_by_metres_and_the_same_seed_gives_the_same():
    errors = FixErrors(0.1, 0.0, 0.02, outlier_share=0.1, outlier_size=5.0, seed=3)

    def told():
        fixes = Fixes(errors)
        stamps = [SECOND + number * SECOND // 10 for number in range(3000)]
        return np.array([fix.pose for stamp in stamps for fix in fixes.measure(stamp, at(0.5))])

    off = told() - at(0.5).pose
    far = np.hypot(off[:, 0], off[:, 1]) > 0.2
    assert far.mean() == pytest.approx(0.1, abs=0.02)
    assert off[~far, :2].std() == pytest.approx(0.02, rel=0.05)
    np.testing.assert_array_equal(told(), told())


@pytest.mark.parametrize(("inclination", "share"), [(90.0, 1.0), (30.0, 0.5), (0.0, 0.0)])
def test_creep_takes_a_rolling_climber_down_the_wall_and_leaves_one_at_rest(inclination, share):
    climber = Climber(inclination=inclination, max_wheel_torque=4.0)
    physics = Physics(creep=0.03)
    parts = Parts(Plant(climber, PERIOD), Motors(), Sensors(), physics)
    exact = parts._replace(physics=Physics())
    rolling = State.rolling(np.zeros(3), 0.3, 0.0)
    creeping, straight = (SimulatedRobot(kind, rolling, PERIOD) for kind in (parts, exact))
    for robot in (creeping, straight) * 20:
        robot.advance(np.full(2, 1.0))
    way = climber.wheel_radius * straight.angles.mean()
    sagged = straight.state.pose - creeping.state.pose
    np.testing.assert_allclose(sagged, [0, 0.03 * share * way, 0], atol=1e-4 * way)
    resting = SimulatedRobot(parts, at(0.0), PERIOD)
    resting.advance(np.zeros(2))
    np.testing.assert_array_equal(resting.state.pose, at(0.0).pose)
