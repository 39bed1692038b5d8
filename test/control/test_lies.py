"""Odometry that lies, of a climber under way: on a wall, on a floor, and on magnets."""

from copy import deepcopy
from functools import cache

import numpy as np
import pytest
from climbs import PERIOD, Climb

from climber_uk.mechanics.quantities import State

UNDER_WAY = 6.0  # [s]
CLIMBERS = {
    "wall": {},
    "floor": {"inclination": 0.0},
    "magnets": {"adhesion": "magnetic", "magnetic.force_at_contact": 400.0},
}


def told(pose=(1, 1, 1), speed=1.0, yaw_rate=1.0, turned=0.0):
    """Odometry whose numbers are times what they are, and whose heading is turned [rad]."""

    def lie(_, state):
        where = state.pose * np.array(pose) + [0.0, 0.0, turned]
        return State.rolling(where, speed * state.forward_speed, yaw_rate * state.yaw_rate)

    return lambda: lie


def frozen(pose=False, twist=False):
    """Odometry of which a part stays what it was."""

    def making():
        first = []

        def lie(_, state):
            first.append(state)
            twisted = first[0] if twist else state
            where = first[0].pose if pose else state.pose
            return State.rolling(where, twisted.forward_speed, twisted.yaw_rate)

        return lie

    return making


def every(number):
    return lambda: lambda time, state: None if round(time / PERIOD) % number else state


def in_bursts():
    return lambda time, state: None if time % 0.3 < 0.15 else state


def of_the_wheels():
    """Their speeds in place of the body's."""
    return lambda _, s: State.rolling(
        s.pose, s.forward_speed + 0.3 * s.yaw_rate, s.forward_speed - 0.3 * s.yaw_rate
    )


def swapped():
    return lambda _, s: State.rolling(s.pose[[1, 0, 2]], s.forward_speed, s.yaw_rate)


LIES = {  # and the most [rad/s] it may turn at the end, where nothing resists that
    "yaw rate of the wrong sign": (told(yaw_rate=-1), 0.1),
    "speed of the wrong sign": (told(speed=-1), 0.05),
    "twist of the wrong sign": (told(speed=-1, yaw_rate=-1), 0.05),
    "twist x 0.1": (told(speed=0.1, yaw_rate=0.1), 0.5),
    "speed x 0.03": (told(speed=0.03), 0.15),
    "yaw rate x 0.1": (told(yaw_rate=0.1), 0.1),
    "no twist": (told(speed=0, yaw_rate=0), 0.05),
    "no yaw rate": (told(yaw_rate=0), 0.05),
    "no speed": (told(speed=0), 0.05),
    "yaw rate in degrees": (told(yaw_rate=57.3), 1.0),
    "twist in mm and mrad": (told(speed=1000, yaw_rate=1000), 1.5),
    "twist frozen": (frozen(twist=True), 0.3),
    "pose frozen": (frozen(pose=True), 0.1),
    "all frozen": (frozen(pose=True, twist=True), 0.3),
    "heading mirrored": (told((1, 1, -1)), 0.1),
    "heading in degrees": (told((1, 1, 57.3)), 0.1),
    "heading turned by 90 degrees": (told(turned=np.pi / 2), 0.6),
    "pose in mm": (told((1000, 1000, 1)), 0.05),
    "x and y swapped": (lambda: swapped(), 0.05),
    "10 Hz": (every(20), 0.3),
    "in bursts": (lambda: in_bursts(), 0.6),
    "wheels' speeds": (lambda: of_the_wheels(), 3.0),
}


@cache
def under_way(climber):
    climb = Climb(**CLIMBERS[climber]).run(UNDER_WAY)
    assert not any(mode.is_fault for mode in climb.modes)
    return climb


# without a seal a climber falls where its speed or its heading cannot be known
ON_MAGNETS = (
    "yaw rate of the wrong sign",
    "no twist",
    "no yaw rate",
    "no speed",
    "yaw rate in degrees",
    "pose frozen",
    "10 Hz",
    "in bursts",
)


def cases():
    """Lies and climbers; on the floor, where no weight pulls, for soak only."""
    for lie in LIES:
        yield pytest.param(lie, "wall", id=f"{lie}-wall")
        yield pytest.param(lie, "floor", id=f"{lie}-floor", marks=pytest.mark.soak)
    for lie in ON_MAGNETS:
        yield pytest.param(lie, "magnets", id=f"{lie}-magnets")


@pytest.mark.slow
@pytest.mark.parametrize(("lie", "climber"), cases())
def test_odometry_that_lies_makes_nothing_run_away(lie, climber):
    lies, turning = LIES[lie]
    climb = deepcopy(under_way(climber)).run(1.5, odometry=lies())
    is_near = climb.off_the_path(UNDER_WAY) < 0.05
    after = climb.faulty_after(UNDER_WAY)
    fastest, turns = climb.fastest(UNDER_WAY), climb.fastest_turn(climb.time - 0.1)
    print(f"{lie}, {climber}: {after:.2f} s, {fastest:.2f} m/s, {turns:.2f} rad/s at the end")
    assert is_near or after <= 0.5
    assert fastest < 1.5 * climb.reference_speed + 0.1
    assert turns < turning
