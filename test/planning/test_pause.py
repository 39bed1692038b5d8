"""Asked for while its path is not driven: the climber rests where it is, and goes on from there."""

import numpy as np
import pytest
from under_way import Travelling

from climber_uk.control.safety import Mode
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Line
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.planning.journey import AT_BEGINNING, AT_END, WAITS

LINE = Trajectory(Line(length=1.0), RestToRest(rate=0.2, ramp_time=1.0))
OTHER = Trajectory(Line(length=1.0), RestToRest(rate=0.2, ramp_time=1.0), origin=(0.5, 0.0))
BEHIND = State(np.array([-0.25, 0.0, 0.0]), np.zeros(3))  # from where it is approached
BRAKES = 0.05  # [m] in which it does, at 0.1 m/s
LONGEST = 60.0  # [s]


def moved(climber, seconds):
    """How far [m] it gets meanwhile from where it is."""
    first = len(climber.states)
    climber.run(seconds)
    return np.hypot(*(climber.places[first:] - climber.places[first]).T).max()


def comes_to(climber, mode):
    climber.run(LONGEST, until=lambda: climber.modes[-1] is mode)
    assert climber.modes[-1] is mode


def on_its_way():
    """A climber that is driving to its path."""
    climber = Travelling(LINE, state=BEHIND)
    climber.run(LONGEST, until=lambda: abs(climber.state.forward_speed) > 0.05)
    assert climber.modes[-1] is Mode.APPROACHING
    return climber


def disabled():
    """A climber that was disabled in mid-course, and has come to rest."""
    climber = Travelling(LINE).run(2.5)
    climber.controller.enable(False)
    return climber.run(0.5)


def test_paused_on_its_way_it_rests_where_it_is_and_goes_on_from_there():
    climber = on_its_way()
    climber.pause()
    assert moved(climber, 2.0) < BRAKES
    assert moved(climber, 0.5) < 1e-4
    assert climber.journey.is_held
    climber.go_on()
    comes_to(climber, Mode.APPROACHING)
    comes_to(climber, Mode.FOLLOWING)
    assert climber.places[-1] == pytest.approx((0.0, 0.0), abs=1e-3)
    assert climber.largest_jump <= 0.2


def test_a_goal_that_is_cancelled_on_its_way_ends_where_it_is():
    climber = on_its_way()
    climber.journey.halt(climber.position, climber.is_driven)
    assert moved(climber, 2.0) < BRAKES
    climber.replace(OTHER)
    assert not climber.journey.is_paused
    comes_to(climber, Mode.APPROACHING)


def test_paused_while_it_is_disabled_it_does_not_move_when_it_is_enabled():
    climber = disabled()
    climber.pause()
    climber.run(0.1)
    climber.controller.enable(True)
    assert moved(climber, 2.0) < 1e-3


@pytest.mark.parametrize("speed", [0.2, 1.0])
def test_what_is_asked_while_it_is_disabled_holds_from_the_first_moment_on(speed):
    climber = disabled()
    place = climber.places[-1, 0]
    climber.set_speed(speed)
    if speed == 1.0:
        climber.retreat()
    climber.run(0.1)
    climber.controller.enable(True)
    first = len(climber.states)
    climber.run(2.0)
    moves = [state.forward_speed for state in climber.states[first:]]
    if speed == 1.0:
        assert climber.places[first:, 0].max() < place + 1e-3
        assert min(moves) < -0.1
    else:
        assert max(moves) < 1.1 * speed * 0.2
        assert climber.places[-1, 0] > place


def test_another_path_waits_as_long_as_it_is_paused():
    climber = Travelling(LINE).run(1.0)
    climber.pause()
    climber.run(2.0)
    climber.journey.planned = OTHER
    assert climber.journey.begin("path", climber.position, climber.is_driven) == (False, WAITS)
    assert moved(climber, 1.0) < 1e-3
    climber.go_on()
    comes_to(climber, Mode.APPROACHING)
    climber.run(0.6)
    assert climber.journey.course.trajectory is OTHER


def test_a_stick_takes_a_climber_that_is_held_and_gives_it_back():
    climber = on_its_way()
    climber.pause()
    climber.run(2.0)
    climber.stick(0.0, 0.0)  # as one does that is not touched
    assert climber.journey.is_held
    for _ in range(10):
        climber.stick(-0.1, 0.0)
    assert not climber.journey.is_held
    assert moved(climber, 2.0) > 0.05
    climber.go_on()
    comes_to(climber, Mode.APPROACHING)


def test_where_nothing_is_left_to_go_along_it_is_said():
    climber = Travelling(LINE).run(0.1)
    assert climber.journey.retreat(climber.position) == AT_BEGINNING
    climber.run(LONGEST, until=lambda: climber.journey.course.is_done(climber.position))
    assert climber.journey.go_on(climber.position) == AT_END
    assert climber.journey.retreat(climber.position)[0]
