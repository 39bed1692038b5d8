"""The time that a reference has lost is the integral of 1 - σ, and σ follows its own rate."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.control.time_scaling import Pace, Pacing

PACING = Pacing(catch_up=0.25, recovery_time=2.0, settling_time=0.4)


@given(st.floats(0.5, 5), st.floats(0.5, 1.25), st.floats(-1, 1), st.floats(1e-3, 0.1))
def test_lag_grows_by_what_the_rate_lacks_of_one(lag, rate, change, time):
    """Of a rate that changes evenly the integral is exact: its mean, times the time."""
    after = Pace(lag, rate, change).after(time, PACING)
    assert after.rate == pytest.approx(rate + change * time)
    assert after.lag == pytest.approx(lag + time * (1 - rate - change * time / 2))


def test_in_many_steps_it_is_what_it_is_in_one():
    pace, step = Pace(1.0, 0.5, 0.8), 1e-3
    for _ in range(100):
        pace = pace.after(step, PACING)._replace(change=0.8)
    once = Pace(1.0, 0.5, 0.8).after(0.1, PACING)
    assert (pace.lag, pace.rate) == pytest.approx((once.lag, once.rate))


@pytest.mark.parametrize(
    ("lag", "wanted"),
    [(0.2, 1.1), (0.5, 1.25), (3.0, 1.25)],  # 1 + lag / recovery_time, at most 1 + catch_up
)
def test_the_rate_goes_to_what_makes_up_for_the_lag(lag, wanted):
    after = Pace(lag, 1.0, 0.0).after(1e-9, PACING)
    assert after.change == pytest.approx((wanted - 1.0) / PACING.settling_time, rel=1e-6)


def test_neither_lag_nor_rate_falls_below_zero():
    assert Pace(0.001, 1.25, 0.0).after(0.1, PACING).lag == 0
    assert Pace(1.0, 0.1, -5.0).after(0.1, PACING).rate == 0
