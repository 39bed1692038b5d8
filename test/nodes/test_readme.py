"""What README offers to be done with a bag, done as it is written there, by somebody new."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.nodes, pytest.mark.soak]

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
PATH = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
# of a table's rows, the first cell
OF_A_BAG = re.findall(r"^\| `(\w+ (?:BAG|A B)[^`]*)` \|", README, re.MULTILINE)
DEMOS = re.findall(r"^\| `(C\w+=[\w/.]+)` \|", README, re.MULTILINE)


def given(words, **options):
    environment = {**os.environ, "PATH": PATH}
    return subprocess.run(words, env=environment, capture_output=True, text=True, **options)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Directory of a run on a path that tells everything, with encoders, IMU and fixes."""
    directory = tmp_path_factory.mktemp("new")
    config = str(ROOT / "config" / "field.yaml")
    ran = given(["run_demo", "--config", config, "--output", str(directory / "run")])
    assert ran.returncode == 0, ran.stderr
    return directory / "run"


@pytest.mark.parametrize("command", OF_A_BAG)
def test_a_tool_of_the_table_does_what_it_is_there_for(run, command, tmp_path):
    words = command.replace("name:=value", "mass:=5.5").replace("A B", "BAG BAG").replace("…", "")
    words = [str(run / "bag") if word == "BAG" else word for word in shlex.split(words)]
    done = given(words, cwd=tmp_path)
    assert "Traceback" not in done.stderr
    # identify's answer may be that something cannot be told of this run
    assert done.returncode in (0, words[0] == "identify"), done.stdout + done.stderr
    assert done.stdout


@pytest.mark.parametrize("variable", DEMOS)
def test_a_demonstration_of_the_table_drives_its_path(variable, tmp_path):
    words = ["make", "demo", variable, f"OUTPUT={tmp_path / 'run'}"]
    done = given([*words, f"BIN={Path(sys.executable).parent}"], cwd=ROOT, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "report.html" in done.stdout
    assert len(done.stdout.splitlines()) <= 40


def test_the_tables_are_read():
    assert len(OF_A_BAG) >= 7
    assert len(DEMOS) >= 7
