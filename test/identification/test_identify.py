"""The command itself, without nodes: what it writes, and what it says when it cannot."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from made_bag import JOINTS, ODOMETRY, SECOND, blank, message, turn, write

from climber_uk.identification import excitation, identify
from climber_uk.identification.integral_equations import Site
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.shapes import SHAPES
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.parameters.changed_parameters import write_changed
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.path_check import check_path

SIDES = "right", "left"
CONFIG = Path(__file__).parents[2] / "config" / "climber.yaml"
LIMITS = excitation.ExcitationLimits(size=1.0, speed=0.2, duration=20.0)


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["identify", *map(str, arguments)])
    identify.main()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "identify: there is no bag nowhere"),
        (["nowhere", "--params", "nothing.yaml"], "nothing.yaml"),
        (["--plan", "p.yaml", "--speed", "-1"], "identify: speed=-1.0 must be > 0 [m/s]"),
        (
            ["--plan", "p.yaml", "--torque", "0.1"],
            "no trajectory keeps within size 2 m, speed 0.3 m/s, torque 0.1 N m, duration 60 s",
        ),
        (["--plan", "."], "identify: . is a directory, and would be a file"),
        (["nowhere", "--window", "1e-9"], "identify: window=1e-09 must be >= 0.02 [s]"),
        (["nowhere", "--window", "nan"], "identify: window=nan must be a finite number [s]"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(monkeypatch, capsys, tmp_path, arguments, said):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match="2"):
        run(monkeypatch, *arguments)
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line


def test_a_bag_or_a_plan_is_wanted(monkeypatch, capsys):
    with pytest.raises(SystemExit):
        run(monkeypatch)
    assert "want a bag, or --plan" in capsys.readouterr().err


@pytest.fixture(scope="module")
def best():
    return excitation.plan(Climber(), LIMITS, origin=(3.0, 4.0))


def test_a_plan_keeps_within_its_limits(best):
    time = np.linspace(0.0, best.trajectory.duration, 5000)
    reference = best.trajectory.at(time)
    assert np.abs(reference.speed).max() <= LIMITS.speed * (1 + 1e-9)
    assert np.ptp(reference.pose[:, :2], axis=0).max() <= LIMITS.size * (1 + 1e-9)
    assert best.trajectory.duration <= LIMITS.duration
    _, torques = excitation.driven(best.trajectory, Climber())
    assert np.abs(torques).max() <= LIMITS.torque


def test_a_plan_for_wheels_that_scrub_has_no_bend_that_turns_one_back():
    scrubbing = excitation.plan(Climber(), LIMITS, site=Site(scrubs=True)).trajectory
    time = np.linspace(0.0, scrubbing.duration, 5000)
    reference = scrubbing.at(time)
    rims = np.abs(reference.speed) - 0.3 * np.abs(reference.yaw_rate)
    assert rims.min() > -1e-3


def test_a_plan_tells_more_than_a_line_does(best):
    def worst(trajectory):
        motion, _ = excitation.driven(trajectory, Climber())
        return excitation.predicted(motion, Climber()).uncertainty[excitation.SOUGHT].max()

    line = Trajectory(SHAPES["line"](length=1.0), RestToRest(rate=0.2, runs=3))
    assert worst(best.trajectory) < 0.02
    assert worst(line) > 10.0  # of the inertia nothing


def test_a_plan_is_written_with_all_that_the_nodes_had(monkeypatch, tmp_path, capsys):
    plan = tmp_path / "plan.yaml"
    run(monkeypatch, "--plan", plan, "--params", CONFIG, "--duration", 20, "--size", 1)
    publisher = read_file(plan, "/trajectory_publisher")
    assert publisher["time_law"] == "rest_to_rest"
    shape = Values(publisher).read(SHAPES[publisher["shape"]], f"{publisher['shape']}.")
    law = Values(publisher).read(RestToRest, "rest_to_rest.")
    x, y, heading = Trajectory(shape, law, origin=(0.0, 3.0)).at(0.0).pose
    plant = read_file(plan, "/plant_simulator")
    assert [plant[f"initial_{name}"] for name in ("x", "y", "heading")] == [x, y, heading]
    assert read_file(plan, "/run_demo")["duration"] == law.duration(shape)
    assert read_file(plan, "/uk_torque_controller") == read_file(CONFIG, "/uk_torque_controller")
    assert "mass ±" in capsys.readouterr().out


def test_changed_parameters_hold_in_every_namespace_and_leave_the_others(tmp_path):
    original, changed = tmp_path / "a.yaml", tmp_path / "b.yaml"
    original.write_text(
        "/a/node:\n  ros__parameters: {mass: 1.0, part: {one: 1.0, two: 2.0}}\n"
        "/**/node:\n  ros__parameters: {mass: 2.0, part.one: 5.0}\n"
        "/**/other:\n  ros__parameters: {mass: 3.0}\n"
    )
    write_changed(original, {"node": {"mass": 7.0, "part.one": 8.0}}, changed)
    assert read_file(changed, "/a/node") == {"mass": 7.0, "part.one": 8.0, "part.two": 2.0}
    assert read_file(changed, "/b/node") == {"mass": 7.0, "part.one": 8.0}
    assert read_file(changed, "/other") == {"mass": 3.0}
    assert yaml.safe_load(changed.read_text())["/**/node"]["ros__parameters"]["part"] == {
        "one": 8.0
    }


def test_the_table_is_written_as_json_and_drawn(monkeypatch, tmp_path, capsys):
    from test_estimation import moved

    monkeypatch.setattr(identify, "read_motion", lambda *_: (moved(noise=1.0, wheels=True), 3))
    files = {name: tmp_path / f"a.{name}" for name in ("json", "figure", "output")}
    bag = made_bag(tmp_path / "bag", {})
    run(monkeypatch, bag, *(part for name, file in files.items() for part in (f"--{name}", file)))
    rows = {row["parameter"]: row for row in json.loads(files["json"].read_text())}
    assert rows["mass"]["estimate"] == pytest.approx(6.5, rel=0.02)
    assert rows["mass"]["nodes_now"] == 5.0
    assert files["figure"].read_bytes().startswith(b"\x89PNG")
    assert read_file(files["output"], "/plant_simulator")["mass"] == pytest.approx(6.5, rel=0.02)
    said = capsys.readouterr().out
    assert "3 unfit messages were left out" in said
    assert "| mass " in said


EVERY = 4  # of the times of a made motion
WHEELS = ("a_right", "a_left")


def bag_of(path, motion, parameters=None, others=(), name=WHEELS):
    """A bag of a made motion, commanded torques that have its impulse, and recorded parameters."""
    messages = []
    right_left = [*name]
    for i in range(0, len(motion.time) - EVERY, EVERY):
        stamp = SECOND + round(motion.time[i] * SECOND)
        x, y, heading = motion.pose[i]
        odometry = message(
            ODOMETRY,
            stamp,
            child_frame_id="base_link",
            pose__pose__position__x=float(x),
            pose__pose__position__y=float(y),
            pose__pose__orientation=turn(heading),
            twist__twist__linear__x=float(motion.rates[i, 0]),
            twist__twist__angular__z=float(motion.rates[i, 1]),
        )
        duration = motion.time[i + EVERY] - motion.time[i]
        held = (motion.impulse[i + EVERY] - motion.impulse[i]) / duration  # until the next
        commanded = message(JOINTS, stamp, name=right_left, effort=held)
        told = message(JOINTS, stamp, name=right_left, position=motion.wheel_angles[i])
        messages += [("/odom", ODOMETRY, stamp, odometry)]
        messages += [("/wheel_torques", JOINTS, stamp, commanded)]
        messages += [("/joint_states", JOINTS, stamp, told)]
        messages += [("/joint_states", JOINTS, stamp, message(JOINTS, stamp, **o)) for o in others]
    if parameters:
        event = blank("rcl_interfaces/msg/ParameterEvent")
        event.new_parameters = [parameter(*item) for item in parameters.items()]
        topic = "/uk_torque_controller/parameters"
        messages.append((topic, "rcl_interfaces/msg/ParameterEvent", SECOND, event))
    return write(path, messages)


def parameter(name, value):
    made = blank("rcl_interfaces/msg/Parameter")
    made.name = name
    made.value.type = 4 if isinstance(value, str) else 3
    setattr(made.value, "string_value" if isinstance(value, str) else "double_value", value)
    return made


def made_bag(path, recorded, **others):
    """A bag of the motion of `test_estimation`."""
    from test_estimation import moved

    motion = moved(noise=1.0, wheels=True)
    names = {f"{side}_wheel_joint": name for side, name in zip(SIDES, WHEELS, strict=True)}
    return bag_of(path, motion, {**names, **recorded}, **others)


def told_of(monkeypatch, tmp_path, capsys, bag, *arguments):
    """Rows by parameter, the file that was written, what was printed, and the status."""
    files = "--json", tmp_path / "told.json", "--output", tmp_path / "told.yaml"
    status = 0
    try:
        run(monkeypatch, bag, *files, *arguments)
    except SystemExit as end:
        status = end.code
    rows = {row["parameter"]: row for row in json.loads((tmp_path / "told.json").read_text())}
    return rows, (tmp_path / "told.yaml").read_text(), capsys.readouterr().out, status


def test_names_and_geometry_are_those_that_the_bag_recorded(monkeypatch, tmp_path, capsys):
    brush = {"name": ["brush", "lift"], "effort": np.array([9.0, 9.0])}
    bag = made_bag(tmp_path / "bag", {"wheel_radius": 0.027}, others=[brush])
    rows, written, _, status = told_of(monkeypatch, tmp_path, capsys, bag)
    assert status == 0
    assert rows["mass"]["estimate"] == pytest.approx(6.5, rel=0.002)
    assert rows["wheel_radius"]["estimate"] == pytest.approx(0.03, rel=0.002)
    assert rows["mass"]["model_fits"]
    assert yaml.safe_load(written)["/**/plant_simulator"]["ros__parameters"]["mass"] > 6


def test_a_file_that_differs_from_what_was_recorded_is_used_and_said(monkeypatch, tmp_path, capsys):
    bag = made_bag(tmp_path / "bag", {"inclination": 80.0})
    file = tmp_path / "now.yaml"
    file.write_text("/**/uk_torque_controller:\n  ros__parameters: {inclination: 90.0}\n")
    rows, _, said, _ = told_of(monkeypatch, tmp_path, capsys, bag, "--params", file)
    assert rows["mass"]["estimate"] == pytest.approx(6.5, rel=0.01)
    assert "inclination was 80 when this was recorded; 90 of the file is used" in said


def test_a_magnetic_climber_has_no_seal_and_no_pressure(monkeypatch, tmp_path, capsys):
    bag = made_bag(tmp_path / "bag", {"adhesion": "magnetic"})
    rows, written, said, _ = told_of(monkeypatch, tmp_path, capsys, bag)
    assert rows["rolling_friction"]["unit"] == "N"
    for word in ("seal", "pressure"):
        assert word not in said + written + " ".join(rows)


def test_a_plan_for_a_magnetic_climber_has_no_seal(monkeypatch, tmp_path, capsys):
    file = tmp_path / "now.yaml"
    file.write_text("/**/uk_torque_controller:\n  ros__parameters: {adhesion: magnetic}\n")
    with open(file, "a") as more:
        more.write("/**/trajectory_publisher:\n  ros__parameters: {origin_y: 1.0}\n")
    run(monkeypatch, "--plan", tmp_path / "p.yaml", "--params", file, "--duration", 12)
    said = capsys.readouterr().out
    assert "rolling_friction ±" in said
    assert "seal" not in said


def test_settings_that_the_model_does_not_know_are_said(monkeypatch, tmp_path, capsys):
    bag, file = made_bag(tmp_path / "bag", {}), tmp_path / "now.yaml"
    file.write_text(
        "/**/uk_torque_controller:\n  ros__parameters: {seal_radius: 0.1}\n"
        "/**/plant_simulator:\n  ros__parameters: {wall: cylinder, cylinder.radius: -500.0, "
        "friction: lugre, odometry_source: wheels, heading_bias: 0.1}\n"
    )
    _, _, said, _ = told_of(monkeypatch, tmp_path, capsys, bag, "--params", file)
    for setting in ("seal_radius is 0.1", "the wall is a cylinder", "friction is lugre"):
        assert setting in said
    for setting in ("odometry_source is wheels", "heading_bias is 0.1"):
        assert setting in said


def test_what_cannot_be_told_is_in_status_file_and_table(monkeypatch, tmp_path, capsys):
    from test_estimation import STRAIGHT, moved

    motion = moved(heading=STRAIGHT, noise=1.0, wheels=True)
    names = {f"{side}_wheel_joint": name for side, name in zip(SIDES, WHEELS, strict=True)}
    bag = bag_of(tmp_path / "bag", motion, names)
    rows, written, said, status = told_of(monkeypatch, tmp_path, capsys, bag)
    assert "identify: " in status
    assert "yaw inertia cannot be told" in status
    assert rows["yaw_inertia"]["estimate"] is None
    assert "yaw_inertia" not in written
    assert "it turns one way at more than 0.05 rad/s in only 0 windows" in said


def test_wrong_joint_names_are_said_with_the_right_ones(monkeypatch, capsys, tmp_path):
    bag = made_bag(tmp_path / "bag", {}, name=("left", "right"))
    with pytest.raises(SystemExit):
        run(monkeypatch, bag)
    said = capsys.readouterr().err
    assert "no a_right and no a_left among the joints left, right" in said


def check(monkeypatch, capsys, bag):
    """Status of check_path with the posterior of a bag, what it says, and its lines on errors."""
    words = ["check_path", "--params", CONFIG, "--posterior", bag, "--climbers", 10]
    monkeypatch.setattr(sys, "argv", [*map(str, words)])
    with pytest.raises(SystemExit) as ended:
        check_path.main()
    said = capsys.readouterr()
    return ended.value.code, said.out, said.err.splitlines()


@pytest.mark.soak
def test_check_path_has_it_tell_of_a_bag(monkeypatch, capsys, tmp_path):
    status, said, _ = check(monkeypatch, capsys, made_bag(tmp_path / "bag", {}))
    assert status == 0
    assert "10 climbers drawn: mass 6.5" in said
    assert "falls: 0.00% " in said
    (tmp_path / "empty").mkdir()
    status, said, (line,) = check(monkeypatch, capsys, tmp_path / "empty")
    assert (status, said) == (2, "")
    assert line.startswith("check_path: identify: ")
