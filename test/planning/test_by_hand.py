"""A stick's speeds become a reference that is smooth, and ends at rest whatever is lost."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from under_way import CONFIG, Travelling, UnderWay

from climber_uk.closed_loop.node_parameters import read_parameters
from climber_uk.control.safety import Mode
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Line
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.messages.topics import STICK_LOCK
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.planning.by_hand import ByHand, HandOptions
from climber_uk.planning.course import CourseOptions
from climber_uk.ros import plant_parts

OPTIONS, HAND = CourseOptions(), HandOptions(input="twist", speed=0.25, yaw_rate=0.6)
ASKED = st.lists(
    st.tuples(st.floats(0.05, 2.0), st.floats(-0.4, 0.4), st.floats(-1.0, 1.0)), max_size=4
)


def begun(pose=(0.0, 0.0, 0.0)):
    return ByHand(np.array(pose), 0, OPTIONS, HAND, lambda reference, time: (time, reference))


def driven(by_hand, asked, after=4.0):
    """Points by their time that were near the climber, of a stick that is moved again and again."""
    points, time, last = {}, 0.0, None
    for wait, speed, yaw_rate in [*asked, (after, None, None)]:
        for now in np.arange(time, time + wait, 0.1):
            at = round(now * SECOND)
            if speed is not None:
                by_hand.command(speed, yaw_rate, at)
            last = by_hand.preview(at, at)
            for when, reference in last:
                key = round(when / OPTIONS.point_period)
                if when <= now + OPTIONS.reaction:
                    assert points.setdefault(key, reference) is reference, "taken back"
            assert not last[-1][1].velocity.any() or abs(last[-1][1].velocity).max() < 1e-12
        time += wait
    return [points[key] for key in sorted(points)], last


@settings(max_examples=5)
@given(ASKED)
def test_it_is_smooth_within_its_limits_and_ends_at_rest(asked):
    references, last = driven(begun(), asked)
    speed = np.array([reference.speed for reference in references])
    assert np.abs(speed).max() <= HAND.speed + 1e-9
    yaw_rate = np.array([reference.velocity[2] for reference in references])
    assert np.abs(yaw_rate).max() <= HAND.yaw_rate + 1e-9
    acceleration = np.array([reference.forward_acceleration for reference in references])
    assert np.abs(acceleration).max() <= 15 / 8 * HAND.speed / HAND.ramp_time + 1e-9
    for part, rate in (("pose", "velocity"), ("velocity", "acceleration")):
        values, rates = (np.array([getattr(r, n) for r in references]) for n in (part, rate))
        means = (rates[:-1] + rates[1:]) / 2 * OPTIONS.point_period
        np.testing.assert_allclose(np.diff(values, axis=0), means, atol=2e-3)
    assert np.abs(last[-1][1].velocity).max() < 1e-12
    assert np.abs(last[0][1].velocity).max() < 1e-12  # silent for long, it rests


def test_straight_on_it_is_as_fast_as_asked_and_a_turn_is_a_circle():
    by_hand = begun((1.0, 2.0, 0.5))
    references, _ = driven(by_hand, [(3.0, 0.2, 0.0)], after=0.1)
    assert references[-1].speed == pytest.approx(0.2)
    by_hand = begun()
    references, _ = driven(by_hand, [(8.0, 0.2, 0.4)], after=0.1)
    poses = np.array([reference.pose for reference in references[-100:]])
    centre = poses[:, :2] + 0.5 * np.c_[-np.sin(poses[:, 2]), np.cos(poses[:, 2])]
    np.testing.assert_allclose(centre, np.broadcast_to(centre[0], centre.shape), atol=1e-8)


@pytest.mark.parametrize("speeds", [(math.nan, 0.0), (0.1, math.inf)])
def test_speeds_that_are_none_are_refused(speeds):
    with pytest.raises(ValueError, match="must be finite"):
        begun().command(*speeds, 0)


def slipping_plant(**parameters):
    """The plant of climber.yaml, whose wheels may slip."""
    given = {**read_file(CONFIG, "/plant_simulator"), "slip": True, **parameters}
    return plant_parts.parts(Values(given)).plant


@pytest.mark.parametrize(
    "heading", [-np.pi / 2, *(pytest.param(it, marks=pytest.mark.soak) for it in (np.pi / 2, 0.0))]
)
def test_a_stick_that_is_lost_at_full_speed_stops_the_climber_without_slip_or_a_jump(heading):
    """It rests by the end of the first preview that is published once `timeout` is over."""
    line = Trajectory(Line(length=1.0, direction=heading), RestToRest(rate=0.1))
    start = State(line.at(0.0).pose, np.zeros(3))
    climb = UnderWay(line, state=start, plant_of=lambda _: slipping_plant())
    start = climb.now
    hand = ByHand(
        line.at(0.0).pose,
        start,
        OPTIONS,
        HAND,
        lambda reference, time: (start + round(time * SECOND), reference),
    )
    lost, ends = 4.0, []

    def preview(position):
        since = (climb.now - start) / SECOND - lost
        if since <= 0:
            hand.command(1.0, 0.0, climb.now)
        rows = hand.preview(position, climb.now)
        if since > HAND.timeout:
            ends.append(rows[-1][0])
        return rows

    climb.course.preview = preview
    climb.run(lost)
    assert climb.states[-1].forward_speed == pytest.approx(HAND.speed, rel=0.02)
    climb.run(5.0, until=lambda: ends and climb.now >= ends[0])
    within = HAND.timeout + OPTIONS.reaction + 3 * OPTIONS.publish_period + HAND.ramp_time
    assert climb.now - start <= (lost + within) * SECOND + 1
    assert climb.states[-1].forward_speed == pytest.approx(0.0, abs=1e-3)
    assert set(climb.modes) == {Mode.FOLLOWING}
    assert climb.largest_jump <= 0.2
    assert max(abs(state.side_slip) for state in climb.states) <= 1e-9
    assert not any(state.slip.any() for state in climb.states[1:])


def test_a_stick_that_is_locked_stops_the_climber_and_is_ignored_until_it_is_not():
    line = Trajectory(Line(length=1.0, direction=-np.pi / 2), RestToRest(rate=0.1))
    climb = Travelling(line, state=State(line.at(0.0).pose, np.zeros(3)))

    def steer(seconds):
        for _ in range(round(10 * seconds)):
            climb.stick(1.0, 0.0)
        return climb.state.forward_speed

    assert steer(2.0) == pytest.approx(0.2, rel=0.02)
    climb.journey.lock(True)
    within = OPTIONS.reaction + 3 * OPTIONS.publish_period + HAND.ramp_time
    assert steer(within) == pytest.approx(0.0, abs=1e-3)
    assert steer(0.5) == pytest.approx(0.0, abs=1e-3)
    climb.journey.lock(False)
    assert steer(2.0) == pytest.approx(0.2, rel=0.02)
    assert climb.largest_jump <= 0.2


def test_a_lock_of_no_stick_is_refused():
    with pytest.raises(ValueError, match="lock=true needs an input"):
        HandOptions(lock=True)


def test_what_a_gamepad_sends_by_its_file_is_what_the_planner_takes():
    gamepad, planner = CONFIG.with_name("joystick.yaml"), "/trajectory_publisher"
    hand = Values(read_parameters(gamepad, planner)).read(HandOptions, "by_hand.")
    sends = read_file(gamepad, "/teleop_twist_joy_node")
    assert hand.input == ("twist_stamped" if sends["publish_stamped_twist"] else "twist")
    assert (hand.speed, hand.yaw_rate) == (sends["scale_linear.x"], sends["scale_angular.yaw"])
    assert 1 / read_file(gamepad, "/joy_node")["autorepeat_rate"] <= hand.timeout / 2


def test_the_lock_of_twist_mux_by_its_file_is_the_planners_and_above_all():
    mux = read_file(CONFIG.with_name("twist_mux.yaml"), "/twist_mux")
    assert mux["locks.by_hand_lock.topic"] == STICK_LOCK
    priorities = {name: of for name, of in mux.items() if name.endswith("priority")}
    assert max(priorities, key=priorities.get) == "locks.by_hand_lock.priority"
