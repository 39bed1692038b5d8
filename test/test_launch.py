"""What the launch file names exists; where launch itself does, it also describes what it should."""

import ast
import importlib.util
import xml.etree.ElementTree as ElementTree
from importlib.metadata import entry_points
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FILE = ROOT / "launch" / "climber.launch.py"
TREE = ast.parse(FILE.read_text())
ARGUMENTS = {"sim", "config", "namespace", "record", "use_sim_time", "rviz"}


def calls(name):
    return [
        call
        for call in ast.walk(TREE)
        if isinstance(call, ast.Call) and getattr(call.func, "id", "") == name
    ]


def test_every_node_of_the_package_is_an_executable():
    named = {call.args[0].value for call in calls("node")}
    ours = {script.name for script in entry_points(group="console_scripts")}
    assert {"trajectory_publisher", "uk_torque_controller", "plant_simulator"} <= named <= ours


def test_every_file_of_the_package_is_there_and_installed():
    paths = [call.args[0].elts[1:] for call in calls("PathJoinSubstitution")]
    files = [Path(*(part.value for part in parts)) for parts in paths]
    assert len(files) >= 3
    set_up = (ROOT / "setup.py").read_text()
    for file in files:
        assert (ROOT / file).is_file()
        assert f'"share/{{package_name}}/{file.parent}"' in set_up


def test_every_package_whose_nodes_are_started_is_depended_on():
    depended = {
        depend.text for depend in ElementTree.parse(ROOT / "package.xml").iter("exec_depend")
    }
    packages = {
        keyword.value.value
        for call in calls("Node")
        for keyword in call.keywords
        if keyword.arg == "package"
    }
    assert packages - {"climber_uk"} == {"robot_state_publisher", "rviz2"}
    assert packages - {"climber_uk"} <= depended


def test_every_argument_is_declared_and_used():
    declared = next(
        node.value
        for node in TREE.body
        if isinstance(node, ast.Assign) and "ARGUMENTS" in ast.dump(node.targets[0])
    )
    assert {key.value for key in declared.keys} == ARGUMENTS
    used = {
        node.slice.value
        for node in ast.walk(TREE)
        if isinstance(node, ast.Subscript) and getattr(node.value, "id", "") == "argument"
        if isinstance(node.slice, ast.Constant)
    }
    used |= {keyword.value.value for call in calls("node") for keyword in call.keywords}
    assert used == ARGUMENTS


@pytest.mark.skipif(not importlib.util.find_spec("launch_ros"), reason="needs a ROS installation")
@pytest.mark.parametrize(
    ("given", "nodes"),
    [
        ({}, {"trajectory_publisher", "uk_torque_controller", "plant_simulator"}),
        ({"sim": "false"}, {"trajectory_publisher", "uk_torque_controller"}),
    ],
)
def test_the_real_launch_starts_what_the_arguments_say(given, nodes):
    from launch import LaunchContext
    from launch.actions import GroupAction
    from launch_ros.actions import Node

    spec = importlib.util.spec_from_file_location("climber_launch", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    context = LaunchContext()
    entities = module.generate_launch_description().entities
    for name, (default, _) in module.ARGUMENTS.items():
        value = given.get(name, default if isinstance(default, str) else "")
        context.launch_configurations[name] = value
    group = next(entity for entity in entities if isinstance(entity, GroupAction))
    started = [
        action
        for action in group.get_sub_entities()
        if isinstance(action, Node)
        and (action.condition is None or action.condition.evaluate(context))
    ]
    assert {action.node_executable for action in started} == nodes
