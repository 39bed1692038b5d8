from dataclasses import replace

import numpy as np
import pytest

from climber_uk.closed_loop.unicycle import UnicycleModel, advanced
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.many import indexed
from climber_uk.mechanics.quantities import Motion, State, Wrench
from climber_uk.simulation.plant import Plant

PAPER = Climber()
UPRIGHT = State(np.array([0.0, 6.0, np.pi / 2]), np.zeros(3))


def many_starts(number, fastest):
    random = np.random.default_rng(6)
    heading = random.uniform(-3, 3, number)
    x, y, omega = random.normal(size=(3, number))
    speed = fastest * random.normal(size=number) * (random.random(number) > 0.2)  # some at rest
    return Motion(x, y, heading, np.cos(heading), np.sin(heading), speed, omega)


def floats(motion):
    return Motion(*(float(number) for number in motion))


def wheels(random, motion):
    """Torques (2, n) that make climbers slow down, stop, stay, turn on the spot and go back."""
    drive = 49.05 * motion.sine + 60 * random.normal(size=len(motion.x)) - 10 * motion.speed
    turn = -motion.yaw_rate + 0.3 * random.normal(size=len(motion.x))
    return PAPER.wheel_torques(drive, turn).T


@pytest.mark.parametrize(
    ("fastest", "rotors"), [(0.2, 0.0), pytest.param(6.0, 0.0, marks=pytest.mark.soak), (1.0, 2e-4)]
)
def test_many_at_once_are_each_the_plant_and_the_same_alone(fastest, rotors):
    climber = replace(PAPER, rotor_inertia=rotors)
    random, body, step = np.random.default_rng(7), UnicycleModel.of(climber), 0.0025
    plant, motion = Plant(climber, step), many_starts(12, fastest)
    states = [State.moving(floats(indexed(motion, i))) for i in range(12)]
    alone = [state.motion for state in states]
    changes = 0
    for _ in range(100):
        torques = wheels(random, motion)
        was = np.sign(motion.speed)
        for _ in range(2):
            motion = advanced(body, motion, Wrench(*PAPER.wrench(*torques)), step)
        changes += np.count_nonzero(np.sign(motion.speed) != was)
        for i in range(12):
            pair = torques[:, i]
            states[i] = plant.advance(states[i], pair, steps=2)
            for _ in range(2):
                alone[i] = advanced(body, alone[i], Wrench(*PAPER.wrench(*pair.tolist())), step)
            expected = states[i].motion
            np.testing.assert_allclose(floats(indexed(motion, i)), expected, atol=1e-9)
            np.testing.assert_allclose(alone[i], expected, atol=1e-9)
    assert changes > 50  # it was about sticking and sliding, too


def test_friction_stops_it_where_the_brakes_law_says_whatever_the_step():
    floor = replace(PAPER, inclination=0.0)
    motion = State.rolling(np.array([0.0, 0.0, 0.5]), 1.0, 0.0).motion
    for _ in range(10):
        motion = advanced(UnicycleModel.of(floor), motion, Wrench(0.0, 0.0), 0.1)
    assert np.hypot(motion.x, motion.y) == pytest.approx(5.0 / (2 * floor.seal_friction), rel=1e-12)
    assert motion.speed == 0


@pytest.mark.parametrize(("part_of", "slides"), [(1 + 1e-6, False), (1 - 1e-6, True)])
def test_it_slides_just_below_the_critical_pressure(part_of, slides):
    pressure = part_of * 5 * 9.81 / (0.47 * 0.8 * 0.06)
    body, motion = UnicycleModel.of(replace(PAPER, suction_pressure=pressure)), UPRIGHT.motion
    for _ in range(400):
        motion = advanced(body, motion, Wrench(0.0, 0.0), 0.0025)
    assert (motion.y < 6) is slides
    assert (motion.speed < 0) is slides


def test_what_friction_holds_may_turn_on_the_spot_and_gives_way_at_its_angle():
    weak = replace(PAPER, suction_pressure=1500.0)  # friction 33.84 N < 49.05 N of weight
    motion = State(np.zeros(3), np.array([0.0, 0.0, 1.0])).motion
    steps = 0
    while motion.speed == 0:
        assert motion.x == motion.y == 0
        motion, steps = (
            advanced(UnicycleModel.of(weak), motion, Wrench(0.0, 0.0), 0.0025),
            steps + 1,
        )
    since = steps * 0.0025 - np.arcsin(33.84 / 49.05)  # at 1 rad/s
    assert 0 < since <= 0.0025
    # v̇ grows from 0 as g cosθ t does
    expected = -9.81 * np.sqrt(1 - (33.84 / 49.05) ** 2) * since**2 / 2
    assert motion.speed == pytest.approx(expected, rel=1e-2)
