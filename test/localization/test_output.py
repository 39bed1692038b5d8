"""The output's pose, speed and yaw rate: smooth, and not late."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.control.twist import TwistCheck
from climber_uk.localization.options import LocalizationOptions
from climber_uk.localization.output_speed import OutputSpeed
from climber_uk.localization.smoothing import Smoothing, between
from climber_uk.mechanics.quantities import Motion

OPTIONS, STEP = LocalizationOptions(), 0.005
METRES = st.floats(-3, 3)


@settings(max_examples=12)
@given(x=METRES, y=METRES, heading=METRES)
def test_the_output_follows_a_correction_no_faster_than_it_may_and_arrives(x, y, heading):
    smoothing, jump, fast = Smoothing(OPTIONS), np.array([x, y, heading]), (10 * STEP, 10 * STEP)
    smoothing.corrected(np.zeros(3), jump)
    np.testing.assert_array_equal(smoothing.offset, -jump)  # the output is where it was
    for _ in range(round(120 / STEP)):
        before = smoothing.offset
        smoothing.go_on(STEP, *fast)
        moved = smoothing.offset - before
        assert np.hypot(*moved[:2]) <= OPTIONS.pull_speed * STEP + 1e-12
        assert abs(moved[2]) <= OPTIONS.pull_yaw_rate * STEP + 1e-12
        if not np.abs(smoothing.offset).max() > 1e-9:
            break
    np.testing.assert_allclose(smoothing.offset, 0, atol=1e-6)


def test_after_a_long_pause_the_output_is_at_the_estimate_and_not_beyond():
    smoothing = Smoothing(OPTIONS)
    smoothing.corrected(np.zeros(3), np.array([0.01, 0.0, 0.001]))
    smoothing.go_on(10.0, 1.0, 1.0)
    np.testing.assert_array_equal(smoothing.offset, 0)


@pytest.mark.parametrize(
    ("speed", "yaw_rate"), [(0.0, 0.0), (0.02, 0.0), (-0.02, 0.1), (0.2, 0.0), (0.2, -0.4)]
)
def test_what_corrections_add_to_the_way_is_no_twist_that_lies(speed, yaw_rate):
    """Half a metre ahead or behind, and 0.1 rad to either side, for the controller's check."""
    for ahead, aside in itertools.product((-0.5, 0.5), (-0.1, 0.1)):
        smoothing, check, pose = Smoothing(OPTIONS), TwistCheck(), np.zeros(3)
        smoothing.corrected(pose, np.array([ahead, 0.0, aside]))
        last = Motion.at(*smoothing.offset, speed, yaw_rate)
        for _ in range(300):
            way, turned = speed * STEP, yaw_rate * STEP
            pose = pose + np.array([way * np.cos(pose[2]), way * np.sin(pose[2]), turned])
            smoothing.go_on(STEP, way, turned)
            now = Motion.at(*(pose + smoothing.offset), speed, yaw_rate)
            check.add(last, now, STEP, 0.3)
            assert (check.missing(0.05), check.trouble(0.05)) == ("", ("", False))
            last = now
        assert (np.hypot(*smoothing.offset[:2]) < 0.5) == (speed != 0)  # it is on its way


@given(x=METRES, y=METRES, heading=METRES)
def test_the_estimate_is_the_output_as_seen_in_the_map(x, y, heading):
    estimate, output = np.array([x, y, heading]), np.array([y - 1, x, heading + 0.2])
    ahead, beside, angle = between(estimate, output)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose((ahead, beside) + turn @ output[:2], estimate[:2], atol=1e-12)
    assert angle == pytest.approx(-0.2)
    assert between(estimate, estimate) == pytest.approx((0, 0, 0))


COUNT = 2 * np.pi / 4096 * 0.027  # [m] of a wheel


def told(rate, time, of=lambda wheels: wheels):
    """Speeds and yaw rates of the output, of wheels with counts, of a climber with one `rate`."""
    output, ways = OutputSpeed(50.0), COUNT * np.floor(np.cumsum(rate) * STEP / COUNT)
    steps = np.diff(ways, prepend=0.0)
    both = [output.go_on(way, way / STEP, of(way / STEP), STEP) for way in steps]
    return np.array(both)[time > 2].T


def test_speed_and_yaw_rate_are_smoother_than_counts_and_as_early_as_the_truth():
    time = np.arange(0, 8, STEP)
    # the mean of a step is that of its middle
    true = 0.2 * np.sin(2 * (time - STEP / 2))
    at_the_end = 0.2 * np.sin(2 * time)[time > 2]
    for found in told(true, time):
        off = found - at_the_end
        assert np.sqrt(np.mean(off**2)) < 0.0015
        assert np.sqrt(np.mean(np.diff(off) ** 2)) < 0.0005  # of the counts': 0.008
        assert abs(np.mean(off * np.cos(2 * time[time > 2]))) < 1e-4  # late by 0.5 ms


def test_at_rest_both_are_zero_soon_and_at_any_period_they_follow():
    time = np.arange(0, 8, STEP)
    speeds, _ = told(np.where(time < 3, 0.1, 0.0), time)
    assert np.abs(speeds[time[time > 2] > 3.3]).max() < 1e-4
    for period in (0.001, 0.02, 0.1, 1.0):
        output = OutputSpeed(50.0)
        for _ in range(round(2 / period) + 3):
            speed, yaw_rate = output.go_on(0.3 * period, 0.5, 0.5, period)
        assert (speed, yaw_rate) == pytest.approx((0.3, 0.5), rel=1e-3)


def test_the_yaw_rate_is_the_gyros_in_the_long_run():
    time = np.arange(0, 8, STEP)
    _, rates = told(np.full(len(time), 0.5), time, of=lambda _: 0.4)
    assert rates.mean() == pytest.approx(0.4, abs=1e-3)
