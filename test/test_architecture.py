"""docs/architecture.md says what the code does, and each room what its modules are."""

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from test_layers import BELOW, PACKAGE

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "architecture.md").read_text()


def section(heading):
    return PAGE.split(f"## {heading}\n")[1].split("\n## ")[0]


def test_the_table_of_layers_is_the_one_that_is_enforced():
    told = {}
    for room, words in re.findall(r"^\| `(\w+)` \|(.*)\|$", section("The layers"), re.MULTILINE):
        like = re.search(r"those of `(\w+)`", words)
        rooms = re.findall(r"`(\w+)`", words.replace(like[0], "") if like else words)
        told[room] = set(rooms) | (told[like[1]] if like else set())
    assert told == BELOW


def test_the_figure_of_the_layers_has_all_rooms_and_what_a_room_imports_is_below_it():
    figure = (ROOT / "docs" / "figures" / "layers.svg").read_text()
    names = re.findall(r'y="(\d+)"[^>]*font-weight="bold">(\w+)<', figure)
    depth = {name: int(y) for y, name in names}
    assert depth.keys() == BELOW.keys()
    assert all(depth[below] > depth[room] for room, rooms in BELOW.items() for below in rooms)


@cache
def traced():
    """Depth, file and function of each call that answers an odometry."""
    pytest.importorskip("rclpy")
    command = [sys.executable, ROOT / "test" / "nodes" / "odometry_trace.py"]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=100)
    lines = [line.split() for line in done.stdout.splitlines()]
    return [(int(depth), file, name) for depth, file, name in lines]


@pytest.mark.nodes
def test_the_tree_has_all_rooms():
    rooms = {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    assert set(re.findall(r"climber_uk/(\w+)/ ", section("Where things are"))) == rooms


def test_one_odometry_goes_the_way_that_is_drawn():
    calls = [(file, name) for _, file, name in traced()]
    files = {file for file, _ in calls}
    way = section("One odometry's way")
    drawn = re.findall(r"^ *(\w+/\w+\.py) +(\w+)\b", way, re.MULTILINE)
    assert {file for file, _ in drawn} == files
    assert f"\n{len(files)} files, " in way
    left = iter(calls)
    assert not [call for call in drawn if call not in left], "not called, or not in this order"


@pytest.mark.nodes
def test_no_file_on_an_odometrys_way_calls_one_that_has_called_it():
    callers, called = [], {}
    for depth, file, _ in traced():
        callers[depth:] = [file]
        for caller in callers[:-1]:
            if caller != file:
                called.setdefault(caller, set()).add(file)
    assert not [(a, b) for a in called for b in called[a] if a in called.get(b, ())]


@pytest.mark.parametrize("room", sorted(BELOW))
def test_a_room_says_what_each_of_its_modules_is(room):
    about = ast.get_docstring(ast.parse((PACKAGE / room / "__init__.py").read_text()))
    named = re.findall(r"\b\w+\b", " ".join(re.findall(r"`([\w.]+)`", about)))
    modules = {module.stem for module in (PACKAGE / room).glob("*.py")} - {"__init__"}
    assert not modules - set(named)
