import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.simulation.command_buffer import MOST, CommandBuffer


def test_what_is_sent_acts_from_its_time_on_and_the_last_to_begin_acts():
    schedule = CommandBuffer()
    schedule.add(10, "first")
    schedule.add(20, "second")
    assert [schedule.at(time)[0] for time in (9, 10, 19, 20, 1000)] == [
        None,
        "first",
        "first",
        "second",
        "second",
    ]


def test_what_was_to_begin_later_than_the_last_one_sent_is_dropped():
    schedule = CommandBuffer()
    schedule.add(10, "first")
    schedule.add(30, "overtaken")
    schedule.add(20, "last")
    assert [schedule.at(time)[0] for time in (15, 20, 40)] == ["first", "last", "last"]


def test_of_two_at_one_time_the_later_acts():
    schedule = CommandBuffer()
    schedule.add(10, "one")
    schedule.add(10, "other")
    assert schedule.at(10) == ("other", False)


@pytest.mark.parametrize(
    ("time", "acts", "is_stale"),
    [(9, None, False), (10, "one", False), (110, "one", False), (111, None, True)],
)
def test_after_its_timeout_nothing_acts_and_that_is_told(time, acts, is_stale):
    schedule = CommandBuffer(timeout=100)
    schedule.add(10, "one")
    assert schedule.at(time) == (acts, is_stale)


def test_what_comes_while_time_stands_still_does_not_grow():
    schedule = CommandBuffer()
    for number in range(3 * MOST):
        schedule.add(10, number)
    assert len(schedule._coming) == MOST
    assert schedule.at(10) == (3 * MOST - 1, False)


def test_an_empty_one_is_not_stale():
    assert CommandBuffer(timeout=1).at(1000) == (None, False)


@given(st.lists(st.integers(0, 20), max_size=8), st.lists(st.integers(0, 20), min_size=1))
def test_it_is_what_a_list_of_all_that_was_sent_says(begins, times):
    """Sent in order, each drops those that begin after it; what acts is the last that has begun."""
    schedule, kept = CommandBuffer(), []
    for value, begin in enumerate(begins):
        schedule.add(begin, value)
        kept = [(earlier, sent) for earlier, sent in kept if earlier <= begin] + [(begin, value)]
    for time in sorted(times):
        acting = [value for begin, value in kept if begin <= time]
        assert schedule.at(time) == (acting[-1] if acting else None, False)
