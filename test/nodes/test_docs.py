"""The references of parameters, topics and services say what the nodes say."""

import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"

pytestmark = pytest.mark.nodes


def test_the_references_are_current(world, tmp_path):
    command = [sys.executable, DOCS / "generate.py", tmp_path]
    subprocess.run(command, env=world.environment, check=True)
    written = sorted(path.name for path in tmp_path.iterdir())
    assert written == ["interfaces.md", "metrics.md", "parameters.md", "security_policy.xml"]
    for name in written:
        assert (DOCS / name).read_text() == (tmp_path / name).read_text(), "run make docs"
