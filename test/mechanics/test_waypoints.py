"""Paths through waypoints, each property over random polylines and over the cases met so far."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from climber_uk.mechanics.summary import summary
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.waypoints import Waypoints

RATE, YAW_RATE, ACCELERATION = 0.2, 1.0, 0.5
ANGLE = np.linspace(0, 2 * np.pi, 401)
STAR = 0.8 * np.pi * np.arange(6)
CASES = {
    "uneven": [[0, 0], [0.01, 0], [5, 0.3], [5.01, 0.3], [5.02, 0.5]],
    "there and back": [[0, 0], [1, 0], [0, 0]],
    "nearly there and back": [[0, 0], [1, 0], [0, 0.1]],
    "a square, nearly closed": [[0, 0], [1, 0], [1, 1], [0, 1], [0, 1e-9]],
    "lanes": [[0, 0], [1, 0], [1, 0.2], [0, 0.2], [0, 0.4], [1, 0.4]],
    "lanes of a tank": [[0, 0], [2, 0], [2.3, 0.15], [2, 0.3], [0, 0.3], [-0.3, 0.45], [0, 0.6]],
    "lanes nearer than the tolerance": [[0, 0], [1, 0], [1, 0.01], [0, 0.01], [0, 0.02], [1, 0.02]],
    "two points": [[3, -1], [3, 2]],
    "points that repeat": [[0, 0], [0, 0], [1, 0], [1, 0], [1, 0], [1, 1], [1, 1]],
    "a step back smaller than the tolerance": [[0, 0], [1, 0], [0.998, 0], [2, 0]],
    "a step back": [[0, 0], [1, 0], [0.9, 0], [2, 0]],
    "a zigzag": [[i % 2, 0.05 * i] for i in range(12)],
    "a fan from one point": [[0, 0], [1, 0], [0, 0], [1, 0.2], [0, 0], [1, 0.4], [0, 0]],
    "a corner right before a reversal": [[0, 0], [1, 0], [1, 0.01], [1, -1]],
    "a closed path with two reversals": [[0, 0], [1, 0], [0.5, 0], [0.5, 1], [0.52, 0.4], [0, 0]],
    "a closed path that ends tail first": [[0, 0], [1, 0], [0.5, 0.1], [0.5, -1], [0, -1], [0, 0]],
    "a dense circle": np.c_[np.cos(ANGLE), np.sin(ANGLE)],
    "a star that crosses itself": np.c_[np.cos(STAR), np.sin(STAR)],
    "far away": [[1e5, 1e5], [1e5 + 1, 1e5], [1e5 + 1, 1e5 + 1]],
    "millimetres": [[0, 0], [2000, 0], [2000, 300], [0, 300]],
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("waypoints")


def made(folder, points, **parameters):
    file = folder / "points.txt"
    np.savetxt(file, points)
    return Waypoints(
        file=str(file), max_yaw_rate=YAW_RATE, max_acceleration=ACCELERATION, **parameters
    )


def distance(places, line):
    """Distances (n,) of places (n, 2) from the nearest point of a polyline."""
    a, way = line[:-1], np.diff(line, axis=0)
    square = np.maximum(np.sum(way**2, axis=1), 1e-300)
    nearest = np.full(len(places), np.inf)
    for i in range(len(a)):
        share = np.clip((places - a[i]) @ way[i] / square[i], 0, 1)
        gap = places - a[i] - share[:, None] * way[i]
        nearest = np.minimum(nearest, np.hypot(*gap.T))
    return nearest


def check(folder, points, tolerance=0.02, rate=RATE):
    """Assert all that a path through waypoints promises."""
    points = np.array(points, float)
    shape = made(folder, points, tolerance=tolerance)
    trajectory = Trajectory(shape, RestToRest(rate=rate, ramp_time=1.0))
    path = trajectory.course
    size = 1e-12 * np.abs(points).max()  # of rounding
    s = np.union1d(path.stations, np.linspace(0, path.length, 4001))
    p, p_1, p_2, _ = path.derivatives(s)
    assert distance(p, points).max() <= tolerance + size
    assert distance(points, p).max() <= tolerance + size
    # p' is the velocity at a rate of 1, p'' the acceleration
    speed = np.hypot(*p_1.T)
    assert speed.max() <= 1 + 1e-6  # it is looked at 1e-6 of a cell beside its ends
    turning = (p_1[:, 0] * p_2[:, 1] - p_1[:, 1] * p_2[:, 0]) / speed**2
    assert rate * np.abs(turning).max() <= YAW_RATE * (1 + 1e-3)
    # each of braking and turning keeps to its part, but for how a spline may be steeper
    assert rate**2 * np.hypot(*p_2.T).max() <= ACCELERATION * 1.15
    smooth_in_time(trajectory)
    return trajectory


def smooth_in_time(trajectory):
    """Every derivative is the slope of the one below, with bounded error: no jump, no leap of π."""
    times = np.linspace(-0.1, trajectory.duration + 0.1, 1501)
    h = 1e-7
    before, here, after = (trajectory.at(times + shift) for shift in (-h, 0, h))
    headings = np.unwrap(np.stack([before.pose[:, 2], after.pose[:, 2]]), axis=0)
    assert np.abs(np.diff(headings, axis=0)).max() <= 2 * h * YAW_RATE * 1.01
    for low, high in (
        (before.pose[:, :2], after.pose[:, :2]),
        (before.velocity, after.velocity),
        (before.acceleration[:, :2], after.acceleration[:, :2]),
        (before.jerk, after.jerk),
    ):
        # a jump would be as large as the quantity itself, a slope is not within 0.2 µs
        assert np.abs(high - low).max() <= 0.01 * max(np.abs(low).max(), 0.01)
    np.testing.assert_allclose(here.speed**2, np.sum(here.velocity[:, :2] ** 2, axis=1), atol=1e-12)


@pytest.mark.parametrize("points", CASES.values(), ids=CASES)
def test_a_path_keeps_its_promises(folder, points):
    check(folder, points)


COORDINATE = st.floats(-2.0, 2.0)
POLYLINES = st.lists(st.tuples(COORDINATE, COORDINATE), min_size=2, max_size=12)
GRIDS = st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=2, max_size=12)
TOLERANCES, RATES = st.sampled_from([0.005, 0.02, 0.2]), st.sampled_from([0.05, 0.2, 1.0])
STEPS = st.lists(
    st.tuples(st.sampled_from([1e-4, 1e-3, 0.01, 0.1, 1.0]), st.floats(-math.pi, math.pi)),
    min_size=1,
    max_size=12,
)


def is_path(points, tolerance):
    return np.hypot(*np.ptp(np.array(points, float), axis=0)) > 2 * tolerance


@settings(deadline=None, max_examples=6)
@given(points=POLYLINES, tolerance=TOLERANCES, rate=RATES)
def test_random_polylines_keep_their_promises(folder, points, tolerance, rate):
    if is_path(points, tolerance):
        check(folder, points, tolerance, rate)


@settings(deadline=None, max_examples=6)
@given(points=GRIDS, tolerance=TOLERANCES, rate=RATES)
@example([(3, 3), (0, -2), (1, -1), (3, 1), (-1, 1), (2, 1)], 0.005, 1.0)
@example([(-2, -1), (3, -3), (0, 1), (0, -3), (-3, 3), (-1, 1), (0, -1)], 0.02, 1.0)
@example([(0, -3), (3, -2), (-2, 1), (-3, -1), (2, -2), (0, 3), (-2, -3)], 0.005, 0.05)
def test_polylines_on_a_grid_that_turn_back_and_repeat_keep_their_promises(
    folder, points, tolerance, rate
):
    if is_path(points, tolerance):
        check(folder, points, tolerance, rate)


@settings(deadline=None, max_examples=6)
@given(steps=STEPS)
def test_polylines_of_very_uneven_steps_keep_their_promises(folder, steps):
    points = np.cumsum([[0, 0], *([r * math.cos(a), r * math.sin(a)] for r, a in steps)], axis=0)
    if is_path(points, 0.02):
        check(folder, points)


def test_straights_are_straight_and_at_full_speed(folder):
    shape = made(folder, [[0, 0], [2, 0], [2, 2]])
    p, p_1, p_2, p_3 = shape.derivatives(np.linspace(0.0, 1.9, 20))
    np.testing.assert_allclose(p[:, 1], 0.0, atol=1e-12)
    np.testing.assert_allclose(p_1, [[1, 0]] * 20, atol=1e-9)
    np.testing.assert_allclose([p_2, p_3], 0.0, atol=1e-6)


def test_the_ends_of_an_open_path_are_its_points_and_the_last_leg_its_heading(folder):
    trajectory = check(folder, [[1, 1], [2, 1], [2, 3]])
    start, end = trajectory.at(0.0), trajectory.at(trajectory.duration)
    np.testing.assert_allclose(start.pose, [1, 1, 0], atol=1e-9)
    np.testing.assert_allclose(end.pose, [2, 3, np.pi / 2], atol=1e-9)


def test_there_and_back_stops_at_the_tip_and_comes_back_in_reverse_gear(folder):
    trajectory = Trajectory(
        made(folder, CASES["there and back"]), RestToRest(rate=0.5, ramp_time=1)
    )
    assert trajectory.duration == pytest.approx(2 * (1 / 0.5 + 1.0))
    tip = trajectory.at(3.0)
    np.testing.assert_allclose(tip.pose, [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose([tip.velocity, tip.acceleration], 0, atol=1e-9)
    assert trajectory.at(1.5).speed == pytest.approx(0.5)
    assert trajectory.at(4.5).speed == pytest.approx(-0.5)
    np.testing.assert_allclose(trajectory.at(4.5).pose, [0.5, 0, 0], atol=1e-9)


def test_laps_go_around_a_nearly_closed_path_and_there_and_back_again(folder):
    for name, length in (("a square, nearly closed", None), ("there and back", 2.0)):
        shape = made(folder, CASES[name])
        once, thrice = (Trajectory(shape, RestToRest(rate=0.2, laps=n)) for n in (1, 3))
        assert shape.closed
        assert not summary(thrice).remarks
        assert thrice.duration > 2.5 * once.duration
        end = thrice.at(thrice.duration)
        np.testing.assert_allclose(end.pose[:2], once.at(0.0).pose[:2], atol=1e-9)
        np.testing.assert_allclose(np.cos(end.heading - once.at(0.0).heading), 1.0)
        if length:
            assert summary(thrice).length == pytest.approx(length)


def test_a_path_whose_ends_do_not_meet_is_open_and_its_laps_are_remarked(folder):
    shape = made(folder, [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0.1]])
    assert not shape.closed
    (remark,) = summary(Trajectory(shape, RestToRest(rate=0.2, laps=3))).remarks
    assert "laps=3 has no effect" in remark


def test_sizes_in_millimetres_are_remarked(folder):
    said = summary(Trajectory(made(folder, CASES["millimetres"]), RestToRest(rate=0.2)))
    assert "4300 m long: are its sizes in mm" in said.remarks[0]


def test_a_law_that_never_stops_is_refused_where_the_path_turns_back(folder):
    for name in ("there and back", "a closed path with two reversals"):
        shape = made(folder, CASES[name])
        with pytest.raises(ValueError, match=r"turns back or rests, at \(.* m: use 'rest_to_rest'"):
            Trajectory(shape, ConstantRate(0.2))
    Trajectory(made(folder, CASES["a square, nearly closed"]), ConstantRate(0.2))


@pytest.mark.parametrize("points", [[[1, 2]] * 7, [[1, 2]] * 2, [[0, 0], [0, 1e-3], [0, 0]]])
def test_points_all_in_one_place_are_refused_in_words(folder, points):
    with pytest.raises(ValueError, match=r"points.txt.*all points are within .* the tolerance"):
        made(folder, points)


@pytest.mark.parametrize("speed", [1e-12, 1e-300])
def test_a_speed_too_low_to_be_reckoned_with_is_refused_with_the_place(folder, speed):
    file = folder / "slow.csv"
    file.write_text(f"x,y,speed\n0,0,\n1,0,{speed}\n1,1,\n")
    with pytest.raises(
        ValueError, match=r"slow.csv': at \(.*\) m it must be slower than 2e-07 m/s"
    ):
        Waypoints(file=str(file)).at_rate(RATE)


def test_a_summary_of_waypoints_has_the_sizes_of_its_path(folder):
    said = summary(Trajectory(made(folder, CASES["lanes"]), RestToRest(rate=RATE)))
    assert 3.3 < said.length < 3.4
    assert said.fastest_speed == pytest.approx(RATE, rel=1e-3)
    assert 0.95 * YAW_RATE < said.fastest_yaw_rate <= 1.001 * YAW_RATE
    assert 0.005 < said.smallest_radius < 0.05
    circle = summary(Trajectory(made(folder, CASES["a dense circle"]), RestToRest(rate=RATE)))
    # a chord is off the circle by 31 µm, which in knots 19 mm apart bends it by 8 %
    assert circle.smallest_radius == pytest.approx(1.0, rel=0.09)
    assert circle.fastest_yaw_rate == pytest.approx(RATE, rel=0.09)


@pytest.mark.soak
def test_more_sharp_corners_than_can_be_looked_at_are_refused(folder):
    corners = np.arange(14_000)
    lanes = np.c_[corners // 2 % 2, 0.1 * ((corners + 1) // 2)]
    with pytest.raises(ValueError, match=r"points.txt': too many bends: .* 8000 sharp corners"):
        made(folder, lanes).at_rate(RATE)
    assert made(folder, lanes[:400]).at_rate(RATE).length > 200


def test_50_000_points_make_a_path(folder):
    turns = np.cumsum(0.05 * np.random.default_rng(1).normal(size=50_000))
    points = np.cumsum(0.05 * np.c_[np.cos(turns), np.sin(turns)], axis=0)
    trajectory = Trajectory(made(folder, points), RestToRest(rate=RATE))
    times = np.linspace(0, trajectory.duration, 2001)
    there = trajectory.at(times)
    assert np.abs(there.speed).max() <= RATE * (1 + 1e-6)
    assert np.abs(there.yaw_rate).max() <= YAW_RATE
    np.testing.assert_allclose(there.pose[-1, :2], points[-1], atol=1e-6)
