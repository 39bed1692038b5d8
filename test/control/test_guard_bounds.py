"""The guard by itself: what is just within its bounds, and what just beyond."""

import pytest

from climber_uk.control.estimator import Observed
from climber_uk.control.guard import Expected, Guard, GuardOptions, Rates
from climber_uk.control.safety import Mode
from climber_uk.mechanics.adhesion import Suction
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.quantities import Motion, Torques, Wrench

CLIMBER = Climber(max_wheel_torque=4.0)
EXPLAINED = 2500 * 0.06 + 5 * GRAVITY  # [N] suction and weight
LEVER = 0.3  # [m]
PERIOD = 0.02  # [s]
REACTION = 0.02  # [s]
LET_GO = CLIMBER.seal_friction / 5 * (REACTION + 0.012)  # [m/s]


class Watched:
    """A guard of a climber that always does the same."""

    def __init__(self):
        self.guard = Guard(GuardOptions(), Suction())

    def finds(self, speed=0.1, turn=0.0, torques=(0.0, 0.0), disturbance=(0.0, 0.0), **expected):
        """What it finds in the next period."""
        wanted = Rates(*expected.get("wanted", (0.2, 0.0)))
        expected = Expected(wanted, Rates(0.3, 0.5), expected.get("waits", False))
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
        ({"speed": 0.0, "wanted": (0.0, 0.0), "torques": (4.0, 4.0)}, None),  # it is to rest
        ({"waits": True, "torques": (3.95, 0.0)}, 6),
        ({"waits": True, "torques": (3.9, 0.0)}, None),
        ({"waits": False, "torques": (4.0, 4.0)}, None),
    ],
    ids=str,
)
def test_a_climber_is_stalled_if_it_stands_or_its_reference_waits(what, periods):
    assert Watched().periods_until(Mode.STALLED, **what) == periods


def test_a_stall_that_was_interrupted_counts_from_the_beginning():
    climb = Watched()
    for _ in range(5):
        assert climb.finds(speed=0.0, torques=(2.41, 2.41)) is None
    assert climb.finds(speed=0.0) is None
    assert climb.periods_until(Mode.STALLED, speed=0.0, torques=(2.41, 2.41)) == 6


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    "most", [(EXPLAINED, 0.0), (0.0, LEVER * EXPLAINED)], ids=["drive", "turn"]
)
def test_a_disturbance_is_explained_by_adhesion_and_weight_up_to_their_size(most, sign):
    drive, turn = most
    more, less = 1.001 * sign, 0.999 * sign
    assert Watched().finds(disturbance=(more * drive, more * turn)) is Mode.DISTURBED
    assert Watched().finds(disturbance=(less * drive, less * turn)) is None


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
