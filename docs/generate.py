"""Write what is said in one place only: `python docs/generate.py [DIRECTORY]`.

parameters.md, interfaces.md and security_policy.xml come from the nodes, metrics.md from the
metrics of bags.
"""

import dataclasses
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from climber_uk.driver_check.node import DriverNode
from climber_uk.messages import topics
from climber_uk.nodes.markers import Markers
from climber_uk.nodes.plant_simulator import PlantSimulator
from climber_uk.nodes.trajectory_publisher import TrajectoryPublisher
from climber_uk.nodes.uk_torque_controller import UkTorqueController
from climber_uk.nodes.wall_odometry import WallOdometry
from climber_uk.parameters.declaration import bounds
from climber_uk.report.metrics import GROUPS
from climber_uk.ros.running import ClimberNode

NODES: list[Callable[[], ClimberNode]] = [
    TrajectoryPublisher,
    UkTorqueController,
    PlantSimulator,
    WallOdometry,
    Markers,
    DriverNode,
]
ALL_ON = [  # what a node publishes and subscribes only if it is asked to
    "trajectory_publisher:by_hand.input:=twist_stamped",
    "trajectory_publisher:by_hand.lock:=true",
    "uk_torque_controller:publish_cmd_vel:=true",
    "uk_torque_controller:effort_commands:=true",
    "uk_torque_controller:stops.emergency_stop:=true",
    "uk_torque_controller:stops.least_charge:=0.2",
    "uk_torque_controller:guard.encoder_distance:=0.2",
    "uk_torque_controller:least_suction.enabled:=true",
    "plant_simulator:simulated_time:=true",
    "plant_simulator:setpoint_timeout:=0.5",
    "plant_simulator:imu.enabled:=true",
    "plant_simulator:fixes.period:=0.1",
]
RELIABLE, SENT_RELIABLE = "reliable, last 10", "reliable, last 1000"
UNSEEN = {  # by node: what it does not list, or has only at times, or where a package is installed
    "trajectory_publisher": [("subscribes", topics.STICK, "geometry_msgs/Twist", RELIABLE)],
    "uk_torque_controller": [
        ("publishes", "~/transition_event", "lifecycle_msgs/TransitionEvent", RELIABLE)
    ],
    "plant_simulator": [("publishes", "/tf", "tf2_msgs/TFMessage", SENT_RELIABLE)],
    "wall_odometry": [("publishes", "/tf", "tf2_msgs/TFMessage", SENT_RELIABLE)],
    "check_driver": [("publishes", topics.TORQUES, "sensor_msgs/JointState", SENT_RELIABLE)],
}
ACTIONS = {  # that the node has only where a package is installed
    "trajectory_publisher": [(topics.FOLLOW_PATH, "nav2_msgs/FollowPath")],
}
EVERY_NODE = (
    topics.LOG,
    "/parameter_events",
    "_type_description",
    "_parameters",
    "parameter_types",
)

CONTENTS = {
    topics.ODOMETRY: "pose in `odom`, twist in `base_link`: forward, to the left, about z",
    topics.REFERENCE_TIME: "where on the reference the climber is (`time_ref`) at an odometry's "
    "stamp; `source`: the controller's mode",
    topics.REFERENCE: "the next second: per point pose, velocity and acceleration, in `odom`; the "
    "stamp plus `time_from_start` is its time",
    topics.GIVEN_PATH: "2 to 50 000 places, x and y, to drive through, in `odom`; no orientations",
    topics.FOLLOW_PATH: "an action, where nav2_msgs is installed: a path as a goal, with feedback, "
    "cancel and result",
    topics.REFERENCE_PATH: "the whole path, for display",
    topics.TORQUES: "`effort` [N m] and `velocity` [rad/s] by joint name, of which motors "
    "take one; the stamp is that of the odometry it answers",
    "effort_controller/commands": "the torques again, in the order of `effort_order`; with "
    "`effort_commands`",
    topics.STICK: "of the controller: the speeds again, if `publish_cmd_vel`: forward, about z; of "
    "the planner: a stick's, by `by_hand.input`",
    topics.STICK_LOCK: "while true the stick on `cmd_vel` is ignored; with `by_hand.lock`",
    topics.PRESSURE: "pressure difference [Pa]; the plant tells it at 20 Hz",
    topics.SETPOINT: "least pressure difference [Pa] that margins need, for the pump, 20 Hz; with "
    "`least_suction.enabled` of the controller, `setpoint_timeout` of the plant",
    topics.JOINTS: "angle [rad], rate [rad/s] and torque [N m] of the wheels; the controller reads "
    "them with `guard.encoder_distance`",
    topics.IMU: "yaw rate [rad/s] and specific force [m/s²], gravity in it: on a vertical "
    "wall 9.81 upwards; the plant tells it if `imu.enabled`",
    topics.POSE: "x, y [m] and heading of the climber, measured from outside at the stamp, however "
    "late; parts with a variance of 1e4 m², π² rad² or more are not measured; the plant tells it "
    "if `fixes.period` > 0",
    topics.TRUTH: "the simulated climber without its sensors' errors",
    "emergency_stop": "true stops the climber, until false and `~/enable`; with "
    "`stops.emergency_stop`",
    "battery_state": "charge and voltage, too low of which stop it; with `stops.least_charge` or "
    "`stops.least_voltage`",
    topics.PUSH: "force [N] and moment [N m] on the simulated climber, in `odom` or `base_link`",
    "markers": "climber, reference, way, torques and force for RViz and Foxglove, in `odom`; 20 Hz",
    topics.FORCE: "what the controller publishes",
    topics.MARGINS[1]: "what the controller publishes",
    topics.CLOCK: "simulated time, if `simulated_time`; 100 Hz of it, or each control period if "
    "longer",
    "/tf": "of the plant: the true pose, `base_link` in `odom`; of wall_odometry: `odom` in "
    "`map_frame`; where tf2_msgs is installed, with `publish_tf`",
    topics.DIAGNOSTICS: "every second and when something changes: troubles and values",
    "~/tracking_error": "along-track [m], cross-track [m], heading [rad]",
    topics.private(
        topics.FORCE
    ): "Udwadia-Kalaba: drive [N], lateral [N], about z [N m], in `base_link`",
    "~/disturbance": "force [N], moment [N m] that the model did not expect, in `base_link`; 20 Hz",
    topics.private(
        topics.MARGINS[1]
    ): "lowest slip, tip margin (below 1 it slips, or tips over), load on the wheels [N]; 20 Hz",
    topics.private(
        topics.PARAMETERS
    ): "all parameters as they are, at the start and whenever one changes",
    "~/map_to_odom": "pose of `odom` in `map_frame`, in which corrections act at once; 20 Hz",
    "~/transition_event": "changes of the managed node's state",
    "~/start": "start, or start again, at the next odometry",
    "~/stop": "come to rest on the path, as `~/pause`",
    "~/retreat": "go back along the path, heading kept",
    "~/speed": "share of the planned speed, 0.01 to 1: as the parameter `speed`",
    topics.private(
        topics.PROGRESS
    ): "one status; `message`: waiting, approaching, following, paused "
    "or done; values: done, left [m], time_left [s], lap, segment, mode; 10 Hz, if anybody listens",
    topics.private(
        topics.EVENTS
    ): "one status for each tag of the path, when the climber reaches it: "
    "`message`: the tag; values: x, y [m] of its place; the stamp is that of when it did",
    "~/enable": "become active or inactive",
    "~/change_state": "managed node: configure, activate, deactivate, clean up, shut down",
    "~/get_state": "managed node",
    "~/get_available_states": "managed node",
    "~/get_available_transitions": "managed node",
    "~/get_transition_graph": "managed node",
    "~/reset": "back to the initial state; time goes on",
    "~/pause": "of the plant: stop time, of all climbers that share it, or let it go on; of the "
    "planner: come to rest on the path, or go on along it",
    "~/step": "one control period, while paused",
}

HEAD = "# {}\n\n<!-- made by docs/generate.py -->\n"


def parameters(nodes: list[ClimberNode]) -> str:
    """Reference of all parameters."""
    lines = [
        HEAD.format("Parameters"),
        "The same name means the same in every node. Those of a part have its name before them, as "
        "in `guidance.cross_track_gain`. *Runtime* ones can be changed while the node runs; the "
        "others only at its start. Every topic's QoS is a parameter besides: "
        "`qos_overrides.<topic>.publisher.reliability`, ….",
        "\nIn a parameter file, what `/**` is given (or `/a/*`: any name) is for all nodes that "
        "have it, and remarked on by the others; what is given to `/**/x`, or to x in any other "
        "way by its name, x has to have: a misspelt parameter ends the node at its start, and so "
        "does a file that has nothing for it.",
    ]
    for node in nodes:
        lines.append(f"\n## {node.get_name()}\n")
        for (prefix, kind), fields in by_class(node):
            lines.append(f"\n{first_sentence(kind)}\n")
            lines.append("| parameter | default | unit | bounds | runtime | meaning |")
            lines.append("|---|---|---|---|---|---|")
            lines += [row(prefix, field) for field in fields]
    return "\n".join(lines) + "\n"


def by_class(node: ClimberNode) -> Iterator[tuple[tuple[str, type], list[Any]]]:
    """Prefix and class of a node's parameters, with its fields, as they were declared."""
    for prefix, kind in dict.fromkeys((p, k) for p, k, _ in node.parameters.declared):
        yield (prefix, kind), list(dataclasses.fields(kind))


def first_sentence(kind: type) -> str:
    """What a class says it is."""
    return (kind.__doc__ or "").split("\n")[0]


def row(prefix: str, field: "dataclasses.Field[Any]") -> str:
    """Line of the table for a field."""
    rule = field.metadata
    values = [
        bound.replace(">=", "≥").replace("<=", "≤").replace("!=", "≠") for bound in bounds(rule)
    ]
    values += [f"`{choice}`" for choice in rule["choices"] or ()]
    default = str(field.default).lower() if isinstance(field.default, bool) else field.default
    cells = (
        f"`{prefix}{field.name}`",
        f"`{default}`" if default != "" else "",
        rule["unit"],
        ", ".join(values),
        "yes" if rule["runtime"] else "",
        rule["description"],
    )
    return f"| {' | '.join(map(str, cells))} |"


def interfaces(nodes: list[ClimberNode]) -> str:
    """Reference of all topics and services."""
    lines = [
        HEAD.format("Topics and services"),
        "Names are relative: in a namespace, all but those with a slash before them are in it. "
        "Units are SI. `odom` is fixed to the wall, x horizontal and y up; `base_link` is the "
        "climber, x forward and y left; in a namespace both have its name before them "
        "(`prefix_frames`).",
    ]
    for node in nodes:
        lines.append(f"\n## {node.get_name()}\n")
        lines.append("| | name | type | QoS | contents |")
        lines.append("|---|---|---|---|---|")
        for word, ends in (("publishes", node.publishers), ("subscribes", node.subscriptions)):
            for end in ends:
                kind = type_name(end.msg_type)
                lines += entry(node, word, end.topic_name, kind, qos(end.qos_profile))
        for word, name, kind, quality in UNSEEN.get(node.get_name(), ()):
            lines.append(f"| {word} | `{name}` | {kind} | {quality} | {CONTENTS[name]} |")
        for service in node.services:
            lines += entry(node, "serves", service.service_name, type_name(service.srv_type), "")
        for name, kind in ACTIONS.get(node.get_name(), ()):
            lines += entry(node, "serves", name, kind, "")
    return "\n".join(lines) + "\n"


def entry(node: ClimberNode, word: str, name: str, kind: str, quality: str) -> list[str]:
    """Line of the table for a topic or service, unless every node has it; `KeyError`: no words."""
    if any(part in name for part in EVERY_NODE):
        return []
    short = name.replace(node.get_fully_qualified_name(), "~") if name.count("/") > 1 else name
    short = short if short in CONTENTS else short.lstrip("/")
    return [f"| {word} | `{short}` | {kind} | {quality} | {CONTENTS[short]} |"]


def topic_names(node: ClimberNode, word: str) -> list[str]:
    """Full names of all topics that a node `publishes`, or `subscribes`."""
    ends = node.publishers if word == "publishes" else node.subscriptions
    unseen = [name for how, name, *_ in UNSEEN.get(node.get_name(), ()) if how == word]
    return [*(end.topic_name for end in ends), *map(node.resolve_topic_name, unseen)]


def check_graph(node: ClimberNode) -> None:
    """Raise `LookupError` if the running graph has of a node what it would not be said to have."""
    whose = node.get_name(), node.get_namespace()
    known = {
        "publishes": topic_names(node, "publishes"),
        "subscribes": topic_names(node, "subscribes"),
        "serves": [service.service_name for service in node.services],
    }
    running = {
        "publishes": node.get_publisher_names_and_types_by_node(*whose),
        "subscribes": node.get_subscriber_names_and_types_by_node(*whose),
        "serves": node.get_service_names_and_types_by_node(*whose),
    }
    for word, found in running.items():
        names = {name for name, _ in found if not any(part in name for part in EVERY_NODE)}
        if not found or (lacking := names - {*known[word]}):
            raise LookupError(f"{whose[0]} {word} {lacking}, of which nothing is said here")


def security_policy(nodes: list[ClimberNode]) -> str:
    """What each of `nodes` has to be allowed, as `ros2 security` takes it: an enclave for each."""
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        "<!-- made by docs/generate.py; in a namespace, change ns and paths -->",
        '<policy version="0.2.0">',
        "  <enclaves>",
    ]
    for node in nodes:
        own = node.get_fully_qualified_name()
        published, subscribed = topic_names(node, "publishes"), topic_names(node, "subscribes")
        named = {
            ("topic", "publish"): [topics.LOG, *published],
            ("topic", "subscribe"): [topics.CLOCK, *subscribed],
            ("service", "reply"): [service.service_name for service in node.services],
        }
        if actions := ACTIONS.get(node.get_name()):
            named["action", "execute"] = [f"/{name}" for name, _ in actions]
        lines.append(f'    <enclave path="{own}">\n      <profiles>')
        lines.append(f'        <profile ns="/" node="{node.get_name()}">')
        for (kind, may), names in named.items():
            lines.append(f'          <{kind}s {may}="ALLOW">')
            lines += [f"            <{kind}>{name}</{kind}>" for name in sorted(set(names))]
            lines.append(f"          </{kind}s>")
        lines.append("        </profile>\n      </profiles>\n    </enclave>")
    return "\n".join([*lines, "  </enclaves>", "</policy>"]) + "\n"


def type_name(kind: type) -> str:
    """Name as messages have it, as in nav_msgs/Odometry."""
    return f"{kind.__module__.split('.')[0]}/{kind.__name__}"


def qos(profile: QoSProfile) -> str:
    """Short words for a profile."""
    kept = f"last {profile.depth}"
    reliable = profile.reliability == ReliabilityPolicy.RELIABLE
    latched = profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return f"{'reliable' if reliable else 'best effort'}, {kept}{', latched' if latched else ''}"


def metrics() -> str:
    """Reference of what `analyze_bag` tells."""
    lines = [
        HEAD.format("Metrics"),
        "What `analyze_bag` and `compare_bags` tell of a run ([analysis.md](analysis.md)), in the "
        "units of CSV, JSON and `--fail-if`; tables put m, µ or n before some of them, and leave "
        "out what is not known. `saturation`, `friction`, and power without `joint_states`, need "
        "the climber's parameters.",
    ]
    for title, group in GROUPS.items():
        lines.append(f"\n## {title}\n\n| metric | unit | definition |\n|---|---|---|")
        lines += [f"| `{metric.name}` | {metric.unit} | {metric.definition} |" for metric in group]
    return "\n".join(lines) + "\n"


def documents() -> dict[str, str]:
    """Texts by file name, of nodes as they are."""
    rclpy.init(args=["--ros-args", *(word for given in ALL_ON for word in ("-p", given))])
    nodes = [make() for make in NODES]
    try:
        for node in nodes:
            check_graph(node)
        return {
            "parameters.md": parameters(nodes),
            "interfaces.md": interfaces(nodes),
            "security_policy.xml": security_policy(nodes),
            "metrics.md": metrics(),
        }
    finally:
        for node in nodes:
            node.destroy_node()
        rclpy.shutdown()


if __name__ == "__main__":
    directory = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for name, text in documents().items():
        (directory / name).write_text(text)
