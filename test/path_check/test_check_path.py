"""What a path asks for, by hand, and as the executable tells it."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from climber_uk.mechanics.adhesion import Grip, Magnetic, Suction
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact, FourWheeled
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Circle, Line
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.wall import Cone, Cylinder, Plane, Sphere, Tank
from climber_uk.path_check import check_path
from climber_uk.path_check.demands import demands, reserves
from climber_uk.path_check.fastest import fastest
from climber_uk.path_check.path_limits import Limits
from climber_uk.path_check.time_optimal import time_optimal
from climber_uk.simulation.plant import Plant

CONFIG = Path(__file__).parents[2] / "config"
CLIMBER = Climber(
    mass=5.0,
    yaw_inertia=0.33,
    wheel_radius=0.027,
    half_track=0.3,
    seal_friction_coefficient=0.6,
    wheel_load_share=0.8,
    suction_pressure=8000.0,
    suction_area=0.06,
    max_wheel_torque=4.0,
)
WALLS = {
    "tilted": Plane(20.0),
    "pipe": Cylinder(3.0),
    "tank": Tank(-5.0),
    "roof": Cone(6.0),
    "sphere": Sphere(5.0),
}
HELD = Contact(adhesion=Suction(), grip=Grip())
FRICTION = 0.6 * 0.2 * 8000 * 0.06  # [N] of the seal, by hand


def least(trajectory, climber=CLIMBER, margin=1.0):
    found = demands(trajectory, climber, HELD, margin)
    return {limit.name.split(",")[0]: limit for limit in found.least()}, found


def test_straight_up_it_carries_its_weight_and_friction():
    up = Trajectory(Line(3.0, direction=math.pi / 2), RestToRest(rate=0.2, ramp_time=2.0))
    limits, found = least(up)
    # by hand: the ramp's acceleration is 15/8 0.2 / 2, in its middle
    force = 5 * 9.81 + FRICTION + 5 * 15 / 8 * 0.1
    assert limits["torque"].reserve == pytest.approx(4.0 / (0.027 * force / 2), rel=1e-4)
    assert limits["torque"].time == pytest.approx(1.0, abs=0.03)
    assert limits["torque"].place[1] == pytest.approx(up.at(1.0).pose[1], abs=0.005)
    friction = Grip().wheel_friction_coefficient
    assert limits["slip"].reserve == pytest.approx(friction * 0.8 * 480 / force, rel=1e-4)
    # what it does: weight and friction, all along
    assert found.energy == pytest.approx(3.0 * (5 * 9.81 + FRICTION), rel=1e-3)


def test_the_highest_rate_is_that_at_which_the_least_reserve_is_one():
    """Of a line upwards by hand: what torque or wheels can do beyond weight and friction."""
    up = Trajectory(Line(60.0, direction=math.pi / 2), RestToRest(rate=5.0, ramp_time=2.0))
    best = fastest(up, CLIMBER, HELD, 1.5)
    limits, _ = least(best, margin=1.5)
    assert min(limit.reserve for limit in limits.values()) == pytest.approx(1.0, abs=2e-3)
    most = min(2 * 4.0 / 0.027, Grip().wheel_friction_coefficient * 0.8 * 480 / 1.5)
    force = most - 5 * 9.81 - FRICTION
    assert best.law.rate == pytest.approx(force / 5 * 2.0 * 8 / 15, rel=2e-3)


def test_a_climber_that_cannot_carry_its_weight_has_no_rate():
    up = Trajectory(Line(3.0, direction=math.pi / 2), RestToRest(rate=0.2, ramp_time=2.0))
    assert fastest(up, replace(CLIMBER, max_wheel_torque=0.5), HELD, 1.5) is None


def test_straight_down_the_motors_take_back_no_energy():
    down = Trajectory(Line(3.0, direction=-math.pi / 2), RestToRest(rate=0.2, ramp_time=2.0))
    _, found = least(down)
    assert found.energy == pytest.approx(3.0 * (FRICTION - 5 * 9.81), rel=0.02)


def test_a_margin_that_is_to_be_kept_takes_its_share():
    circle = Trajectory(Circle(1.0), ConstantRate(0.2))
    once, twice = (least(circle, margin=margin)[0]["slip"].reserve for margin in (1.0, 2.0))
    assert once == pytest.approx(2 * twice)


def test_a_motor_near_its_highest_rate_has_less_torque():
    up = Trajectory(Line(3.0, direction=math.pi / 2), RestToRest(rate=0.2, ramp_time=2.0))
    rate = 0.2 / 0.027
    slower = replace(CLIMBER, no_load_wheel_rate=2 * rate)
    limits, _ = least(up, slower)
    # at full speed, by hand: half of the torque
    force = 5 * 9.81 + FRICTION
    assert limits["torque"].reserve == pytest.approx(2.0 / (0.027 * force / 2), rel=0.02)


def run(monkeypatch, capsys, *words):
    monkeypatch.setattr("sys.argv", ["check_path", *map(str, words)])
    with pytest.raises(SystemExit) as ended:
        check_path.main()
    return ended.value.code, capsys.readouterr().out


def test_the_configuration_of_lanes_is_feasible_and_drawn(monkeypatch, capsys, tmp_path):
    words = "--params", CONFIG / "lanes.yaml", "--output", tmp_path / "out"
    status, said = run(monkeypatch, capsys, *words)
    assert (status, said.splitlines()[-2]) == (0, "feasible")
    numbers = json.loads((tmp_path / "out" / "check_path.json").read_text())
    assert numbers["feasible"]
    assert all(limit["reserve"] > 1 for limit in numbers["limits"].values())
    assert (tmp_path / "out" / "check_path.png").stat().st_size > 10_000


def test_lanes_begin_where_the_simulated_climber_is_nearest_to_them(tmp_path):
    file, area = tmp_path / "lanes.yaml", tmp_path / "facade.csv"
    area.write_text("0 0\n3 0\n3 0.45\n0 0.45\n")
    text = (CONFIG / "lanes.yaml").read_text()
    file.write_text(text.replace("initial_x: 0.201", "initial_x: 2.799"))
    remarks = []
    trajectory, *_ = check_path.read(file, {}, remarks)
    assert trajectory.at(0.0).pose[:2] == pytest.approx((2.8, 0.2), abs=0.01)
    (said,) = remarks  # its heading
    assert "starts 0.00 m and 3.14 rad off" in said


def test_what_looks_like_a_mistake_is_said(monkeypatch, capsys):
    line = "-p", "shape:=line", "-p", "rest_to_rest.laps:=3"
    words = ["check_path", "--params", CONFIG / "climber.yaml", *line]
    monkeypatch.setattr("sys.argv", [*map(str, words)])
    with pytest.raises(SystemExit):
        check_path.main()
    assert capsys.readouterr().err == "check_path: laps=3 has no effect: the path is open\n"


@pytest.mark.parametrize(
    ("height", "said"),
    [
        ("3.0", ""),
        ("2.5", "0.50 m and 0.00 rad off where the path begins: "),
        ("0.0", "3.00 m and 0.00 rad off where the path begins, beyond max_start_distance (2 m): "),
    ],
)
def test_a_simulated_climber_that_starts_elsewhere_is_said(
    monkeypatch, capsys, tmp_path, height, said
):
    text = (CONFIG / "climber.yaml").read_text().replace("initial_y: 3.0", f"initial_y: {height}")
    (tmp_path / "mine.yaml").write_text(text)
    monkeypatch.setattr("sys.argv", ["check_path", "--params", str(tmp_path / "mine.yaml")])
    with pytest.raises(SystemExit):
        check_path.main()
    there = "there its initial_x is 0.0, initial_y 3.0, initial_heading 0.7854\n"
    line = f"check_path: {tmp_path / 'mine.yaml'}: plant_simulator starts {said}{there}"
    assert capsys.readouterr().err == (line if said else "")


def test_a_climber_of_which_a_number_was_changed_in_one_place_only_is_said(
    monkeypatch, capsys, tmp_path
):
    text = (CONFIG / "climber.yaml").read_text().replace("mass: 5.0", "mass: 6.0", 1)
    (tmp_path / "mine.yaml").write_text(text)
    monkeypatch.setattr("sys.argv", ["check_path", "--params", str(tmp_path / "mine.yaml")])
    with pytest.raises(SystemExit):
        check_path.main()
    said = "uk_torque_controller and plant_simulator have mass 6.0 and 5.0"
    assert capsys.readouterr().err == f"check_path: {tmp_path / 'mine.yaml'}: {said}\n"


def test_a_file_for_a_robot_of_ones_own_needs_no_simulator(monkeypatch, capsys, tmp_path):
    text = (CONFIG / "climber.yaml").read_text().partition("/**/plant_simulator:")[0]
    (tmp_path / "mine.yaml").write_text(text)
    status, with_one = run(monkeypatch, capsys, "--params", CONFIG / "climber.yaml")
    monkeypatch.setattr("sys.argv", ["check_path", "--params", str(tmp_path / "mine.yaml")])
    with pytest.raises(SystemExit) as ended:
        check_path.main()
    said = capsys.readouterr()
    assert (ended.value.code, said.out) == (status, with_one)
    assert said.err.endswith(
        "without a plant_simulator's locomotion, nothing is taken to resist turns\n"
    )


def test_what_asks_for_too_much_is_told_with_its_place_and_the_status(monkeypatch, capsys):
    fast = "-p", "rest_to_rest.rate:=2.0", "-p", "rest_to_rest.ramp_time:=0.05"
    words = "--params", CONFIG / "climber.yaml", *fast
    status, said = run(monkeypatch, capsys, *words)
    assert status == 1
    assert said.splitlines()[-1] == "NOT feasible"
    assert "slip, to a margin of 1.5: " in said
    assert "TOO MUCH" in said


@pytest.fixture
def refusal(monkeypatch, capsys):
    """The one line by which check_path refuses climber.yaml with some changes, and status 2."""

    def told(*changes):
        words = [part for change in changes for part in ("-p", change)]
        file = str(CONFIG / "climber.yaml")
        monkeypatch.setattr("sys.argv", ["check_path", "--params", file, *words])
        with pytest.raises(SystemExit) as ended:
            check_path.main()
        out, err = capsys.readouterr()
        assert (ended.value.code, err.count("\n"), out) == (2, 1, "")
        return err

    return told


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("shape:=line line.length:=1e12", "the path leads to (1.25e+11, 3) m, beyond 1e+06 m of"),
        ("shape:=line line.length:=1e-12", "the path is 1e-12 m wide and high, want >= 0.0001 m"),
        ("shape:=circle circle.radius:=1e12", "beyond 1e+06 m of the origin"),
        ("shape:=circle circle.radius:=1e-9", "want >= 0.0001 m"),
        ("shape:=ellipse ellipse.semi_axis_y:=1e-9", "the path turns on the spot"),
        ("shape:=lemniscate lemniscate.half_height:=1e-12", "the path turns on the spot"),
        ("shape:=sine_wave sine_wave.wavelength:=1e-12", "the path turns on the spot"),
        (
            "shape:=line line.length:=1e300",
            "line.length=1e+300 must be of a size from 1e-12 to 1e+12 [m]",
        ),
        (
            "shape:=line line.length:=1e-300",
            "line.length=1e-300 must be of a size from 1e-12 to 1e+12 [m]",
        ),
        ("origin_x:=1e12", "beyond 1e+06 m of the origin"),
        ("rest_to_rest.rate:=1e-12", "s, more than 1e+09 s"),
        ("rest_to_rest.ramp_time:=1e12", "s, more than 1e+09 s"),
        ("rest_to_rest.ramp_time:=1e-12", "rest_to_rest.ramp_time=1e-12 must be >= 0.001 [s]"),
        ("rest_to_rest.laps:=1000000000000", "s, more than 1e+09 s"),
        ("shape:=waypoints rest_to_rest.rate:=1e300", "rate=1e+300 must be of a size from"),
        ("shape:=waypoints waypoints.tolerance:=1e-12", "tolerance=1e-12 must be >= 1e-05 [m]"),
        ("shape:=waypoints waypoints.max_yaw_rate:=1e-12", "m it must be slower than 1.2e-07 m/s"),
        ("shape:=lanes lanes.clearance:=1e12", "m between the clearances"),
        ("shape:=lanes lanes.dwell:=1e12", "s, more than 1e+09 s"),
    ],
)
def test_absurd_numbers_are_refused_in_words(refusal, words, said):
    files = f"waypoints.file:={CONFIG / 'lanes.csv'}", f"lanes.area:={CONFIG / 'facade.csv'}"
    assert said in refusal(*files, *words.split())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x,y\n0,0\n1,1e300\n", "line 3: point 2 at (1, 1e+300) m is beyond 1e+06 m"),
        ("x,y,speed\n0,0,1e-300\n1,0,\n", "at (0, 0) m it must be slower than 1.2e-07 m/s"),
        ("x,y,dwell\n0,0,\n1,0,1e300\n2,0,\n", "s, more than 1e+09 s"),
    ],
)
def test_absurd_numbers_of_files_are_refused_too(refusal, tmp_path, text, said):
    (tmp_path / "points.csv").write_text(text)
    assert said in refusal("shape:=waypoints", f"waypoints.file:={tmp_path / 'points.csv'}")


def test_what_scrubs_resists_a_turn():
    """By hand: on a floor, four wheels in a circle at a steady speed."""
    floor, wheels = replace(CLIMBER, inclination=0.0), FourWheeled(0.8, wheelbase=0.25)
    contact = Contact(adhesion=Suction(), grip=Grip(), locomotion=wheels)
    circle = Trajectory(Circle(1.0), ConstantRate(0.2))
    found = demands(circle, floor, contact, 1.0)
    moment = 0.8 * (0.8 * 480 + 5 * 9.81) * 0.25 / 2
    right, left = (0.027 * (FRICTION + side * moment / 0.3) / 2 for side in (1, -1))
    np.testing.assert_allclose(found.torques, [[right, left]] * len(found.time), rtol=1e-6)
    straight = Trajectory(Line(1.0), RestToRest(rate=0.2))
    turns_not = (demands(straight, floor, of, 1.0).torques for of in (contact, HELD))
    np.testing.assert_array_equal(*turns_not)


def test_what_the_plant_runs_on_is_in_what_a_circle_asks_for(monkeypatch, capsys):
    words = "--params", CONFIG / "four_wheels.yaml"
    status, said = run(monkeypatch, capsys, *words)
    trajectory, climber, contact, _ = check_path.read(CONFIG / "four_wheels.yaml", {}, [])
    left, without = (
        {limit.name: limit.reserve for limit in demands(trajectory, climber, of, 1.5).least()}
        for of in (contact, HELD)
    )
    assert left["torque"] < 0.7 * without["torque"]
    assert f"torque: {left['torque']:.3g} times what is asked for" in said
    assert status == (min(left.values()) < 1)


UNSAFE = "/**/uk_torque_controller:\n  ros__parameters:\n    safe_output: x"


@pytest.mark.parametrize(
    ("text", "words", "line"),
    [
        (None, ["-p", "shape:=nothing"], "shape='nothing' must be one of "),
        (None, ["-p", "shape"], "'shape' must be name:=value"),
        (None, ["-p", "shape:=[circle]"], "shape=['circle'] must be one of "),
        (f"shape: circle\n{UNSAFE}", [], "safe_output='x' must be one of zero, hold"),
        ("shape: waypoints\n    waypoints: {file: [a]}", [], "waypoints.file=['a'] must be a text"),
        (None, ["-p", "rest_to_rest.ratee:=5.0"], "(did you mean rest_to_rest.rate?)"),
        (None, ["-p", "autostart:=false"], "autostart is no parameter of a path"),
        ("rest_to_rest.ramp_tim: 0.1", [], "(did you mean rest_to_rest.ramp_time?)"),
        ("shape: circle\n    circle: {radus: 0.1}", [], "(did you mean circle.radius?)"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(monkeypatch, capsys, tmp_path, text, words, line):
    file = CONFIG / "climber.yaml"
    if text:
        file = tmp_path / "wrong.yaml"
        file.write_text(f"/**/trajectory_publisher:\n  ros__parameters:\n    {text}\n")
    monkeypatch.setattr("sys.argv", ["check_path", "--params", str(file), *words])
    with pytest.raises(SystemExit) as ended:
        check_path.main()
    said = capsys.readouterr()
    assert (ended.value.code, said.out) == (2, "")
    assert said.err.startswith("check_path: ")
    assert line in said.err
    assert len(said.err.splitlines()) == 1


def test_margins_are_those_that_the_nodes_tell():
    """The paper's: 0.54 to 0.53, as the controller publishes them."""
    trajectory, climber, contact, _ = check_path.read(CONFIG / "paper.yaml", {}, [])
    found = demands(trajectory, climber, contact, 1.0)
    slip = next(iter(found.reserves.values()))
    assert np.min(slip) == pytest.approx(0.53, abs=0.02)


@pytest.mark.parametrize("name", WALLS)
def test_on_a_wall_that_is_told_torques_and_margins_are_the_plants(name):
    """On a circle far from the origin: what the plant needs for a steady speed, and tells."""
    wall, climber = WALLS[name], replace(CLIMBER, inclination=70.0)
    circle = Trajectory(Circle(1.0), ConstantRate(0.4), origin=(1.5, 1.0))
    found = demands(circle, climber, HELD, 1.0, wall)
    slip, tip, _ = found.reserves.values()
    plant = Plant(climber, 0.0025, Contact(), wall)
    for k in np.random.default_rng(2).integers(1, len(found.time), 10):
        at = circle.at(found.time[k])
        state, torques = State(at.pose, at.velocity), found.torques[k]
        assert plant.margins(state, torques) == pytest.approx((slip[k], tip[k]))
        after = plant.advance(state, torques, 1)
        assert after.forward_speed == pytest.approx(0.4, abs=2e-5)  # 0.008 m/s²


def test_the_command_takes_the_wall_of_the_controller(monkeypatch, capsys, tmp_path):
    """A roof whose apex is 2 m uphill of the origin; the eight goes around it at 3 m."""
    told = []
    for wall in ("plane", "cone"):
        file = tmp_path / f"{wall}.yaml"
        text = (CONFIG / "climber.yaml").read_text()
        words = f"inclination: 60.0\n    wall: {wall}\n    cone.distance: 6.0"
        file.write_text(text.replace("inclination: 90.0", words, 1))
        told.append(run(monkeypatch, capsys, "--params", file)[1].splitlines()[1])
    assert told[0] != told[1]


def test_the_fastest_law_keeps_its_margin_on_a_sphere_which_would_throw_it_off():
    """Outside of one of 2 m; v²/R takes from what presses it on, up to lifting it off."""
    sphere, held = Sphere(-2.0), Contact(adhesion=Magnetic(force_at_contact=150.0))
    circle = Trajectory(Circle(1.0), RestToRest(rate=0.2))
    free = replace(CLIMBER, seal_friction_coefficient=0.0, inclination=0.0)
    law = time_optimal(circle, free, held, Limits(margin=1.5), wall=sphere).trajectory
    reference = law.at(np.linspace(0.01, law.duration - 0.01, 2000))
    left = reserves(reference, free, held, wall=sphere)
    assert np.min(left.slip) > 1.5
    assert np.median(left.slip) < 1.6
    on_plane = reserves(reference, free, held)
    lifts = 5 * np.max(reference.speed) ** 2 / 2
    assert lifts > 15  # N of 199
    assert np.min(left.normal) < np.min(on_plane.normal) - 0.9 * lifts
