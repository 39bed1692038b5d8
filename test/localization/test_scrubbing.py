"""A climber whose wheels scrub in turns: its sag is learnt, its speed is not that of what slips."""

import math

import numpy as np
import pytest

from climber_uk.localization.encoders import Rolled
from climber_uk.localization.gate import Fix
from climber_uk.localization.localizer import Localizer
from climber_uk.localization.models import DRAG_SLIP, PIVOT, SCRUB, WEIGHT_SLIP
from climber_uk.localization.options import LocalizationOptions
from climber_uk.localization.scrubbing import LONGEST, SOON, TURNING, Push, Scrubbing, Turned
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import GRAVITY

PERIOD, SPEED, YAW_RATE = 0.01, 0.2, 0.4
LAMBDA, LEVER = 0.08, 0.03  # λ, a [m]
WIDER, BY_DRAG, BY_WEIGHT = 0.06, 0.6, 0.4  # [m] by which wheels show a wider track; ζ, ξ
NOISE = 0.02  # [m] of a fix
STRAIGHT = Turned(0.0, 0.0, 0.0)


def aside(heading, yaw_rate):
    """u [m/s] by hand."""
    return LEVER * math.sin(heading) * yaw_rate - LAMBDA * math.cos(heading) * abs(yaw_rate)


class Circles:
    """A climber on circles up to 20 s, then on straight ways and turns, and its localizer."""

    def __init__(self, slips=(0.0, 0.0), **options):
        self.slips, wider = slips, WIDER if any(slips) else 0.0
        known = {"initial_heading": 0.3, "initial_position_deviation": 0.001, "imu_y": 0.1}
        self.options = LocalizationOptions(
            effective_half_track=0.3 + wider,
            way_noise=0.002,
            scale_deviation=0.002,
            creep_deviation=0.0,
            **known,
            **options,
        )
        self.localizer, self.random = Localizer(self.options), np.random.default_rng(0)
        self.pose, self.angles, self.now = np.array([0.0, 0.0, 0.3]), np.zeros(2), 0.0
        self.speed = self.yaw_rate = 0.0
        self.off, self.too_fast, self.aside_off = 0.0, 0.0, 0.0

    def go_on(self, duration, yaw_rate, fixes=True, spin=0.0):
        """Speeds change within 0.5 s; wheels turn faster by a `spin` [m/s] for the first 0.3 s."""
        before = self.speed, self.yaw_rate
        for number in range(round(duration / PERIOD)):
            share = min(number * PERIOD / 0.5, 1.0)
            speed = before[0] + (SPEED - before[0]) * share
            rate = before[1] + (yaw_rate - before[1]) * share
            acceleration = (speed - self.speed) / PERIOD
            turning = (rate - self.yaw_rate) / PERIOD
            self._step(speed, rate, acceleration, turning, spin * (number * PERIOD < 0.3))
            if fixes and number % 10 == 0:
                values = self.pose[:2] + self.random.normal(0, NOISE, 2)
                stamp = SECOND + round(self.now * SECOND)
                self.localizer.on_fix(Fix(stamp, (0, 1), values, NOISE**2 * np.eye(2)))
        return self

    def _step(self, speed, rate, acceleration, turning, spin):
        self.speed, self.yaw_rate, heading = speed, rate, float(self.pose[2])
        side, weight = aside(heading, rate), self.options.gravity_along_wall
        lever = self.options.imu_y
        forwards = acceleration - rate * side + weight * math.sin(heading) - turning * lever
        left = rate * speed + weight * math.cos(heading) - rate * rate * lever
        self.now += PERIOD
        middle = heading + rate * PERIOD / 2
        along, across = speed * PERIOD, side * PERIOD
        cosine, sine = math.cos(middle), math.sin(middle)
        self.pose = self.pose + np.array(
            [along * cosine - across * sine, along * sine + across * cosine, rate * PERIOD]
        )
        drag, uphill = self.slips
        slip = WIDER * abs(rate) * (drag + uphill * math.sin(heading))
        track = self.options.effective_half_track * rate
        rims = speed + spin + slip + np.array([track, -track])
        self.angles = self.angles + rims * PERIOD / self.options.wheel_radius
        stamp = SECOND + round(self.now * SECOND)
        self.localizer.on_imu(stamp, rate, forwards, left)
        located = self.localizer.on_encoders(stamp, *self.angles.tolist())
        if located is not None:
            motion = located.motion
            self.off = math.hypot(motion.x - self.pose[0], motion.y - self.pose[1])
            self.too_fast = max(self.too_fast, motion.speed - speed)
            self.aside_off = max(self.aside_off, abs(located.aside - side))


@pytest.mark.parametrize(("pivot", "deviation"), [(0.0, 0.04), (LEVER, 0.015)])  # of 0.08: half
def test_a_pivot_that_is_told_is_as_uncertain_as_the_scrub_by_its_share(pivot, deviation):
    told = {"scrub_deviation": 0.04, "initial_scrub": LAMBDA, "initial_pivot": pivot}
    estimate = Localizer(LocalizationOptions(**told)).estimate
    assert estimate.deviation(SCRUB) == pytest.approx(0.04)
    assert estimate.deviation(PIVOT) == pytest.approx(deviation)


def test_how_wheels_give_way_is_learnt_from_fixes_and_carries_through_a_time_without():
    circles = Circles(scrub_deviation=0.1).go_on(1, 0.0)
    for _ in range(3):
        circles.go_on(6, YAW_RATE).go_on(6, -YAW_RATE)
    estimate = circles.localizer.estimate
    assert estimate.mean[SCRUB] == pytest.approx(LAMBDA, abs=0.01)
    assert estimate.mean[PIVOT] == pytest.approx(LEVER, abs=0.01)
    circles.go_on(6, YAW_RATE, fixes=False).go_on(6, -YAW_RATE, fixes=False)
    assert circles.off < 0.03  # having sagged by 0.2 m


def test_how_far_they_slip_along_in_turns_is_learnt_and_is_no_way_of_the_climber():
    circles = Circles((BY_DRAG, BY_WEIGHT), scrub_deviation=0.1, slip_walk=0.02).go_on(1, 0.0)
    for _ in range(3):
        circles.go_on(6, YAW_RATE).go_on(6, -YAW_RATE)
    estimate = circles.localizer.estimate
    assert estimate.mean[DRAG_SLIP] == pytest.approx(BY_DRAG, abs=0.1)
    assert estimate.mean[WEIGHT_SLIP] == pytest.approx(BY_WEIGHT, abs=0.1)
    circles.too_fast = 0.0
    circles.go_on(6, YAW_RATE, fixes=False).go_on(6, -YAW_RATE, fixes=False)
    assert circles.off < 0.03  # wheels have turned 0.17 m too far
    assert circles.too_fast < 0.008  # of 24 mm/s


def test_what_an_earlier_run_has_told_of_it_needs_no_fixes():
    told = {"scrub_deviation": 0.002, "initial_scrub": LAMBDA, "initial_pivot": LEVER}
    circles = Circles(**told).go_on(1, 0.0, fixes=False)
    circles.go_on(6, YAW_RATE, fixes=False).go_on(6, -YAW_RATE, fixes=False)
    assert circles.off < 0.01
    assert circles.aside_off < 0.008  # [m/s] of 32 mm/s, as its turn goes through a low-pass
    plain = Circles().go_on(1, 0.0, fixes=False)
    plain.go_on(6, YAW_RATE, fixes=False).go_on(6, -YAW_RATE, fixes=False)
    assert plain.off > 0.1


def test_wheels_that_break_away_for_a_moment_are_not_believed_to_move_the_climber():
    circles = Circles(scrub_deviation=0.1).go_on(2, 0.0).go_on(1, YAW_RATE, fixes=False, spin=0.3)
    assert circles.too_fast < 0.05
    assert circles.off < 0.02
    plain = Circles().go_on(2, 0.0).go_on(1, YAW_RATE, fixes=False, spin=0.3)
    assert plain.too_fast > 0.25


def test_wheels_that_roll_again_as_a_turn_ends_slip_no_more_at_once_and_noise_is_no_slip():
    options, scrubbing = LocalizationOptions(effective_half_track=0.5), Scrubbing()
    random, (sides, noise) = np.random.default_rng(0), (0.3, 0.005)  # [m/s]

    def slips(times, rolled_rate, rate):
        """T by its time [m/s]."""
        told = rolled_rate + noise / 0.5 * random.normal(size=times)
        rows = [Rolled(PERIOD, SPEED * PERIOD, SPEED * PERIOD, it, False) for it in told]
        return [scrubbing.turned(it, rate, options).slipped / PERIOD for it in rows]

    begun = slips(500, sides / 0.5, 0.6)
    assert np.mean(begun[50:]) == pytest.approx(sides - 0.3 * 0.6, rel=0.02)
    late = math.exp(-4 * PERIOD / TURNING)  # by the turn's own low-pass
    assert slips(4, 0.0, 0.0)[-1] < late / 2 * begun[-1]


@pytest.mark.parametrize("wrong", [-0.5, -0.1, 0.05, 0.3])  # [m/s²]
def test_an_accelerometer_that_is_off_for_good_moves_the_speed_by_a_bound_only(wrong):
    scrubbing, rolled = Scrubbing(), Rolled(PERIOD, SPEED * PERIOD, SPEED * PERIOD, 0.0, False)
    scrubbing.go_on(rolled, None, STRAIGHT, 0.0)
    push = Push(wrong, 0.0, 0.0)
    gone = [scrubbing.go_on(rolled, push, STRAIGHT, 0.0).distance for _ in range(4000)]
    off = np.array(gone) / PERIOD - SPEED
    assert np.abs(off).max() < abs(wrong) * (LONGEST + 2 * SOON)
    assert np.abs(off[-1]) < abs(wrong) * (0.2 * LONGEST + 2 * SOON)


def test_at_rest_and_without_an_imu_the_way_is_the_wheels():
    scrubbing = Scrubbing()
    spins = Rolled(PERIOD, PERIOD, PERIOD, 0.0, False)
    scrubbing.go_on(spins, Push(0.0, 0.0, 0.0), STRAIGHT, 0.0)
    assert scrubbing.breaks_away
    rests = Rolled(PERIOD, 0.0, 0.0, 0.0, True)
    assert scrubbing.go_on(rests, Push(GRAVITY, 0.0, 0.0), STRAIGHT, 0.0).distance == 0
    assert not scrubbing.breaks_away
    rolls = Rolled(PERIOD, SPEED * PERIOD, SPEED * PERIOD, 0.0, False)
    gone = scrubbing.go_on(rolls, None, Turned(0.0, 1e-3, 1e-3), 4e-4)
    assert gone == pytest.approx((rolls.distance - 4e-4, 1e-3, 1e-3))
