"""Whatever the viewers' configurations name exists: a renamed topic or field breaks them here."""

import importlib
import json
import re
import subprocess
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


# what a button can have: types.ts of Lichtblick's and Foxglove Studio's CallService and Publish
OF_BUTTON = {"foxglovePanelTitle", "buttonText", "buttonTooltip", "buttonColor"}
OF_SERVICE = OF_BUTTON | {"serviceName", "requestPayload", "layout"}
OF_PUBLISHER = OF_BUTTON | {"topicName", "datatype", "value", "advancedView"}


def interfaces(how):
    """Type and QoS by full name, of all that nodes publish, subscribe or serve."""
    found = {}
    node = ""
    for line in (ROOT / "docs" / "interfaces.md").read_text().splitlines():
        if line.startswith("## "):
            node = line.removeprefix("## ")
        elif line.startswith(f"| {how} |"):
            name, kind, quality = (cell.strip(" `") for cell in line.split("|")[2:5])
            found["/" + name.lstrip("/").replace("~", node)] = kind, quality
    return found


TOPICS = {name: (kind, "latched") for name, kind in BROUGHT.items()} | interfaces("publishes")


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


LAYOUT = json.loads((CONFIG / "foxglove_layout.json").read_text())
CONFIGURATIONS = LAYOUT["configById"]


def panels(node):
    """Names of the panels of a layout, those in tabs included."""
    if not isinstance(node, str):
        return panels(node["first"]) + panels(node["second"])
    tabs = CONFIGURATIONS[node].get("tabs", [])
    return [node] + [name for tab in tabs for name in panels(tab["layout"])]


def test_foxglove_shows_each_panel_once_and_topics_that_exist():
    assert sorted(panels(LAYOUT["layout"])) == sorted(CONFIGURATIONS)
    kinds = {name.split("!")[0] for name in CONFIGURATIONS}
    shown = {"3D", "Plot", "DiagnosticSummary", "RosOut", "Parameters", "Tab"}
    assert kinds == {*shown, "CallService", "Publish"}
    wall = CONFIGURATIONS["3D!wall"]
    assert wall["followTf"] == Names().odom_frame
    named = [it["topicToRender"] for it in CONFIGURATIONS.values() if "topicToRender" in it]
    assert len(named) == 2
    assert {*named, *wall["topics"]} <= set(TOPICS)


def test_foxglove_plots_fields_that_exist():
    for name, configuration in CONFIGURATIONS.items():
        for path in configuration.get("paths", []):
            value = path["value"]
            if not value.isdecimal():  # a number is a horizontal line
                topic, *fields = re.sub(r"\[\d+\]", "", value).split(".")
                assert field_type(topic, fields) in NUMBERS, (name, value)


def check_payload(kind, content):
    """Assert that JSON is a message's of this class: its fields, of their types."""
    given = json.loads(content)
    types = kind.get_fields_and_field_types()
    assert set(given) == set(types)  # none is left to a default that nobody sees
    for field, value in given.items():
        assert isinstance(value, {"boolean": bool, "double": float}[types[field]]), (field, value)


def test_foxglove_has_buttons_for_services_and_a_topic_that_exist():
    services = interfaces("serves")
    buttons = [it for name, it in CONFIGURATIONS.items() if name.startswith("CallService!")]
    assert [button["buttonText"] for button in buttons] == [
        *("Start", "Pause", "Go on", "Disable", "Enable")
    ]
    for button in buttons:
        assert set(button) <= OF_SERVICE
        package, name = services[button["serviceName"]][0].split("/")
        kind = getattr(importlib.import_module(f"{package}.srv"), name)
        check_payload(kind.Request, button["requestPayload"])
    speed = CONFIGURATIONS["Publish!speed"]
    assert set(speed) <= OF_PUBLISHER
    assert interfaces("subscribes")[speed["topicName"]][0] == speed["datatype"]
    package, name = speed["datatype"].split("/")
    kind = getattr(importlib.import_module(f"{package}.msg"), name)
    check_payload(kind, speed["value"])


def test_a_second_climber_s_layout_is_made_as_the_page_says():
    page = (ROOT / "docs" / "viewing.md").read_text()
    command = re.search(r"^(sed -E .*\\\n.*foxglove_layout.json) >", page, re.MULTILINE)[1]
    made = subprocess.run(
        ["sh", "-c", command], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    names = re.findall(r'"(/[a-z]\w+[\w/]*)', (CONFIG / "foxglove_layout.json").read_text())
    shared = {"/diagnostics", "/rosout"}
    expected = [name if name in shared else f"/climber_1{name}" for name in names]
    assert re.findall(r'"(/[a-z]\w+[\w/]*)', made) == expected
    assert json.loads(made)["configById"]["3D!wall"]["followTf"] == "climber_1/odom"


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
