"""The nodes of one climber: `ros2 launch climber_uk climber.launch.py config:=FILE`.

With `sim:=false` the simulator stays away, and your driver takes its place. `ros2 launch -s` tells
all arguments.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, GroupAction
from launch.conditions import IfCondition
from launch.substitutions import (
    Command,
    LaunchConfiguration,
    PathJoinSubstitution,
    PythonExpression,
)
from launch_ros.actions import Node, PushRosNamespace
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

SHARE = FindPackageShare("climber_uk")
ARGUMENTS = {
    "sim": ("true", "start the simulator; false: your driver is there"),
    "config": (PathJoinSubstitution([SHARE, "config", "climber.yaml"]), "parameters of all nodes"),
    "namespace": ("", "of the climber"),
    "record": ("false", "record all topics with rosbag2, as MCAP"),
    "use_sim_time": ("false", "take time from /clock; the simulator, if any, then is in lock-step"),
    "rviz": ("false", "show it in RViz"),
}


def generate_launch_description() -> LaunchDescription:
    """Describe what is started, for given arguments."""
    argument = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    simulated = ParameterValue(argument["use_sim_time"], value_type=bool)

    def node(executable: str, parameters: dict[str, ParameterValue], when: str = "") -> Node:
        return Node(
            package="climber_uk",
            executable=executable,
            parameters=[argument["config"], parameters],
            condition=IfCondition(argument[when]) if when else None,
            output="screen",
        )

    time = {"use_sim_time": simulated}
    description = Command(["cat ", PathJoinSubstitution([SHARE, "urdf", "climber.urdf"])])
    # frames keep the namespace, as the nodes' do
    namespace = argument["namespace"]
    prefix = PythonExpression(["'", namespace, "'.strip('/') + '/' if '", namespace, "' else ''"])
    seen = IfCondition(argument["rviz"])
    climber = GroupAction(
        [
            PushRosNamespace(argument["namespace"]),
            node("trajectory_publisher", time),
            node("uk_torque_controller", time),
            node("plant_simulator", {"simulated_time": simulated}, when="sim"),
            node("markers", time, when="rviz"),
            Node(
                package="robot_state_publisher",
                executable="robot_state_publisher",
                parameters=[
                    {
                        "robot_description": ParameterValue(description, value_type=str),
                        "frame_prefix": ParameterValue(prefix, value_type=str),
                        **time,
                    }
                ],
                condition=seen,
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=[
                    *("-d", PathJoinSubstitution([SHARE, "config", "climber.rviz"])),
                    *("--fixed-frame", [prefix, "odom"]),
                ],
                parameters=[time],
                condition=seen,
            ),
        ]
    )
    recorder = ExecuteProcess(
        cmd=["ros2", "bag", "record", "--all", "--storage", "mcap"],
        condition=IfCondition(argument["record"]),
    )
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, climber, recorder])
