import math
from dataclasses import replace

import pytest

from climber_uk.mechanics.shapes import SHAPES, Circle, Ellipse, Lemniscate, Line, SineWave
from climber_uk.mechanics.summary import summary
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.waypoints import Waypoints

BEND = 0.2 * (2 * math.pi) ** 2  # [1/m] of the sine wave at its crests
SIZES = {  # length, fastest speed and yaw rate at a rate of 1, smallest radius
    # 4 a E(e²); fastest where it is flat; dθ/ds = ab / |p'|²; b² / a
    "ellipse": (Ellipse(10.0, 6.0), 51.053997726796, 10.0, 10 / 6, 3.6),
    "circle": (Circle(2.0), 4 * math.pi, 2.0, 1.0, 2.0),
    # fastest at the crossing; the others from a grid of two million points
    "lemniscate": (
        Lemniscate(1.0, 0.5),
        6.0972234701,
        math.sqrt(2),
        3.1712020150,
        1 / 4.7902894062,
    ),
    "line": (Line(3.0, 0.5), 3.0, 1.0, 0.0, math.inf),
    # the length by quadrature
    "sine_wave": (SineWave(), 2.6413164534, math.hypot(1, 0.4 * math.pi), BEND, 1 / BEND),
}
LAW = RestToRest(rate=1.0, ramp_time=0.5)


@pytest.mark.parametrize(
    ("shape", "length", "speed", "yaw_rate", "radius"), SIZES.values(), ids=SIZES
)
@pytest.mark.parametrize("rate", [0.2, 1.0])
def test_a_summary_has_the_sizes_of_its_shape(shape, length, speed, yaw_rate, radius, rate):
    said = summary(Trajectory(shape, replace(LAW, rate=rate)))
    assert said.length == pytest.approx(length, rel=1e-6)
    assert said.fastest_speed == pytest.approx(rate * speed, rel=1e-6)
    assert said.fastest_yaw_rate == pytest.approx(rate * yaw_rate, rel=1e-6)
    assert said.smallest_radius == pytest.approx(radius, rel=1e-6)
    assert said.closed == shape.closed
    assert not said.remarks


def test_every_shape_has_known_sizes_or_a_test_of_its_own():
    assert SIZES.keys() | {"waypoints", "lanes"} == SHAPES.keys()


@pytest.mark.parametrize("laps", [1, 3, 10**6])
def test_more_rounds_or_runs_are_longer_but_not_faster(laps):
    once = summary(Trajectory(Circle(2.0), LAW))
    often = summary(Trajectory(Circle(2.0), replace(LAW, laps=laps, runs=2, pause=1.0)))
    assert once.duration == pytest.approx(2 * math.pi + 0.5)
    assert often.duration == pytest.approx(2 * (2 * math.pi * laps + 0.5) + 1.0)
    assert often.fastest_speed == pytest.approx(once.fastest_speed)
    assert often.length == once.length


def test_a_law_without_end_is_said_to_be_one():
    for law in (ConstantRate(0.5), replace(LAW, rate=0.5, runs=0)):
        said = summary(Trajectory(Circle(2.0), law))
        assert said.duration == math.inf
        assert said.fastest_speed == pytest.approx(1.0)
        assert "without end" in str(said)


def test_ramps_that_fill_the_way_keep_it_slow():
    said = summary(Trajectory(Line(1.0), RestToRest(rate=50.0, ramp_time=2.0)))
    assert said.fastest_speed == pytest.approx(0.5)
    assert said.duration == pytest.approx(4.0)


@pytest.mark.parametrize("reverse_gear", [False, True])
def test_the_outer_wheel_is_the_fastest(reverse_gear):
    trajectory = Trajectory(Circle(2.0), LAW, reverse_gear, origin=(5.0, 0.0))
    assert summary(trajectory, half_track=0.3).fastest_wheel_speed == pytest.approx(2.3)
    assert summary(trajectory).fastest_wheel_speed is None


def test_the_tightest_place_is_in_the_frame_of_the_wall():
    said = summary(Trajectory(Ellipse(10.0, 6.0), LAW, origin=(1.0, 2.0)))
    x, y = said.tightest_place
    assert abs(x - 1.0) == pytest.approx(10.0, abs=1e-3)
    assert y == pytest.approx(2.0, abs=0.01)


def test_one_line_tells_all():
    line = str(summary(Trajectory(Circle(2.0), LAW), half_track=0.3))
    assert line == (
        "12.57 m, closed, 6.783 s, at most 2 m/s and 1 rad/s, wheels at most 2.3 m/s, "
        "smallest radius 2 m at (2, 0) m"
    )
    line = str(summary(Trajectory(Line(3.0), LAW)))
    assert line == "3 m, open, 3.5 s, at most 1 m/s and 0 rad/s, straight"


def test_what_looks_like_a_mistake_is_remarked():
    (remark,) = summary(Trajectory(Line(600.0), LAW)).remarks
    assert "600 m" in remark
    assert "mm" in remark
    (remark,) = summary(Trajectory(Line(1.0), replace(LAW, laps=3))).remarks
    assert "laps=3" in remark


def test_a_column_that_nothing_is_done_by_is_told(tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("x,velocity,y,,speed\n0,0.1,0,,\n1,0.1,0,,0.1\n")
    (remark,) = summary(Trajectory(Waypoints(file=str(file)), LAW)).remarks
    assert remark == "of the waypoints' columns, not used: velocity"
