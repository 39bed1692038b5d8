"""What README and the docs say can be done, done as it is written there, by somebody new."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from test_documented_commands import DEMOS, README, ROOT, WHOLE
from world import new_domain

pytestmark = [pytest.mark.nodes, pytest.mark.soak]

PATH = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
# of a table's rows, the first cell
OF_A_BAG = re.findall(r"^\| `(\w+ (?:BAG|A B)[^`]*)` \|", README, re.MULTILINE)


ONE_BY_ONE = re.search(r"^## Run the nodes.*?^```\n(.*?)^```", README, re.MULTILINE | re.DOTALL)[1]


def given(words, **options):
    environment = {**os.environ, "PATH": PATH}
    return subprocess.run(words, env=environment, capture_output=True, text=True, **options)


@pytest.fixture
def clone(tmp_path):
    """A directory that has what the repository has, and keeps what is written into it."""
    for entry in ROOT.iterdir():
        if not entry.name.startswith((".", "demo")) or entry.name == ".venv":
            (tmp_path / entry.name).symlink_to(entry)
    return tmp_path


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("page", WHOLE)
def test_the_commands_of_a_page_can_be_given_one_after_the_other(page, clone):
    for words in WHOLE[page]:
        done = given(words, cwd=clone)
        assert done.returncode == 0, (words, done.stdout, done.stderr)
        assert "Traceback" not in done.stderr


@pytest.mark.timeout(1200)
def test_the_nodes_are_run_one_by_one(clone):
    environment = {**os.environ, "PATH": PATH, "ROS_DOMAIN_ID": str(new_domain())}
    logs = [clone / f"{number}.log" for number in range(4)]
    lines = ONE_BY_ONE.splitlines()
    assert [line.split()[0] for line in lines][-1] == "record_bag"
    started = []
    for line, log in zip(lines, logs, strict=True):
        with log.open("w") as file:
            how = {"env": environment, "cwd": clone, "stdout": file, "stderr": subprocess.STDOUT}
            started.append(subprocess.Popen(shlex.split(line), **how))
    try:
        while "done: at the end" not in logs[0].read_text():
            assert [process.poll() for process in started] == [None] * 4
            time.sleep(1.0)
    finally:
        for process in reversed(started):
            process.send_signal(signal.SIGINT)
            process.wait(60)
    assert [process.returncode for process in started] == [0] * 4
    done = given(["analyze_bag", "my_bag"], cwd=clone)
    assert done.returncode == 0, done.stderr
    # a machine may be busy: then it stops, and goes on, but never is far off
    assert re.search("It followed its path|It stopped for safety", done.stdout)
    told = json.loads((clone / "my_bag" / "analysis" / "metrics.json").read_text())
    assert told["runs"][0]["metrics"]["truth_max_distance"] < 0.3


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


@pytest.mark.parametrize("variable", ["", *DEMOS])
def test_a_demonstration_of_the_table_drives_its_path(variable, tmp_path):
    words = ["make", "demo", *filter(None, [variable]), f"OUTPUT={tmp_path / 'run'}"]
    done = given([*words, f"BIN={Path(sys.executable).parent}"], cwd=ROOT, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "report.html" in done.stdout
    assert len(done.stdout.splitlines()) <= 40


def test_the_tables_are_read():
    assert len(OF_A_BAG) >= 7
    assert len(DEMOS) >= 7
    assert sum(map(len, WHOLE.values())) >= 20
