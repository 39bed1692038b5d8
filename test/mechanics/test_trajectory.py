import math
from pathlib import Path

import numpy as np
import pytest

from climber_uk.mechanics.lanes import Lanes
from climber_uk.mechanics.shapes import SHAPES, Circle, Ellipse, Line
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.waypoints import Waypoints

FACADE = Path(__file__).parents[2] / "config" / "facade.csv"
CORNERS = [[0, 0], [1, 0], [1.5, 1], [0, 2]]


@pytest.fixture
def waypoints(tmp_path):
    def make(points):
        file = tmp_path / "points.txt"
        np.savetxt(file, points)
        return Waypoints(file=str(file))

    return make


@pytest.fixture(params=[*SHAPES, "closed waypoints", "waypoints there and back"])
def shape(request, waypoints):
    if request.param == "waypoints":
        return waypoints(CORNERS)
    if request.param == "closed waypoints":
        return waypoints([*CORNERS, CORNERS[0]])
    if request.param == "waypoints there and back":
        return waypoints([*CORNERS, [1.5, 0.8], [1.5, 1.0], [0, 1.9]])
    if request.param == "lanes":
        return Lanes(area=str(FACADE))
    return SHAPES[request.param]()


LAWS = {
    "once": RestToRest(rate=0.8, ramp_time=1.5),
    "repeated": RestToRest(rate=0.8, ramp_time=1.5, runs=3, laps=2, pause=0.4),
    "too short for its ramps": RestToRest(rate=50.0, ramp_time=1.5),
}


@pytest.mark.parametrize("reverse_gear", [False, True])
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_every_derivative_is_the_difference_of_the_one_below(shape, law, reverse_gear):
    trajectory = Trajectory(shape, law, reverse_gear)
    h = 1e-6
    time = np.linspace(-0.3, min(trajectory.duration, 40) + 0.3, 1001) + 1e-4
    before, here, after = (trajectory.at(time + shift) for shift in (-h, 0, h))
    turned = np.unwrap(np.stack([before.pose[:, 2], after.pose[:, 2]]), axis=0)
    for low, high, rate in (
        (before.pose[:, :2], after.pose[:, :2], here.velocity[:, :2]),
        (*turned, here.velocity[:, 2]),
        (before.velocity, after.velocity, here.acceleration),
        (before.acceleration[:, :2], after.acceleration[:, :2], here.jerk),
        (before.speed, after.speed, here.forward_acceleration),
    ):
        difference = (high - low) / (2 * h)
        assert np.abs(difference - rate).max() <= 1e-6 * max(1.0, np.abs(rate).max())


def test_the_paper_starts_as_printed():
    start = Trajectory(Ellipse(), ConstantRate()).at(0.0)
    np.testing.assert_allclose(start.pose, [0, 6, 0], atol=1e-15)
    np.testing.assert_allclose(start.velocity, [10, 0, -0.6], atol=1e-15)


def test_a_run_starts_and_ends_at_rest_and_takes_its_time():
    trajectory = Trajectory(Circle(), RestToRest(rate=0.5, ramp_time=2.0, laps=2))
    assert trajectory.duration == pytest.approx(4 * math.pi / 0.5 + 2.0)
    for time in (0.0, trajectory.duration, trajectory.duration + 100):
        reference = trajectory.at(time)
        np.testing.assert_allclose(reference.pose[:2], [1, 0], atol=1e-12)
        np.testing.assert_allclose(reference.velocity, 0, atol=1e-12)
        np.testing.assert_allclose(reference.acceleration, 0, atol=1e-12)


def test_the_second_run_along_an_open_shape_goes_back_in_reverse_gear():
    trajectory = Trajectory(Line(length=3.0), RestToRest(ramp_time=1.0, runs=2, pause=0.0))
    way, back = trajectory.at(2.0), trajectory.at(6.0)
    np.testing.assert_allclose(way.pose, back.pose, atol=1e-12)
    assert way.speed == pytest.approx(1.0)
    assert back.speed == pytest.approx(-1.0)
    assert trajectory.at(trajectory.duration).pose[0] == pytest.approx(0.0, abs=1e-12)


def test_reverse_gear_turns_the_climber_but_not_the_path():
    law = RestToRest()
    forwards = Trajectory(Ellipse(), law).at(2.0)
    backwards = Trajectory(Ellipse(), law, reverse_gear=True).at(2.0)
    np.testing.assert_allclose(forwards.velocity, backwards.velocity)
    assert backwards.pose[2] - forwards.pose[2] == pytest.approx(math.pi)
    assert backwards.speed == pytest.approx(-forwards.speed)


def test_an_open_shape_refuses_a_law_that_would_run_off_it():
    with pytest.raises(ValueError, match="rest_to_rest"):
        Trajectory(Line(), ConstantRate())


def test_the_origin_moves_the_path_and_nothing_else():
    law = RestToRest()
    here, there = Trajectory(Circle(), law), Trajectory(Circle(), law, origin=(2.0, -3.0))
    np.testing.assert_allclose(there.at(1.0).pose - here.at(1.0).pose, [2, -3, 0])
    np.testing.assert_array_equal(there.at(1.0).velocity, here.at(1.0).velocity)
    np.testing.assert_allclose(there.path(5)[0], [3, -3, math.pi / 2])
