"""Backwards through the estimates, beside all of it at once: conditioning one large Gaussian."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.localization import models
from climber_uk.localization.history import Entry, History, Sample
from climber_uk.localization.kalman import Estimate, corrected, predicted_with_jacobian
from climber_uk.localization.models import SIZE, Travel
from climber_uk.localization.options import LocalizationOptions
from climber_uk.localization.smoother import smoothed

OPTIONS = LocalizationOptions(initial_heading_deviation=0.05)
NOISE = 0.02**2 * np.eye(2)
H = np.eye(SIZE)[:2]


def driven(seed, count=8, anew=()):
    """Entries of a climber that drives and turns, with a fix at every second one, and the fixes."""
    random, history, fixes = np.random.default_rng(seed), History(OPTIONS, START), {}
    for number in range(count):
        travel = Travel(0.1, random.uniform(0, 0.1), 0.1, random.normal(0, 0.5), True)
        history.add(10**8 * (number + 1), Sample(travel))
        if number % 2:
            fixes[number] = history.latest.mean[:2] + random.normal(0, 0.02, 2)

            def correction(estimate, at=fixes[number]):
                return corrected(estimate, at - estimate.mean[:2], H, NOISE)

            history.correct(number, correction, anew=number in anew)
    return history.entries, fixes


START = Estimate.start(OPTIONS)


def at_once(entries, fixes):
    """Means (n, 8) and covariances (n, 8, 8) by all fixes, of the model as the filter takes it."""
    means, crossed, before = [], np.zeros((0, 0)), START
    for entry in entries:
        ahead, jacobian = predicted_with_jacobian(before, entry.sample.travel, OPTIONS)
        noise = np.diag(models.process_noise(entry.sample.travel, OPTIONS))
        if means:
            means.append(ahead.mean + jacobian @ (means[-1] - before.mean))
            rows = jacobian @ crossed[-SIZE:]
            corner = jacobian @ crossed[-SIZE:, -SIZE:] @ jacobian.T + noise
            crossed = np.block([[crossed, rows.T], [rows, corner]])
        else:
            means, crossed = [ahead.mean], jacobian @ before.covariance @ jacobian.T + noise
        before = entry.estimate
    mean = np.concatenate(means)
    told = np.zeros((2 * len(fixes), len(mean)))
    for row, number in enumerate(fixes):
        told[2 * row : 2 * row + 2, SIZE * number : SIZE * number + SIZE] = H
    off = np.concatenate(list(fixes.values())) - told @ mean
    gain = (
        crossed
        @ told.T
        @ np.linalg.inv(told @ crossed @ told.T + np.kron(np.eye(len(fixes)), NOISE))
    )
    mean, crossed = mean + gain @ off, crossed - gain @ told @ crossed
    parts = [slice(SIZE * k, SIZE * k + SIZE) for k in range(len(entries))]
    return [mean[part] for part in parts], [crossed[part, part] for part in parts]


@given(seed=st.integers(0, 2**32 - 1))
def test_going_back_gives_what_all_of_it_at_once_gives(seed):
    entries, fixes = driven(seed)
    means, covariances = at_once(entries, fixes)
    for found, mean, covariance in zip(smoothed(entries, OPTIONS), means, covariances, strict=True):
        np.testing.assert_allclose(found.mean, mean, atol=1e-6)
        np.testing.assert_allclose(found.covariance, covariance, atol=1e-8)


def test_what_is_believed_anew_says_nothing_of_before():
    entries, _ = driven(1, anew=(5,))
    found, alone = smoothed(entries, OPTIONS), smoothed(entries[:5], OPTIONS)
    for one, other in zip(found[:5], alone, strict=True):
        np.testing.assert_array_equal(one.mean, other.mean)
    assert found[-1] is entries[-1].estimate
    assert isinstance(entries[5], Entry)
    assert entries[5].anew
    assert found[0].deviation(0) == pytest.approx(alone[0].deviation(0))
