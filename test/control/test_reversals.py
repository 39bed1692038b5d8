"""Paths that turn back, of climbers whose friction, mass or surroundings the model does not know.

What friction the seal has beyond the model's acts the other way after a reversal; a wrong weight
and a push do not.
"""

import itertools
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from climbs import PERIOD, Climb
from hypothesis import given, settings
from hypothesis import strategies as some

from climber_uk.control.model import DisturbanceEstimate, Observer
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State

SLOWER = 4  # every fourth odometry arrives: at 50 Hz
LAG = 0.02  # [s] of the motors there
MAGNETIC = {"adhesion": "magnetic", "magnetic.force_at_contact": 400.0}
CUSPS = "0 0\n0.3 0.1\n0.05 0.0\n0.3 -0.1\n"


def forth_and_back(rate, ramp_time, **shape):
    law = {"time_law": "rest_to_rest", "rest_to_rest.runs": 4, "rest_to_rest.pause": 0.0}
    return {**law, "rest_to_rest.rate": rate, "rest_to_rest.ramp_time": ramp_time, **shape}


PATHS = {
    "level": forth_and_back(0.3, 1.0, shape="line", **{"line.length": 0.4}),
    "uphill": forth_and_back(
        0.2, 0.8, shape="line", **{"line.length": 0.3, "line.direction": 1.57}
    ),
    "short": forth_and_back(
        0.3, 0.5, shape="line", **{"line.length": 0.15, "line.direction": -0.8}
    ),
    "sine": forth_and_back(
        0.25,
        0.5,
        shape="sine_wave",
        **{"sine_wave.length": 0.6, "sine_wave.amplitude": 0.1, "sine_wave.wavelength": 0.6},
    ),
    "cusps": forth_and_back(0.2, 0.5, shape="waypoints"),
}


class Odd(NamedTuple):
    """What a climber is other than believed."""

    friction: float = 1.0  # times the seal's
    mass: float = 1.0  # times
    rolling: float = 0.0  # [N] friction of a climber without a seal
    push: tuple[float, float] = (0.0, 0.0)  # [N]

    def true(self, believed):
        heavier = replace(
            believed, mass=believed.mass * self.mass, yaw_inertia=believed.yaw_inertia * self.mass
        )
        rubs = believed.seal_friction * self.friction + self.rolling
        on_seal = (1 - believed.wheel_load_share) * believed.suction_pressure
        coefficient = rubs / (on_seal * believed.suction_area)
        return replace(heavier, seal_friction_coefficient=coefficient)


PUSHED = Odd(mass=1.2, push=(10.0, -10.0))


def climbed(path, odd, tmp_path_factory, seconds=6.0, is_slow=False, **parameters):
    """A climb on a path that turns back; at 50 Hz and with lazy motors if it is slow."""
    planner = PATHS[path]
    if path == "cusps":
        file = tmp_path_factory.getbasetemp() / "cusps.txt"
        file.write_text(CUSPS)
        planner = {**planner, "waypoints.file": str(file)}
    climb = Climb(planner=planner, truth=odd.true, **parameters)
    acting = np.zeros(2)

    def seldom(time, state):
        return None if round(time / PERIOD) % SLOWER else state

    def lazy(_, torques):
        nonlocal acting
        acting = acting + (1 - np.exp(-PERIOD / LAG)) * (torques - acting)
        return acting

    disturbed = {"odometry": seldom, "motors": lazy} if is_slow else {}
    return climb.run(seconds, push=np.array([*odd.push, 0.0]), **disturbed)


def is_never_stopped(climb, most):
    assert not any(mode.is_fault for mode in climb.modes)
    assert climb.fastest() < climb.reference_speed + most


def telling(*rows):
    """Paths each with a value, of which all but these are for soak."""
    values = [*dict.fromkeys(value for _, value in rows)]
    for path, value in itertools.product(PATHS, values):
        yield pytest.param(path, value, marks=() if (path, value) in rows else pytest.mark.soak)


@pytest.mark.parametrize(
    ("path", "friction"),
    [
        *telling(("uphill", 0.4), ("sine", 0.4), ("short", 1.5), ("cusps", 1.5)),
        *(pytest.param(p, it, marks=pytest.mark.soak) for p in PATHS for it in (0.7, 1.3)),
    ],
)
def test_friction_that_is_another_stops_no_slow_loop_that_turns_back(
    path, friction, tmp_path_factory
):
    is_never_stopped(climbed(path, Odd(friction), tmp_path_factory, is_slow=True), 0.15)


@settings(max_examples=3, deadline=None)
@given(
    path=some.sampled_from(sorted(PATHS)),
    friction=some.floats(0.4, 1.6),
    mass=some.floats(0.8, 1.2),
    push=some.tuples(some.floats(-15, 15), some.floats(-15, 15)),
)
def test_nothing_unknown_stops_a_climber_that_turns_back(
    path, friction, mass, push, tmp_path_factory
):
    is_never_stopped(climbed(path, Odd(friction, mass, push=push), tmp_path_factory), 0.1)


@pytest.mark.parametrize(
    ("path", "odd"), telling(("sine", Odd(mass=0.8, rolling=8.0)), ("uphill", PUSHED))
)
def test_nor_one_without_a_seal(path, odd, tmp_path_factory):
    is_never_stopped(climbed(path, odd, tmp_path_factory, **MAGNETIC), 0.1)


def learnt_forth_and_back(climber, force, friction):
    """What is learnt of a force and a friction by driving forwards, backwards and forwards."""
    observer, learnt, time = Observer(), DisturbanceEstimate(), 0.01
    for direction in (1.0, -1.0, 1.0):
        expected = State.rolling(np.zeros(3), direction * 0.2, 0.0).motion
        for _ in range(300):
            both = force - direction * friction
            missing = both - (learnt.force - direction * learnt.friction)
            found = expected._replace(speed=expected.speed + time * missing / climber.mass)
            shares = observer.shares(time, 0.0)
            _, learnt = observer.corrected(
                climber, learnt, expected, found, time, shares, direction
            )
    return learnt


@given(force=some.floats(-40, 40), friction=some.floats(-50, 50))
def test_one_reversal_tells_a_friction_from_a_push(force, friction):
    climber = Climber()
    learnt = learnt_forth_and_back(climber, force, friction)
    assert learnt.force == pytest.approx(force, abs=0.1)
    assert learnt.friction == pytest.approx(friction, abs=0.1)


def test_no_more_than_the_friction_itself_is_put_down_to_friction():
    climber = Climber()
    learnt = learnt_forth_and_back(climber, 0.0, 80.0)
    assert learnt.friction <= climber.seal_friction
    assert learnt.force - learnt.friction == pytest.approx(-80, abs=0.1)
    assert learnt_forth_and_back(replace(climber, suction_pressure=0.0), 0.0, 20.0).friction == 0


@given(some.lists(some.tuples(*[some.floats(-60, 60)] * 4), min_size=1, max_size=5))
def test_many_learn_a_friction_as_one_does(numbers):
    numbers = np.array(numbers).T
    for direction in (1.0, 0.0, -1.0):
        force, friction, change, speed = numbers
        many = DisturbanceEstimate(force, friction=friction).changed(
            Climber(), change, direction, speed / 1000
        )
        for index, (force, friction, change, speed) in enumerate(numbers.T.tolist()):
            one = DisturbanceEstimate(force, friction=friction).changed(
                Climber(), change, direction, speed / 1000
            )
            assert one == tuple(part[index] for part in many)
