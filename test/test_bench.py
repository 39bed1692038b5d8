"""The benchmarks run as the documents say: a row of a table, and every one starts."""

import subprocess
import sys
from pathlib import Path

import pytest

from climber_uk.closed_loop.node_parameters import PARAMETERS
from climber_uk.messages.topics import CONTROLLER, PLANT
from climber_uk.parameters.parameter_file import load

pytestmark = pytest.mark.slow

BENCH = Path(__file__).parents[1] / "bench"


@pytest.mark.soak
def test_a_row_has_a_figure_for_every_controller():
    row = "the same noise, no twist"  # the shortest
    command = [sys.executable, BENCH / "robustness.py", "--only", row]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    header, figures = told.splitlines()
    kinds = [kind for kind in header.split("  ") if kind]
    assert len(kinds) > 6
    figures = [float(figure) for figure in figures.removeprefix(row).split()[1:]]
    assert len(figures) == len(kinds)


@pytest.mark.soak
@pytest.mark.parametrize("row", ["the same noise, no twist", "30 % of odometry lost"])
def test_a_row_of_wall_bench_run_twice_is_the_same_to_the_last_bit(row, monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(BENCH)
    import wall_bench

    monkeypatch.setattr(wall_bench, "DURATION", 4.0)
    monkeypatch.setattr(wall_bench, "UNTIL", 3.5)
    rows = load((BENCH / "wall_bench.yaml").read_text())
    runs = []
    for number in range(2):
        (folder := tmp_path / str(number)).mkdir()
        runs.append(wall_bench.drive(rows[row], "", folder))
    told = [wall_bench.numbers(run) for run in runs]
    assert told[0] == told[1]
    assert len(told[0]) == len(wall_bench.HEAD)
    assert runs[0].odometry.values[:, 3:].any() == rows[row].get("publish_twist", True)
    sent = len(runs[0].odometry.values) / (wall_bench.DURATION / 0.005)
    assert sent == pytest.approx(1 - rows[row].get("odometry_loss", 0.0), abs=0.1)


def test_rows_of_wall_bench_change_what_there_is(tmp_path):
    known = {name.removeprefix(f"{PLANT}.") for name in PARAMETERS}
    for row in load((BENCH / "wall_bench.yaml").read_text()).values():
        config, told = row.pop("config", "climber.yaml"), row.pop("told", {})
        assert (BENCH.parent / "config" / config).exists()
        assert set(row) <= known
        assert {f"{CONTROLLER}.{name}" for name in told} <= set(PARAMETERS)


SCRIPTS = sorted(path for path in BENCH.glob("*.py") if "argparse" in path.read_text())
# in one process, as most of a start is imports
START = """
import runpy, sys
sys.path.insert(0, sys.argv[1])
for script in sys.argv[2:]:
    sys.argv = [script, "--help"]
    try:
        runpy.run_path(script, run_name="__main__")
    except SystemExit as end:
        print(script, end.code)
"""


def test_every_script_starts():
    command = [sys.executable, "-c", START, BENCH, *SCRIPTS]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    lines = told.splitlines()
    assert len(SCRIPTS) > 10
    for script in SCRIPTS:
        assert any(line.startswith(f"usage: {script.name} ") for line in lines)
        assert f"{script} 0" in lines


@pytest.mark.parametrize("wall", ["upright tank", "inside it", "lying tank", "sphere", "roof"])
def test_magnets_hold_a_robot_in_mujoco_on_what_is_round(monkeypatch, wall):
    pytest.importorskip("mujoco", reason="an extra, `physics`, that `make test` does not install")
    monkeypatch.syspath_prepend(BENCH)
    import physics

    monkeypatch.syspath_prepend(physics.ROOT / "examples")
    from mujoco_climber import MujocoClimber

    path = "eight, 1.6 m by 0.8 m"
    monkeypatch.setitem(physics.PATHS, path, (physics.PATHS[path][0], 4.0))
    row = physics.run(f"magnets, {wall}", path, MujocoClimber)
    assert row.largest < 1  # mm


def test_ways_are_measured_in_turns_and_compared_within_a_round(monkeypatch, capsys):
    monkeypatch.syspath_prepend(BENCH)
    from side_by_side import in_turns, table

    begun = []

    def giving(name, *times):
        rest = iter(times)
        return lambda: begun.append(name) or next(rest)

    times = in_turns({"ours": giving("a", 9, 1, 2, 4), "theirs": giving("b", 9, 3, 8, 8)}, 3)
    assert "".join(begun) == "abababab"
    assert [of_each.tolist() for of_each in times.values()] == [[1, 2, 4], [3, 8, 8]]
    table("title", times, "ms", lambda time: time * 1000)
    row = capsys.readouterr().out.splitlines()[-1].split()
    assert row == ["theirs", "8000", "5500", "…", "8000", "3", "2.5", "…", "3.5"]
