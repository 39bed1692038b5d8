"""Does a speed follow its torque? And the safe output, of a climber whose odometry is in doubt."""

import math

import numpy as np
import pytest
from climbs import Climb

from climber_uk.control.observed import Observed
from climber_uk.control.polarity import MEMORY, Polarities, Polarity
from climber_uk.control.safety import Mode
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State, Torques, Wrench

PERIOD = 0.005
SHOVE = np.array([4.0, -4.0])  # [N m]


def swung(gain, amplitude=0.05, drift=0.0, noise=0.0, late=0, seconds=1.0):
    """Polarity of a speed that swings at 3 Hz, with a gain, and drifts meanwhile [m/s²]."""
    random, polarity = np.random.default_rng(1), Polarity()
    count = round(seconds / PERIOD)
    expected = amplitude * np.sin(2 * math.pi * 3 * PERIOD * np.arange(count + 1))
    measured = gain * np.roll(expected, late) + drift * PERIOD * np.arange(count + 1)
    measured = measured + noise * random.normal(size=count + 1)
    for should, does in zip(np.diff(expected), np.diff(measured), strict=True):
        polarity.add(float(should), float(does), PERIOD)
    return polarity.sign


@pytest.mark.parametrize(
    ("sign", "case"),
    [
        (1, {"gain": 1.0}),
        (1, {"gain": 0.3}),
        (1, {"gain": 1.0, "drift": 1.0}),
        (1, {"gain": 1.0, "noise": 0.02}),
        (1, {"gain": 1.0, "late": 10}),  # 50 ms, 54 degrees
        (-1, {"gain": -1.0}),
        (-1, {"gain": -2.5, "drift": -1.0}),
        (0, {"gain": 1.0, "late": 25}),  # 135 degrees
        (0, {"gain": 0.0, "noise": 0.02}),
        (0, {"gain": 1.0, "amplitude": 0.002}),
        (0, {"gain": 0.0}),
    ],
)
def test_a_speed_follows_its_torque_or_goes_against_it_or_nobody_knows(sign, case):
    assert swung(**case) == sign


def test_what_was_long_ago_tells_nothing():
    polarity = Polarity()
    for number in range(200):
        polarity.add(*[0.01 * (-1) ** (number // 20)] * 2, PERIOD)
    assert polarity.sign == 1
    for _ in range(round(6 * MEMORY / PERIOD)):
        polarity.add(0.0, 0.0, PERIOD)
    assert polarity.sign == 0


def told(speed=1, yaw_rate=1):
    """Odometry whose twist has other signs."""
    return lambda _, s: State.rolling(s.pose, speed * s.forward_speed, yaw_rate * s.yaw_rate)


@pytest.mark.slow
@pytest.mark.parametrize("since", [pytest.param(0.0, marks=pytest.mark.soak), 5.0])
@pytest.mark.parametrize(
    "lie", [told(yaw_rate=-1), told(speed=-1), pytest.param(told(-1, -1), marks=pytest.mark.soak)]
)
def test_a_climber_whose_twist_has_a_wrong_sign_comes_to_rest_whichever_mode_says_so(lie, since):
    climb = Climb().run(since).run(8.0, odometry=lie)
    assert any(mode.is_fault for mode in climb.modes)
    assert climb.fastest_turn() < 8.0
    assert climb.fastest(since + 7.5) < 0.01
    assert climb.fastest_turn(since + 7.5) < 0.1


def shoved():
    """A climber that is turned by force, against its torques."""
    climb = Climb().run(3.0).run(0.06, motors=lambda _, torques: torques + SHOVE)
    assert abs(climb.states[-1].yaw_rate) > 0.5
    return climb


@pytest.mark.slow
@pytest.mark.parametrize(
    "mode", [Mode.BAD_ODOMETRY, Mode.TWIST_WRONG, Mode.SIGN_WRONG, Mode.DEAD_WHEEL, Mode.TOO_FAST]
)
def test_a_climber_that_spins_is_braked_in_every_mode_in_which_its_speeds_are_known(mode):
    climb = shoved()
    climb.controller._find_mode = lambda now: (mode, "")
    climb.run(3.0)
    assert climb.modes[-1] is mode
    assert climb.fastest_turn(climb.time - 0.1) < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("side", [0, 1])
def test_the_wheel_that_is_left_brakes_a_turn_and_does_not_drive(side):
    def dead(_, torques):
        return torques * [side, 1 - side]

    climb = shoved()
    climb.controller._find_mode = lambda now: (Mode.DEAD_WHEEL, "")
    climb.run(4.0, motors=dead)
    assert climb.fastest_turn(climb.time - 0.1) < 0.05
    assert climb.fastest(climb.time - 0.1) == 0


@pytest.mark.parametrize(
    ("wiring", "signs"),
    [
        (np.eye(2), (1, 1)),
        (np.diag([1, -1]), (1, -1)),
        (np.diag([0, 1]), (0, 1)),
        (-np.eye(2), (-1, -1)),
    ],
)
def test_each_wheel_is_told_from_the_other_and_from_a_steady_push(wiring, signs):
    climber, polarities = Climber(), Polarities()
    random, speeds = np.random.default_rng(1), np.array([0.5, 0.0])
    mass, inertia, friction, _ = climber.inertial
    for _ in range(400):
        torques = random.normal(1.0, 0.5, 2)
        force, moment = climber.wrench(*(wiring @ torques + [0.5, 0.0]))
        push = force - friction - 20.0
        after = speeds + PERIOD * np.array([push / mass, moment / inertia])
        one, other = (State.rolling(np.zeros(3), *it).motion for it in (speeds, after))
        acted = [(Torques(*torques), PERIOD)]
        polarities.add(climber, Observed(one, other, PERIOD, acted, Wrench(0.0, 0.0), 0.01))
        speeds = np.array([0.5, after[1]])
    assert (polarities.right.sign, polarities.left.sign) == signs
