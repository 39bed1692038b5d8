"""Odometry that tells again what it told before, and what only looks like it."""

import math

import numpy as np
import pytest

from climber_uk.control.repeat_check import BACK, IN_A_ROW, KEPT, RepeatCheck
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


@pytest.mark.parametrize("back", [6, 24, 60])
@pytest.mark.parametrize("each", [1, 2])
def test_a_buffer_that_repeats_itself_is_found_until_it_tells_something_new(back, each):
    motions = [*driven(160, each=each)]
    told = found(motions[:100] + motions[100 - back :])
    again = [number for number, older in enumerate(told) if older]
    leaps = 0.2 * PERIOD * back / each > BACK  # which shows at once
    first = 100 if leaps else 100 + each * (IN_A_ROW - 1)
    assert again == [*range(first, 100 + back)]
    assert not again or told[99 + back] == pytest.approx(back * PERIOD)


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


@pytest.mark.parametrize("speed", [0.2, -0.2, 0.05])
@pytest.mark.parametrize("back", [12.5, 40.5, 80.5])
def test_one_that_leaps_back_along_its_way_is_as_old_as_that_way(back, speed):
    """No message of it was told before: it tells what was between two."""
    motions = [*driven(400, speed=speed, yaw_rate=0.0)]
    gone = speed * back * PERIOD
    later = [motion._replace(x=motion.x - gone * motion.cosine) for motion in motions[200:]]
    later = [it._replace(y=it.y - gone * it.sine) for it in later]
    told = found(motions[:200] + later)
    again = [number for number, older in enumerate(told) if older]
    if abs(gone) < BACK:
        assert not again
        return
    assert again == [*range(200, 200 + math.ceil(back))]
    assert all(told[number] == pytest.approx(back * PERIOD, abs=0.6 * PERIOD) for number in again)


@pytest.mark.parametrize("noise", [1e-3, 5e-3, 2e-2])
def test_noise_of_the_pose_is_no_leap(noise):
    random = np.random.default_rng(1)
    off = noise * np.clip(random.normal(size=(400, 2)), -2.5, 2.5)
    off *= np.minimum(np.arange(400) / 40, 1.0)[:, None]
    motions = driven(400)
    noisy = zip(motions, off, strict=True)
    assert not any(found([it._replace(x=it.x + x, y=it.y + y) for it, (x, y) in noisy]))


@pytest.mark.parametrize("speeds", [(0.0, 0.5), (-0.3, 0.3), (1.0, 2.0)])
def test_what_changes_its_speed_at_once_leaps_back_nowhere(speeds):
    """At 5 Hz: from one message to the next it goes as far as both speeds tell."""
    check, before, after = RepeatCheck(), *speeds
    ways = np.cumsum([*5 * [0.2 * before], 0.1 * (before + after), *5 * [0.2 * after]])
    for number, x in enumerate(ways):
        speed = before if number < 5 else after
        check.add(round(0.2 * number * SECOND), Motion.at(x, 0.0, 0.0, speed, 0.0), HALF_TRACK)
        assert not check.older


def test_what_a_fix_corrects_by_less_or_more_than_a_second_of_the_way_is_no_repetition():
    motions = [*driven(200, yaw_rate=0.0)]
    for corrected in (0.87 * BACK, 0.2113):
        fixed = [it._replace(x=it.x - corrected) for it in motions[100:]]
        assert not any(found(motions[:100] + fixed))
