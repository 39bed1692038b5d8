"""Odometry that is older than its stamps say, and torques that act late: nobody told."""

from collections import deque
from copy import deepcopy
from dataclasses import replace
from functools import cache
from itertools import count

import numpy as np
import pytest
from climbs import PERIOD, Climb, as_it_is
from test_force_budget import CIRCLE
from test_reversals import PATHS, Odd

from climber_uk.control.delay_check import BORNE, DELAYS, EXCITED, DelayCheck
from climber_uk.control.observed import Observed
from climber_uk.control.safety import Mode
from climber_uk.control.timing import LONGEST_DELAY
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion, State, Torques, Wrench

soak = pytest.mark.soak
CLIMBER = Climber(max_wheel_torque=4.0)
LARGEST = 2 * 4.0 / CLIMBER.wheel_radius  # [N]
NOTHING = Wrench(0.0, 0.0)


def found(delay, force, moment=0.0, noise=0.0, seconds=1.0, resists=0.0, known=0.0):
    """The delay that is found where force [N] and moment [N m] swing, and act so much later [s].

    Speeds have `noise` [m/s]; a force `resists` [N] that nobody knows.
    """
    check, random = DelayCheck(), np.random.default_rng(1)
    asked = deque([(0.0, 0.0)] * (1 + round(delay / PERIOD)))
    before, (speed, rate) = Motion(0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0), (1.0, 0.0)
    mass, inertia, friction, _ = CLIMBER.inertial
    for number in range(round(seconds / PERIOD)):
        swing = np.cos(2 * np.pi * number * PERIOD / 0.4)
        asked.append((swing * force, swing * moment))
        acts, turns = asked.popleft() if delay else asked[-1]
        speed += PERIOD * acts / mass
        rate += PERIOD * turns / inertia
        off, off_yaw = noise * random.normal(size=2)
        after = before._replace(speed=speed + off, yaw_rate=rate + off_yaw / CLIMBER.half_track)
        torques = CLIMBER.torques(asked[-1][0] + friction + resists, asked[-1][1])
        arrived = [(Torques(*torques), PERIOD)]
        observed = Observed(before, after, PERIOD, arrived, NOTHING, 0.01)
        if (now := check.add(CLIMBER, observed, known)) is not None:
            return now
        before = after
    return None


@pytest.mark.parametrize(("noise", "resists"), [(0.0, 0.0), (1e-3, 30.0)])
@pytest.mark.parametrize(("force", "moment"), [(60.0, 0.0), (0.0, 15.0)], ids=["drive", "turn"])
@pytest.mark.parametrize("delay", [it for it in DELAYS if it <= LONGEST_DELAY])
def test_the_delay_of_what_swings_is_found_if_it_is_not_borne(delay, force, moment, noise, resists):
    wanted = pytest.approx(delay, abs=0.021) if delay > BORNE else None
    assert found(delay, force, moment, noise, resists=resists) == wanted


@pytest.mark.parametrize("delay", [0.0, 0.06, 0.1, 0.14])
def test_a_delay_that_is_known_is_found_only_if_it_is_another(delay):
    wanted = pytest.approx(delay, abs=0.021) if abs(delay - 0.1) > BORNE else None
    assert found(delay, 60.0, known=0.1) == wanted


def test_what_hardly_swings_tells_no_delay():
    assert found(0.1, 0.5 * EXCITED * LARGEST) is None  # of what is unexplained, twice at most
    assert found(0.1, 6.0 * EXCITED * LARGEST) is not None


def test_a_turn_that_comes_in_time_speaks_against_a_drive_that_looks_late():
    one, other = DelayCheck()._drive, DelayCheck()._yaw
    near = [delay <= BORNE for delay in DELAYS]
    for number in range(20):
        swings = [60.0 * np.cos(number + 10 * delay) for delay in DELAYS]
        one.add(swings[5], swings, 0.1)
        other.add(swings[0], swings, 0.1)
    (late, _), (in_time, _) = one.evidence(near, LARGEST), other.evidence(near, LARGEST)
    assert np.argmax(late) == 5
    assert np.argmax(np.add(late, in_time)) in (0, 5)
    assert in_time[5] < 0 < late[5]


class Late:
    """What was to be now comes some time [s] later: a number, or a function of the time."""

    def __init__(self, delay, before):
        self.delay, self.past = delay, [before] * 200

    def __call__(self, time, now):
        self.past.append(now)
        delay = self.delay(time) if callable(self.delay) else self.delay
        return self.past[-1 - round(delay / PERIOD)]


def every(number, odometry):
    """One odometry in a few."""
    calls = count()
    return lambda time, state: (lambda told: None if next(calls) % number else told)(
        odometry(time, state)
    )


@cache
def healthy(planner, number):
    """A climb that goes well for 4 s, with one odometry in a few."""
    return Climb(planner=PLANNERS[planner]).run(4.0, odometry=every(number, as_it_is))


PLANNERS = {"eight": {}, "circle": CIRCLE}
WAYS = [  # and of how many odometries one arrives
    pytest.param(
        planner, number, marks=() if (planner, number) in [("eight", 1), ("circle", 4)] else soak
    )
    for planner in PLANNERS
    for number in (1, 2, 4)
]


def assert_never_runs_away(climb, since):
    assert climb.fastest(since) < 1.5 * climb.reference_speed + 0.1
    assert climb.off_the_path(since) < 0.05


def assert_goes_on(climb, since, delay):
    """It may stop for a while; it knows the delay [s] in the end."""
    assert_never_runs_away(climb, since)
    assert climb.controller.estimator.latency.delay == pytest.approx(delay, abs=0.03)


@pytest.mark.parametrize(("planner", "number"), WAYS)
@pytest.mark.parametrize(
    "delay", [pytest.param(0.04, marks=soak), 0.06, 0.1, pytest.param(0.2, marks=soak)]
)
def test_odometry_that_is_late_from_the_start_is_learnt(planner, number, delay):
    climb = Climb(planner=PLANNERS[planner])
    climb.run(3.0, odometry=every(number, Late(delay, climb.state)))
    assert_goes_on(climb, 0.0, delay)


@pytest.mark.parametrize(("planner", "number"), WAYS)
@pytest.mark.parametrize(
    "delay", [*(pytest.param(it, marks=soak) for it in (0.06, 0.08, 0.15)), 0.1]
)
@pytest.mark.parametrize("what", ["odometry", "motors"])
def test_what_comes_to_be_late_in_mid_course_is_learnt(what, delay, number, planner):
    climb = deepcopy(healthy(planner, number))
    late = Late(delay, climb.state if what == "odometry" else climb.torques)
    seldom = every(number, late if what == "odometry" else as_it_is)
    climb.run(2.5, odometry=seldom, **({"motors": late} if what == "motors" else {}))
    assert_goes_on(climb, 4.0, delay)


@pytest.mark.parametrize(
    ("delay", "most"),  # [s], [rad/s]
    [
        pytest.param(0.06, 1.5, marks=soak),
        (0.1, 2.0),
        *(pytest.param(d, 5.0, marks=soak) for d in (0.15, 0.2)),
    ],
)
@pytest.mark.parametrize("turned", [pytest.param(0.6, marks=soak), -1.2])
def test_a_turn_on_the_spot_to_the_path_does_not_spin_by_a_delay_that_nobody_told(
    turned, delay, most
):
    """At 7 to 16 rad/s it did, from 60 ms on, where nothing resists a turn."""
    climb = Climb(offset=(0.0, 0.0, turned))
    climb.run(2.5, motors=Late(delay, climb.torques))
    assert max(abs(state.velocity[2]) for state in climb.states) < most


@pytest.mark.parametrize(
    ("mass", "delay", "number"),  # [kg], believed to be 5; [s]; of `every`
    [
        (9.0, 0.05, 1),
        (7.5, 0.05, 4),
        *(pytest.param(*it, marks=soak) for it in ((7.5, 0.05, 1), (9.0, 0.05, 4), (9.0, 0.1, 1))),
    ],
)
@pytest.mark.parametrize("is_enabled", [True, pytest.param(False, marks=soak)])
def test_what_its_seal_does_not_hold_is_found_though_torques_are_late(
    mass, delay, number, is_enabled
):
    """5 to 13 m/s at the end, where what brakes in vain was taken for what drives."""
    climb = Climb(offset=(0.0, 0.05, -2.3), truth=lambda it: replace(it, mass=mass))
    climb.controller.enable(is_enabled)
    climb.run(4.0, odometry=every(number, as_it_is), motors=Late(delay, climb.torques))
    assert climb.fastest() < 1.3
    assert climb.fastest(climb.time - 0.5) < 0.1


@pytest.mark.parametrize(("planner", "number"), WAYS)
@pytest.mark.parametrize("rate", [pytest.param(0.02, marks=soak), 0.05])
@pytest.mark.parametrize("what", ["odometry", pytest.param("motors", marks=soak)])
def test_a_delay_that_grows_is_learnt_on_the_way(what, rate, number, planner):
    climb = deepcopy(healthy(planner, number))
    late = Late(
        lambda time: rate * (time - 4.0), climb.state if what == "odometry" else climb.torques
    )
    seldom = every(number, late if what == "odometry" else as_it_is)
    climb.run(0.15 / rate, odometry=seldom, **({"motors": late} if what == "motors" else {}))
    assert_never_runs_away(climb, 4.0)
    assert climb.controller.estimator.latency.delay > 0.05


@pytest.mark.parametrize(("planner", "number"), WAYS)
@pytest.mark.parametrize(
    "delay", [*(pytest.param(it, marks=soak) for it in (0.08, 0.15, 0.2)), 0.1]
)
def test_odometry_that_is_late_where_it_stands_in_mid_course_is_learnt(delay, number, planner):
    climb = deepcopy(healthy(planner, number))
    climb.controller.enable(False)
    climb.run(0.5, odometry=every(number, as_it_is))
    climb.controller.enable(True)
    since = climb.time
    climb.run(2.5, odometry=every(number, Late(delay, climb.state)))
    assert_goes_on(climb, since, delay)


LATER = [*(pytest.param(it, marks=soak) for it in (0.25, 0.3, 0.6, 1.0)), 0.4]


@pytest.mark.parametrize(("planner", "number"), WAYS)
@pytest.mark.parametrize("delay", LATER)
def test_odometry_that_is_silent_and_then_as_late_stops_it(delay, number, planner):
    """As of a buffer that fills while nothing comes; stamps tell when it arrives."""
    climb = deepcopy(healthy(planner, number))
    late = Late(delay, climb.state)
    late.past += climb.states[-200:]

    def resumes(time, state):
        told = late(time, state)
        return told if time - 4.0 >= delay - 1e-9 else None

    climb.run(2 * delay + 1.5, odometry=every(number, resumes))
    assert_never_runs_away(climb, 4.0)
    assert climb.controller.guard.fault is not None
    climb.run(1.0, odometry=every(number, resumes))
    assert climb.fastest(climb.time - 0.5) < 0.1


@pytest.mark.parametrize(("planner", "number"), WAYS)
@pytest.mark.parametrize("delay", LATER)
@pytest.mark.parametrize("what", ["odometry", pytest.param("motors", marks=soak)])
def test_what_is_later_than_can_be_learnt_from_the_start_is_found_by_the_first_push(
    what, delay, number, planner
):
    climb = Climb(planner=PLANNERS[planner])
    late = Late(delay, climb.state if what == "odometry" else climb.torques)
    seldom = every(number, late if what == "odometry" else as_it_is)
    climb.run(delay + 0.7, odometry=seldom, **({"motors": late} if what == "motors" else {}))
    assert climb.controller.mode is Mode.LATE
    assert climb.fastest() < 0.1


@pytest.mark.parametrize(("planner", "number"), WAYS)
@pytest.mark.parametrize("gap", [0.5, pytest.param(1.0, marks=soak), pytest.param(1.9, marks=soak)])
def test_odometry_in_bursts_drives_nothing_however_patient_its_timeout(gap, number, planner):
    climb = Climb(planner=PLANNERS[planner], odometry_timeout=2.0)
    climb.run(2.0, odometry=every(number, as_it_is))
    held, calls = [], count()

    def bursts(time, state):
        if next(calls) % number == 0:
            held.append((SECOND + round(time * SECOND), state))
        if (time - 2.0) % (gap + 0.5) < gap - 1e-9:
            return None
        for stamp, each in held[:-1]:
            climb.controller.on_odometry(SECOND + round(time * SECOND), stamp, each.motion)
        told = held[-1][1] if held and held[-1][0] == SECOND + round(time * SECOND) else None
        held.clear()
        return told

    climb.run(2 * gap + 1.0, odometry=bursts)
    assert_never_runs_away(climb, 2.0)


@pytest.mark.parametrize(("planner", "number"), WAYS)
@pytest.mark.parametrize("span", [*(pytest.param(it, marks=soak) for it in (0.1, 0.3, 0.4)), 0.2])
@pytest.mark.parametrize("goes_on_late", [True, pytest.param(False, marks=soak)])
def test_odometry_that_repeats_itself_without_a_gap_drives_nothing(
    goes_on_late, span, number, planner
):
    """As of a buffer that is sent once more, with new stamps; what follows is as late, or not."""
    climb = deepcopy(healthy(planner, number))
    late = Late(lambda time: span if goes_on_late or time < 4.0 + span - 1e-9 else 0.0, climb.state)
    late.past += climb.states[-200:]
    climb.run(2.5, odometry=every(number, late))
    assert climb.faulty_after(4.0) < 0.1
    assert_never_runs_away(climb, 4.0)


def growing(rate):
    return lambda time: rate * (time - 4.0)


@pytest.mark.parametrize(("planner", "number"), WAYS)
@pytest.mark.parametrize(
    "delay",
    [
        *(pytest.param(it, id=f"{it}", marks=soak) for it in (0.25, 0.4, 0.6)),
        pytest.param(0.3, id="0.3"),
        pytest.param(growing(0.2), id="growing"),
    ],
)
def test_torques_that_act_later_than_can_be_learnt_stop_it_before_they_do(delay, number, planner):
    climb = deepcopy(healthy(planner, number))
    climb.run(2.0, odometry=every(number, as_it_is), motors=Late(delay, climb.torques))
    assert climb.fastest(4.0) < 1.0  # m/s; what was sent before a fault is found acts as well
    assert climb.off_the_path(4.0) < 0.05


def test_a_delay_that_is_borne_is_followed():
    climb = deepcopy(healthy("eight", 1))
    climb.run(3.0, motors=Late(0.02, climb.torques))
    assert climb.follows()
    assert not climb.controller.guard.faults


def test_a_delay_that_may_not_be_learnt_ends_in_the_safe_output():
    climb = Climb(learn_delay=False).run(3.0, odometry=Late(0.1, Climb().state))
    assert climb.controller.mode is Mode.LATE
    assert climb.controller.detail.endswith("~/enable to go on")
    assert climb.fastest() < 1.5 * climb.reference_speed + 0.1
    assert climb.fastest(climb.time - 0.2) < 0.01


def noisy(seed):
    """Another climber than believed, with a noisy twist, and loops that are as late as is borne."""
    random = np.random.default_rng(seed)
    friction, mass = random.uniform(0.8, 1.2), random.uniform(0.75, 1.3)
    path = PATHS[random.choice(["level", "sine"])]
    every, lag, late = random.choice([1, 2]), random.choice([0.0, 0.02]), random.integers(0, 2)
    climb = Climb(planner=path, truth=Odd(friction, mass).true)
    delayed, acting = Late(late * PERIOD, np.zeros(2)), np.zeros(2)

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


LOOKED_LATE = 1, 23  # as 17 and 30 did, by variances of a few windows


@pytest.mark.parametrize(
    "seed", [pytest.param(it, marks=() if it in LOOKED_LATE else soak) for it in range(40)]
)
def test_noise_of_the_twist_is_no_delay_that_stops_anybody(seed):
    climb = noisy(seed)
    assert Mode.LATE not in climb.modes
    assert climb.off_the_path() < 0.01


@pytest.mark.parametrize(("planner", "number"), WAYS)
@pytest.mark.parametrize("span", [*(pytest.param(it, marks=soak) for it in (0.1, 0.4)), 0.25])
def test_odometry_that_goes_back_between_its_messages_stops_it(span, number, planner):
    """What it tells is late from then on, and no message of it was told before."""
    climb = deepcopy(healthy(planner, number))
    late = Late(span, climb.state)
    late.past += climb.states[-200:]

    def between(time, state):
        late(time, state)
        index = round(span / PERIOD)
        one, other = late.past[-1 - index].motion, late.past[-2 - index].motion
        middle = [0.7 * here + 0.3 * there for here, there in zip(one, other, strict=True)]
        return State.rolling(np.array(middle[:3]), *middle[-2:])

    climb.run(2.5, odometry=every(number, between))
    assert climb.faulty_after(4.0) < 0.1
    assert_never_runs_away(climb, 4.0)


@pytest.mark.parametrize("back", [0.025, pytest.param(0.03, marks=soak), 0.05])
def test_one_correction_backwards_stops_nobody_for_good(back):
    """As of a fix: it leaps as odometry does that goes back in time, but is no later then."""
    climb = deepcopy(healthy("eight", 1))
    heading = climb.state.pose[2]
    off = -back * np.array([np.cos(heading), np.sin(heading), 0.0])
    climb.run(5.0, odometry=lambda _, state: State(state.pose + off, state.velocity))
    assert climb.controller.mode is Mode.FOLLOWING
    assert abs(climb.controller.estimator.latency.delay) < 0.01
    assert_never_runs_away(climb, 4.0)
