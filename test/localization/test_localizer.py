"""A climber at rest, or rolling, told sample by sample: what is located, and what is said."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.localization.encoders import LARGEST_SPEED, Encoders, Rolled
from climber_uk.localization.gate import Fix
from climber_uk.localization.imu import MOST, Imu
from climber_uk.localization.localizer import Localizer
from climber_uk.localization.models import BIAS, CREEP, HEADING
from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import GRAVITY
from climber_uk.mechanics.elementary import wrapped

PERIOD = 0.005
GYRO, FORCE = 0.00175, 0.00354  # noise by root of a second
ANGLES = st.floats(-math.pi, math.pi)
SEEDS = st.integers(0, 2**32 - 1)


class Told:
    """A climber of a heading and a speed, and the localizer that is told of it."""

    def __init__(self, seed=0, heading=0.0, speed=0.0, bias=0.0, creep=0.0, **options):
        known = {"initial_heading": 0.0, "acceleration_bias_deviation": 0.0}
        self.options = LocalizationOptions(
            gyro_noise=GYRO, acceleration_noise=FORCE, **{**known, **options}
        )
        self.localizer, self.random = Localizer(self.options), np.random.default_rng(seed)
        self.heading, self.speed, self.bias, self.creep = heading, speed, bias, creep
        self.position, self.rolled, self.stamp = np.zeros(2), 0.0, SECOND
        self.located = []

    def go_on(self, duration=PERIOD, has_imu=True):
        """Go on for some time; the located poses since the start are in `located`."""
        pull = self.options.gravity_along_wall
        for _ in range(round(duration / PERIOD)):
            if has_imu:
                noise = self.random.normal(size=3) / math.sqrt(PERIOD)
                force = pull * np.array([math.sin(self.heading), math.cos(self.heading)])
                force = force + FORCE * noise[:2]
                self.localizer.on_imu(self.stamp, self.bias + GYRO * noise[2], *force.tolist())
            angle = self.rolled / self.options.wheel_radius
            self.located.append(self.localizer.on_encoders(self.stamp, angle, angle))
            way = self.speed * PERIOD
            self.rolled += way
            direction = np.array([math.cos(self.heading), math.sin(self.heading)])
            sag = self.creep * abs(way) * pull / GRAVITY
            self.position = self.position + way * direction - np.array([0, sag])
            self.stamp += round(PERIOD * SECOND)
        return self

    def fix(self, off=(0.0, 0.0), age=0.0, deviation=0.02, lever=(0.0, 0.0)):
        """A fix of the position some time ago."""
        direction = np.array([math.cos(self.heading), math.sin(self.heading)])
        then = self.position - self.speed * (age + PERIOD) * direction
        turned = np.exp(1j * self.heading) * complex(*lever)
        off = np.array([off[0] + turned.real, off[1] + turned.imag])
        values = then + off + self.random.normal(0, deviation, 2)
        stamp = self.stamp - round((age + PERIOD) * SECOND)
        self.localizer.on_fix(Fix(stamp, (0, 1), values, deviation**2 * np.eye(2), lever))

    @property
    def off(self):
        """Of the last heading from the truth [rad]."""
        return wrapped(self.located[-1].motion.heading - self.heading)


@settings(max_examples=8)
@given(seed=SEEDS, heading=ANGLES, inclination=st.floats(20, 160), bias=st.floats(-0.02, 0.02))
def test_at_rest_any_heading_is_found_within_a_second(seed, heading, inclination, bias):
    told = Told(seed, heading, bias=bias, inclination=inclination).go_on(1.0)
    assert abs(told.off) < math.radians(0.5)
    assert told.localizer.estimate.deviation(HEADING) < math.radians(0.2)
    assert abs(told.off) < 5 * told.localizer.estimate.deviation(HEADING)
    assert told.localizer.estimate.mean[BIAS] == pytest.approx(bias, abs=0.012)


@given(heading=ANGLES)
def test_on_a_wall_the_first_samples_are_enough_to_begin_with(heading):
    told = Told(heading=heading).go_on(2 * PERIOD)
    assert told.located[-1] is not None
    assert abs(told.off) < math.radians(2)


def test_a_gyros_bias_is_not_learnt_of_the_first_few_samples_more_than_they_tell():
    """The means of the first moment are all of the same samples."""
    ratios = []
    for seed in range(40):
        told = Told(seed, heading=0.7, speed=0.15).go_on(0.3)
        estimate = told.localizer.estimate
        ratios.append((estimate.mean[BIAS]) / estimate.deviation(BIAS))
    assert np.mean(np.square(ratios)) < 1.3


@pytest.mark.parametrize("inclination", [0.0, 180.0])
def test_on_floor_and_ceiling_a_heading_that_is_not_given_is_waited_for(inclination):
    told = Told(heading=0.0, inclination=inclination).go_on(1.0)
    assert told.located == [None] * 200
    assert not told.localizer.knows_heading
    told.localizer.on_fix(Fix(told.stamp - 1, (0, 1, 2), np.zeros(3), 1e-4 * np.eye(3)))
    assert told.go_on().located[-1].motion.heading == pytest.approx(0, abs=0.05)


def test_without_a_known_position_a_fix_is_waited_for():
    told = Told(initial_position_deviation=10.0).go_on(0.2)
    assert told.located[-1] is None
    assert told.localizer.knows_heading
    told.fix(off=(3.0, -4.0), deviation=0.02)
    motion = told.go_on().located[-1].motion
    assert (motion.x, motion.y) == pytest.approx((3.0, -4.0), abs=0.1)


def test_a_given_heading_that_gravity_contradicts_is_given_up_and_that_is_said():
    told = Told(heading=1.5, initial_heading_deviation=0.02).go_on(1.0)
    assert any("gravity tells" in remark for remark in told.localizer.remarks)
    assert wrapped(told.localizer.estimate.mean[HEADING] - 1.5) == pytest.approx(0, abs=0.01)


def test_creep_is_learnt_from_fixes_and_carries_through_a_time_without():
    told = Told(heading=0.0, speed=0.2, creep=0.04, initial_heading_deviation=0.01)
    for _ in range(200):
        told.go_on(0.1)
        told.fix(age=0.1)
    assert told.localizer.estimate.mean[CREEP] == pytest.approx(0.04, abs=0.005)
    told.go_on(20.0)
    off = told.localizer.estimate.mean[1] - told.position[1]
    assert abs(off) < 0.03  # of the 0.16 m that it sags
    assert abs(off) < 4 * told.localizer.estimate.deviation(1)


def test_a_tag_away_from_the_centre_tells_where_the_centre_is_and_on_a_floor_the_heading():
    """A floor's gravity tells no heading; a tag that turns about the centre does."""
    told = Told(speed=0.2, inclination=0.0, initial_heading_deviation=0.1)
    told.heading = 0.1
    for _ in range(150):
        told.go_on(0.1)
        told.fix(age=0.1, lever=(0.4, -0.2))
    assert told.off == pytest.approx(0, abs=0.03)
    motion = told.located[-1].motion
    assert np.hypot(*(told.position - (motion.x, motion.y))) < 0.03


def test_fixes_that_are_off_leave_no_step_and_are_told_apart():
    told = Told(heading=0.0, speed=0.2)
    for number in range(100):
        told.go_on(0.1)
        told.fix(off=(3.0 * (number % 10 == 0), 0.0), age=0.1)
    counts = told.localizer.counts
    assert (counts.refused, counts.believed) == (10, 0)
    assert all("refused" in remark for remark in told.localizer.remarks)
    assert largest_step(told) < 0.002


def test_a_tag_that_has_moved_for_good_is_believed_and_the_output_follows_at_its_pace():
    told = Told(heading=0.0, speed=0.1)
    for number in range(200):
        told.go_on(0.1)
        told.fix(off=(0.0, 0.3 * (number >= 50)), age=0.1)
    assert told.localizer.counts.believed == 1
    assert sum("believed" in remark for remark in told.localizer.remarks) == 1
    assert largest_step(told) <= (0.1 + told.options.pull_speed) * PERIOD + 2e-4
    assert told.located[-1].motion.y - told.position[1] == pytest.approx(0.3, abs=0.03)


def largest_step(told):
    places = np.array([(located.motion.x, located.motion.y) for located in told.located if located])
    return np.hypot(*np.diff(places, axis=0).T).max()


def test_fixes_too_old_or_ahead_of_the_encoders_are_refused_and_those_a_little_ahead_wait():
    told = Told().go_on(0.1)
    told.fix(age=0.5)
    assert "older than the first of the encoders" in told.localizer.remarks[-1]
    told.go_on(2.0)
    told.fix(age=1.5)
    assert "old, older than longest_delay=1" in told.localizer.remarks[-1]
    told.fix(age=-3.0)
    assert "ahead of the encoders" in told.localizer.remarks[-1]
    told.fix(age=-0.02)
    assert told.localizer.counts.taken == 0
    assert told.go_on(0.05).localizer.counts.taken == 1


def test_the_same_sample_again_gets_the_same_answer_and_changes_nothing():
    told = Told(speed=0.2, heading=0.5).go_on(0.5)
    last = told.located[-1]
    assert told.localizer.on_encoders(last.stamp, 100.0, 100.0) is last
    assert told.localizer.on_encoders(last.stamp - 1000, 100.0, 100.0) is last
    assert told.go_on().located[-1].motion.speed == pytest.approx(0.2, abs=0.02)


def test_stamps_that_go_back_begin_everything_anew():
    told = Told(speed=0.2, heading=0.5).go_on(3.0)
    told.stamp -= 2 * SECOND
    located = told.go_on(0.2).located[-1]
    assert "stamps went back: started anew" in told.localizer.remarks
    assert (located.motion.x, located.motion.y) == pytest.approx((0, 0), abs=0.05)


@pytest.mark.parametrize("stamp", [1, 2**31 * SECOND - 1])
def test_one_stamp_that_is_wrong_costs_one_sample(stamp):
    told = Told(speed=0.2, heading=0.5).go_on(1.0)
    told.localizer.on_imu(stamp, 0.0, 0.0, 0.0)
    assert told.localizer.on_encoders(stamp, 9.0, 9.0) is told.located[-1]
    told.go_on(0.5)
    assert np.hypot(*(told.localizer.estimate.mean[:2] - told.position)) < 0.01
    assert told.localizer.imu.is_there(told.stamp)


def test_an_imu_whose_encoders_have_stopped_does_not_grow():
    imu = Imu()
    for number in range(3 * MOST):
        imu.add(number * SECOND, 0.0, 0.0, 0.0)
    assert len(imu._samples) <= MOST


@pytest.mark.parametrize("lowest", [0.0, -math.pi])
def test_angles_that_begin_anew_each_turn_are_travelled_on(lowest):
    encoders, period = Encoders(LocalizationOptions()), 0.02
    for speed in (0.3, -0.3):  # [m/s], of a wheel of 27 mm
        angles = lowest + (np.arange(100) * period * speed / 0.027 - lowest) % (2 * math.pi)
        rolled = [encoders.roll(angle, angle, period) for angle in angles.tolist()]
        assert sum(one.distance for one in rolled[1:]) == pytest.approx(99 * period * speed)


def test_a_counter_that_begins_anew_is_no_travel():
    told = Told(speed=0.1, heading=0.5).go_on(1.0)
    before = told.localizer.estimate.mean[:2]
    with pytest.raises(ValueError, match=rf"above {LARGEST_SPEED:g}: counted anew"):
        told.localizer.on_encoders(told.stamp, -500.0, -500.0)
    told.stamp += round(PERIOD * SECOND)
    told.rolled -= 500 * told.options.wheel_radius + told.rolled
    told.go_on()
    assert np.hypot(*(told.localizer.estimate.mean[:2] - before)) < 0.01


def test_without_an_imu_the_wheels_tell_the_turn():
    told = Told(speed=0.2, initial_heading_deviation=0.02).go_on(5.0, has_imu=False)
    assert told.off == pytest.approx(0, abs=1e-6)
    scrubbed = told.options.turn_noise * math.sqrt(1.0 / told.options.half_track)  # over 1 m
    deviation = told.localizer.estimate.deviation(HEADING)
    assert deviation == pytest.approx(math.hypot(0.02, scrubbed), rel=0.01)


@settings(max_examples=6)
@given(seed=SEEDS)
def test_deviations_are_those_of_the_errors(seed):
    """At rest and rolling; 5 deviations are missed once in a million."""
    told = Told(seed, heading=0.7, speed=0.15, bias=0.01)
    for _ in range(20):
        told.go_on(0.1)
        told.fix(age=0.1)
    estimate = told.localizer.estimate
    last = told.position - 0.15 * PERIOD * np.array([math.cos(0.7), math.sin(0.7)])
    for part, true in enumerate((*last, 0.7)):
        assert abs(wrapped(float(estimate.mean[part] - true))) < 5 * estimate.deviation(part)


def test_the_heading_is_off_by_its_deviation_on_average():
    """Gravity tells what was DELAY ago: the gyro's noise since then is in the heading alone."""
    ratios, known = [], {"gyro_bias_deviation": 0.0, "gyro_bias_walk": 0.0}
    for seed in range(8):
        told = Told(seed, heading=0.7, speed=0.15, **known).go_on(1.0)
        for _ in range(40):
            told.go_on(0.1)
            estimate = told.localizer.estimate
            off = wrapped(float(estimate.mean[HEADING]) - told.heading)
            ratios.append(off / estimate.deviation(HEADING))
    assert np.mean(np.square(ratios)) == pytest.approx(1, abs=0.15)


def test_a_position_that_is_not_known_any_more_is_in_doubt_until_fixes_are_back():
    told = Told(speed=1.0, creep_deviation=0.2, initial_heading_deviation=0.01).go_on(0.5)
    assert not told.localizer.doubts.unknown
    told.go_on(2.0)
    doubts = told.localizer.doubts
    assert list(doubts.unknown) == ["position"]
    assert doubts.said.startswith("position by 0.")
    assert doubts.said.endswith("above 0.2 m")
    told.fix(deviation=0.18)
    told.go_on(PERIOD)
    assert doubts.unknown  # it is less than the limit now, but by a little
    for _ in range(10):
        told.fix()
        told.go_on(PERIOD)
    assert not doubts.unknown


def test_fixes_have_stopped_after_some_times_their_longest_interval_and_some_seconds():
    told, stopped = Told(), []
    doubts = told.localizer.doubts
    assert not told.go_on(6.0).localizer.doubts.have_stopped(told.stamp)  # there were none
    for interval in (0.1, 2.0, 0.1):
        told.fix()
        told.go_on(interval)
    for second in range(1, 15):
        told.go_on(1.0)
        stopped += [second] * doubts.have_stopped(told.stamp)
    assert stopped == [10, 11, 12, 13, 14]
    told.fix()
    assert not doubts.have_stopped(told.stamp)


@pytest.mark.parametrize("place", [(0.0, 0.0), (0.1, 0.0), (0.0, -0.1)])
def test_an_imu_away_from_the_centre_tells_the_same_weight(place):
    """Of a climber that turns on the spot on a floor, by 2 sin(5 t) rad/s."""
    (x, y), imu, weights = place, Imu(*place), []
    for number in range(400):
        time = number * PERIOD
        rate, faster = 2 * math.sin(5 * time), 10 * math.cos(5 * time)
        imu.add(round(time * SECOND), rate, -(rate**2) * x - faster * y, faster * x - rate**2 * y)
        weights.append(imu.weight(Rolled(PERIOD, 0.0, 0.0, rate, False), rate))
    forces = [(weight.forwards, weight.left) for weight in weights[100:] if weight is not None]
    np.testing.assert_allclose(forces, 0, atol=0.03)  # of up to 1 m/s²
