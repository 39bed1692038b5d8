"""What is no dead wheel: numbers of healthy climbers that were stopped as if they had one."""

import math

import numpy as np
import pytest

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


def named_at(noise, share=0.0, since=math.inf, messages=2000, seed=1):
    """Message at which a wheel is named, of which a share of its force is missing since one.

    It is asked for 56 N of 148 N. What else does not act, beside the force, is noise of so much
    RMS [N] that lasts 17 ms, half as much at the other wheel; a message each 5 ms.
    """
    kept, weight = math.exp(-0.005 / 0.017), 1 - math.exp(-0.005 / 0.15)
    chance = np.random.default_rng(seed).normal(size=(messages, 2))
    wheel, other, off = Wheel(), Wheel(), np.zeros(2)
    for number in range(messages):
        off = kept * off + noise * math.sqrt(1 - kept * kept) * chance[number] * [1.0, 0.5]
        acts = 56.0 * (1 - share * (number >= since)) + off[0]
        wheel.add(56.0, acts, 0.0, weight)
        other.add(104.0, 104.0 + off[1], 0.0, weight)
        if wheel.lacks(other, LARGEST):
            return number
    return None


@pytest.mark.parametrize("noise", [6.0, 9.0])
def test_a_force_that_fluctuates_is_none_that_is_missing_all_at_once(noise):
    """As of four wheels that scrub with all their torque, with odometry by an IMU."""
    assert named_at(noise) is None


@pytest.mark.parametrize(("noise", "share"), [(0.0, 0.4), (3.0, 0.5), (6.0, 0.5), (6.0, 1.0)])
def test_a_force_that_is_missing_all_at_once_stands_out_of_what_fluctuates(noise, share):
    found = [named_at(noise, share, 400, 500, seed) for seed in range(4)]
    assert all(number is not None and 400 < number < 407 for number in found)
