"""Log times against a system clock that is set, drifts and is looked at now and then."""

from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.bags.log_clock import STEP, LogClock

SECOND = 10**9
START = 1_700_000_000 * SECOND
FORWARDS = st.integers(3 * STEP, 3600 * SECOND)


class Clocks:
    """A steady clock, and a system clock that is some offset ahead of it."""

    def __init__(self):
        self.steady, self.offset = 5 * SECOND, START
        self.log = LogClock(lambda: self.steady + self.offset, lambda: self.steady)

    def received(self):
        return self.steady + self.offset

    def log_time(self, received):
        return received + self.log.shift(received)


@settings(deadline=None)
@given(
    st.lists(
        st.tuples(
            st.integers(1, SECOND),  # until the clock is set
            # by which it is: little enough is between two looks to tell what was before it
            st.one_of(st.just(0), st.integers(-3600 * SECOND, -3 * STEP), FORWARDS),
            st.integers(1, STEP),  # until the next look
        ),
        max_size=20,
    )
)
def test_log_times_rise_whatever_is_done_to_the_clock(changes):
    clocks, times = Clocks(), []
    for before, step, after in changes:
        clocks.steady += before
        clocks.log.look()
        before_step = clocks.received()
        clocks.offset += step
        clocks.steady += after
        after_step = clocks.received()
        assert clocks.log.look() == step
        times += [clocks.log_time(before_step), clocks.log_time(after_step)]
        assert times[-1] == clocks.log.at(clocks.steady)
        assert times[-1] >= after_step  # never behind the system clock
    assert all(earlier < later for earlier, later in pairwise(times))


def test_a_clock_that_is_set_back_and_right_again_is_the_system_clock():
    clocks = Clocks()
    for step, ahead in ((-100 * SECOND, 100), (-50 * SECOND, 150), (120 * SECOND, 30)):
        clocks.offset += step
        assert clocks.log.look() == step
        assert clocks.log.ahead == ahead * SECOND
    clocks.offset += 40 * SECOND
    clocks.log.look()
    assert clocks.log.ahead == 0


@pytest.mark.parametrize("drift", [-STEP // 2, STEP // 2])
def test_a_clock_that_drifts_is_followed(drift):
    clocks = Clocks()
    for _ in range(1000):
        clocks.offset += drift
        assert clocks.log.look() == 0
    assert clocks.log.at(clocks.steady) == clocks.received()
