"""The files for other packages name what is there on our side: topics, frames, parameters."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml

from climber_uk.messages.names import Names
from climber_uk.messages.topics import FOLLOW_PATH, LOCALIZATION, PLANNER

ROOT = Path(__file__).parents[1]
CONFIG = ROOT / "config"
PAGE = (ROOT / "docs" / "with-other-packages.md").read_text()
FILES = sorted({*re.findall(r"`config/(\w+\.yaml)`", PAGE)})
INTERFACES = (ROOT / "docs" / "interfaces.md").read_text()
FRAMES = {Names().odom_frame, Names().base_frame, "map"}
# what others give to robot_localization, as the file says
THEIRS = {"wheels", "global_pose"}


def parameters(file):
    """Parameters of each node of a file."""
    sections = yaml.safe_load((CONFIG / file).read_text())
    return {
        name.rpartition("/")[2]: section.get("ros__parameters", {})
        for name, section in sections.items()
    }


def flat(values, prefix=""):
    for name, value in values.items():
        if isinstance(value, dict):
            yield from flat(value, f"{prefix}{name}.")
        else:
            yield prefix + name, value


@pytest.mark.parametrize("file", FILES)
def test_a_file_for_others_gives_our_nodes_only_what_they_have(file):
    text = (ROOT / "docs" / "parameters.md").read_text()
    for node, values in parameters(file).items():
        section = re.search(rf"^## {node}\n(.*?)(^## |\Z)", text, re.MULTILINE | re.DOTALL)
        if section is not None:
            known = set(re.findall(r"^\| `([\w.]+)` \|", section[1], re.MULTILINE))
            assert {name for name, _ in flat(values)} <= known


def test_our_nodes_are_in_the_files():
    found = {node for file in FILES for node in parameters(file)}
    assert {PLANNER, LOCALIZATION} <= found


@pytest.mark.parametrize("file", FILES)
def test_frames_are_those_of_the_wall_and_the_climber(file):
    for values in parameters(file).values():
        found = {value for name, value in flat(values) if re.search(r"\w_frame$|frame_id", name)}
        assert found <= FRAMES


def test_each_input_of_robot_localization_is_ours_or_said_to_be_theirs():
    for node, values in parameters("robot_localization.yaml").items():
        inputs = {name: topic for name, topic in values.items() if re.fullmatch(r"[a-z]+\d", name)}
        assert inputs or node == LOCALIZATION
        for name, topic in inputs.items():
            assert f"`{topic}`" in INTERFACES or topic in THEIRS
            assert [type(taken) for taken in values[f"{name}_config"]] == [bool] * 15
            assert not any(values[f"{name}_config"][12:])  # accelerations: gravity lies in the wall


def test_nav2s_tree_sends_paths_to_our_action():
    tree = ElementTree.parse(CONFIG / "nav2_follow_path.xml")
    (sent,) = tree.iter("FollowPath")
    assert sent.get("server_name") == FOLLOW_PATH
    assert f"`{FOLLOW_PATH}`" in INTERFACES
    given = parameters("nav2.yaml")["bt_navigator"]["default_nav_to_pose_bt_xml"]
    assert (ROOT / given).exists()
