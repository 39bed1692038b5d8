"""Variants of another package: had by their names, or left out with one line each."""

import json
import os
import subprocess
import sys

import pytest
from extension import install

TABLES = {
    "shapes": "mechanics.shapes:SHAPES",
    "time_laws": "mechanics.time_laws:TIME_LAWS",
    "friction": "mechanics.friction:FRICTION",
    "adhesion": "mechanics.adhesion:ADHESION",
    "locomotion": "mechanics.contact:LOCOMOTION",
    "walls": "mechanics.wall:WALLS",
    "odometry_sources": "simulation.sensors:SOURCES",
    "constraints": "control.constraints:CONSTRAINTS",
    "controllers": "control.constraints:FORCE_LAWS",
}
OTHERS = {  # of which the document has no example
    "climber_uk.walls": {"another_wall": "climber_uk.mechanics.wall:Plane"},
    "climber_uk.locomotion": {"another_way": "climber_uk.mechanics.contact:Wheeled"},
}


def python(directory, code):
    """What Python says, with the packages in a directory."""
    environment = {**os.environ, "PYTHONPATH": str(directory)}
    command = [sys.executable, "-c", code]
    said = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert said.returncode == 0, said.stderr
    return said


@pytest.mark.parametrize(
    "first",
    [
        pytest.param(first, marks=() if first in ("friction", "controllers") else pytest.mark.soak)
        for first in TABLES
    ],
)
def test_every_table_has_the_entries_of_other_packages_whichever_is_imported_first(first, tmp_path):
    groups = install(tmp_path, OTHERS)
    order = [first, *(group for group in TABLES if group != first)]
    lines = [f"from climber_uk.{TABLES[g].replace(':', ' import ')} as {g}" for g in order]
    names = ", ".join(f"{group!r}: [*{group}]" for group in order)
    said = python(tmp_path, "\n".join([*lines, "import json", f"print(json.dumps({{{names}}}))"]))
    assert not said.stderr
    tables = json.loads(said.stdout)
    assert {f"climber_uk.{group}" for group in TABLES} == set(groups)
    for group, entries in groups.items():
        own = tables[group.removeprefix("climber_uk.")]
        assert own[-len(entries) :] == list(entries)
        assert len(own) == len(set(own))


BAD = {
    "missing": ("nowhere_to_be_found:Law", "No module named 'nowhere_to_be_found'"),
    "without": ("my_climber:NoSuchLaw", "no attribute 'NoSuchLaw'"),
    "bare": ("bad:Bare", "fields must be made by `parameter`: gain"),
    "function": ("bad:function", "it must be a dataclass"),
    "an-odd-name": ("my_climber:Fading", "its name must be"),
    "lugre": ("my_climber:Fading", "another one than theirs"),
    "raising": ("raising:Law", "RuntimeError: two"),
}
CODE = "from climber_uk.mechanics.friction import FRICTION; print(*FRICTION)"


def test_what_cannot_be_had_is_left_out_with_one_line_and_the_others_are_there(tmp_path):
    install(tmp_path, {"climber_uk.friction": {name: value for name, (value, _) in BAD.items()}})
    (tmp_path / "bad.py").write_text(
        "import dataclasses\n@dataclasses.dataclass\nclass Bare:\n    gain: float = 1.0\n"
        "def function(): pass\n"
    )
    (tmp_path / "raising.py").write_text("raise RuntimeError('two\\nlines')\n")
    said = python(tmp_path, CODE)
    assert said.stdout.split() == ["coulomb", "viscous", "stribeck", "lugre", "fading", "dahl"]
    lines = said.stderr.splitlines()
    assert len(lines) == len(BAD)
    for name, (value, why) in BAD.items():
        (line,) = [line for line in lines if f"friction {name!r} ({value})" in line]
        assert why in line


def test_no_metadata_is_read_where_no_package_has_an_entry(tmp_path):
    """That would take longer than all the rest of the registry."""
    said = python(tmp_path, f"{CODE}; import sys; print('importlib.metadata' in sys.modules)")
    assert said.stdout.split() == ["coulomb", "viscous", "stribeck", "lugre", "False"]
