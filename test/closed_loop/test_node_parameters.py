"""Tools read a parameter file as the nodes do: what no node has is misspelt, and refused."""

import re
import sys
from pathlib import Path

import pytest
from made_bag import a_run

from climber_uk.closed_loop.node_parameters import read_parameters
from climber_uk.driver_check.check_driver import as_the_controller
from climber_uk.identification import identify
from climber_uk.messages.topics import CONTROLLER, LOCALIZATION, PLANNER, PLANT
from climber_uk.path_check import check_path
from climber_uk.replay import localize, replay_controller
from climber_uk.report import analyze_bag, compare_bags

CONFIG = Path(__file__).parents[2] / "config"
FILES = [file for file in CONFIG.glob("*.yaml") if f"{PLANT}:" in file.read_text()]
IDENTIFY = [identify, "{bag}"]
PLAN = [identify, "--plan", "{bag}.yaml", "--torque", "0.1"]  # with which there is none: soon told


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_file_of_ours_is_taken(file):
    namespace = "/climber_1" if file.stem == "four_climbers" else ""
    for node in PLANNER, CONTROLLER, PLANT:
        assert read_parameters(file, f"{namespace}/{node}")


COMMANDS = pytest.mark.parametrize(
    ("command", "node"),
    [
        ([analyze_bag, "{bag}", "-o", "{bag}.out"], CONTROLLER),
        ([compare_bags, "{bag}", "{bag}", "-o", "{bag}.out"], CONTROLLER),
        (IDENTIFY, CONTROLLER),
        (IDENTIFY, PLANT),
        *((PLAN, node) for node in (PLANNER, CONTROLLER, PLANT)),
        ([replay_controller, "{bag}", "-o", "{bag}.out"], CONTROLLER),
        ([localize, "{bag}", "-o", "{bag}.out"], LOCALIZATION),
        *(([check_path], node) for node in (PLANNER, CONTROLLER)),
    ],
    ids=lambda given: given if isinstance(given, str) else given[0].__name__.split(".")[-1],
)


@pytest.fixture
def said(monkeypatch, capsys, tmp_path):
    """Give a tool a file in which a node has a line more; return its status and what it says."""

    def run(command, node, line):
        bag = a_run(20).write(tmp_path / "bag")
        text = (CONFIG / "field.yaml").read_text()
        before, _, after = text.partition(f"{node}:\n  ros__parameters:\n")
        file = tmp_path / "nodes.yaml"
        own = re.sub(rf"    {line.partition(':')[0]}: .*\n", "", after, count=1)
        file.write_text(f"{before}{node}:\n  ros__parameters:\n    {line}\n{own}")
        tool, *words = command
        words = [word.format(bag=bag) for word in words]
        monkeypatch.setattr(sys, "argv", ["tool", *words, "--params", str(file)])
        status = 0
        try:
            tool.main()
        except SystemExit as ended:
            status = ended.code
        return status, capsys.readouterr().err + str(status)

    return run


@COMMANDS
def test_a_name_that_no_node_has_is_refused_in_words(said, command, node):
    status, told = said(command, node, "rate_off: 1.0")
    assert status
    assert f"rate_off is no parameter of /{node}" in told


@COMMANDS
def test_a_number_in_another_unit_is_doubted_in_words(said, command, node):
    line, meant = {
        PLANNER: ("origin_x: 3000.0", "origin_x=3000 [m] is hardly meant"),
        LOCALIZATION: ("wheel_radius: 27.0", "if it is in mm, write 0.027"),
    }.get(node, ("mass: 5000.0", "if it is in g, write 5"))
    assert meant in said(command, node, line)[1]


def test_a_file_with_values_for_all_nodes_has_to_have_one_for_each(tmp_path):
    (file := tmp_path / "nodes.yaml").write_text("/**:\n  ros__parameters:\n    mass: 6.0\n")
    assert read_parameters(file, f"/{CONTROLLER}") == {"mass": 6.0}
    with pytest.raises(ValueError, match=f"has no parameters for /{PLANNER} but mass"):
        read_parameters(file, f"/{PLANNER}")


def test_so_does_a_check_of_a_driver(tmp_path):
    file = tmp_path / "nodes.yaml"
    file.write_text(f"{CONTROLLER}:\n  ros__parameters:\n    maas: 6.0\n")
    said = r"maas is no parameter of uk_torque_controller \(did you mean mass\?\)"
    with (
        pytest.raises(ValueError, match=said),
        as_the_controller(["--ros-args", "--params-file", str(file)]),
    ):
        pass
