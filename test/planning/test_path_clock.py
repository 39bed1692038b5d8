"""The rate of a trajectory's own time goes to what is asked for, and is never beyond all of it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.planning.path_clock import PathClock

ASKED = st.lists(st.tuples(st.floats(0.01, 3.0), st.floats(-1.0, 1.0)), max_size=8)


def asked(changes, ramp_time=1.0):
    """Clock after changes (seconds after the one before, rate), and when each began."""
    clock, time = PathClock(ramp_time), 0.0
    for wait, rate in changes:
        time += wait
        clock = clock.changed(time, rate, time - 0.005)
    return clock, time


@given(ASKED)
def test_every_derivative_is_the_difference_of_the_one_below(changes):
    clock, end = asked(changes)
    time, h = np.linspace(end - 0.004, end + 1.5, 301), 1e-6
    before, here, after = (clock.at(time + shift) for shift in (-h, 0, h))
    for order in range(3):
        difference = (after[order] - before[order]) / (2 * h)
        np.testing.assert_allclose(here[order + 1], difference, atol=1e-4)


@given(ASKED)
def test_a_change_leaves_the_past_alone(changes):
    clock, end = asked(changes)
    changed = clock.changed(end + 0.3, 0.123, end)
    time = np.linspace(end, end + 0.3, 31)
    for before, after in zip(clock.at(time), changed.at(time), strict=True):
        np.testing.assert_allclose(after, before, atol=1e-12)


@given(ASKED)
def test_the_rate_stays_between_those_asked_for_and_is_the_last_one_in_the_end(changes):
    rates, time = [1.0], 0.0
    clock = PathClock(1.0)
    for wait, rate in changes:
        seen = clock.at(np.linspace(time, time + wait, 50))[1]
        assert min(rates) - 1e-12 <= seen.min()
        assert seen.max() <= max(rates) + 1e-12
        time += wait
        clock = clock.changed(time, rate, time)
        rates.append(rate)
    settled = clock.at(clock.settles() + 0.1) if changes else clock.at(9.0)
    assert settled[1] == pytest.approx(rates[-1], abs=1e-12)
    assert settled[2] == pytest.approx(0, abs=1e-12)


def test_it_rests_exactly_and_has_lost_half_the_ramp():
    """By hand: from rate 1 to 0 in T it goes T/2 on."""
    clock = PathClock(0.8).changed(2.0, 0.0, 1.7)
    for time in (2.81, 50.0):
        np.testing.assert_allclose(clock.at(time), [2.4, 0, 0, 0], atol=1e-15)


@given(ASKED)
def test_the_rate_changes_no_faster_than_in_one_ramp_between_its_extremes(changes):
    clock, end = asked(changes, 0.7)
    rates = [1.0, *(rate for _, rate in changes)]
    most = 15 / 8 * (max(rates) - min(rates)) / 0.7
    change = clock.at(np.linspace(end - 0.004, end + 1.0, 401))[2]
    assert np.abs(change).max() <= most + 1e-9


def test_it_turns_round_by_way_of_rest_and_what_has_not_begun_is_taken_back():
    clock = PathClock(0.8).turned(2.0, -0.5, 1.7)
    np.testing.assert_allclose(clock.at(2.8)[:3], [2.4, 0, 0], atol=1e-12)
    np.testing.assert_allclose(clock.at(3.6)[:3], [2.2, -0.5, 0], atol=1e-12)  # -0.5 T/2
    for rate in (0.0, 1.0):
        back = clock.turned(2.5, rate, 2.3)
        assert back.asked == rate
        assert back.at(np.linspace(2.3, 9.0, 99))[1].min() >= -1e-12
