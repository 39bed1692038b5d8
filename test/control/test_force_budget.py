"""Torque is given and no motion is told: a seal sticks, or odometry is stuck, or late."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from climbs import PERIOD, Climb
from test_lies import frozen

from climber_uk.control.control_law import Command
from climber_uk.control.force_budget import BREAKS_LOOSE, ForceBudget
from climber_uk.control.observed import Observed
from climber_uk.control.safety import Mode
from climber_uk.mechanics.quantities import Motion, State, Torques, Wrench

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

    climb = Climb(learn_delay=False).run(4.0, odometry=late)
    assert Mode.LATE in climb.modes
    assert climb.fastest() < 1.5 * climb.reference_speed + 0.1


def test_a_seal_that_holds_more_than_believed_is_followed():
    def truth(it):
        return replace(it, seal_friction_coefficient=1.4 * it.seal_friction_coefficient)

    climb = Climb(truth=truth).run(4.0)
    assert not any(mode.is_fault for mode in climb.modes)
    assert climb.fastest() > 0.1


@pytest.mark.parametrize("met", [0.0, 30.0])
def test_a_turn_is_given_on_trust_what_turns_have_met_and_a_fifth_more(met):
    """It turns at a steady rate against a moment [N m]; then no motion is told any more."""
    law, budget, nothing = Climb().controller._law, ForceBudget(), Wrench(0.0, 0.0)
    climber, rests = law.climber, Motion(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)

    def see(before, after, moment):
        acted = [(climber.torques(0.0, moment), PERIOD)]
        budget.see(climber, Observed(before, after, PERIOD, acted, nothing, 0.01), 0.1, 0.2)

    turning = [rests._replace(heading=0.8 * PERIOD * i, yaw_rate=0.8) for i in range(200)]
    for before, after in pairwise(turning):
        see(before, after, met)
    see(rests, rests, 0.0)
    asked = Command(climber.torques(0.0, 80.0), nothing, 0.0, nothing, rests, 0.0)
    _, given = climber.wrench(*budget.within(asked, law, PERIOD, []).wheels)
    assert given == pytest.approx(BREAKS_LOOSE * met, rel=1e-3)


def test_what_creeps_as_pose_and_twist_tell_alike_is_not_held():
    law, budget, nothing = Climb().controller._law, ForceBudget(), Wrench(0.0, 0.0)
    climber, speed = law.climber, 2e-3
    places = [Motion(i * speed * PERIOD, 0.0, 0.0, 1.0, 0.0, speed, 0.0) for i in range(400)]
    asked = Command(Torques(2.0, 0.0), nothing, 0.0, nothing, places[0], 0.0)
    for before, after in pairwise(places):
        acted = [(asked.wheels, PERIOD)]
        budget.see(climber, Observed(before, after, PERIOD, acted, nothing, 0.01), 0.1, 0.2)
        assert budget.within(asked, law, PERIOD, []) is asked
