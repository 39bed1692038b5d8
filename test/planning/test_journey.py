"""Stick, paths from outside, starts and pauses at any time: no torque jumps as one takes over."""

import numpy as np
import pytest
from moments import moments, off_line, some_path
from under_way import Travelling

from climber_uk.control.safety import Mode

SHARES = {
    **{"pause": 0.2, "go on": 0.3, "speed": 0.1, "back": 0.05},
    **{"another path": 0.1, "start": 0.1, "stick": 0.15},
}


def travel(random, number):
    """Have an operator ask for `number` things, and assert what holds all along."""
    climber = Travelling(some_path(random)).run(5.0)
    assert max(back for *_, back in moments(climber, random, number, SHARES)) <= 1e-9  # [s]
    assert set(climber.modes) <= {Mode.FOLLOWING, Mode.APPROACHING}
    assert max(abs(state.forward_speed) for state in climber.states) <= 1.02 * 0.2
    assert off_line(climber) <= 10  # [mm]
    assert climber.largest_jump <= 0.2  # [N m] from one odometry to the next, 5 ms later


def test_whatever_takes_over_no_torque_jumps_and_the_path_is_kept():
    travel(np.random.default_rng(11), 4)


@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_two_hundred_times():
    travel(np.random.default_rng(1), 200)
