"""Prediction and correction, beside the information form and a batch of least squares."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.localization import models
from climber_uk.localization.kalman import (
    LARGEST_KNOCK,
    Estimate,
    corrected,
    predicted,
    with_gravity,
    with_yaw_rate_at_rest,
)
from climber_uk.localization.models import BIAS, HEADING, SCALE, SIZE, Late, Travel
from climber_uk.localization.options import LocalizationOptions

SEEDS = st.integers(0, 2**32 - 1)
UPRIGHT, FLOOR = (
    LocalizationOptions(acceleration_bias_deviation=0.0),
    LocalizationOptions(inclination=0.0),
)


def estimate_of(random, size=1.0):
    root = random.normal(size=(SIZE, SIZE))
    return Estimate(random.normal(size=SIZE), size * (root @ root.T + 0.1 * np.eye(SIZE)))


@given(seed=SEEDS, parts=st.integers(1, 3))
def test_a_correction_is_that_of_the_information_form(seed, parts):
    random = np.random.default_rng(seed)
    before, jacobian = estimate_of(random), random.normal(size=(parts, SIZE))
    noise, innovation = np.diag(random.uniform(0.1, 2, parts)), random.normal(size=parts)
    after = corrected(before, innovation, jacobian, noise)
    weighed = jacobian.T @ np.linalg.inv(noise)
    information = np.linalg.inv(before.covariance) + weighed @ jacobian
    expected = before.mean + np.linalg.solve(information, weighed @ innovation)
    np.testing.assert_allclose(after.covariance @ information, np.eye(SIZE), atol=1e-6)
    np.testing.assert_allclose(after.mean, expected, atol=1e-6)


@settings(max_examples=10)
@given(seed=SEEDS)
def test_covariances_stay_symmetric_and_positive_whatever_comes(seed):
    random = np.random.default_rng(seed)
    estimate = Estimate.start(UPRIGHT)
    for _ in range(200):
        travel = Travel(
            0.005, *random.normal(0, 0.1, 2), random.normal(), bool(random.random() < 0.5)
        )
        estimate = predicted(estimate, travel._replace(path=abs(travel.path)), UPRIGHT)
        force = random.normal(0, 20, 2)
        estimate = with_gravity(estimate, force, Late(0.01, 0.08), 1e-4, 9.81)
        estimate = corrected(estimate, random.normal(size=2), np.eye(SIZE)[:2], 1e-8 * np.eye(2))
    np.testing.assert_array_equal(estimate.covariance, estimate.covariance.T)
    assert np.linalg.eigvalsh(estimate.covariance).min() >= -1e-15


def test_on_a_floor_gravity_tells_the_biases_of_the_accelerometer_and_nothing_else():
    before = Estimate.start(FLOOR)
    after = with_gravity(before, np.array([0.3, -0.2]), Late(0, 0), 1e-9, 0.0)
    np.testing.assert_allclose(after.mean[:6], before.mean[:6])
    np.testing.assert_allclose(after.covariance[:6], before.covariance[:6])
    np.testing.assert_allclose(after.mean[models.FORCE_BIASES], (0.3, -0.2), atol=1e-6)


@pytest.mark.parametrize("heading", [0.0, 1.0, 3.0])
def test_a_heading_from_gravity_is_as_uncertain_as_the_accelerometers_biases(heading):
    options = LocalizationOptions(acceleration_bias_deviation=0.2)
    true = np.array([0, 0, heading, 0, 0, 0, 0.1, -0.05, 0, 0])
    force = models.gravity(true, Late(0, 0), 9.81)
    told = math.atan2(force[0], force[1])
    estimate = Estimate.start(options).with_heading(told, 0.001, 9.81)
    for _ in range(20):  # more of the same tells no more
        estimate = with_gravity(estimate, force, Late(0, 0), 0.001, 9.81)
    assert estimate.deviation(HEADING) == pytest.approx(0.2 / 9.81, rel=0.02)
    for half_a_turn in (true, estimate.mean):  # which the gyro tells
        half_a_turn[HEADING] += math.pi
    force = models.gravity(true, Late(0, 0), 9.81)
    for _ in range(100):
        estimate = with_gravity(estimate, force, Late(0, 0), 0.001, 9.81)
    np.testing.assert_allclose(estimate.mean[models.FORCE_BIASES], (0.1, -0.05), atol=0.005)
    assert estimate.mean[HEADING] == pytest.approx(true[HEADING], abs=0.001)
    assert estimate.deviation(HEADING) < 0.1 * 0.2 / 9.81


def test_gravity_tells_the_heading_as_well_as_its_mean_does():
    """n samples of variance R: R / n / g², whatever the heading is."""
    for heading in np.linspace(-3, 3, 7):
        estimate = Estimate.start(UPRIGHT).with_heading(float(heading) + 0.01, 0.05, 9.81)
        true = np.array([0, 0, heading, *[0] * 7])
        force = models.gravity(true, Late(0, 0), 9.81)
        for _ in range(100):
            estimate = with_gravity(estimate, force, Late(0, 0), 0.01, 9.81)
        assert estimate.mean[HEADING] == pytest.approx(heading, abs=1e-4)
        assert estimate.deviation(HEADING) == pytest.approx(math.sqrt(0.01 / 100) / 9.81, rel=0.01)


def test_a_knock_moves_the_heading_by_a_bounded_amount():
    before = Estimate.start(UPRIGHT).with_heading(0.0, 0.001, 9.81)
    moved = []
    for force in (30.0, 300.0):
        after = with_gravity(before, np.array([force, 9.81]), Late(0, 0), 1e-3, 9.81)
        moved.append(abs(after.mean[HEADING]) / before.deviation(HEADING))
    assert max(moved) < math.sqrt(LARGEST_KNOCK)


def test_at_rest_the_gyro_tells_its_bias_unless_the_climber_turns():
    estimate = Estimate.start(UPRIGHT)
    for _ in range(200):
        estimate = with_yaw_rate_at_rest(estimate, 0.0087, 0.02**2)
    assert estimate.mean[BIAS] == pytest.approx(0.0087, rel=0.03)
    assert with_yaw_rate_at_rest(estimate, 0.5, 0.02**2) is estimate


def test_the_scale_error_forgets_in_its_time_and_keeps_its_deviation():
    start = Estimate.start(UPRIGHT)
    mean = start.mean.copy()
    mean[SCALE] = 0.02
    estimate = Estimate(mean, start.covariance)
    for _ in range(1000):
        estimate = predicted(estimate, Travel(0.01, 0.0, 0.0, 0.0, True), UPRIGHT)
    assert estimate.mean[SCALE] == pytest.approx(0.02 / math.e, rel=1e-6)
    assert estimate.deviation(SCALE) == pytest.approx(UPRIGHT.scale_deviation, rel=1e-3)


def test_what_an_earlier_run_has_told_of_creep_is_where_it_starts():
    start = Estimate.start(LocalizationOptions(initial_creep=0.03, creep_deviation=0.002))
    assert start.mean[models.CREEP] == 0.03
    assert start.deviation(models.CREEP) == 0.002
