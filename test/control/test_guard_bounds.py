"""The guard by itself: what is just within its bounds, and what just beyond."""

import numpy as np
import pytest

from climber_uk.control.actuator_check import RimStop
from climber_uk.control.guard import Expected, Guard, GuardOptions, Rates
from climber_uk.control.observed import Observed
from climber_uk.control.safety import Mode
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.adhesion import NoAdhesion, Suction
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.quantities import Motion, Torques, Wrench

CLIMBER = Climber(max_wheel_torque=4.0)
LEVER = 0.3  # [m]
PERIOD = 0.02  # [s]
REACTION = 0.02  # [s]
LET_GO = CLIMBER.seal_friction / 5 * (REACTION + 0.012)  # [m/s]


class Watched:
    """A guard of a climber that always does the same."""

    def __init__(self, adhesion=None):
        self.guard = Guard(GuardOptions(), adhesion or Suction())

    def finds(self, speed=0.1, turn=0.0, torques=(0.0, 0.0), disturbance=(0.0, 0.0), **expected):
        """What it finds in the next period."""
        wanted = Rates(*expected.get("wanted", (0.2, 0.0)))
        way = [expected[name] for name in ("reference", "against") if name in expected]
        expected = Expected(wanted, Rates(0.3, 0.5), expected.get("waits", False), *way)
        motion = Motion(0.0, 0.0, 0.0, 1.0, 0.0, speed, turn)
        wrench, acted = Wrench(*disturbance), [(Torques(*torques), PERIOD)]
        observed = Observed(motion, motion, PERIOD, acted, wrench, REACTION)
        found = self.guard.watch(CLIMBER, observed, expected)
        return found and found[0]

    def periods_until(self, mode, **what):
        """How many until it finds this, and nothing before; None: not within a second."""
        for number in range(1, 51):
            found = self.finds(**what)
            assert found in (None, mode)
            if found:
                return number
        return None


@pytest.mark.parametrize(("reference", "is_against"), [(0.2, -1.0), (-0.2, 1.0)])
def test_the_other_way_than_the_reference_goes_less_is_too_fast(reference, is_against):
    most = 0.05 + GuardOptions().speed_margin
    for speed, found in ((most - 1e-3, None), (most + 1e-3, 2), (-(most + 1e-3), None)):
        way = {"reference": reference, "against": 0.05, "speed": is_against * speed}
        assert Watched().periods_until(Mode.TOO_FAST, **way) == found
    unclear = {"reference": reference, "against": np.inf, "speed": is_against * (most + 1e-3)}
    assert Watched().periods_until(Mode.TOO_FAST, **unclear) is None


@pytest.mark.parametrize(
    ("what", "periods"),
    [
        ({"speed": 0.0, "torques": (2.41, 2.41)}, 6),  # 0.12 s
        ({"speed": 0.0, "torques": (2.39, 2.39)}, None),
        ({"speed": 0.0, "torques": (-2.41, 0.0)}, 6),
        ({"speed": 0.0, "torques": (0.0, 4.0)}, 4),  # sooner, as it is more
        ({"speed": 0.019, "torques": (4.0, 4.0)}, 4),
        ({"speed": 0.021, "torques": (4.0, 4.0)}, None),  # it moves, at a tenth
        ({"speed": 0.0, "wanted": (0.0, 0.5), "torques": (4.0, -4.0)}, 4),
        ({"speed": 0.0, "wanted": (0.0, 0.5), "turn": 0.06, "torques": (4.0, -4.0)}, None),
        # in a corner, whose inner wheel is to go backwards, it turns
        ({"speed": 0.0, "wanted": (0.1, 0.5), "turn": 0.4, "torques": (4.0, -4.0)}, None),
        ({"speed": 0.0, "wanted": (0.1, 0.5), "turn": 0.04, "torques": (4.0, -4.0)}, 4),
        ({"speed": 0.0, "wanted": (0.2, 0.5), "turn": 0.4, "torques": (4.0, 4.0)}, 4),
        ({"speed": 0.0, "wanted": (0.0, 0.0), "torques": (4.0, 4.0)}, None),  # it is to rest
        ({"waits": True, "torques": (3.95, 3.95)}, 6),
        ({"waits": True, "torques": (3.9, 3.9)}, None),
        ({"waits": False, "torques": (4.0, 4.0)}, None),
    ],
    ids=str,
)
def test_a_climber_is_stalled_if_it_stands_or_its_reference_waits(what, periods):
    assert Watched().periods_until(Mode.STALLED, **what) == periods


def test_a_stall_counts_from_the_beginning_once_the_climber_has_moved():
    climb = Watched()
    for _ in range(5):
        assert climb.finds(speed=0.0, torques=(2.41, -2.41)) is None
    assert climb.finds(speed=0.021, torques=(2.41, -2.41)) is None
    assert climb.periods_until(Mode.STALLED, speed=0.0, torques=(2.41, -2.41)) == 6


@pytest.mark.parametrize(("reference", "speed"), [(0.0, -0.1), (-0.2, -0.1), (0.2, 0.1)])
def test_a_climber_that_brakes_on_its_way_is_not_stalled(reference, speed):
    climb = Watched()
    for _ in range(50):
        torques = (2.41, -2.41)
        assert climb.finds(speed=speed, torques=torques, reference=reference) is None


@pytest.mark.parametrize(
    ("strong", "weak", "periods"), [(1, 1, 14), (2, 1, 10), (1, 3, 48), (1, 4, None)]
)
def test_a_climber_that_trembles_is_stalled(strong, weak, periods):
    """It is driven for some periods and let go for others, in which it swings back."""
    climb = Watched()
    for number in range(1, 101):
        drives = number % (strong + weak) < strong
        torque = 2.41 if drives else 0.0
        speed = 0.0 if drives else -0.1
        if climb.finds(speed=speed, torques=(torque, -torque), reference=0.2):
            break
    assert (number if number < 100 else None) == periods


@pytest.mark.parametrize(
    ("torque", "every", "found"),
    [(4.0, 1, 7), (-2.41, 1, 7), (2.39, 1, None), (4.0, 4, 49), (4.0, 5, None)],
)
def test_a_torque_that_swings_from_limit_to_limit_is_a_stall(torque, every, found):
    """Of these the last two swing 12 and 10 times a second."""
    climb = Watched()
    for number in range(100):
        sign = 1 if number // every % 2 else -1
        if climb.finds(torques=(sign * torque, -sign * torque)):
            break
    assert (number + 1 if number < 99 else None) == found


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("drive", "turn"), [(1.0, 0.0), (0.0, LEVER)], ids=["drive", "turn"])
@pytest.mark.parametrize(
    ("adhesion", "explained"), [(Suction(), 2500 * 0.06 + 5 * GRAVITY), (NoAdhesion(), 5 * GRAVITY)]
)
def test_a_disturbance_is_explained_by_adhesion_and_weight_up_to_their_size(
    adhesion, explained, drive, turn, sign
):
    more, less = 1.001 * sign * explained, 0.999 * sign * explained
    climb = Watched(adhesion)
    assert climb.finds(disturbance=(more * drive, more * turn)) is Mode.DISTURBED
    assert climb.finds(disturbance=(less * drive, less * turn)) is None


@pytest.mark.parametrize(
    "what",
    [{"speed": 0.351}, {"speed": -0.351}, {"turn": 1.51}, {"turn": -1.51}],
    ids=str,
)
def test_a_speed_or_a_turn_is_too_fast_twice_in_a_row(what):
    slower = {name: 0.99 * value for name, value in what.items()}
    assert Watched().periods_until(Mode.TOO_FAST, **what) == 2
    assert Watched().periods_until(Mode.TOO_FAST, **slower) is None
    climb = Watched()
    assert [climb.finds(**how) for how in (what, slower, what)] == 3 * [None]


def test_friction_that_lets_go_is_forgiven_for_a_moment_after_rest_only():
    within, beyond = 0.34 + LET_GO, 0.36 + LET_GO
    climb = Watched()
    assert climb.periods_until(Mode.TOO_FAST, speed=within) == 2  # it did not rest
    for rest in (0.019, -0.019):
        climb = Watched()
        climb.finds(speed=rest)
        assert climb.periods_until(Mode.TOO_FAST, speed=within) == 11  # the second after 0.182 s
        climb.finds(speed=rest)
        assert climb.periods_until(Mode.TOO_FAST, speed=beyond) == 2


LARGEST = 4.0 / CLIMBER.wheel_radius  # [N] of a wheel's torque
UNCHECKED = {"yaw_rate_margin": 0.0, "stall_time": 0.0, "max_disturbance": 0.0}


def found_of_wheels(
    asked, acted, sines=(0.0, 0.0), speeds=(0.3, 0.3), periods=60, fast_from=60, guard=None
):
    """What is found where, in turns, these forces (right, left) [N] are asked for and these act.

    In each period the climber comes to the next speed and heading (its sine), by whatever else it
    takes beside its friction and weight, on both wheels alike. From a period on it is too fast.
    """
    guard = guard or Guard(GuardOptions(**UNCHECKED), Suction())
    mass, inertia, friction, weight = CLIMBER.inertial
    nothing = Rates(0.0, 0.0)
    speed, turn = speeds[-1], 0.0
    for number in range(periods):
        now = number % 2
        right, left = acted[now]
        before = Motion(0.0, 0.0, 0.0, 1.0, sines[now - 1], speed, turn)
        speed = speeds[now]
        turn += PERIOD * LEVER / inertia * (right - left)
        after = Motion(0.0, 0.0, 0.0, 1.0, sines[now], speed, turn)
        # by hand, (11): what drives, both wheels together
        drive = mass * (speed - before.speed) / PERIOD + weight * sines[now]
        drive += friction if speed > 0 else -friction
        assert drive == pytest.approx(right + left)
        torques = Torques(*(CLIMBER.wheel_radius * force for force in asked[now]))
        observed = Observed(before, after, PERIOD, [(torques, PERIOD)], Wrench(0.0, 0.0), REACTION)
        allowed = Rates(9.0 if number < fast_from else 0.1, 9.0)
        found = guard.watch(CLIMBER, observed, Expected(nothing, allowed, waits=False))
        if found:
            return found
    return None


HELD = CLIMBER.seal_friction / 2  # [N] of friction on each wheel


def beside(*forces):
    """Forces in turns, and what friction takes of each wheel."""
    return [(HELD + right, HELD + left) for right, left in forces]


@pytest.mark.parametrize("side", [0, 1], ids=["right", "left"])
@pytest.mark.parametrize(("share", "answers"), [(0.33, True), (0.28, False)])
def test_a_wheel_answers_that_does_a_third_of_what_is_asked(side, share, answers):
    """By hand: (1 - s)² > 5 s² for s < 0.309."""
    asked, acted = ([0.0, 0.0], [0.0, 0.0]), ([0.0, 0.0], [0.0, 0.0])
    for turn, force in enumerate((30.0, -30.0)):
        asked[turn][side] = force
        acted[turn][side] = share * force
    speeds = [0.3 + sign * 0.5 * share * 30.0 * PERIOD / 5 for sign in (1, -1)]
    found = found_of_wheels(asked, beside(*acted), speeds=speeds)
    assert found is None if answers else found[0] is Mode.DEAD_WHEEL
    if found:
        assert found[1].startswith(f"the {('right', 'left')[side]} one")


@pytest.mark.parametrize(("of_largest", "is_known"), [(0.11, False), (0.13, True)])
def test_a_wheel_that_does_nothing_is_found_where_enough_is_asked_of_it(of_largest, is_known):
    force = of_largest * LARGEST
    found = found_of_wheels([(force, 0.0), (-force, 0.0)], beside((0.0, 0.0), (0.0, 0.0)))
    assert (found is not None) == is_known


def test_a_wheel_that_leaves_the_weight_to_the_other_is_found():
    """It turns so that the weight pulls up and down in turns."""
    weight = CLIMBER.weight_along_wall * 0.9
    asked = [(weight / 2, weight), (-weight / 2, -weight)]
    acted = beside((0.0, weight), (0.0, -weight))
    found = found_of_wheels(asked, acted, sines=(0.9, -0.9))
    assert found[0] is Mode.DEAD_WHEEL
    assert found[1].startswith("the right one")


def test_a_wheel_that_leaves_friction_to_the_other_is_found():
    """It goes forth and back in turns."""
    friction, inertia = CLIMBER.seal_friction, 5 * 2 * 0.05 / PERIOD  # [N]
    both = friction + inertia
    acted = [(0.0, both), (0.0, -both)]
    asked = [(25.0, both), (-25.0, -both)]
    found = found_of_wheels(asked, acted, speeds=(0.05, -0.05))
    assert found[0] is Mode.DEAD_WHEEL
    assert found[1].startswith("the right one")


STRONG, DEAD = [(40.0, 0.0), (-40.0, 0.0)], beside((0.0, 0.0), (0.0, 0.0))


@pytest.mark.parametrize(("periods", "is_known"), [(7, False), (8, True)])
def test_a_wheel_has_its_time_to_answer(periods, is_known):
    assert (found_of_wheels(STRONG, DEAD, periods=periods) is not None) == is_known


@pytest.mark.parametrize("side", [0, 1], ids=["right", "left"])
@pytest.mark.parametrize(
    ("asked", "of_it", "of_other", "periods", "is_known"),
    [
        (0.5, 0.0, 0.0, 3, True),
        (0.5, 0.0, 0.0, 2, False),
        (-0.5, 0.0, 0.0, 3, True),
        (0.31, 0.0, 0.0, 3, True),
        (0.29, 0.0, 0.0, 9, False),  # too little to tell
        (0.5, 0.69, 0.0, 3, True),
        (0.5, 0.71, 0.0, 9, False),  # friction, weight
        (0.5, -0.29, 0.0, 3, True),
        (0.5, -0.31, 0.0, 9, False),  # something pushes it
        (0.5, 0.0, 0.24, 3, True),
        (0.5, 0.0, 0.26, 9, False),
        (0.5, 0.0, -0.26, 9, False),
    ],
)
def test_a_force_that_is_missing_at_one_wheel_alone_is_found_at_once(
    side, asked, of_it, of_other, periods, is_known
):
    force = asked * LARGEST
    forces, acted = [0.0, 0.0], [of_other * force] * 2
    forces[side], acted[side] = force, of_it * force
    torques = Torques(*(CLIMBER.wheel_radius * each for each in forces))
    guard = Guard(GuardOptions(**UNCHECKED), Suction())
    found, speed, turn, expected = None, 3.0, 0.0, Expected(Rates(0, 0), Rates(99, 99), False)
    for _ in range(periods):
        before = Motion(0.0, 0.0, 0.0, 1.0, 0.0, speed, turn)
        speed += PERIOD / 5 * (sum(acted) - CLIMBER.seal_friction)
        turn += PERIOD * LEVER / CLIMBER.yaw_inertia * (acted[0] - acted[1])
        after = Motion(0.0, 0.0, 0.0, 1.0, 0.0, speed, turn)
        known = Wrench(0.0, 0.0)
        observed = Observed(before, after, PERIOD, [(torques, PERIOD)], known, REACTION)
        found = found or guard.watch(CLIMBER, observed, expected)
    assert (found and found[0]) == (Mode.DEAD_WHEEL if is_known else None)
    if found:
        assert found[1].startswith(f"the {('right', 'left')[side]} one")


@pytest.mark.parametrize("speed", [0.2, -0.2])
@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize(("wanted", "is_stuck"), [(1.0, False), (0.6, True)])
def test_a_rim_may_stand_in_a_turn_that_is_wanted(speed, turn, wanted, is_stuck):
    """Wheels that scrub have to turn faster than the reference does, whose both rims go."""
    rate = turn * abs(speed) / CLIMBER.half_track
    guard, found = Guard(GuardOptions(), Suction()), None
    motion = Motion(0.0, 0.0, 0.0, 1.0, 0.0, speed, rate)
    observed = Observed(motion, motion, PERIOD, [], Wrench(0.0, 0.0), REACTION, 0.0, wanted * rate)
    expected = Expected(Rates(0.2, 0.6 * abs(rate)), Rates(9.0, 9.0), False, speed)
    for _ in range(30):
        found = found or guard.watch(CLIMBER, observed, expected)
    assert (found and found[0]) == (Mode.DEAD_WHEEL if is_stuck else None)


@pytest.mark.parametrize(
    ("others", "is_stuck"),
    [
        ((0.06, 0.05, 0.05), True),
        ((0.05, 0.0, 0.05, 0.05), True),
        ((0.017, 0.0, 0.0, 0.0), False),
        ((0.05, 0.05, 0.0, 0.0, 0.0, 0.02), False),  # it rests, and one wheel goes on first
    ],
)
def test_wheels_that_stop_one_message_after_the_other_are_none_that_is_stuck(others, is_stuck):
    """A seal that has let go sticks again; of a coarse encoder, one wheel shows it first."""
    rim = RimStop()
    rim.add(0.06, 0.06, 0.0)
    for other in others:
        rim.add(0.0, other, 0.0)
    assert rim.is_stuck == is_stuck


def test_what_a_wheel_did_before_a_rest_is_forgotten():
    guard = Guard(GuardOptions(**UNCHECKED), Suction())
    assert found_of_wheels(STRONG, DEAD, periods=7, guard=guard) is None
    standing = Motion(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    rests = Observed(standing, standing, PERIOD, [], Wrench(0.0, 0.0), REACTION)
    guard.watch(CLIMBER, rests, Expected(Rates(0.0, 0.0), Rates(9.0, 9.0), waits=False))
    assert found_of_wheels([(0.0, 0.0)] * 2, DEAD, periods=12, guard=guard) is None
    assert found_of_wheels(STRONG, DEAD, guard=guard) is not None


def test_where_both_torques_swing_and_nothing_acts_neither_wheel_answers():
    found = found_of_wheels([(60.0, 60.0), (-60.0, -60.0)], DEAD)
    assert found[0] is Mode.DEAD_WHEEL
    assert found[1].startswith("neither one")
    weak = 0.1 * LARGEST
    assert found_of_wheels([(weak, weak), (-weak, -weak)], DEAD) is None


@pytest.mark.parametrize("fast_from", [20, 60])
def test_less_proof_is_needed_where_it_is_too_fast_as_well(fast_from):
    force = 0.06 * LARGEST
    found = found_of_wheels([(force, 0.0), (-force, 0.0)], DEAD, fast_from=fast_from)
    assert (found and found[0]) == (Mode.DEAD_WHEEL if fast_from < 60 else None)


def rest_that_heals(mode, turn=0.0):
    """Seconds of a turn in place [rad/s] until a fault is over; None: not within 10 s."""
    guard = Guard(GuardOptions(), Suction())
    guard.count(SECOND, (mode, "what"))
    motion = Motion(0.0, 0.0, 0.0, 1.0, 0.0, 0.0, turn)
    for number in range(1, 501):
        guard.rest(CLIMBER, motion, PERIOD)
        if guard.fault is None:
            return number * PERIOD
    return None


@pytest.mark.parametrize(
    ("mode", "turn", "seconds"),
    [
        (Mode.TOO_FAST, 0.0, 0.52),
        (Mode.DISTURBED, -0.066, 0.52),
        (Mode.DISTURBED, 0.067, None),  # a wheel's rim is at 0.02 m/s
        (Mode.STALLED, 0.0, 5.0),
        (Mode.DEAD_WHEEL, 0.0, None),  # somebody has to look
        (Mode.SIGN_WRONG, 0.0, None),
    ],
)
def test_a_fault_is_over_after_a_rest_but_for_some(mode, turn, seconds):
    assert rest_that_heals(mode, turn) == (seconds and pytest.approx(seconds, abs=0.021))
