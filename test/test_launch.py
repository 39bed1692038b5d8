"""The launch file starts what its arguments say, and nothing where they say nothing that can be.

Where launch is not installed, its classes are replaced by ones that keep what they are given.
"""

import importlib.util
import sys
import xml.etree.ElementTree as ElementTree
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest
import yaml

from climber_uk.messages import topics
from climber_uk.simulation.options import SimulationOptions

ROOT = Path(__file__).parents[1]
FILE = ROOT / "launch" / "climber.launch.py"
CONFIG = ROOT / "config" / "climber.yaml"
USED = {
    "ament_index_python.packages": ["PackageNotFoundError", "get_package_prefix"],
    "launch": ["LaunchContext", "LaunchDescription"],
    "launch.actions": [
        *("DeclareLaunchArgument", "ExecuteProcess", "GroupAction", "OpaqueFunction", "Shutdown")
    ],
    "launch.substitutions": ["LaunchConfiguration"],
    "launch_ros.actions": ["Node", "PushRosNamespace"],
    "launch_ros.parameter_descriptions": ["ParameterValue"],
}


class Kept:
    """Stands for any class of launch."""

    def __init__(self, *given, **named):
        self.given, self.named = given, named


class NotFoundError(Exception):
    """Stands for ament's."""


@pytest.fixture
def launch(monkeypatch):
    """The launch file as a module, all packages that it asks for being there."""
    installed = importlib.util.find_spec("launch_ros")
    for name, classes in {} if installed else USED.items():
        module = ModuleType(name)
        for of in classes:
            setattr(module, of, type(of, (Kept,), {}))
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location("climber_launch", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "PackageNotFoundError", NotFoundError)
    monkeypatch.setattr(module, "get_package_prefix", lambda name: str(ROOT))
    return module


def context(launch, *words, above=()):
    """What a launch file sees of a command line; `above`: arguments of one that includes it."""
    given = dict(word.split(":=", 1) for word in [*words, *above])
    return SimpleNamespace(argv=list(words), launch_configurations=given)


def start(launch, *words):
    seen = context(launch, *words)
    launch.refuse_unknown(seen)
    defaults = {name: default for name, (default, _) in launch.ARGUMENTS.items()}
    seen.launch_configurations = {**defaults, **seen.launch_configurations}
    return launch.start(seen)


def nodes(launch, *words):
    """Keywords of every node that is started, by its executable, and whether a recorder is."""
    *recorder, group = start(launch, *words)
    (actions,) = group.given
    found = [action.named for action in actions if "executable" in action.named]
    return {named["executable"]: named for named in found}, bool(recorder)


without_launch = pytest.mark.skipif(
    bool(importlib.util.find_spec("launch_ros")), reason="looks into the stand-ins"
)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["sim:=no"], "sim:=no must be true or false"),
        (["use_sim_time:=yes"], "use_sim_time:=yes must be true or false"),
        (["record:=ture"], "record:=ture must be true or false"),
        (["rviz:=2"], "rviz:=2 must be true or false"),
        (["simulate:=true"], "simulate is not an argument of this file"),
        (["confg:=x.yaml"], "confg is not an argument of this file (did you mean config?)"),
        (["config:=typo.yaml"], "config:=typo.yaml: .*No such file"),
        (["namespace:=7 of nine"], "namespace:=7 of nine must be a name"),
    ],
)
def test_an_argument_that_means_nothing_is_refused_in_words(launch, words, said):
    with pytest.raises(RuntimeError, match=said.replace("(", r"\(").replace("?)", r"\?\)")):
        start(launch, *words)


@pytest.mark.parametrize(
    ("text", "words", "said"),
    [
        ("", [], "has no parameters for /trajectory_publisher, but for no node"),
        (
            "/**/uk_controller:\n  ros__parameters: {mass: 5.0}\n",
            [],
            "but for /\\*\\*/uk_controller",
        ),
        (
            "/a/trajectory_publisher:\n  ros__parameters: {x: 5.0}\n",
            ["namespace:=b"],
            "for /b/traj",
        ),
        ("/**:\n  ros__parameters: {mass: 5.0, mass: 6.0}\n", [], "twice"),
        ("/**:\n  ros__parameters: {mass: [5.0}\n", [], "no parameter file"),
    ],
)
def test_a_file_that_says_nothing_to_the_nodes_is_refused_in_words(
    launch, tmp_path, text, words, said
):
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    with pytest.raises(RuntimeError, match=said):
        start(launch, f"config:={file}", *words)


@pytest.mark.parametrize(
    ("word", "package"), [("rviz:=true", "rviz2"), ("record:=1", "rosbag2_storage_mcap")]
)
def test_what_is_not_installed_is_named(launch, monkeypatch, word, package):
    def find(name):
        if name == package:
            raise NotFoundError

    monkeypatch.setattr(launch, "get_package_prefix", find)
    with pytest.raises(RuntimeError, match=f"needs the package {package}, which is not installed"):
        start(launch, word)


def test_a_file_that_includes_it_may_have_arguments_of_its_own(launch):
    launch.refuse_unknown(context(launch, "robot:=7", above=["sim:=false"]))
    with pytest.raises(RuntimeError, match="robot is not an argument"):
        launch.refuse_unknown(context(launch, "robot:=7", "sim:=false"))


PLANNER, CONTROLLER, PLANT = "trajectory_publisher", "uk_torque_controller", "plant_simulator"
VIEWERS = {"markers", "robot_state_publisher", "rviz2"}


@without_launch
@pytest.mark.parametrize(
    ("words", "started", "recorded"),
    [
        ([], {PLANNER, CONTROLLER, PLANT}, False),
        (["sim:=false"], {PLANNER, CONTROLLER}, False),
        (["sim:=FALSE", "record:=True"], {PLANNER, CONTROLLER}, True),
        (["rviz:=1", "namespace:=/north"], {PLANNER, CONTROLLER, PLANT, *VIEWERS}, False),
    ],
)
def test_what_the_arguments_say_is_started_and_ends_together(launch, words, started, recorded):
    found, is_recorded = nodes(launch, *words)
    assert (set(found), is_recorded) == (started, recorded)
    required = {name for name, named in found.items() if "on_exit" in named}
    assert required == started & {PLANNER, CONTROLLER, PLANT}


@without_launch
@pytest.mark.parametrize(("word", "under"), [("", "/"), ("namespace:=/wall/north", "/wall/north/")])
def test_a_recorder_lets_messages_of_the_loop_wait(launch, word, under):
    recorder, _ = start(launch, "record:=true", *[word] * bool(word))
    command = recorder.named["cmd"]
    file = Path(command[command.index("--qos-profile-overrides-path") + 1])
    overrides = yaml.safe_load(file.read_text())
    loop = {topics.ODOMETRY, topics.TORQUES, topics.REFERENCE, topics.JOINTS, topics.FORCE}
    assert {f"{under}{name}" for name in loop} | {"/clock"} <= overrides.keys()
    assert all(how["depth"] == 5000 for how in overrides.values())


@without_launch
def test_a_recorder_of_a_driver_finds_out_itself_what_the_driver_offers(launch):
    """It would get nothing of a topic that is published as best effort."""
    recorder, _ = start(launch, "record:=true", "sim:=false")
    assert recorder.named["cmd"] == ["ros2", "bag", "record", "--all", "--storage", "mcap"]


@without_launch
def test_a_simulation_that_is_recorded_waits_for_the_recorder(launch):
    found, _ = nodes(launch, "record:=true", "use_sim_time:=1")
    (config, given) = found[PLANT]["parameters"]
    assert config == str(CONFIG)
    assert given == {"simulated_time": True, "wait_for": "rosbag2_recorder"}
    assert given.keys() <= SimulationOptions.__dataclass_fields__.keys()
    assert found[CONTROLLER]["parameters"][1] == {"use_sim_time": True}
    found, _ = nodes(launch)
    assert found[PLANT]["parameters"][1] == {"simulated_time": False}


@without_launch
def test_a_config_may_be_in_the_home_directory(launch, monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "mine.yaml").write_text(CONFIG.read_text())
    found, _ = nodes(launch, "config:=~/mine.yaml")
    assert found[topics.PLANT]["parameters"][0] == str(tmp_path / "mine.yaml")


@without_launch
def test_every_node_is_an_executable_and_every_package_is_depended_on(launch):
    found, _ = nodes(launch, "rviz:=true")
    ours = {script.name for script in entry_points(group="console_scripts")}
    assert {name for name, how in found.items() if how["package"] == "climber_uk"} <= ours
    tree = ElementTree.parse(ROOT / "package.xml")
    depended = {depend.text for depend in tree.iter("exec_depend")}
    packages = {how["package"] for how in found.values()} | set(launch.NEEDED["record"])
    assert packages - {"climber_uk"} <= depended


def test_every_file_of_the_package_is_there_and_installed(launch):
    set_up = (ROOT / "setup.py").read_text()
    for file in ("config/climber.yaml", "config/climber.rviz", "urdf/climber.urdf"):
        assert (ROOT / file).is_file()
        assert Path(file).name in FILE.read_text()
        assert f'"share/{{package_name}}/{Path(file).parent}"' in set_up
