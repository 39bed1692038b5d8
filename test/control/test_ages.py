import pytest

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
    ("least", "offset"), [(0.02, 0.0), (0.021, 0.021), (-0.02, 0.0), (-0.021, -0.021)]
)
def test_what_no_latency_explains_is_the_offset_of_the_clocks(least, offset):
    ages = ages_of((10.0, least))
    assert ages.offset(0.02) == offset
    for more, latency in ((-0.01, 0.0), (0.01, 0.01), (0.03, 0.02)):
        assert ages.latency(offset + more, 0.02) == pytest.approx(latency)
