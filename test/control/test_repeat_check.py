"""Odometry that tells again what it told before, and what only looks like it."""

import math

import pytest

from climber_uk.control.repeat_check import IN_A_ROW, KEPT, RepeatCheck
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import Motion

PERIOD, HALF_TRACK = 0.01, 0.3


def driven(times, speed=0.2, yaw_rate=0.3, each=1, step=0.0):
    """Motions of a climber that drives; `each` is told so often, in steps of the pose [m, rad]."""

    def told(value):
        return round(value / step) * step if step else value

    for i in range(times):
        time = PERIOD * (i // each)
        heading = told(0.1 + yaw_rate * time)
        c, s = math.cos(heading), math.sin(heading)
        yield Motion(told(speed * time), 1.0, heading, c, s, speed, yaw_rate)


def found(motions):
    """Of each message, by how much it is older than its stamp."""
    check, older = RepeatCheck(), []
    for number, motion in enumerate(motions):
        check.add(round(number * PERIOD * SECOND), motion, HALF_TRACK)
        older.append(check.older)
    return older


@pytest.mark.parametrize("back", [6, 20, 60])
@pytest.mark.parametrize("each", [1, 2])
def test_a_buffer_that_repeats_itself_is_found_until_it_tells_something_new(back, each):
    motions = [*driven(160, each=each)]
    told = found(motions[:100] + motions[100 - back :])
    again = [number for number, older in enumerate(told) if older]
    first = 100 + each * (IN_A_ROW - 1)
    assert again == [*range(first, 100 + back)]
    assert all(told[number] == pytest.approx(back * PERIOD) for number in again)


def test_so_is_one_that_repeats_itself_for_ever():
    motions = [*driven(40)]
    assert all(found(motions[:20] + 5 * motions[20:])[40 + IN_A_ROW :])


@pytest.mark.parametrize(
    "motions",
    [
        [*driven(100, each=5)],
        [*driven(100, speed=0.0, yaw_rate=0.0)],
        [*driven(200, speed=0.03, yaw_rate=0.0, step=0.01)],
        [*driven(30), *reversed([*driven(30)])],
        50 * [*driven(2, speed=0.02, yaw_rate=0.0)],
    ],
    ids=["told often", "rests", "in coarse steps", "comes back", "trembles"],
)
def test_what_rests_trembles_comes_back_or_is_told_often_is_no_repetition(motions):
    assert not any(found(motions))


def test_one_that_rests_where_the_repetition_ended_is_heard_again():
    motions = [*driven(40)]
    there = motions[-1]._replace(speed=0.0, yaw_rate=0.0)
    told = found([*motions, *motions[20:], there, there])
    assert told[-3] > 0.0
    assert told[-2:] == [0.0, 0.0]


def test_it_keeps_a_second_of_messages():
    check = RepeatCheck()
    for number, motion in enumerate(driven(500)):
        check.add(round(number * PERIOD * SECOND), motion, HALF_TRACK)
    assert len(check._told) <= KEPT / SECOND / PERIOD + 1
