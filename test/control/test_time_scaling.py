import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.active_reference import Progress
from climber_uk.control.time_scaling import Pace, Pacing
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory

PREVIEW = sampled(Trajectory(Ellipse(), ConstantRate()), 20.0)
PACING = Pacing()
STEP = 0.005  # [s]


@given(st.floats(0, 5), st.floats(0.1, 1.5), st.floats(-0.5, 0.5), st.floats(6, 18))
def test_a_paced_reference_is_the_derivative_of_itself(lag, rate, change, time):
    """Lag and rate move on as they say; central differences of 1 ms agree to their order."""
    h = 1e-3

    def at(since):
        pace = Pace(
            lag=lag + since * (1 - rate) - since**2 / 2 * change,
            rate=rate + since * change,
            change=change,
        )
        return Reference.of(pace.target(PREVIEW, SECOND + round((time + since) * SECOND)))

    before, here, after = at(-h), at(0.0), at(h)
    gone = after.pose - before.pose
    gone[2] = wrapped(gone[2])  # where a piece ends, the next one may begin a turn away
    np.testing.assert_allclose(here.velocity, gone / (2 * h), atol=2e-3)
    expected = (after.velocity - before.velocity) / (2 * h)
    np.testing.assert_allclose(here.acceleration, expected, atol=2e-3)
    jerk = (after.acceleration - before.acceleration)[:2] / (2 * h)
    np.testing.assert_allclose(here.jerk, jerk, atol=2e-2)


def test_at_its_own_pace_the_reference_is_untouched():
    time = 3 * SECOND
    assert Pace().target(PREVIEW, time) == PREVIEW.target(time)
    assert Pace().after(STEP, PACING) == Pace()


def test_lost_time_is_made_up_for_without_running_ahead():
    pace, lags = Pace(lag=2.0, rate=0.3), []
    for _ in range(4000):
        pace = pace.after(STEP, PACING)
        lags.append(pace.lag)
        assert 0 <= pace.rate <= 1 + PACING.catch_up
    assert min(lags) >= 0
    assert lags[-1] < 1e-4
    assert pace.rate == pytest.approx(1.0, abs=1e-3)


def test_what_is_missing_is_no_longer_asked_for():
    time = SECOND + round(2.3 * SECOND)
    pace = Pace(lag=0.4, rate=0.8, change=0.5)
    slower = pace.slowed(2.0, PREVIEW, time, STEP)
    before, after = (Reference.of(p.target(PREVIEW, time)) for p in (pace, slower))
    assert before.forward_acceleration - after.forward_acceleration == pytest.approx(2.0)
    np.testing.assert_array_equal(before.velocity, after.velocity)


def test_time_never_runs_backwards_and_a_reference_at_rest_is_not_waited_for():
    pace = Pace(rate=0.01).slowed(1e6, PREVIEW, 3 * SECOND, STEP)
    assert pace.after(STEP, PACING).rate == 0.0
    still = type(PREVIEW)(PREVIEW.times, 0 * PREVIEW.pose, 0 * PREVIEW.pose, 0 * PREVIEW.pose)
    assert Pace().slowed(5.0, still, 3 * SECOND, STEP) == Pace()
    assert Pace().slowed(-5.0, PREVIEW, 3 * SECOND, STEP) == Pace()  # braking is not missing


@pytest.mark.parametrize(
    ("progress", "lag", "waited"),
    [
        (Progress(SECOND, 0, Pace(lag=6.0)), 5.0, 1.0),  # a longer lag shifts the rest
        (Progress(SECOND, 2 * SECOND, Pace(lag=4.0)), 4.0, 2.0),
        (Progress(SECOND, 0, Pace(lag=0.5, rate=0.5), is_restarting=True), 0.0, 0.5),
    ],
)
def test_time_that_is_not_made_up_for_is_waited(progress, lag, waited):
    later = progress.advanced(SECOND + 1, Pacing())
    assert later.pace.lag == pytest.approx(lag, abs=1e-6)
    assert later.waited / SECOND == pytest.approx(waited, abs=1e-6)
    assert later.at(SECOND) == pytest.approx(progress.at(SECOND), abs=10)  # [ns]


@pytest.mark.parametrize(("passed", "goes_on"), [(0.29, True), (0.31, False), (-0.1, False)])
def test_over_a_gap_the_reference_stands_still(passed, goes_on):
    time = SECOND + round(passed * SECOND)
    later = Progress(SECOND, 0).advanced(time, Pacing())
    assert later.at(time) == (time if goes_on else SECOND)
