"""The command itself, without nodes: what it writes, and what it says when it cannot."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from climber_uk.analysis import excitation, identify
from climber_uk.analysis.changed_parameters import write_changed
from climber_uk.analysis.parameter_file import Values, read_file
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.shapes import SHAPES
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory

CONFIG = Path(__file__).parents[2] / "config" / "climber.yaml"
LIMITS = excitation.Limits(size=1.0, speed=0.2, duration=20.0)


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["identify", *map(str, arguments)])
    identify.main()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "identify: there is no bag nowhere"),
        (["nowhere", "--params", "nothing.yaml"], "nothing.yaml"),
        (["--plan", "p.yaml", "--speed", "-1"], "identify: speed=-1.0 must be > 0 [m/s]"),
        (["--plan", "p.yaml", "--torque", "0.1"], "identify: no trajectory keeps within"),
        (["nowhere", "--window", "nan"], "identify: window=nan must be a finite number [s]"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(monkeypatch, tmp_path, arguments, said):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        run(monkeypatch, *arguments)
    assert said in str(end.value)
    assert "\n" not in str(end.value)


def test_a_bag_or_a_plan_is_wanted(monkeypatch, capsys):
    with pytest.raises(SystemExit):
        run(monkeypatch)
    assert "want a bag, or --plan" in capsys.readouterr().err


def test_a_plan_keeps_within_its_limits():
    best = excitation.plan(Climber(), LIMITS, origin=(3.0, 4.0))
    time = np.linspace(0.0, best.trajectory.duration, 5000)
    reference = best.trajectory.at(time)
    assert np.abs(reference.speed).max() <= LIMITS.speed * (1 + 1e-9)
    assert np.ptp(reference.pose[:, :2], axis=0).max() <= LIMITS.size * (1 + 1e-9)
    assert best.trajectory.duration <= LIMITS.duration
    _, torques = excitation.driven(best.trajectory, Climber())
    assert np.abs(torques).max() <= LIMITS.torque


def test_a_plan_tells_more_than_a_line_does():
    def worst(trajectory):
        motion, _ = excitation.driven(trajectory, Climber())
        return excitation.predicted(motion, Climber()).uncertainty[excitation.SOUGHT].max()

    line = Trajectory(SHAPES["line"](length=1.0), RestToRest(rate=0.2, runs=3))
    best = excitation.plan(Climber(), LIMITS)
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
    from test_identification import moved

    monkeypatch.setattr(identify, "read_motion", lambda *_: (moved(noise=1.0, wheels=True), 3))
    files = {name: tmp_path / f"a.{name}" for name in ("json", "figure", "output")}
    run(monkeypatch, "bag", *(part for name, file in files.items() for part in (f"--{name}", file)))
    rows = {row["parameter"]: row for row in json.loads(files["json"].read_text())}
    assert rows["mass"]["estimate"] == pytest.approx(6.5, rel=0.02)
    assert rows["mass"]["nodes_now"] == 5.0
    assert files["figure"].read_bytes().startswith(b"\x89PNG")
    assert read_file(files["output"], "/plant_simulator")["mass"] == pytest.approx(6.5, rel=0.02)
    said = capsys.readouterr().out
    assert "3 unfit messages were left out" in said
    assert "| mass " in said
