import pytest

from climber_uk.control.timing import TorqueHistory
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import Torques


@pytest.fixture
def acting():
    acting = TorqueHistory()
    for second, torque in ((1, 1.0), (2, 2.0), (4, 3.0)):
        acting.add(second * SECOND, Torques(torque, torque))
    return acting


def spans(acting, start, end):
    between = acting.between(round(start * SECOND), round(end * SECOND))
    return [(torques[0], time) for torques, time in between]


def test_every_torque_acts_until_the_next_one(acting):
    assert spans(acting, 0, 5) == [(0, 1), (1, 1), (2, 2), (3, 1)]
    assert spans(acting, 1.5, 2.25) == [(1, 0.5), (2, 0.25)]
    assert spans(acting, 2, 4) == [(2, 2)]
    assert spans(acting, 6, 6) == []


def test_none_overtakes_the_last(acting):
    assert acting.begin(3 * SECOND) == 4 * SECOND
    assert acting.begin(5 * SECOND) == 5 * SECOND


def test_what_is_forgotten_does_not_change_what_comes(acting):
    before = spans(acting, 2.5, 5)
    acting.forget_before(round(2.5 * SECOND))
    assert spans(acting, 2.5, 5) == before
    assert acting.are_known_since(2 * SECOND)
    assert not acting.are_known_since(SECOND)


def test_after_a_restart_the_last_torques_have_always_acted(acting):
    acting.restart()
    assert spans(acting, 0, 1) == [(3, 1)]
    assert acting.are_known_since(0)


def test_nothing_is_known_at_first():
    assert not TorqueHistory().are_known_since(0)
    assert TorqueHistory().last == (0, 0)
