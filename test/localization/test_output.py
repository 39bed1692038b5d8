"""The output's pose, speed and yaw rate: smooth, and not late."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.localization.options import LocalizationOptions
from climber_uk.localization.output_speed import OutputSpeed
from climber_uk.localization.smoothing import Smoothing, between

OPTIONS, STEP = LocalizationOptions(), 0.005
METRES = st.floats(-3, 3)


@settings(max_examples=30)
@given(x=METRES, y=METRES, heading=METRES)
def test_the_output_follows_a_correction_no_faster_than_it_may_and_arrives(x, y, heading):
    smoothing, jump = Smoothing(OPTIONS), np.array([x, y, heading])
    smoothing.corrected(np.zeros(3), jump)
    np.testing.assert_array_equal(smoothing.offset, -jump)  # the output is where it was
    for _ in range(round(120 / STEP)):
        before = smoothing.offset
        smoothing.go_on(STEP)
        moved = smoothing.offset - before
        assert np.hypot(*moved[:2]) <= OPTIONS.pull_speed * STEP + 1e-12
        assert abs(moved[2]) <= OPTIONS.pull_yaw_rate * STEP + 1e-12
        if not np.abs(smoothing.offset).max() > 1e-9:
            break
    np.testing.assert_allclose(smoothing.offset, 0, atol=1e-6)


def test_after_a_long_pause_the_output_is_at_the_estimate_and_not_beyond():
    smoothing = Smoothing(OPTIONS)
    smoothing.corrected(np.zeros(3), np.array([0.01, 0.0, 0.001]))
    smoothing.go_on(10.0)
    np.testing.assert_array_equal(smoothing.offset, 0)


@given(x=METRES, y=METRES, heading=METRES)
def test_the_estimate_is_the_output_as_seen_in_the_map(x, y, heading):
    estimate, output = np.array([x, y, heading]), np.array([y - 1, x, heading + 0.2])
    ahead, beside, angle = between(estimate, output)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose((ahead, beside) + turn @ output[:2], estimate[:2], atol=1e-12)
    assert angle == pytest.approx(-0.2)
    assert between(estimate, estimate) == pytest.approx((0, 0, 0))


def test_the_speed_is_smoother_than_counts_and_as_early_as_the_truth_with_a_biased_imu():
    output, random = OutputSpeed(), np.random.default_rng(0)
    time = np.arange(0, 8, STEP)
    true = 0.2 * np.sin(2 * time)
    found = np.array(
        [
            output.go_on(speed, force + 0.3, STEP)
            for speed, force in zip(
                true + random.normal(0, 0.005, len(time)), 0.4 * np.cos(2 * time), strict=True
            )
        ]
    )
    off = (found - true)[time > 2]
    assert np.sqrt(np.mean(off**2)) < 0.0025
    assert abs(off.mean()) < 2e-4
    assert np.sqrt(np.mean(np.diff(off) ** 2)) < 0.001  # of the counts': 0.007


def test_without_an_imu_the_speed_is_the_encoders():
    output = OutputSpeed()
    output.go_on(0.1, 5.0, STEP)
    assert output.go_on(0.2, None, STEP) == 0.2


def test_the_yaw_rate_is_the_gyros_in_the_long_run():
    output = OutputSpeed()
    rates = [output.yaw_rate(0.5, 0.4, STEP) for _ in range(400)]
    assert rates[-1] == pytest.approx(0.4, abs=1e-3)
