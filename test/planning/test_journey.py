"""Stick, paths from outside, starts and pauses at any time: no torque jumps as one takes over."""

import numpy as np
import pytest
from random_paths import random_path
from test_given_path import MANNER
from under_way import Travelling

from climber_uk.control.safety import Mode
from climber_uk.planning.given_path import planned

JUMP = 0.2  # [N m] from one odometry to the next, 5 ms later


def some_path(random, place=None):
    """A path that can be driven; it begins near a place (2,) [m]."""
    while True:
        _, places = random_path(random)
        if place is not None:
            places = places - places[0] + place + random.normal(0, 0.2, 2)
        try:
            return planned(places, MANNER)[0]
        except ValueError:
            continue


def travel(random, number):
    """Have an operator ask for `number` things; return the largest jump of a torque [N m]."""
    climber = Travelling(some_path(random)).run(5.0)
    asked = {
        "pause": climber.pause,
        "go on": climber.go_on,
        "speed": lambda: climber.set_speed(random.uniform(0.2, 1.0)),
        "back": climber.retreat,
        "another path": lambda: climber.replace(some_path(random, climber.places[-1])),
        "start": climber.start,
        "stick": lambda: [
            climber.stick(random.uniform(-0.3, 0.3), random.uniform(-0.5, 0.5))
            for _ in range(random.integers(3, 30))
        ],
    }
    for _ in range(number):
        asked[random.choice(list(asked), p=[0.2, 0.3, 0.1, 0.05, 0.1, 0.1, 0.15])]()
        climber.run(random.exponential(1.5) + 0.05)
    assert set(climber.modes) <= {Mode.FOLLOWING, Mode.APPROACHING}
    assert max(abs(state.forward_speed) for state in climber.states) <= 1.02 * 0.2
    return climber.largest_jump


def test_whatever_takes_over_no_torque_jumps():
    assert travel(np.random.default_rng(11), 4) <= JUMP


@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_two_hundred_times():
    assert travel(np.random.default_rng(1), 200) <= JUMP
