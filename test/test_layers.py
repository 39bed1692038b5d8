"""Imports run downwards only, and ROS stays where the nodes are."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "climber_uk"
BELOW = {
    "system": set(),
    "mechanics": set(),
    "control": {"mechanics"},
    "simulation": {"mechanics"},
    "messages": {"mechanics"},
    "analysis": {"system", "mechanics", "control", "simulation", "messages"},
    "nodes": {"system", "mechanics", "control", "simulation", "messages", "analysis"},
}
ROS_ALLOWED = {"nodes", "messages"}
# what a node has no use for: importing it would make every start longer
UNUSED = {
    "trajectory_publisher": ["control", "simulation", "analysis", "mechanics.hold"],
    "uk_torque_controller": ["simulation", "analysis", "mechanics.shapes", "mechanics.contact"],
    "plant_simulator": ["control", "analysis", "mechanics.shapes", "mechanics.preview"],
}


def imported(file):
    """Modules that `file` imports when it runs; what is for type checkers only does not count."""
    tree = ast.parse(file.read_text())
    checked = [
        n for n in ast.walk(tree) if isinstance(n, ast.If) and "TYPE_CHECKING" in ast.dump(n.test)
    ]
    skipped = {inner for outer in checked for inner in ast.walk(outer)}
    for node in ast.walk(tree):
        if node in skipped:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def is_ros(module):
    root = module.split(".")[0]
    return root == "rclpy" or root.endswith(("_msgs", "_interfaces", "_srvs"))


@pytest.mark.parametrize("file", sorted(PACKAGE.rglob("*/*.py")), ids=lambda file: file.stem)
def test_imports_run_downwards(file):
    room = file.relative_to(PACKAGE).parts[0]
    modules = set(imported(file))
    used = {m.split(".")[1] for m in modules if m.startswith("climber_uk.")} - {room}
    assert used <= BELOW[room]
    if room not in ROS_ALLOWED or file.stem.startswith("reading"):
        assert not [m for m in modules if is_ros(m)]


@pytest.mark.parametrize("file", sorted((PACKAGE / "nodes").glob("*.py")), ids=lambda f: f.stem)
def test_nodes_do_not_import_nodes(file):
    names = "running", "parameters", "parameter_files", "plant_topics", "plant_time", "managed"
    names = *names, "margins", "plant_parts", "driver_node", "driver_graph", "parameter_paths"
    names = *names, "offered_qos", "transport"
    shared = {f"climber_uk.nodes.{name}" for name in names}
    nodes = {m for m in imported(file) if m.startswith("climber_uk.nodes.")}
    assert {m for m in nodes if m.count(".") == 2} <= shared


@pytest.mark.parametrize("name", UNUSED)
def test_a_node_imports_only_what_it_uses(name):
    code = f"import sys, climber_uk.nodes.{name}; print(*sys.modules)"
    command = [sys.executable, "-c", code]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert f"climber_uk.nodes.{name}" in said
    assert not {f"climber_uk.{unused}" for unused in UNUSED[name]} & set(said)
