"""Nodes start, refuse to start with one clear line, and end without a trace."""

import signal

import pytest

pytestmark = [pytest.mark.nodes, pytest.mark.installed]

NODES = ["trajectory_publisher", "uk_torque_controller", "plant_simulator"]


@pytest.mark.parametrize(
    ("name", "parameters", "line"),
    [
        ("trajectory_publisher", ["shape:=heart"], "shape='heart' must be one of ellipse, circle"),
        ("trajectory_publisher", ["time_law:=constant_rate", "shape:=line"], "'rest_to_rest'"),
        ("trajectory_publisher", ["preview:=0.1"], r"preview=0.1 must be >= 2 publish_period"),
        ("uk_torque_controller", ["mass:=-5.0"], "mass=-5.0 must be > 0 [kg]"),
        ("uk_torque_controller", ["guidance.speed_rate:=0.0"], "guidance.speed_rate=0.0 must be"),
        ("uk_torque_controller", ["mass:=5"], "mass=5 must be a float (write 5.0)"),
        ("uk_torque_controller", ["maas:=5.0"], "maas is not a parameter"),
        ("plant_simulator", ["integration_step:=0.003"], "control_period=0.005 must be a multiple"),
        ("plant_simulator", ["suction_area:=.nan"], "suction_area=nan must be a finite number"),
    ],
)
def test_a_bad_parameter_is_refused_with_one_line(world, name, parameters, line):
    assert world.start_node(name, *parameters).wait(60) == 1
    (said,) = world.log(name).splitlines()
    assert said.startswith(f"{name}: ")
    assert line in said
    del world.processes[name]


@pytest.mark.parametrize(
    ("content", "wrong"), [("1 2\n", "1 point"), ("0 0\n1 nan\n", "line 2: point 2 is not finite")]
)
def test_a_bad_waypoint_file_is_refused_with_one_line(world, tmp_path, content, wrong):
    file = tmp_path / "points.txt"
    file.write_text(content)
    name = "trajectory_publisher"
    assert world.start_node(name, "shape:=waypoints", f"waypoints.file:={file}").wait(60) == 1
    (said,) = world.log(name).splitlines()
    assert f"waypoints.file='{file}'" in said
    assert wrong in said
    del world.processes[name]


@pytest.mark.parametrize("name", NODES)
def test_a_missing_parameter_file_is_refused_without_a_traceback(world, name):
    assert world.start_node(name, config="nothing.yaml").wait(60) == 1
    assert "nothing.yaml" in world.log(name)
    assert "Traceback" not in world.log(name)
    del world.processes[name]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("name", NODES)
def test_a_signal_ends_a_node_cleanly_even_if_it_comes_twice(world, name, number):
    process = world.start_node(name)
    node = (name, "/")
    world.wait(lambda: node in world.node.get_node_names_and_namespaces(), name)
    process.send_signal(number)
    assert world.end(name, number) == 0
    assert "Traceback" not in world.log(name)
