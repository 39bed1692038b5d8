"""What the documents say to give to ros2, pip, rosdep and colcon names what there is.

None of these is run: ros2, rosdep and an index of packages belong to an installation. That a topic,
service or parameter is there, and that a message is one of its type, is looked up.
"""

import importlib
import re
import shlex
from importlib.metadata import metadata
from pathlib import Path

import pytest
import yaml
from test_documented_commands import NODES, OURS, PAGES, PARTS
from test_interfaces import ROWS

ROOT = Path(__file__).parents[1]
PROGRAMS = {"ros2", "pip", "rosdep", "colcon"}
# of others, as their documentation has them; not tried
OTHERS = {
    "run": {
        *(("teleop_twist_keyboard", "teleop_twist_keyboard"), ("plotjuggler", "plotjuggler")),
        *(("joy", "joy_node"), ("teleop_twist_joy", "teleop_node"), ("twist_mux", "twist_mux")),
        *(("nav2_map_server", "map_server"), ("nav2_planner", "planner_server")),
        *(("nav2_bt_navigator", "bt_navigator"), ("nav2_lifecycle_manager", "lifecycle_manager")),
        ("robot_localization", "ekf_node"),
    },
    "launch": {
        ("foxglove_bridge", "foxglove_bridge_launch.xml"),
        ("nav2_bringup", "navigation_launch.py"),
    },
}
# of ROS itself and pip: verbs with the options that are used here
VERBS = {
    "ros2 bag record": {"--all", "--storage", "--qos-profile-overrides-path"},
    "ros2 bag play": {"--clock"},
    "ros2 security create_enclave": set(),
    "ros2 security create_permission": set(),
    "pip download": {"--requirement", "--dest"},
    "pip hash": set(),
    "rosdep install": {"--from-paths", "--ignore-src"},
    "rosdep check": {"--from-paths", "--ignore-src"},
    "colcon build": set(),
}


def lines_of(text):
    """Commands of a page or of a file's comments, one a line, however they are broken."""
    for kind, block, word in PARTS.findall(text):
        if kind:
            continue
        if word:
            yield word
        whole = re.sub(r"\\\n *", " ", block)
        for part in re.split(r"\n(?=[^']*(?:'[^']*'[^']*)*$)", whole):  # not within quotes
            yield from re.sub(r" +#.*", "", part).split(" && ")


def in_comments(file):
    """Comments of a parameter file as a block of a page."""
    commented = re.findall(r"^#  +(.*)$", file.read_text(), re.MULTILINE)
    return "```\n{}\n```".format("\n".join(commented))


SOURCES = [(page.name, page.read_text()) for page in PAGES]
SOURCES += [(file.name, in_comments(file)) for file in sorted((ROOT / "config").glob("*.yaml"))]
GIVEN = {
    " ".join(line.split()): name
    for name, text in SOURCES
    for line in lines_of(text)
    if line.split()[:1] and line.split()[0] in PROGRAMS and len(line.split()) > 2
}


def filled(kind, values):
    """Message of a type, with the values of a mapping; `AttributeError` or so if it is none."""
    package, how, name = kind.split("/")
    found = getattr(importlib.import_module(f"{package}.{how}"), name)
    message = found.Request() if how == "srv" else found()
    for field, value in values.items():
        declared = message.get_fields_and_field_types()[field]
        inner = re.sub(r"sequence<|[>\[].*", "", declared).replace("/", "/msg/")
        if isinstance(value, dict):
            value = filled(inner, value)
        elif isinstance(value, list):
            value = [filled(inner, each) if isinstance(each, dict) else each for each in value]
        setattr(message, field, value)
    return message


def node_and_short(name):
    """Node whose own a name is, or None, and the name as the reference has it."""
    own = re.match(rf"/({'|'.join(NODES)})/", name)
    return (own[1], name.replace(own[0], "~/")) if own else (None, name.lstrip("/"))


def check_topic_or_service(words):
    """Assert that a topic or service of ours is there, of this type, and takes these values."""
    rest, options = words[3:], {"--once", "-r"}
    if not rest:
        return  # the tool is spoken of
    while rest[0].startswith("-"):
        assert rest[0] in options
        rest = rest[2:] if rest[0] == "-r" else rest[1:]
    node, short = node_and_short(rest[0])
    found = [row[3] for row in ROWS if row[2] == short and node in (None, row[0])]
    assert found, rest[0]
    if len(rest) > 1:
        package, _, name = rest[1].split("/")
        assert f"{package}/{name}" in found
    if len(rest) > 2:
        filled(rest[1], yaml.safe_load(rest[2]))


def check_parameter(words):
    """Assert that a node has a parameter."""
    _, _, verb, node, name, *_ = words
    assert verb in ("set", "get", "describe")
    section = (ROOT / "docs" / "parameters.md").read_text().split(f"\n## {node.lstrip('/')}\n")[1]
    assert f"\n| `{name}` |" in section.split("\n## ")[0]


def check_run_or_launch(words):
    """Assert that a program of ours is there; another's has to be listed here."""
    _, verb, package, name, *_ = words
    if package != "climber_uk":
        assert (package, name) in OTHERS[verb]
    elif verb == "run":
        assert name in {*OURS, "…"}
    else:
        assert (ROOT / "launch" / name).exists()


def check_install(words):
    """Assert that what is to be installed is ours, or among what is pinned."""
    pinned = (ROOT / "requirements.txt").read_text() + (ROOT / "setup.py").read_text()
    flags = {"--no-deps", "--no-build-isolation", "--editable", "--no-index", "--require-hashes"}
    rest = iter(words[2:])
    for word in rest:
        if word == "--find-links":
            next(rest)
        elif word.startswith("climber_uk["):
            extra = word.removeprefix("climber_uk[").rstrip("]")
            assert extra in metadata("climber_uk").get_all("Provides-Extra")
        elif "/" in word:
            assert (ROOT / word).is_dir()
        else:
            assert word in flags or re.search(rf"\b{word}\b", pinned), word


@pytest.mark.parametrize("line", GIVEN)
def test_it_names_what_there_is(line):
    words = shlex.split(line)
    program, verb, *rest = words
    if program == "ros2" and verb in ("run", "launch"):
        check_run_or_launch(words)
    elif program == "ros2" and verb in ("topic", "service"):
        check_topic_or_service(words)
    elif (program, verb) == ("ros2", "param"):
        if rest[1:]:
            check_parameter(words)
    elif (program, verb) == ("pip", "install"):
        check_install(words)
    else:
        (known,) = [v for v in VERBS if line.startswith(v)]
        assert set(re.findall(r"--[a-z-]+", re.sub(r"\$\(.*?\)", "", line))) <= VERBS[known]


def test_lines_are_read():
    assert len(GIVEN) > 30
    assert any("/path nav_msgs/msg/Path" in line and line.endswith("}'") for line in GIVEN)
    assert any(line.startswith("ros2 run nav2_planner") for line in GIVEN)
