"""requirements.txt pins all that is installed, by version and hash; its first part: the demo."""

import re
import subprocess
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest

pytest.importorskip("packaging", reason="it comes with what `make test` installs")
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
LINE = re.compile(r"([\w.-]+)==([\w.]+)((?: --hash=sha256:[0-9a-f]{64}){1,3})")
DEMO, REST = (ROOT / "requirements.txt").read_text().split("# For tests")


def normal(name):
    return re.sub(r"[-_.]+", "-", name).lower()


def pinned(text):
    return {normal(line.split("==")[0]) for line in text.splitlines() if "==" in line}


def test_each_line_has_a_version_and_hashes():
    lines = [line for line in (DEMO + "#" + REST).splitlines() if not line.startswith("#")]
    assert len(lines) > 150
    assert not [line for line in lines if not LINE.fullmatch(line)]


def test_the_first_part_has_all_that_the_nodes_and_the_analysis_need():
    """What is installed without a look at what it needs has to be complete."""
    needed, found = [("climber-uk", frozenset({"ros", "analysis"}))], set()
    while needed:
        name, extras = needed.pop()
        if (name, extras) in found:
            continue
        found.add((name, extras))
        try:
            requires = [Requirement(text) for text in distribution(name).requires or ()]
        except PackageNotFoundError:
            pytest.skip("another installation of ROS brings it")
        for each in requires:
            if each.marker is None or any(
                each.marker.evaluate({"extra": e}) for e in extras or [""]
            ):
                needed.append((normal(each.name), frozenset(each.extras)))
    assert {name for name, _ in found} - {"climber-uk"} <= pinned(DEMO)
    assert not pinned(DEMO) & pinned(REST)


def test_make_installs_nothing_for_the_demo_and_the_tests_without_its_hash():
    for target in (".venv/set-up", ".venv/tools-set-up"):
        command = ["make", "-n", "--always-make", target]
        told = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        installs = [line for line in told.splitlines() if "pip install" in line]
        assert len(installs) >= 3
        assert all("--require-hashes" in i or i.endswith("--editable .") for i in installs)
        assert all("--no-deps" in install for install in installs)
