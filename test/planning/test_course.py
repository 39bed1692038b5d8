"""What an operator asks for, at any time: smoothly, on the path, and never faster than planned."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from under_way import CONFIG, UnderWay

from climber_uk.control.safety import Mode
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.shapes import Circle, Line
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.mechanics.waypoints import Waypoints
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.planning.course import Course, CourseOptions

LINE = Trajectory(Line(length=3.0), RestToRest(rate=0.2, ramp_time=2.0))
OPTIONS = CourseOptions()


def course(trajectory, **how):
    """A course that started at 1 s, whose points are (time, reference)."""
    return Course(trajectory, SECOND, OPTIONS, lambda reference, time: (time, reference), **how)


def at(seconds):
    return SECOND + round(seconds * SECOND)


def climber_trajectory():
    return build_trajectory(Values(read_file(CONFIG, "/trajectory_publisher")).read)


def lanes():
    law = RestToRest(rate=0.2, ramp_time=2.0)
    return Trajectory(
        Waypoints(file=str(Path(CONFIG).parent / "lanes.csv")), law, origin=(0.0, 3.0)
    )


def asked_at_random(under_way, random, number):
    """Let an operator ask for `number` things, one after the other, each after some time."""
    course, path = under_way.course, under_way.course.trajectory.path(4001)[:, :2]
    asked = {
        "pause": lambda: course.pause(under_way.position),
        "go on": lambda: course.go_on(under_way.position),
        "speed": lambda: course.set_speed(random.uniform(0.2, 1.0), under_way.position),
        "retreat": lambda: course.go_on(under_way.position, -1),
    }
    for _ in range(number):
        what = random.choice(list(asked), p=[0.3, 0.4, 0.2, 0.1])
        asked[what]()
        came_from = len(under_way.positions)
        under_way.run(random.exponential(1.2) + 0.05)
        # by then a retreat may have been asked for before, and come to rest since
        if what == "go on" and under_way.positions[came_from - 1] < under_way.positions[-1]:
            since = np.array(under_way.positions[came_from:])
            turned = int(np.argmin(since))
            assert (np.diff(since[turned:]) >= -1e-9).all()
    assert set(under_way.modes) == {Mode.FOLLOWING}
    assert under_way.largest_jump <= 0.2
    off = [np.hypot(*(path - place).T).min() for place in under_way.places[::20]]
    assert max(off) <= 10e-3
    fastest = max(abs(state.forward_speed) for state in under_way.states)
    assert fastest <= 1.02 * np.abs(course.trajectory.at(np.linspace(0, 60, 6001)).speed).max()


@pytest.mark.parametrize(
    "trajectory", [climber_trajectory, pytest.param(lanes, marks=pytest.mark.soak)]
)
def test_whatever_is_asked_at_any_time_the_climber_stays_on_its_path_and_no_torque_jumps(
    trajectory,
):
    asked_at_random(UnderWay(trajectory()), np.random.default_rng(21), 6)


@pytest.mark.soak
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("trajectory", [climber_trajectory, lanes])
def test_two_hundred_times(trajectory):
    asked_at_random(UnderWay(trajectory()), np.random.default_rng(7), 200)


ASKED = st.lists(
    st.tuples(st.floats(0.0, 4.0), st.sampled_from(["pause", "go on", "back", 0.3, 1.0])),
    max_size=10,
)


@settings(max_examples=10)
@given(ASKED, st.floats(0.0, 10.0))
def test_its_points_go_on_from_each_other_and_speed_up_no_harder_than_planned(asked, begin):
    """What is near is not taken back; the acceleration is at most half again that of the law."""
    under_way, time, points = course(LINE), begin, {}
    planned = LINE.at(np.linspace(0, 20, 4001))

    def publish(time):
        for when, reference in under_way.preview(at(time)):
            key = round(when / OPTIONS.point_period)
            if key in points and when <= time + OPTIONS.reaction - OPTIONS.point_period:
                assert points[key] is reference or when > soonest
            points[key] = reference

    soonest = np.inf
    for wait, what in asked:
        for step in np.arange(time, time + wait, 0.1):
            publish(step)
        time += wait
        soonest = time + OPTIONS.reaction
        if isinstance(what, float):
            under_way.set_speed(what, at(time))
        elif what == "pause":
            under_way.pause(at(time))
        else:
            under_way.go_on(at(time), -1 if what == "back" else 1)
        publish(time)
    for step in np.arange(time, time + 5, 0.1):
        publish(step)
    place = np.array([points[key].pose[0] for key in sorted(points)])
    speed = np.array([points[key].velocity[0] for key in sorted(points)])
    acceleration = np.array([points[key].acceleration[0] for key in sorted(points)])
    assert np.abs(speed).max() <= np.abs(planned.speed).max() + 1e-9
    assert np.abs(acceleration).max() <= 1.5 * np.abs(planned.forward_acceleration).max() + 1e-9
    # what was published once and is still ahead belongs together: Simpson's rule between points
    if np.diff(sorted(points)).max(initial=1) == 1:
        means = (speed[:-1] + speed[1:]) / 2 - np.diff(acceleration) * OPTIONS.point_period / 12
        np.testing.assert_allclose(np.diff(place), means * OPTIONS.point_period, atol=1e-5)


def test_it_rests_where_it_was_paused_and_goes_on_from_there():
    under_way = course(LINE)
    under_way.pause(at(5.02))
    assert not under_way.rests(at(5.02))
    (_, first), *_, (_, last) = under_way.preview(at(9.0))
    assert under_way.rests(at(9.0))
    np.testing.assert_array_equal(first.pose, last.pose)
    assert np.abs(last.velocity).max() < 1e-12
    under_way.go_on(at(20.0))
    *_, (time, moving) = under_way.preview(at(25.0))
    # what it has lost: by hand, the time between the two ramps' beginnings
    lost = round((20.3 - 5.35) / 0.05) * 0.05
    np.testing.assert_allclose(moving.pose, LINE.at(time - lost).pose, atol=1e-12)


def test_a_course_that_begins_paused_waits_at_its_beginning():
    under_way = course(LINE, is_paused=True)
    assert under_way.rests(at(3.0))
    assert all(not reference.velocity.any() for _, reference in under_way.preview(at(3.0)))
    under_way.go_on(at(3.0))
    *_, (_, reference) = under_way.preview(at(9.0))
    assert reference.speed == pytest.approx(0.2)


def test_back_at_its_beginning_it_is_done_and_goes_on_from_there_however_late():
    under_way = course(LINE)
    under_way.go_on(at(5.0), -1)
    assert not under_way.is_done(at(9.0))
    assert under_way.is_done(at(30.0))
    *_, (_, reference) = under_way.preview(at(30.0))
    np.testing.assert_allclose(reference.pose, LINE.at(0.0).pose, atol=1e-12)
    under_way.go_on(at(500.0))
    assert not under_way.is_done(at(501.0))
    assert under_way.is_done(at(500.3 + 2.0 + LINE.duration))


def test_from_its_end_it_goes_back_at_once():
    under_way = course(LINE)
    assert under_way.is_done(at(100.0))
    under_way.go_on(at(100.0), -1)
    assert not under_way.is_done(at(101.0))
    *_, (_, reference) = under_way.preview(at(105.0))
    assert reference.speed == pytest.approx(-0.2)
    np.testing.assert_allclose(reference.pose[2], LINE.at(1.0).pose[2])


def test_a_course_without_an_end_brakes_in_stop_time_and_is_never_done():
    circle = Trajectory(Circle(), ConstantRate(0.2))
    under_way = course(circle)
    assert under_way.ramp_time == OPTIONS.stop_time
    under_way.pause(at(5.0))
    assert under_way.rests(at(6.35))
    assert not under_way.is_done(at(1e6))


def test_nothing_asked_for_nothing_changed():
    """To the last bit: simulations repeat."""
    whole = {}
    under_way = course(LINE)
    for time in np.arange(0, 20, 0.1):
        whole |= dict(under_way.preview(at(time)))
    for time, reference in whole.items():
        np.testing.assert_array_equal(reference.pose, LINE.at(time).pose)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"preview": 0.1}, "preview=0.1 must be >= 2 publish_period=0.1 [s]"),
        ({"publish_period": 1e-9}, "publish_period=1e-09 must be >= 0.001 [s]"),
        ({"point_period": 1e-9}, "point_period=1e-09 must be >= 0.00153 [s], a 1500th of preview"),
        ({"preview": 1e9}, "point_period=0.05 must be >= "),
        ({"reaction": 1e9}, "point_period=0.05 must be >= "),
    ],
)
def test_previews_that_cannot_be_published_are_refused(changes, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        replace(OPTIONS, **changes)
