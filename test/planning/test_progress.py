"""How far a course is, by hand."""

import math

import numpy as np
import pytest

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.shapes import Circle, Ellipse, Line
from climber_uk.mechanics.summary import summary
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.waypoints import Waypoints
from climber_uk.planning.course import Course, CourseOptions
from climber_uk.planning.progress import Odometer, progress

LAW = RestToRest(rate=0.5, ramp_time=2.0)


def begun(trajectory):
    return Course(trajectory, 0, CourseOptions(), lambda reference, time: reference)


def told(course, seconds, mode="following"):
    return progress(course, Odometer(course.trajectory), round(seconds * SECOND), mode)


def test_of_a_line_it_tells_what_is_done_and_left():
    """3 m at 0.5 m/s: 8 s, of which both ramps lose 1 s."""
    course = begun(Trajectory(Line(3.0), LAW))
    half = told(course, 4.0)
    assert (half.done, half.left, half.time_left) == pytest.approx((1.5, 1.5, 4.0))
    assert (half.lap, half.segment, half.state) == (1, 1, "following")
    end = told(course, 20.0)
    assert (end.done, end.left, end.time_left) == pytest.approx((3.0, 0.0, 0.0))
    assert end.state == "done"


def test_time_left_is_by_the_speed_asked_for():
    course = begun(Trajectory(Line(3.0), LAW))
    course.set_speed(0.25, 0)
    assert told(course, 0.0).time_left == pytest.approx(8.0 / 0.25)


def test_laps_are_counted_and_their_length_is_that_of_the_path():
    law = RestToRest(rate=0.5, ramp_time=2.0, laps=3)
    trajectory = Trajectory(Ellipse(2.0, 1.0), law)
    course, length = begun(trajectory), summary(trajectory).length
    lap = 2 * math.pi / 0.5
    for time, number in ((1.0, 1), (1.5 * lap + 1.0, 2), (2.5 * lap + 1.0, 3), (99.0, 3)):
        how_far = told(course, time)
        assert how_far.lap == number
        assert how_far.done + how_far.left == pytest.approx(3 * length, rel=1e-6)
    assert told(course, 99.0).done == pytest.approx(3 * length, rel=1e-6)


def test_runs_forth_and_back_are_all_driven():
    trajectory = Trajectory(Line(3.0), RestToRest(rate=0.5, ramp_time=2.0, runs=2, pause=1.0))
    course = begun(trajectory)
    back = told(course, 13.0)
    assert (back.done, back.left) == pytest.approx((4.5, 1.5))
    assert back.lap == 2


@pytest.mark.parametrize(
    "trajectory",
    [
        Trajectory(Circle(2.0), ConstantRate(0.25)),
        Trajectory(Circle(2.0), RestToRest(rate=0.25, ramp_time=2.0, runs=0)),
        Trajectory(Line(2.0), RestToRest(rate=0.25, ramp_time=2.0, runs=0)),
    ],
)
def test_without_an_end_nothing_is_left_to_tell_but_the_distance_grows(trajectory):
    course = begun(trajectory)
    way = [told(course, time) for time in np.arange(0.0, 200.0, 7.0)]
    assert all(math.isinf(here.left) and math.isinf(here.time_left) for here in way)
    assert (np.diff([here.done for here in way]) > 0).all()
    speed = np.abs(trajectory.at(np.linspace(0, 196, 20001)).speed)
    assert way[-1].done == pytest.approx(np.trapezoid(speed) * 196 / 20000, rel=1e-3)


def test_segments_are_the_points_of_the_file(tmp_path):
    """One is left out, as it is where another one is; then it drives back."""
    points = [[0, 0], [1, 0], [1, 0], [1, 1], [0, 1], [0.5, 1]]
    np.savetxt(tmp_path / "points.txt", points)
    trajectory = Trajectory(Waypoints(file=str(tmp_path / "points.txt")), LAW)
    course = begun(trajectory)
    seen = []
    for time in np.arange(0.0, trajectory.duration + 1.0, 0.2):
        x, y, _ = trajectory.at(time).pose
        number = told(course, time).segment
        a, b = np.array(points[number - 1]), np.array(points[number])
        if number == 2:  # the two that are at the same place
            b = np.array(points[3])
        gap = np.array([x, y]) - a
        share = np.clip(gap @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        assert np.hypot(*(gap - share * (b - a))) <= 0.05
        seen.append(number)
    assert sorted(set(seen)) == [1, 2, 4, 5]
    assert seen == sorted(seen)


def test_its_state_is_what_the_climber_does():
    course = begun(Trajectory(Line(3.0), LAW))
    assert told(course, 3.0, "").state == "following"  # no controller tells
    assert told(course, 3.0, "approaching").state == "approaching"
    assert told(course, 3.0, "no_odometry").state == "waiting"
    course.pause(3 * SECOND)
    assert told(course, 3.2).state == "following"
    assert told(course, 9.0).state == "paused"


def test_back_at_the_beginning_nothing_is_driven():
    course = begun(Trajectory(Line(3.0), LAW))
    course.go_on(3 * SECOND, -1)
    assert told(course, 99.0).done == pytest.approx(0.0, abs=1e-9)
    assert told(course, 99.0).state == "done"
