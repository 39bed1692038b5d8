"""Torque is given and no motion is told: a seal sticks, or odometry is stuck, or late."""

from dataclasses import replace

import numpy as np
import pytest
from climbs import PERIOD, Climb
from test_lies import frozen

from climber_uk.control.safety import Mode
from climber_uk.mechanics.quantities import State

CIRCLE = {
    **{"shape": "ellipse", "ellipse.semi_axis_x": 0.8, "ellipse.semi_axis_y": 0.8},
    **{"rest_to_rest.rate": 0.25, "rest_to_rest.ramp_time": 3.0},
}

pytestmark = pytest.mark.slow


def test_odometry_that_is_stuck_from_the_start_stalls_and_lets_nothing_run_away():
    climb = Climb().run(2.5, odometry=frozen(pose=True, twist=True)())
    assert climb.controller.mode is Mode.STALLED
    assert "pushes moved nothing" in climb.controller.detail
    assert climb.fastest() < 1.5 * climb.reference_speed + 0.1
    assert climb.fastest(climb.time - 0.5) < 0.01


@pytest.mark.parametrize(
    "offset", [(0.03, 0.0, 0.0), (0.0, 0.03, 0.0), (0.0, 0.0, 0.2), (0.03, -0.03, -0.15)], ids=str
)
@pytest.mark.parametrize("planner", [{}, pytest.param(CIRCLE, marks=pytest.mark.soak)])
@pytest.mark.parametrize("scrubs", [False, pytest.param(True, marks=pytest.mark.soak)])
def test_odometry_that_is_stuck_turns_nothing_away_that_is_to_be_elsewhere(offset, planner, scrubs):
    climb = Climb(planner=planner, offset=offset, scrubs=scrubs)
    climb.run(3.0, odometry=frozen(pose=True, twist=True)())
    print(f"{climb.fastest():.2f} m/s, {climb.fastest_turn():.2f} rad/s")
    assert climb.controller.mode is Mode.STALLED
    assert climb.fastest() < 1.5 * climb.reference_speed + 0.1
    assert climb.fastest_turn() < 0.5


class Encoders:
    """Odometry made of two encoders, which stand from some times [s] on; of `every` few, one."""

    def __init__(self, right, left, every):
        self.stands, self.every, self.calls, self.pose = (right, left), every, 0, None

    def __call__(self, time, state):
        turn = 0.3 * state.yaw_rate
        rims = state.forward_speed + turn, state.forward_speed - turn
        right, left = (
            rim if time < at - 1e-9 else 0.0 for rim, at in zip(rims, self.stands, strict=True)
        )
        speed, yaw_rate = (right + left) / 2, (right - left) / 0.6
        if self.pose is None:
            self.pose = state.pose
        heading = self.pose[2] + yaw_rate * PERIOD / 2
        self.pose = self.pose + PERIOD * np.array(
            [speed * np.cos(heading), speed * np.sin(heading), yaw_rate]
        )
        self.calls += 1
        return None if self.calls % self.every else State.rolling(self.pose, speed, yaw_rate)


@pytest.mark.soak
@pytest.mark.parametrize("planner", [{}, CIRCLE], ids=["eight", "circle"])
@pytest.mark.parametrize("every", [1, 4])
@pytest.mark.parametrize("since", [0.0, 1.0, 4.0])
@pytest.mark.parametrize("later", [0.0, 0.01, 0.1])
def test_two_encoders_that_are_stuck_do_not_drive_it_away(planner, every, since, later):
    climb = Climb(planner=planner)
    climb.run(since + 5.0, odometry=Encoders(since, since + later, every))
    print(f"{climb.fastest(since):.2f} m/s, {climb.controller.mode.name}")
    assert climb.controller.mode in {Mode.STALLED, Mode.DEAD_WHEEL}
    assert climb.fastest(since) < 0.9
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
