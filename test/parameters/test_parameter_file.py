from pathlib import Path

import pytest

from climber_uk.control.constraints import CONSTRAINTS
from climber_uk.mechanics.climber import Climber
from climber_uk.parameters.changed_parameters import write_changed
from climber_uk.parameters.parameter_file import Values, read_argument, read_file, read_sections

NODE = "/second/uk_torque_controller"
CONFIG = Path(__file__).parents[2] / "config"


@pytest.fixture
def file(tmp_path):
    """Path of a file with some text."""

    def write(text):
        path = tmp_path / "parameters.yaml"
        path.write_text(text)
        return path

    return write


def test_our_files_hold_for_a_node_in_any_namespace():
    values = read_file(CONFIG / "climber.yaml", "/uk_torque_controller")
    assert values == read_file(CONFIG / "climber.yaml", NODE)
    assert values["guidance.cross_track_gain"] == 12.0
    assert "initial_y" not in values  # the plant's


@pytest.mark.parametrize(
    "name",
    ["/**", "/**/uk_torque_controller", "/*/uk_torque_controller", NODE, NODE[1:], "/second/*"],
)
def test_a_node_is_named_as_ros_allows_it(file, name):
    path = file(f"{name}:\n  ros__parameters:\n    observer:\n      bandwidth: 50.0\n")
    assert read_file(path, NODE) == {"observer.bandwidth": 50.0}


@pytest.mark.parametrize("name", ["uk_torque_controller", "/*", "/first/*", "/**/plant_simulator"])
def test_another_node_is_not_meant(file, name):
    path = file(f"{name}:\n  ros__parameters:\n    mass: 6.0\n")
    with pytest.raises(ValueError, match=f"parameters.yaml has no parameters for {NODE}"):
        read_file(path, NODE)


def test_namespaces_may_be_nested_and_later_entries_win(file):
    path = file(
        "/**:\n  ros__parameters:\n    mass: 6.0\n    half_track: 0.2\n"
        "second:\n  uk_torque_controller:\n    ros__parameters:\n      mass: 7.0\n"
    )
    assert read_file(path, NODE) == {"mass": 7.0, "half_track": 0.2}


@pytest.mark.parametrize(
    "text",
    [
        *("a: [", "\x00", "5", "", "mass: 5.0", "[[[", "[" * 100_000, "{" * 100_000),
        "x:\n  ros__parameters: {mass: }",
        "x:\n  ros__parameters: {mass: &m 5.0, half_track: *m}",
        "x:\n  ros__parameters: " + "{a: " * 101 + "1" + "}" * 101,
        "x:\n  ros__parameters: {mass: [[1.0]]}",
        "x:\n  ros__parameters: {? [mass] : 5.0}",
        "x:\n  ros__parameters: {mass: [5, 5.0]}",
        "x:\n  ros__parameters:\n    mass:5.0",
        "x:\n  ros__parameters:\n    mass：5.0",
        "ros__parameters:\n  mass: 5.0",
        "x:\n  ros__parameters:\n" + "".join(f"    p{i}: 1\n" for i in range(10_001)),
    ],
)
def test_what_is_no_parameter_file_is_said_in_one_line(file, text):
    with pytest.raises(ValueError, match=r"parameters\.yaml") as error:
        read_file(file(text), NODE)
    assert len(str(error.value).splitlines()) == 1


def test_one_underscore_is_said_to_be_one_too_few(file):
    with pytest.raises(ValueError, match=r"is not in ros__parameters \(with two underscores\)$"):
        read_file(file("x:\n  ros_parameters:\n    mass: 5.0\n"), NODE)


def test_a_tab_in_a_parameter_file_is_said_in_plain_words(file):
    text = "x:\n  ros__parameters:\n    mass: 5.0\n\thalf_track: 0.3\n"
    with pytest.raises(ValueError, match="line 4, column 1: a tab, where YAML takes blanks only"):
        read_file(file(text), NODE)


@pytest.mark.parametrize(
    "text",
    [
        "/**/a:\n  ros__parameters:\n    mass: 6.0\n    mass: 7.0\n",
        "/**/a:\n  ros__parameters:\n    mass: 6.0\n/**/a:\n  ros__parameters:\n    mass: 7.0\n",
        "/**/a:\n  ros__parameters:\n    b.c: 1.0\n    b:\n      c: 2.0\n",
    ],
)
def test_what_a_file_has_twice_is_refused_by_name(file, text):
    with pytest.raises(ValueError, match=r"has (mass|b\.c) of /\*\*/a twice$"):
        read_file(file(text), "/a")


@pytest.mark.parametrize(
    "start",
    ["%YAML 1.2\n---\n/**/a:", "/**/a_*:", "a-b:", "/:", "//a:", "a/:", "2a:", "/b:\n  /a:"],
)
def test_what_rcl_cannot_read_is_refused_as_the_node_would(file, start):
    path = file(start + "\n    ros__parameters:\n        mass: 6.0\n")
    with pytest.raises(ValueError, match=r"cannot be a node's name|rcl reads YAML 1\.1"):
        read_sections(path)


def test_two_sections_of_one_node_are_one(file):
    section = "/**/a:\n  ros__parameters:\n    {}: 6.0\n"
    path = file(section.format("mass") + section.format("half_track"))
    assert read_file(path, "/a") == {"mass": 6.0, "half_track": 6.0}


def test_a_changed_file_has_the_same_values(file, tmp_path):
    values = {"text": "5e0", "yes": "n", "octal": "010", "number": 1e-5, "on": True, "plain": "a"}
    write_changed(
        file("x:\n  ros__parameters: {a: '8e3', b: [y, n]}"), {"node": values}, tmp_path / "b"
    )
    assert read_file(tmp_path / "b", "/node") == values
    assert read_file(tmp_path / "b", "/x") == {"a": "8e3", "b": [True, False]}


def test_values_fill_dataclasses_and_are_checked_by_name():
    values = Values({"mass": 6.0, "guidance.cross_track_gain": -1.0})
    assert values.read(Climber) == Climber(mass=6.0)
    with pytest.raises(ValueError, match=r"^guidance.cross_track_gain=-1.0 must be >= 0"):
        values.read(CONSTRAINTS["guidance"], "guidance.")


def test_arguments_are_read_as_yaml():
    said = ("mass:=6e0", "predict:=n", "constraints:=exact", "mass:=!!int x", "mass:=" + "[" * 5000)
    read = [read_argument(argument) for argument in said]
    assert read[:3] == [("mass", 6.0), ("predict", False), ("constraints", "exact")]
    assert read[3:] == [("mass", "!!int x"), ("mass", "[" * 5000)]


@pytest.mark.parametrize(
    ("given", "found"), [("lanes.csv", "{0}/lanes.csv"), ("../a/b", "{0}/../a/b"), ("/c", "/c")]
)
def test_a_file_named_in_a_parameter_file_is_relative_to_that(file, given, found):
    path = file(f"/**:\n  ros__parameters:\n    waypoints: {{file: {given}}}\n")
    values = read_file(path, "/trajectory_publisher")
    assert values == {"waypoints.file": found.format(path.parent)}
