import itertools

import pytest
from climbs import PERIOD, Climb

from climber_uk.control.timing import Ages
from climber_uk.mechanics import SECOND


def ages_of(*rows):
    """Ages [s] of odometry that came at times [s]."""
    ages = Ages()
    for time, age in rows:
        ages.add(round(time * SECOND), age)
    return ages


@pytest.mark.parametrize(
    ("rows", "least"),
    [
        ([], 0.0),
        ([(10.0, 0.01), (10.2, 0.03), (10.4, 0.05)], 0.01),
        ([(10.0, 0.01), (10.6, 0.03)], 0.01),  # half a second ago is of late
        ([(10.0, 0.03), (10.6, 0.01)], 0.01),
        ([(10.0, 0.01), (10.6, 0.03), (11.2, 0.04)], 0.03),  # more than a second is not
        ([(10.0, 0.01), (9.0, 0.03), (8.0, 0.02)], 0.02),  # a clock that goes back begins anew
        ([(10.0, -0.01), (10.1, 0.03)], -0.01),
    ],
)
def test_the_least_age_is_that_of_the_last_half_to_whole_second(rows, least):
    assert ages_of(*rows).least == least


@pytest.mark.parametrize(
    ("least", "offset"), [(0.02, 0.0), (0.025, 0.005), (0.09, 0.07), (-0.02, 0.0), (-0.021, -0.021)]
)
def test_what_no_latency_explains_is_the_offset_of_the_clocks(least, offset):
    ages = ages_of((10.0, least))
    assert ages.offset(0.02) == pytest.approx(offset)
    for age in (least, least + 0.01, least + 0.06):
        assert ages.latency(age, 0.02) == pytest.approx(max(age - offset, 0.0))


def test_latency_grows_without_a_step_as_odometry_grows_older():
    latencies = [ages_of((10.0, 1e-3 * age)).latency(1e-3 * age, 0.02) for age in range(100)]
    assert max(abs(b - a) for a, b in itertools.pairwise(latencies)) <= 1e-3 + 1e-9
    assert latencies[-1] == pytest.approx(0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    "age", [*(pytest.param(age, marks=pytest.mark.soak) for age in (0.02, 0.03, 0.06)), 0.045, 0.07]
)
def test_odometry_that_is_always_late_is_followed_without_a_swing(age):
    states = []

    def late(_, state):
        states.append(state)
        return states[max(0, len(states) - 1 - round(age / PERIOD))]

    climb = Climb(learn_delay=False).run(6.0, odometry=late, clock=age)
    assert not any(mode.is_fault for mode in climb.modes)
    assert climb.off_the_path() < 0.01
    assert climb.fastest_turn() < 0.6
