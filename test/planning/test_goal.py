"""What becomes of a path that somebody waits for."""

import numpy as np
import pytest
from test_given_path import MANNER

from climber_uk.mechanics import SECOND
from climber_uk.planning.by_hand import HandOptions
from climber_uk.planning.course import CourseOptions
from climber_uk.planning.given_path import planned
from climber_uk.planning.goal import Fate, fate
from climber_uk.planning.journey import BACK, HAND, PATH, Journey

ONE, OTHER = (planned(np.array([[0.0, y], [1.0, y]]), MANNER)[0] for y in (0.0, 1.0))
POSE, START = np.zeros(3), SECOND
END = START + round(ONE.duration * SECOND)
MIDDLE = (START + END) // 2


def under_way(trajectory=ONE):
    journey = Journey(trajectory, CourseOptions(), HandOptions(), lambda reference, time: time)
    journey.start(START, POSE, 0)
    return journey


def rest(journey, since=MIDDLE):
    """Position at which what is under way has come to rest."""
    position = since
    while not journey.under_way.rests(position):
        position += SECOND // 10
    return position


def test_a_path_is_done_where_it_ends():
    journey = under_way()
    assert fate(journey, ONE, MIDDLE) is Fate.DRIVEN
    assert fate(journey, ONE, END - SECOND // 10) is Fate.DRIVEN
    assert fate(journey, ONE, END) is Fate.DONE


def test_a_path_waits_for_what_is_driven_to_rest_and_begins_then():
    journey = under_way(OTHER)
    journey.planned = ONE
    assert fate(journey, OTHER, MIDDLE) is Fate.REPLACED
    assert not journey.begin(PATH, MIDDLE, True)[0]
    assert fate(journey, ONE, MIDDLE) is Fate.BEGINS
    at_rest = rest(journey)
    assert journey.begin(PATH, at_rest, True)[0]
    assert fate(journey, ONE, at_rest) is Fate.BEGINS
    journey.start(at_rest, POSE, at_rest)
    assert fate(journey, ONE, at_rest) is Fate.DRIVEN


def test_it_is_left_for_a_stick_for_the_way_back_and_for_good_if_another_is_gone_back_to():
    journey = under_way()
    journey.retreat(MIDDLE)
    assert fate(journey, ONE, MIDDLE) is Fate.BACK
    journey = under_way()
    journey.begin(HAND, END, True)
    journey.start(END, POSE, END)
    assert fate(journey, ONE, END) is Fate.BY_HAND
    journey.planned = OTHER
    journey.begin(BACK, END, False)
    journey.start(END, POSE, END)
    assert fate(journey, OTHER, END) is Fate.REPLACED
    assert all(what.is_left for what in (Fate.BACK, Fate.BY_HAND, Fate.REPLACED))


@pytest.mark.parametrize("what", [PATH, HAND, BACK])
@pytest.mark.parametrize("was_paused", [False, True])
def test_a_halt_ends_with_what_is_begun_and_a_pause_that_was_asked_for_does_not(what, was_paused):
    journey = under_way()
    if was_paused:
        journey.pause(MIDDLE)
    journey.halt(MIDDLE)
    journey.halt(MIDDLE)
    assert journey.is_paused
    assert rest(journey) < END
    journey.begin(what, rest(journey), True)
    assert journey.is_paused is was_paused
    journey.halt(MIDDLE)
    journey.pause(MIDDLE)
    journey.begin(what, rest(journey), True)
    assert journey.is_paused


def test_what_was_to_begin_does_not_after_a_halt_until_something_is_begun():
    journey = under_way(OTHER)
    journey.planned = ONE
    journey.begin(PATH, MIDDLE, True)
    journey.halt(MIDDLE)
    assert journey.is_halted
    assert not journey.waits_for_rest
    journey.begin(PATH, rest(journey), True)
    assert not journey.is_halted
    assert not journey.is_paused


def test_who_starts_or_goes_on_after_a_halt_is_not_paused():
    journey = under_way()
    journey.halt(MIDDLE)
    journey.go_on(MIDDLE)
    assert not journey.is_halted
    assert not journey.is_paused
    journey.pause(MIDDLE)
    journey.halt(MIDDLE)
    journey.is_paused = False  # as ~/start does
    journey.begin(PATH, rest(journey), True)
    assert not journey.is_paused
