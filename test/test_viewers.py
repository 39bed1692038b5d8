"""Whatever the viewers' configurations name exists: a renamed topic or field breaks them here."""

import importlib
import json
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
import yaml

pytest.importorskip("rclpy")
from climber_uk.ros.running import Names

ROOT = Path(__file__).parents[1]
CONFIG = ROOT / "config"
# as docs/interfaces.md has them; what ROS itself brings
BROUGHT = {"/robot_description": "std_msgs/String", "/rosout": "rcl_interfaces/Log"}
NUMBERS = {"double", "float", "sequence<double>"}
# of RViz's displays with a topic, the message's type
DISPLAYS = {
    "Path": "nav_msgs/Path",
    "MarkerArray": "visualization_msgs/MarkerArray",
    "RobotModel": "std_msgs/String",
    "Odometry": "nav_msgs/Odometry",
}


def published():
    """Type and QoS of every topic by its full name."""
    found = {name: (kind, "latched") for name, kind in BROUGHT.items()}
    node = ""
    for line in (ROOT / "docs" / "interfaces.md").read_text().splitlines():
        if line.startswith("## "):
            node = line.removeprefix("## ")
        elif line.startswith("| publishes |"):
            name, kind, quality = (cell.strip(" `") for cell in line.split("|")[2:5])
            found["/" + name.lstrip("/").replace("~", node)] = kind, quality
    return found


TOPICS = published()


def field_type(topic, path):
    """Type of a field of a topic's messages; `KeyError` if there is none."""
    kind = TOPICS[topic][0]
    for part in path:
        package, name = kind.split("/")
        message = getattr(importlib.import_module(f"{package}.msg"), name)
        kind = message.get_fields_and_field_types()[part]
    return kind


def test_the_topics_are_known_and_a_wrong_field_is_found():
    assert {"/odom", "/markers", "/diagnostics", "/uk_torque_controller/margins"} < set(TOPICS)
    assert field_type("/odom", ["pose", "pose", "position", "x"]) == "double"
    with pytest.raises(KeyError):
        field_type("/odom", ["pose", "position"])


def test_rviz_shows_topics_of_ours_of_the_right_type_and_durability():
    manager = yaml.safe_load((CONFIG / "climber.rviz").read_text())["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == Names().odom_frame
    assert manager["Views"]["Current"]["Class"] == "rviz_default_plugins/TopDownOrtho"
    shown = {}
    for display in manager["Displays"]:
        topic = display.get("Topic") or display.get("Description Topic")
        if topic:
            shown[display["Class"].removeprefix("rviz_default_plugins/")] = topic
    assert set(shown) == set(DISPLAYS)
    for display, topic in shown.items():
        kind, quality = TOPICS["/" + topic["Value"]]  # relative: namespaces make more climbers
        assert kind == DISPLAYS[display]
        assert (topic["Durability Policy"] == "Transient Local") == ("latched" in quality)


def panels(node):
    """Names of the panels of a layout."""
    return [node] if isinstance(node, str) else panels(node["first"]) + panels(node["second"])


def test_foxglove_plots_fields_that_exist():
    layout = json.loads((CONFIG / "foxglove_layout.json").read_text())
    configurations = layout["configById"]
    assert sorted(panels(layout["layout"])) == sorted(configurations)
    kinds = {name.split("!")[0] for name in configurations}
    assert kinds == {"3D", "Plot", "DiagnosticSummary", "RosOut"}
    wall = configurations["3D!wall"]
    assert wall["followTf"] == Names().odom_frame
    named = [configurations[name]["topicToRender"] for name in panels(layout["layout"])[1:3]]
    assert {*named, *wall["topics"]} <= set(TOPICS)
    for name, configuration in configurations.items():
        for path in configuration.get("paths", []):
            value = path["value"]
            if not value.isdecimal():  # a number is a horizontal line
                topic, *fields = re.sub(r"\[\d+\]", "", value).split(".")
                assert field_type(topic, fields) in NUMBERS, (name, value)


def check_series(series):
    """Assert that PlotJuggler makes a series of this name; return its topic."""
    topic = next(name for name in TOPICS if series.startswith(name + "/"))
    fields = series.removeprefix(topic + "/").split("/")
    if TOPICS[topic][0] == "sensor_msgs/JointState":  # it sorts them by joint
        assert fields.pop(0) in (Names().left_wheel_joint, Names().right_wheel_joint)
    assert field_type(topic, fields) in NUMBERS
    return topic


def test_plotjuggler_draws_series_that_it_makes_of_topics_that_it_subscribes():
    root = ElementTree.parse(CONFIG / "plotjuggler_layout.xml").getroot()
    series = set()
    for curve in root.iter("curve"):
        series |= {curve.get(name) for name in ("curve_x", "curve_y")} - {None} or {
            curve.get("name")
        }
    subscribed = root.find("Plugins/plugin/selected_topics").get("value").split(";")
    assert {check_series(name) for name in series} == set(subscribed)
    assert len(series) == 14
