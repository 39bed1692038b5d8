"""Speeds, stops and tags of points: each tag is told once, in order, when it is reached."""

import numpy as np
import pytest

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.shapes import Line
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.waypoints import Waypoints
from climber_uk.planning.course import Course, CourseOptions
from climber_uk.planning.events import Events

LAW = RestToRest(rate=0.5, ramp_time=1.0)
STRAIGHT = """x,y,speed,dwell,tag
0,0,,,start
1,0,0.2,,slowly
2,0,,3,rest
3,0,,,end
"""
SQUARE = """x,y,tag,dwell
0,0,a,
1,0,b,
1,1,c,2
0,1,d,
0,0,e,
"""


def through(folder, text, law=LAW, **how):
    file = folder / "points.csv"
    file.write_text(text)
    return Trajectory(Waypoints(file=str(file), tolerance=0.01), law, **how)


def told(course, events, until, period=0.05, asked=()):
    """Tags with times [s] and places, as the climber follows; `asked` [s] of the course."""
    found, asked = [], list(asked)
    for time in np.arange(0.0, until, period):
        position = round(time * SECOND)
        while asked and asked[0][0] <= time:
            asked.pop(0)[1](position)
        found += events.reached(*course.own_time(position), position)
    return [(event.tag, event.stamp / SECOND, event.place) for event in found]


def begun(trajectory, **how):
    return Course(trajectory, 0, CourseOptions(), lambda reference, time: reference, **how)


def test_it_is_no_faster_than_a_segment_says_and_rests_as_long_as_a_point_says(tmp_path):
    trajectory = through(tmp_path, STRAIGHT)
    time = np.linspace(0.0, trajectory.duration, 20001)
    reference = trajectory.at(time)
    x, speed = reference.pose[:, 0], reference.speed
    assert speed[(x > 1.0) & (x < 2.0)].max() <= 0.2 + 1e-9
    assert speed[(x > 1.3) & (x < 1.7)] == pytest.approx(0.2)
    assert speed[x < 1.0].max() == pytest.approx(0.5, abs=1e-3)
    assert speed[x > 2.0].max() == pytest.approx(0.5, abs=1e-3)
    assert np.abs(reference.forward_acceleration).max() <= 1.15 * 0.5 + 15 / 8 * 0.5
    rests = time[(speed < 1e-9) & (np.abs(x - 2.0) < 1e-6)]
    assert np.ptp(rests) == pytest.approx(3.0, abs=0.05)


def test_tags_are_told_when_they_are_reached(tmp_path):
    trajectory = through(tmp_path, STRAIGHT, origin=(5.0, 1.0))
    found = told(begun(trajectory), Events(trajectory), 60.0)
    assert [tag for tag, *_ in found] == ["start", "slowly", "rest", "end"]
    for (_, time, place), x in zip(found, (0.0, 1.0, 2.0, 3.0), strict=True):
        assert place == pytest.approx((5.0 + x, 1.0), abs=1e-6)
        assert trajectory.at(time).pose[0] == pytest.approx(5.0 + x, abs=1e-3)


def test_paused_and_sent_back_it_tells_each_tag_once(tmp_path):
    trajectory = through(tmp_path, STRAIGHT)
    course = begun(trajectory)
    asked = [
        (1.0, course.pause),
        (6.0, course.go_on),
        (9.0, lambda position: course.go_on(position, -1)),
        (20.0, course.go_on),
    ]
    found = told(course, Events(trajectory), 90.0, asked=asked)
    assert [tag for tag, *_ in found] == ["start", "slowly", "rest", "end"]
    assert found[1][1] < 9.0 < 20.0 < found[2][1]


def test_each_lap_has_all_of_its_tags_and_its_rest(tmp_path):
    law = RestToRest(rate=0.5, ramp_time=1.0, laps=2, runs=2)
    trajectory = through(tmp_path, SQUARE, law)
    found = told(begun(trajectory), Events(trajectory), trajectory.duration + 2)
    assert [tag for tag, *_ in found] == ["a", "b", "c", "d", "e"] * 4
    once = through(tmp_path, SQUARE, RestToRest(rate=0.5, ramp_time=1.0)).duration
    plain = through(tmp_path, SQUARE.replace(",2\n", ",\n"), RestToRest(rate=0.5, ramp_time=1.0))
    assert once >= plain.duration + 2.0


def test_a_path_without_an_end_tells_on(tmp_path):
    trajectory = through(tmp_path, SQUARE.replace(",2\n", ",\n"), ConstantRate(0.5))
    found = told(begun(trajectory), Events(trajectory), 80.0)
    tags = [tag for tag, *_ in found]
    assert tags == (["a", "b", "c", "d", "e"] * 5)[: len(tags)]
    assert len(tags) > 12


def test_what_it_does_not_come_by_is_left_out(tmp_path):
    trajectory = through(tmp_path, STRAIGHT)
    events = Events(trajectory)
    events.skip(trajectory.duration / 2)
    found = told(begun(trajectory, begin=trajectory.duration / 2), events, 60.0)
    assert [tag for tag, *_ in found] == ["rest", "end"]


def test_points_that_are_left_out_leave_their_marks_where_they_were(tmp_path):
    near = "x,y,tag,dwell\n0,0,a,\n1,0,b,1\n1.001,0,c,2\n1.0015,0,d,\n2,0,e,\n"
    trajectory = through(tmp_path, near)
    found = told(begun(trajectory), Events(trajectory), 60.0)
    assert [tag for tag, *_ in found] == ["a", "b", "c", "d", "e"]
    assert found[1][2] == found[3][2] == pytest.approx((1.0, 0.0))


def test_a_shape_without_tags_tells_nothing():
    trajectory = Trajectory(Line(1.0), LAW)
    assert told(begun(trajectory), Events(trajectory), 20.0) == []


def test_a_law_that_does_not_stop_is_refused_where_a_point_asks_for_rest(tmp_path):
    with pytest.raises(ValueError, match=r"does not stop where the path turns back or rests, at"):
        through(tmp_path, SQUARE, ConstantRate(0.5))
