"""The fastest time law: by hand on a line, its limits on any path, its table and its files."""

import math
from dataclasses import replace

import numpy as np
import pytest
from test_check_path import CLIMBER, CONFIG, FRICTION, HELD, run

from climber_uk.closed_loop.simulate import simulate
from climber_uk.control.build import build_controller
from climber_uk.mechanics.adhesion import Grip
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.fastest_law import Fastest, Tabulated, read_table, write_table
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Ellipse, Lemniscate, Line, SineWave
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.wall import Cone, Cylinder, Plane, Sphere, Tank
from climber_uk.mechanics.waypoints import Polyline, Waypoints
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.path_check import check_path
from climber_uk.path_check.demands import demands, reserves
from climber_uk.path_check.path_limits import Limits
from climber_uk.path_check.time_optimal import time_optimal
from climber_uk.simulation.plant import Plant

SLOW = RestToRest(rate=0.1)
WEIGHT = 5 * 9.81
GRIP = Grip().wheel_friction_coefficient * 0.8 * 480  # [N]
HELD_IN_PLANT = Contact()


@pytest.mark.parametrize(("direction", "sign"), [(math.pi / 2, 1.0), (-math.pi / 2, -1.0)])
def test_on_a_line_it_speeds_up_and_brakes_as_hard_as_the_wheels_hold(direction, sign):
    line = Trajectory(Line(3.0, direction=direction), SLOW)
    found = time_optimal(line, CLIMBER, HELD, Limits(margin=1.5))
    # by hand: the wheels' traction with and against weight and friction
    up = (GRIP / 1.5 - sign * WEIGHT - FRICTION) / 5
    down = (GRIP / 1.5 + sign * WEIGHT + FRICTION) / 5
    duration = math.sqrt(2 * 3.0 * (1 / up + 1 / down))
    assert found.abrupt == pytest.approx(duration, rel=1e-3)
    assert duration < found.trajectory.duration < duration + 0.05


def test_motors_that_are_weaker_than_the_grip_decide():
    line = Trajectory(Line(3.0), SLOW)
    weak = replace(CLIMBER, max_wheel_torque=1.5)
    found = time_optimal(line, weak, HELD, Limits(margin=1.5))
    most = 2 * 1.5 / 0.027  # N; the weight is across
    duration = math.sqrt(2 * 3.0 * (5 / (most - FRICTION) + 5 / (most + FRICTION)))
    assert found.abrupt == pytest.approx(duration, rel=1e-3)


def test_a_limit_of_speed_is_reached_and_kept():
    line = Trajectory(Line(3.0), SLOW)
    found = time_optimal(line, CLIMBER, HELD, Limits(speed=0.5)).trajectory
    speed = found.at(np.linspace(0, found.duration, 2001)).speed
    assert 0.999 * 0.5 - 1e-9 < np.max(speed) < 0.5
    assert np.mean(speed > 0.499) > 0.95


PATHS = {
    "ellipse": (Ellipse(2.0, 1.0), CLIMBER, Limits()),
    "eight": (Lemniscate(1.5, 0.75), CLIMBER, Limits(margin=2.0)),
    "sine": (SineWave(), CLIMBER, Limits(acceleration=1.0, yaw_rate=2.0)),
    "motors' line": (
        Lemniscate(1.5, 0.75),
        replace(CLIMBER, no_load_wheel_rate=40.0),
        Limits(margin=1.2),
    ),
    "rotors": (Ellipse(2.0, 1.0), replace(CLIMBER, rotor_inertia=0.003), Limits()),
    "ceiling": (SineWave(), replace(CLIMBER, inclination=180.0), Limits()),
    "there and back": (
        Polyline(places=np.array([[0.0, 0], [1, 0], [1, 1], [0, 1], [1, 1]])),
        CLIMBER,
        Limits(speed=0.6),
    ),
}


@pytest.mark.parametrize("reverse_gear", [False, True])
@pytest.mark.parametrize("name", PATHS)
def test_all_limits_are_kept_everywhere_and_little_is_left_of_them(name, reverse_gear):
    shape, climber, limits = PATHS[name]
    path = Trajectory(shape, SLOW, reverse_gear, origin=(0.3, -0.2))
    found = time_optimal(path, climber, HELD, limits)
    law, limits = found.trajectory, limits.with_those_of(shape)
    reference = law.at(np.linspace(0.0, law.duration, 7001))
    left = reserves(reference, climber, HELD)
    speed, yaw_rate = np.abs(reference.speed), np.abs(reference.yaw_rate)
    total = np.hypot(reference.forward_acceleration, speed * yaw_rate)
    worst = np.max(
        [
            limits.margin / left.slip,
            1 / left.torque,
            speed / limits.speed,
            yaw_rate / limits.yaw_rate,
            total / limits.acceleration,
        ],
        axis=0,
    )
    assert np.max(worst) <= 1.0
    assert np.median(worst) > 0.9  # it is always at some limit, but where one gives way to the next
    legs = 1 + len(law.course.rests[0])
    assert found.abrupt < law.duration < 1.01 * found.abrupt + 0.04 * legs
    assert law.at(law.duration).pose[:2] == pytest.approx(path.at(path.duration).pose[:2])


def test_it_rests_where_the_path_says_and_as_long(tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("x,y,speed,dwell\n0,0,,\n1,0,0.1,2\n2,0,,\n")
    path = Trajectory(Waypoints(file=str(file)), SLOW)
    law = time_optimal(path, CLIMBER, HELD, Limits()).trajectory
    time = np.linspace(0.0, law.duration, 4001)
    reference = law.at(time)
    there = np.abs(reference.pose[:, 0] - 1.0) < 1e-6
    assert np.ptp(time[there]) == pytest.approx(2.0, abs=0.1)
    after = (reference.pose[:, 0] > 1.0) & (reference.pose[:, 0] < 2.0)
    assert np.max(reference.speed[after]) == pytest.approx(0.1, rel=2e-3)


def test_where_it_cannot_be_driven_the_place_is_told():
    up = Trajectory(Line(3.0, direction=math.pi / 2), SLOW)
    weak = replace(CLIMBER, max_wheel_torque=0.5)
    with pytest.raises(ValueError, match=r"^at \(0, \S+\) m: it cannot "):
        time_optimal(up, weak, HELD, Limits())


@pytest.mark.parametrize("path", ["eight", "ellipse"])
def test_in_closed_loop_no_wheel_slips_and_the_margin_is_kept(path):
    """The plant's wheels may slip; what errors take of a margin of 1.5 is a fiftieth."""
    shape = PATHS[path][0]
    law = time_optimal(Trajectory(shape, SLOW), CLIMBER, HELD, Limits(margin=1.5)).trajectory
    given = {**read_file(CONFIG / "climber.yaml", "/uk_torque_controller"), "learn_delay": False}
    controller = build_controller(Values(given), None)
    truth = replace(CLIMBER, max_wheel_torque=100.0)
    at = law.at(0.0)
    done = simulate(
        *(law, State(at.pose, at.velocity), law.duration, controller, truth),
        plant_of=lambda climber, step: Plant(climber, step, HELD_IN_PLANT, slip=True),
        point_period=0.01,
    )
    plant = Plant(truth, 0.0025, HELD_IN_PLANT)
    rows = zip(done.pose, done.velocity, done.torques, strict=True)
    margins = [plant.margins(State(pose, velocity), by)[0] for pose, velocity, by in rows]
    across = done.velocity[:, 1] * np.cos(done.pose[:, 2])
    across -= done.velocity[:, 0] * np.sin(done.pose[:, 2])
    assert np.max(np.abs(across)) < 1e-6
    assert min(margins) > 0.98 * 1.5
    assert np.max(np.abs(done.torques)) < 4.0
    assert np.max(done.distance) < 1e-3


def test_a_table_that_is_written_is_read_again(tmp_path):
    path = Trajectory(Lemniscate(1.5, 0.75), SLOW)
    law = time_optimal(path, CLIMBER, HELD, Limits()).trajectory
    write_table(tmp_path / "law.csv", law.law.period, law.law.table)
    period, table = read_table(tmp_path / "law.csv")
    assert period == pytest.approx(law.law.period)
    assert table == pytest.approx(law.law.table, abs=1e-10)
    read = replace(path, law=Fastest(file=str(tmp_path / "law.csv")))
    time = np.linspace(-0.1, law.duration + 0.1, 50)
    assert read.at(time).velocity == pytest.approx(law.at(time).velocity, abs=1e-6)
    with pytest.raises(ValueError, match=r"law.csv' is for a path of extent 6.28319, not 3: make"):
        replace(path, law=read.law, shape=Line(3.0))


RESTING = [[0.1 * k, 3.0 * (k > 5)] for k in range(12)]


@pytest.mark.parametrize(
    ("rows", "fault"),
    [
        (None, "No such file"),
        ("t,s\n0,a\n", "could not convert"),
        ("t,s\n", "must have 12 rows or more"),
        (RESTING[:8], "must have 12 rows or more"),
        ([[*row, 1.0] for row in RESTING], "of two finite numbers"),
        ([*RESTING, [1.2, math.nan]], "finite"),
        ([*RESTING, [5.0, 3.0]], "t must be even"),
        ([[-t, s] for t, s in RESTING], "t must be even"),
        ([[t, -s] for t, s in RESTING], "s must not fall"),
        ([[t, s + 1] for t, s in RESTING], "rest for 6 rows at 0"),
        ([[0.1 * k, 0.1 * k] for k in range(20)], "rest for 6 rows at 0"),
    ],
)
def test_a_bad_table_is_refused_in_a_line(tmp_path, rows, fault):
    file = tmp_path / "law.csv"
    if rows is not None:
        lines = "".join(",".join(map(repr, row)) + "\n" for row in rows)
        file.write_text(rows if isinstance(rows, str) else "t,s\n" + lines)
    with pytest.raises(ValueError, match=r"law\.csv': ") as refused:
        Trajectory(Line(3.0), Fastest(file=str(file)))
    assert fault in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


def test_a_good_table_of_few_rows_is_taken(tmp_path):
    write_table(tmp_path / "law.csv", 0.1, np.array(RESTING)[:, 1])
    path = Trajectory(Line(3.0), Fastest(file=str(tmp_path / "law.csv")))
    assert path.duration == pytest.approx(0.7)
    assert isinstance(replace(path, law=Tabulated(*path.law.given)).duration, float)


def test_the_command_writes_what_the_nodes_drive_and_checks_it_from_anywhere(
    monkeypatch, capsys, tmp_path
):
    points = tmp_path / "given"
    points.mkdir()
    (points / "points.csv").write_text("0,0\n1,0\n1,1\n")
    text = (CONFIG / "climber.yaml").read_text()
    text = text.replace("shape: lemniscate", "shape: waypoints\n    waypoints.file: points.csv")
    (points / "path.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    words = "--params", "given/path.yaml", "--fastest", "--speed", 0.3, "--output", "out"
    status, said = run(monkeypatch, capsys, *words)
    assert status == 0
    assert "fastest law: " in said
    assert said.splitlines()[-1] == "out/fastest.yaml"
    for here, file in ((tmp_path, "out/fastest.yaml"), (tmp_path / "out", "fastest.yaml")):
        monkeypatch.chdir(here)
        status, said = run(monkeypatch, capsys, "--params", file)
        assert status == 0
        assert "at most 0.3 m/s" in said
    read, climber, held, _ = check_path.read(tmp_path / "out" / "fastest.yaml", {}, [])
    assert all(limit.reserve > 0.999 for limit in demands(read, climber, held, 1.5).least())


def test_the_command_tells_why_there_is_no_fastest_law(monkeypatch, capsys, tmp_path):
    file = tmp_path / "weak.yaml"
    text = (CONFIG / "climber.yaml").read_text()
    file.write_text(text.replace("max_wheel_torque: 4.0", "max_wheel_torque: 0.5"))
    status, said = run(monkeypatch, capsys, "--params", file, "--fastest")
    assert status == 1
    assert "fastest law: none: at (" in said


def random_problem(random):
    """A path, a climber, limits and a wall on which it can be driven slowly, or not."""
    points = np.cumsum(
        random.normal(0, random.uniform(0.2, 1), (random.integers(2, 12), 2)), axis=0
    )
    shape = (
        Ellipse(*random.uniform(0.3, 5, 2)),
        Lemniscate(*random.uniform(0.3, 3, 2)),
        Line(10 ** random.uniform(-1, 1), random.uniform(-3, 3)),
        SineWave(random.uniform(0.3, 6), random.uniform(0, 1), random.uniform(0.3, 3)),
        Polyline(places=points, tolerance=10 ** random.uniform(-2, -1)),
    )[random.integers(5)]
    climber = replace(
        CLIMBER,
        mass=random.uniform(2, 8),
        yaw_inertia=random.uniform(0.05, 1),
        max_wheel_torque=random.uniform(2.5, 10),
        no_load_wheel_rate=float(random.choice([0, 20, 60])),
        inclination=random.uniform(0, 180),
    )
    walls = Plane(), Plane(30.0), Tank(-4.0), Sphere(3.0), Cone(20.0), Cylinder(-6.0)
    limits = Limits(
        margin=random.uniform(1, 2),
        speed=float(random.choice([100.0, 0.5])),
        acceleration=float(random.choice([np.inf, 1.0])),
    )
    return Trajectory(shape, SLOW), climber, limits, walls[random.integers(6)]


@pytest.mark.parametrize(
    "seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(2, 60))]
)
def test_any_path_is_driven_within_its_limits_or_cannot_be_driven_slowly_either(seed):
    path, climber, limits, wall = random_problem(np.random.default_rng(seed))
    try:
        law = time_optimal(path, climber, HELD, limits, wall=wall).trajectory
        can_be_driven = True
    except ValueError:
        law, can_be_driven = replace(path, law=RestToRest(rate=0.003, ramp_time=10.0)), False
    left = reserves(law.at(np.linspace(0.0, law.duration, 5001)[1:-1]), climber, HELD, wall=wall)
    worst = min(np.min(left.slip) / limits.margin, np.min(left.torque), np.min(left.tip))
    assert bool(worst >= 1.0) is can_be_driven
