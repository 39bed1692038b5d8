"""Parts of the safe output; what it does to a climber is in test_guard.py and test_polarity.py."""

import numpy as np
import pytest
from climbs import Climb
from test_delay_check import Late

from climber_uk.control.safe_output import FALLS, LONGEST_EFFECT, SealCheck

PERIOD = 0.01  # [s]
soak = pytest.mark.soak


def told(check, speeds, is_driven=False):
    """Whether the seal gives way, after speeds [m/s] one period apart."""
    for speed in speeds:
        check.add(is_driven, speed, PERIOD, goes_down=False)
    return check.gives_way


def rising(by, seconds):
    """Speeds [m/s] from 5 cm/s on, at a steady acceleration."""
    count = round(seconds / PERIOD)
    return [0.05 + by * (number + 1) / count for number in range(count)]


@pytest.mark.parametrize(
    ("speeds", "is_driven", "gives_way"),
    [
        (rising(0.0, 5.0), False, False),  # it slides steadily
        (rising(1.0, 2.0), True, False),  # its motors do that
        (rising(3.0, 0.9 * LONGEST_EFFECT), False, False),  # or did: torques may act late
        (rising(0.9 * FALLS, LONGEST_EFFECT) + rising(0.9 * FALLS, 2.0), False, False),
        (rising(1.0, 2.0), False, True),
    ],
)
def test_a_seal_gives_way_once_who_is_not_driven_gets_faster(speeds, is_driven, gives_way):
    check = SealCheck()
    assert told(check, speeds, is_driven) == gives_way
    assert told(check, rising(0.0, 1.0), is_driven=True) == gives_way  # and stays so


@pytest.mark.parametrize(("goes_down", "slows", "found"), [(1, 0, 1), (1, 1, 0), (0, 0, 0)])
def test_who_goes_down_faster_whenever_it_is_left_is_not_held(goes_down, slows, found):
    """Though a torque that should brake it comes again and again; a seal that holds slows it."""
    check, speed = SealCheck(), 0.1
    for _ in range(6):
        for driven in [True] * 5 + [False] * 30:
            speed += PERIOD * (0.5 if driven else (-0.4 if slows else 1.0))
            check.add(driven, speed, PERIOD, goes_down=bool(goes_down))
    assert check.gives_way == found


def test_a_torque_now_and_then_begins_the_wait_anew():
    check = SealCheck()
    for _ in range(10):
        assert not told(check, rising(1.0, 0.9 * LONGEST_EFFECT))
        assert not told(check, [1.05], is_driven=True)


@pytest.mark.parametrize(
    ("moment", "delay"),
    [(1.0, 0.0), (3.0, 0.02), *(pytest.param(*it, marks=soak) for it in ((1.0, 0.1), (3.0, 0.1)))],
)
def test_what_turns_it_steadily_turns_it_no_more_once_it_is_disabled(moment, delay):
    """As a centre of mass beside the axle, or a cable: .6 rad/s, and 54 for 3 N m 20 ms late."""
    climb = Climb()
    late = Late(delay, climb.torques)
    climb.run(2.0, motors=late)
    climb.controller.enable(False)
    climb.run(5.0, motors=late, push=np.array([0.0, 0.0, moment]))
    assert climb.fastest_turn(2.0) < 3.4
    assert climb.fastest_turn(climb.time - 0.5) < 0.3
