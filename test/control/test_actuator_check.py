"""What is no dead wheel: numbers of healthy climbers that were stopped as if they had one."""

from climber_uk.control.actuator_check import (
    ASKED,
    LACKS_IN_A_ROW,
    STANDS_AT_ONCE,
    STANDS_ON,
    RimStop,
    Wheel,
)

LARGEST = 148.0  # [N] of a wheel's force


def test_a_rim_that_turns_back_is_not_stuck_and_one_that_does_not_heed_is():
    rim = RimStop()
    for asked in [0.004] * 20 + [0.0103]:  # the inner one of a bend as tight as the half track
        rim.add(0.0005, 0.24, asked)
    assert not rim.is_stuck
    for _ in range(STANDS_ON):
        rim.add(0.0005, 0.24, 1.5 * ASKED)
    assert rim.is_stuck


def test_a_rim_that_begins_as_slowly_as_the_other_one_is_stuck_if_it_does_not_heed():
    for asked, is_stuck in ((0.009, True), (0.006, False)):
        rim = RimStop()
        for _ in range(STANDS_ON):
            rim.add(0.0, 0.014, asked)
        assert rim.is_stuck == is_stuck


def test_a_rim_that_stops_at_once_is_stuck_whatever_is_asked():
    rim = RimStop()
    for speed in [0.1] * 5 + [0.0] * STANDS_AT_ONCE:
        rim.add(speed, 0.24, 0.0)
    assert rim.is_stuck


def lacks(missing, other_missing):
    """Whether a wheel asked for -62 N lacks its force, beside one asked for 104 N."""
    wheel, other = Wheel(), Wheel()
    found = []
    for _ in range(LACKS_IN_A_ROW):
        wheel.add(-62.0, -62.0 - missing, 0.0, 0.1)
        other.add(104.0, 104.0 - other_missing, 0.0, 0.1)
        found.append(wheel.lacks(other, LARGEST))
    return found[-1]


def test_a_moment_of_scrubbing_wheels_is_not_taken_for_a_dead_one():
    assert not lacks(-20.0, 14.0)
    assert lacks(-62.0, 14.0)
    assert lacks(-20.0, 5.0)
