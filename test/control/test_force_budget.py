"""Torque is given and no motion is told: a seal sticks, or odometry is stuck, or late."""

from dataclasses import replace

import pytest
from climbs import PERIOD, Climb
from test_lies import frozen

from climber_uk.control.safety import Mode

pytestmark = pytest.mark.slow


def test_odometry_that_is_stuck_from_the_start_stalls_and_lets_nothing_run_away():
    climb = Climb().run(2.5, odometry=frozen(pose=True, twist=True)())
    assert climb.controller.mode is Mode.STALLED
    assert "pushes moved nothing" in climb.controller.detail
    assert climb.fastest() < 1.5 * climb.reference_speed + 0.1
    assert climb.fastest(climb.time - 0.5) < 0.01


@pytest.mark.parametrize("delay", [0.1, pytest.param(0.15, marks=pytest.mark.soak)])
def test_odometry_that_nobody_told_to_be_late_from_the_start_lets_nothing_run_away(delay):
    states = []

    def late(_, state):
        states.append(state)
        return states[max(0, len(states) - 1 - round(delay / PERIOD))]

    climb = Climb().run(4.0, odometry=late)
    assert Mode.LATE in climb.modes
    assert climb.fastest() < 1.5 * climb.reference_speed + 0.1


def test_a_seal_that_holds_more_than_believed_is_followed():
    def truth(it):
        return replace(it, seal_friction_coefficient=1.4 * it.seal_friction_coefficient)

    climb = Climb(truth=truth).run(4.0)
    assert not any(mode.is_fault for mode in climb.modes)
    assert climb.fastest() > 0.1
