"""The benchmarks run as the documents say: a row of a table, and every one starts."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

BENCH = Path(__file__).parents[1] / "bench"


def run(script, *arguments):
    command = [sys.executable, BENCH / script, *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def test_a_row_has_a_figure_for_every_controller():
    header, row = run("robustness.py", "--only", "paper's ellipse").splitlines()
    assert header.split("  ")[-1].strip() == "Kanayama + PI"
    assert len([float(figure) for figure in row.split()[3:]]) == 5


SCRIPTS = sorted(path.name for path in BENCH.glob("*.py") if "argparse" in path.read_text())


@pytest.mark.parametrize("script", SCRIPTS)
def test_every_script_starts(script):
    assert "usage" in run(script, "--help")
