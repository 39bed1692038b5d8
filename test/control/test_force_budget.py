"""Torque is given and no motion is told: a seal sticks, or odometry is stuck, or late."""

import math
from copy import deepcopy
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from climbs import PERIOD, Climb
from test_lies import frozen
from test_reversals import Odd

from climber_uk.control.control_law import Command, ControlInput
from climber_uk.control.force_budget import BREAKS_LOOSE, FIRST, ForceBudget
from climber_uk.control.guard import Expected, Guard, GuardOptions, Rates
from climber_uk.control.observed import Observed
from climber_uk.control.safety import Mode
from climber_uk.mechanics.adhesion import Suction
from climber_uk.mechanics.quantities import NO_TORQUES, Motion, State, Wrench

CIRCLE = {
    **{"shape": "ellipse", "ellipse.semi_axis_x": 0.8, "ellipse.semi_axis_y": 0.8},
    **{"rest_to_rest.rate": 0.25, "rest_to_rest.ramp_time": 3.0},
}

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def stuck():
    """A climber whose odometry stands, from its start on."""
    return Climb().run(3.5, odometry=frozen(pose=True, twist=True)())


def test_odometry_that_is_stuck_from_the_start_stalls_and_lets_nothing_run_away(stuck):
    climb = stuck
    assert climb.controller.mode is Mode.STALLED
    assert "pushes moved nothing" in climb.controller.detail
    assert climb.fastest() < 1.5 * climb.reference_speed + 0.1
    assert climb.fastest(climb.time - 0.5) < 0.01


@pytest.mark.parametrize("what", ["silence", "jump", "clock"])
def test_odometry_that_was_stuck_ends_nothing_by_falling_silent_or_elsewhere(stuck, what):
    """It drove again after a rest: what had told that it was stuck was forgotten by that."""
    climb = deepcopy(stuck)
    rests = State(climb.state.pose + np.array([0.5 * (what == "jump"), 0.0, 0.0]), np.zeros(3))
    if what == "silence":
        climb.run(0.3, odometry=lambda *_: None)
    climb.time -= 1.0 * (what == "clock")
    climb.run(0.1, odometry=lambda *_: rests)
    assert climb.controller.guard.is_for_good
    climb.controller.enable(True)
    assert not climb.controller.guard.is_for_good


@pytest.mark.parametrize(
    ("direction", "friction", "mass", "lag"),
    [
        pytest.param(math.pi / 2, 1.3, 1.2, 0.02, id="uphill, lazy"),
        pytest.param(math.pi / 2, 1.13, 1.2, 0.0, id="uphill", marks=pytest.mark.soak),
        pytest.param(-math.pi / 2, 1.3, 0.85, 0.02, id="downhill, lazy", marks=pytest.mark.soak),
        pytest.param(math.pi, 1.4, 1.0, 0.02, id="across, lazy", marks=pytest.mark.soak),
    ],
)
def test_a_seal_that_holds_more_than_believed_breaks_loose_however_slowly_its_reference_begins(
    direction, friction, mass, lag
):
    """A push of what the reference asks for alone would be spent before it is strong enough."""
    slowly = {"shape": "line", "line.length": 1.0, "line.direction": direction}
    slowly |= {"time_law": "rest_to_rest", "rest_to_rest.rate": 0.06, "rest_to_rest.ramp_time": 4.0}
    climb, acting = Climb(planner=slowly, truth=Odd(friction, mass).true), np.zeros(2)

    def lazy(_, torques):
        nonlocal acting
        acting = acting + (torques - acting) * (1 - np.exp(-PERIOD / lag) if lag else 1.0)
        return acting

    climb.run(4.0, motors=lazy)
    assert not climb.controller.guard.faults
    assert climb.fastest(3.5) > 0.02


@pytest.mark.parametrize(
    "offset", [(0.03, 0.0, 0.0), (0.0, 0.03, 0.0), (0.0, 0.0, 0.2), (0.03, -0.03, -0.15)], ids=str
)
@pytest.mark.parametrize("planner", [{}, pytest.param(CIRCLE, marks=pytest.mark.soak)])
@pytest.mark.parametrize("scrubs", [False, pytest.param(True, marks=pytest.mark.soak)])
def test_odometry_that_is_stuck_turns_nothing_away_that_is_to_be_elsewhere(offset, planner, scrubs):
    climb = Climb(planner=planner, offset=offset, scrubs=scrubs)
    climb.run(4.0, odometry=frozen(pose=True, twist=True)())
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


RESTS = Motion(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def acted_on(climber, before, after, moment):
    """What is observed while a moment [N m] acts, in a period."""
    acted = [(climber.torques(0.0, moment), PERIOD)]
    return Observed(before, after, PERIOD, acted, Wrench(0.0, 0.0), 0.01)


def turning(rate, times):
    """Motions that turn at a rate [rad/s]."""
    return [RESTS._replace(heading=rate * PERIOD * i, yaw_rate=rate) for i in range(times)]


def given(budget, law, force, moment):
    """What of a force and a moment is given while no motion is told."""
    wanted, ahead = Wrench(force, moment), ControlInput(RESTS, NO_TORQUES, Wrench(0, 0), PERIOD)
    wheels = law.torques(*wanted, ahead)
    asked = Command(wheels, wanted, 0.0, Wrench(0.0, 0.0), RESTS, 0.0)
    return law.climber.wrench(*budget.within(asked, law, ahead, []).wheels)


@pytest.mark.parametrize(("speed", "troubles"), [(0.02, [Mode.LATE]), (0.002, [])])
def test_what_moves_after_a_push_is_late_if_its_twist_tells_so_and_not_where_a_fix_corrects_it(
    speed, troubles
):
    law, budget = Climb().controller._law, ForceBudget()
    moved = RESTS._replace(x=1e-4, speed=speed)
    for force, after, times in ((150.0, RESTS, 10), (0.0, RESTS, 60), (0.0, moved, 1)):
        acted = [(law.climber.torques(force, 0.0), PERIOD)]
        for _ in range(times):
            observed = Observed(RESTS, after, PERIOD, acted, Wrench(0.0, 0.0), 0.01)
            trouble = budget.see(law.climber, observed, 0.1, 0.2)
    assert [it[0] for it in (trouble,) if it] == troubles


@pytest.mark.parametrize("met", [0.0, 30.0])
@pytest.mark.parametrize("back", [0, 20])
def test_a_turn_is_given_on_trust_what_turns_have_met_and_a_fifth_more(met, back):
    """It turns against a moment [N m], and for some periods back; then no motion is told."""
    law, budget = Climb().controller._law, ForceBudget()
    for rate, moment, times in ((0.8, met, 200), (-0.8, -met, back)):
        for before, after in pairwise(turning(rate, times)):
            budget.see(law.climber, acted_on(law.climber, before, after, moment), 0.1, 0.2)
    budget.see(law.climber, acted_on(law.climber, RESTS, RESTS, 0.0), 0.1, 0.2)
    _, moment = given(budget, law, 0.0, -80.0 if back else 80.0)
    assert abs(moment) == pytest.approx(BREAKS_LOOSE * met, rel=1e-3)


def test_turns_on_the_spot_teach_what_turns_meet():
    law, guard = Climb().controller._law, Guard(GuardOptions(), Suction())
    on_the_spot = Expected(Rates(0.0, 0.8), Rates(0.1, 2.0), waits=False)
    for before, after in pairwise(turning(0.8, 200)):
        guard.watch(law.climber, acted_on(law.climber, before, after, 30.0), on_the_spot)
    moments = []
    for budget in (ForceBudget(), guard.budget):
        budget.see(law.climber, acted_on(law.climber, RESTS, RESTS, 0.0), 0.1, 0.2)
        moments.append(given(budget, law, 0.0, 80.0)[1])
    assert moments[1] - moments[0] == pytest.approx(BREAKS_LOOSE * 30.0, rel=1e-3)


def test_a_moment_that_is_not_given_leaves_the_drive_what_may_change_of_torques():
    law, budget = Climb(max_torque_rate=80.0).controller._law, ForceBudget()
    budget.see(law.climber, acted_on(law.climber, RESTS, RESTS, 0.0), 0.1, 0.2)
    budget.turn = FIRST  # it may turn as fast as is given on trust
    force, moment = given(budget, law, 60.0, 80.0)
    assert moment == pytest.approx(0.0)
    assert force == pytest.approx(law.climber.wrench(0.4, 0.4)[0])


def test_what_creeps_as_pose_and_twist_tell_alike_is_not_held():
    law, budget, speed = Climb().controller._law, ForceBudget(), 2e-3
    places = [RESTS._replace(x=i * speed * PERIOD, speed=speed) for i in range(400)]
    for before, after in pairwise(places):
        budget.see(law.climber, acted_on(law.climber, before, after, 40.0), 0.1, 0.2)
        assert given(budget, law, 74.0, 22.0) == pytest.approx((74.0, 22.0))


@pytest.mark.parametrize(("rate", "angle"), [(0.0, 0.02), (0.8, 0.0), (-0.8, 0.0)])
def test_a_turn_that_its_heading_tells_of_leaves_a_creeping_drive_its_friction(rate, angle):
    """It turns at a rate [rad/s], or ever faster by [rad/s²], and its torques carry its weight."""
    law, budget = Climb().controller._law, ForceBudget()
    climber, times = law.climber, PERIOD * np.arange(800)
    friction, moment = climber.seal_friction, climber.driven_inertia * angle
    begin = -math.copysign(math.pi / 2, rate)
    bend = [
        Motion(0.0, 0.0, at, math.cos(at), math.sin(at), 1e-5, rate + angle * time)
        for time, at in zip(times, begin + rate * times + angle * times**2 / 2, strict=True)
    ]
    for before, after in pairwise(bend):
        weight = climber.weight_along_wall * math.sin((before.heading + after.heading) / 2)
        acted = [(climber.torques(friction + weight, moment), PERIOD)]
        observed = Observed(before, after, PERIOD, acted, Wrench(0.0, 0.0), 0.01)
        assert budget.see(climber, observed, 1e-5, 0.5) is None
        assert given(budget, law, friction, moment) == pytest.approx((friction, moment))
