"""The law of docs/your-own-law.md: among many, and by the commands of the page."""

import importlib
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from world import new_domain

from climber_uk.closed_loop.batch import Loops
from climber_uk.closed_loop.period import BatchRun
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import Observer
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion
from climber_uk.mechanics.shapes import Lemniscate
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "your-own-law.md").read_text()
INSTALL, *COMMANDS = map(shlex.split, re.search(r"```\n(.*?)```", PAGE, re.DOTALL)[1].splitlines())


def test_it_leads_climbers_of_any_mass_to_the_path(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "examples" / "own_law")
    law = importlib.import_module("own_law").Lqr()
    beside, turned, mass = np.array([0.0, 0.02, -0.02]), np.zeros(3), np.array([5.0, 4.5, 6.0])
    heading = np.full(3, np.pi / 4) + turned
    start = Motion(beside, beside + 3.0, heading, np.cos(heading), np.sin(heading), turned, turned)
    climber = Climber(suction_pressure=8000.0, max_wheel_torque=4.0)
    true = Climber(mass=mass, suction_pressure=8000.0, max_wheel_torque=4.0)
    observer = Observer(side_slip_bandwidth=0.0)
    loops = Loops(start, true, ControlLaw(climber, Guidance(), other=law), observer)
    eight = Trajectory(Lemniscate(1.5, 0.75), RestToRest(rate=0.12), origin=(0.0, 3.0))
    outcome = loops.run(BatchRun(eight, 4.0, 0.005))
    assert (outcome.last < 5e-4).all()
    assert (outcome.worst < 0.03).all()


@pytest.mark.nodes
@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_the_commands_of_the_page(tmp_path):
    """In a copy of the repository, with the law installed beside what runs the tests."""
    for entry in "bench", "config", "examples":
        shutil.copytree(ROOT / entry, tmp_path / entry)
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "PYTHONPATH": str(tmp_path / "packages"),
        "ROS_DOMAIN_ID": str(new_domain()),
    }
    assert INSTALL[-2:] == ["--editable", "examples/own_law"]
    install = ["python", "-m", *INSTALL[:-2], "--target", "packages", "examples/own_law"]
    told = []
    for words in [install, *COMMANDS]:
        how = {"env": environment, "cwd": tmp_path, "capture_output": True, "text": True}
        done = subprocess.run(words, **how)
        assert done.returncode == 0, (words, done.stdout, done.stderr)
        told.append(done.stdout)
    assert "It followed its path" in told[2]
    assert re.search(r"succeeded +100 +100.000%", told[-1])
