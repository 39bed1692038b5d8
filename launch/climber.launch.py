"""The nodes of one climber: `ros2 launch climber_uk climber.launch.py config:=FILE`.

With `sim:=false` the simulator stays away, and your driver takes its place. `ros2 launch -s` tells
all arguments. They and the file are looked at before anything starts; when planner, controller or
simulator ends, all do.
"""

import os
import re
import shutil
import tempfile
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    GroupAction,
    OpaqueFunction,
    Shutdown,
)
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node, PushRosNamespace
from launch_ros.parameter_descriptions import ParameterValue

from climber_uk.parameters.parameter_file import read_file, similar

SHARE = Path(__file__).parents[1]  # of the package
ARGUMENTS = {
    "sim": ("true", "start the simulator; false: your driver is there"),
    "config": (str(SHARE / "config" / "climber.yaml"), "parameters of all nodes"),
    "namespace": ("", "of the climber"),
    "record": ("false", "record all topics with rosbag2, as MCAP"),
    "use_sim_time": ("false", "take time from /clock; the simulator, if any, then is in lock-step"),
    "rviz": ("false", "show it in RViz"),
}
SWITCHES = ("sim", "record", "use_sim_time", "rviz")
TRUE, FALSE = ("true", "1"), ("false", "0")
NEEDED = {"record": ("ros2bag", "rosbag2_storage_mcap"), "rviz": ("rviz2", "robot_state_publisher")}
OF_LAUNCH = {"launch-prefix", "launch-prefix-filter"}  # arguments that launch itself has
RECORDER = "rosbag2_recorder"  # as it calls its node


def refuse_unknown(context: LaunchContext) -> None:
    """Raise `RuntimeError` for arguments that are misspelt; those of a file that includes us go."""
    given = context.launch_configurations.keys()
    from_command_line = {word.partition(":=")[0] for word in context.argv}
    for name in given - ARGUMENTS.keys() - OF_LAUNCH:
        if given == from_command_line:
            raise RuntimeError(f"{name} is not an argument of this file{similar(name, ARGUMENTS)}")


def start(context: LaunchContext) -> list[GroupAction | ExecuteProcess]:
    """Start what the arguments say; `RuntimeError` in words if they say nothing that can be."""
    given = {name: context.launch_configurations[name] for name in ARGUMENTS}
    on = {name: is_on(name, given[name]) for name in SWITCHES}
    namespace = given["namespace"].strip("/")
    config = os.path.expanduser(given["config"])  # no shell does that behind :=
    if namespace and not re.fullmatch(r"[A-Za-z_]\w*(/[A-Za-z_]\w*)*", namespace):
        raise RuntimeError(f"namespace:={namespace} must be a name: letters, digits, _ and /")
    for name, packages in NEEDED.items():
        for package in packages if on[name] else ():
            find(package, f"{name}:=true")
    nodes = ["trajectory_publisher", "uk_torque_controller", *["plant_simulator"] * on["sim"]]
    for node in nodes:
        try:
            read_file(Path(config), f"/{namespace}/{node}".replace("//", "/"))
        except (ValueError, OSError) as error:
            raise RuntimeError(f"config:={config}: {error}") from None
    return described(nodes, on, namespace, config)


def is_on(name: str, value: str) -> bool:
    """Whether a switch is on."""
    if value.lower() not in (*TRUE, *FALSE):
        raise RuntimeError(f"{name}:={value} must be true or false")
    return value.lower() in TRUE


def find(package: str, why: str) -> None:
    """Raise `RuntimeError` if a package is not installed."""
    try:
        get_package_prefix(package)
    except PackageNotFoundError:
        raise RuntimeError(f"{why} needs the package {package}, which is not installed") from None


def described(
    nodes: list[str], on: dict[str, bool], namespace: str, config: str
) -> list[GroupAction | ExecuteProcess]:
    """What is started; a recorder first, which a simulated climber waits for."""
    # launch may be killed: then they get SIGTERM
    bound = "setpriv --pdeathsig TERM " if shutil.which("setpriv") else ""
    prefix = [bound, LaunchConfiguration("launch-prefix", default="")]
    time = {"use_sim_time": on["use_sim_time"]}
    simulation = {"simulated_time": on["use_sim_time"]}
    if on["record"]:
        simulation["wait_for"] = RECORDER
    climber = [
        Node(
            package="climber_uk",
            executable=name,
            exec_name=name,
            parameters=[config, simulation if name == "plant_simulator" else time],
            on_exit=Shutdown(reason=f"{name} has ended"),
            output="screen",
            prefix=prefix,
        )
        for name in nodes
    ]
    seen = viewers(time, namespace, config, prefix) if on["rviz"] else []
    ours = qos(namespace) if on["sim"] else []
    recorder = ExecuteProcess(
        cmd=["ros2", "bag", "record", "--all", "--storage", "mcap", *ours],
        name="recorder",
        output="screen",
        prefix=prefix,
    )
    group = GroupAction([PushRosNamespace(namespace), *climber, *seen])
    return [*[recorder] * on["record"], group]


def qos(namespace: str) -> list[str]:
    """Options of `ros2 bag record` that let more messages of our simulator wait.

    Of a driver it has to find out by itself what QoS it offers: asked for more, it gets nothing.
    """
    file = SHARE / "config" / "rosbag2_qos.yaml"
    if namespace:
        text = re.sub(r"^/(?!clock)", f"/{namespace}/", file.read_text(), flags=re.MULTILINE)
        file = Path(tempfile.mkdtemp()) / file.name
        file.write_text(text)
    return ["--qos-profile-overrides-path", str(file)]


def viewers(
    time: dict[str, bool], namespace: str, config: str, prefix: list[str | LaunchConfiguration]
) -> list[Node]:
    """RViz, and what it shows."""
    frames = f"{namespace}/" if namespace else ""  # they keep the namespace, as the nodes' do
    description = ParameterValue((SHARE / "urdf" / "climber.urdf").read_text(), value_type=str)
    robot = {"robot_description": description, "frame_prefix": frames, **time}
    shown = ["-d", str(SHARE / "config" / "climber.rviz"), "--fixed-frame", f"{frames}odom"]
    nodes = {
        "markers": ("climber_uk", {"parameters": [config, time]}),
        "robot_state_publisher": ("robot_state_publisher", {"parameters": [robot]}),
        "rviz2": ("rviz2", {"parameters": [time], "arguments": shown}),
    }
    return [
        Node(package=package, executable=name, exec_name=name, prefix=prefix, **how)
        for name, (package, how) in nodes.items()
    ]


def generate_launch_description() -> LaunchDescription:
    """Describe what is started, for given arguments."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in ARGUMENTS.items()
    ]
    return LaunchDescription(
        [
            OpaqueFunction(function=refuse_unknown),
            *arguments,
            OpaqueFunction(function=start),
        ]
    )
