"""Imports run downwards only, in no circle, and ROS stays where the nodes are."""

import ast
import graphlib
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "climber_uk"
# what each room may import; docs/architecture.md draws it
MATHEMATICS = {"parameters", "mechanics"}
DATA = MATHEMATICS | {"control", "simulation", "messages", "closed_loop"}
BELOW = {
    "system": set(),
    "parameters": set(),
    "mechanics": {"parameters"},
    "control": MATHEMATICS,
    "simulation": MATHEMATICS,
    "localization": MATHEMATICS,
    "planning": MATHEMATICS,
    "messages": MATHEMATICS,
    "closed_loop": MATHEMATICS | {"control", "simulation", "messages"},
    "bags": MATHEMATICS | {"control", "messages"},
    "ros": MATHEMATICS | {"planning", "system", "control", "simulation", "messages"},
    "report": DATA | {"system", "bags"},
    "identification": DATA | {"system", "bags", "report"},
    "replay": DATA | {"system", "bags", "report", "localization"},
    "campaign": DATA | {"system", "bags", "report"},
    "path_check": DATA | {"system", "bags", "report"},
    "paper": DATA | {"system", "bags", "report"},
    "driver_check": DATA | {"system", "ros"},
    "nodes": DATA | {"localization", "planning", "system", "ros"},
    "recording": {"system", "ros", "bags"},
    "operating": DATA | {"system", "ros"},
    "demo": DATA | {"system", "ros"},
}
ROS_ALLOWED = {"ros", "nodes", "recording", "driver_check", "operating", "demo", "messages"}
# what a node has no use for: importing it would make every start longer
TOOLS = "closed_loop", "bags", "report", "identification", "campaign", "paper", "path_check"
UNUSED = {
    "wall_odometry": ["control", "simulation", "mechanics.shapes", "mechanics.preview", *TOOLS],
    "trajectory_publisher": ["control", "simulation", "mechanics.adhesion", *TOOLS],
    "uk_torque_controller": ["simulation", "mechanics.shapes", "mechanics.contact", *TOOLS],
    "plant_simulator": ["control", "mechanics.shapes", "mechanics.preview", *TOOLS],
}
FILES = sorted(PACKAGE.rglob("*/*.py"))


def name(file):
    """Dotted name of the module in a file."""
    parts = file.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {name(file) for file in PACKAGE.rglob("*.py")}


def imported(file, when_run=False):
    """Modules that a file imports; those that only type checkers see too, unless `when_run`."""
    return [module for module, is_run in _imported(file) if is_run or not when_run]


@cache
def _imported(file):
    return [*_imported_in(ast.parse(file.read_text()))]


def _imported_in(tree, is_run=True):
    """Modules that are imported, each with whether a run sees that too."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, is_run) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from ((m, is_run) for m in [m for m in inner if m in MODULES] or [node.module])
        elif not isinstance(node, ast.expr):  # in which nothing is imported
            is_checked = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)
            yield from _imported_in(node, is_run and not is_checked)


def is_ros(module):
    root = module.split(".")[0]
    return root == "rclpy" or root.endswith(("_msgs", "_interfaces", "_srvs"))


def test_imports_run_downwards():
    upwards = {}
    for file in FILES:
        room = file.relative_to(PACKAGE).parts[0]
        used = {m.split(".")[1] for m in imported(file) if m.startswith("climber_uk.")} - {room}
        wrong = used - BELOW[room]
        if room not in ROS_ALLOWED or file.stem.startswith("reading"):
            wrong |= {m for m in imported(file, when_run=True) if is_ros(m)}
        if wrong:
            upwards[name(file)] = wrong
    assert not upwards


def test_rooms_are_those_of_the_table():
    assert {file.relative_to(PACKAGE).parts[0] for file in FILES} == set(BELOW)


def test_no_module_imports_itself_by_way_of_others():
    # a room's own __init__ may gather what its modules have
    rooms = {name(file) for file in PACKAGE.rglob("__init__.py")}
    uses = {
        name(file): {m for m in imported(file) if m in MODULES - rooms}
        for file in PACKAGE.rglob("*.py")
    }
    tuple(graphlib.TopologicalSorter(uses).static_order())  # raises CycleError


def test_nodes_do_not_import_nodes():
    nodes = (PACKAGE / "nodes").glob("*.py")
    assert not [m for file in nodes for m in imported(file) if m.startswith("climber_uk.nodes.")]


def test_no_room_is_more_than_a_fifth_of_the_house():
    lines = {
        room: sum(len(f.read_text().splitlines()) for f in (PACKAGE / room).rglob("*.py"))
        for room in BELOW
    }
    assert max(lines.values()) <= 0.2 * sum(lines.values()), lines


@pytest.mark.parametrize("node", UNUSED)
def test_a_node_imports_only_what_it_uses(node):
    code = f"import sys, climber_uk.nodes.{node}; print(*sys.modules)"
    command = [sys.executable, "-c", code]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert f"climber_uk.nodes.{node}" in said
    assert not {f"climber_uk.{unused}" for unused in UNUSED[node]} & set(said)
