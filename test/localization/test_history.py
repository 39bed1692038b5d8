"""A late fix is worth what it would have been in time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.localization.history import History, Sample
from climber_uk.localization.imu import Weight
from climber_uk.localization.kalman import Estimate, corrected
from climber_uk.localization.models import SIZE, Travel
from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import SECOND

OPTIONS, STEP = LocalizationOptions(longest_delay=0.5), SECOND // 200


def started():
    return History(OPTIONS, Estimate.start(OPTIONS).with_heading(0.3, 0.02, 9.81))


def sample(random):
    weight = Weight(*random.normal(5, 1, 2), 0.01, 0.02, 0.16) if random.random() < 0.5 else None
    return Sample(Travel(0.005, 0.001, 0.001, random.normal(), True), weight, random.random() < 0.2)


def fix(x, y):
    def correction(estimate):
        off = np.array([x, y]) - estimate.mean[:2]
        return corrected(estimate, off, np.eye(SIZE)[:2], 1e-3 * np.eye(2))

    return correction


@given(
    seed=st.integers(0, 2**32 - 1),
    fixes=st.lists(st.tuples(st.integers(0, 49), st.integers(0, 40)), max_size=6),
)
def test_fixes_that_come_late_in_any_order_give_what_they_give_in_time(seed, fixes):
    """Each is of a sample, and comes some samples later; those of one sample in that order."""
    random = np.random.default_rng(seed)
    samples = [sample(random) for _ in range(50)]
    places = random.normal(0, 0.05, size=(len(fixes), 2))
    arrivals = sorted(range(len(fixes)), key=lambda number: sum(fixes[number]))
    in_time, late = started(), started()
    for now, taken in enumerate(samples):
        in_time.add((now + 1) * STEP, taken)
        late.add((now + 1) * STEP, taken)
        for number in (n for n in arrivals if fixes[n][0] == now):
            in_time.correct(now, fix(*places[number]))
        for number in (n for n in arrivals if min(sum(fixes[n]), 49) == now):
            late.correct(late.at((fixes[number][0] + 1) * STEP), fix(*places[number]))
    np.testing.assert_allclose(late.latest.mean, in_time.latest.mean, atol=1e-9)
    np.testing.assert_allclose(late.latest.covariance, in_time.latest.covariance, atol=1e-12)


def test_a_second_is_kept_and_no_more():
    history, random = started(), np.random.default_rng(0)
    for now in range(400):
        history.add((now + 1) * STEP, sample(random))
    assert len(history.entries) == pytest.approx(0.5 * 200, abs=2)
    assert history.at(STEP) is None
    assert history.at(400 * STEP) == len(history.entries) - 1
    assert history.at(399 * STEP + 1) == len(history.entries) - 2


def test_between_two_samples_the_climber_goes_on_as_it_did():
    history = started()
    entry = history.add(STEP, Sample(Travel(0.005, 0.001, 0.001, 0.4, False)))
    x, y, heading = entry.pose(STEP + STEP // 2) - entry.estimate.mean[:3]
    assert np.hypot(x, y) == pytest.approx(0.0005)
    assert heading == pytest.approx(0.001)
