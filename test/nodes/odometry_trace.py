"""Prints which functions of the package answer one odometry, in the order of their calls.

The node itself, in its own process, following the default trajectory: from its callback to the
message of wheel torques. A line is the depth of the call, the file within the package and the name.
"""

import sys
from pathlib import Path

import rclpy
from rclpy.clock import ClockType
from rclpy.serialization import serialize_message
from rclpy.time import Time
from reference_points import reference_point
from sensor_msgs.msg import JointState

import climber_uk
from climber_uk.control.safety import Mode
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.messages import writing
from climber_uk.messages.in_place import NumberWriter
from climber_uk.messages.topics import TORQUES
from climber_uk.nodes.uk_torque_controller import UkTorqueController

PACKAGE = str(Path(climber_uk.__file__).parent) + "/"
FRAMES = "odom", "base_link"
PERIOD = SECOND // 200  # [ns]


class Defaults:
    """Parameters that nobody gave."""

    def read(self, kind, prefix=""):
        """Instance of `kind`."""
        return kind()


def traced(function, *arguments):
    """Calls within the package, until the torques are made into a message."""
    calls, depth = [], 0

    def on_event(frame, event, _):
        nonlocal depth
        code = frame.f_code
        if not code.co_filename.startswith(PACKAGE):
            return
        if event == "call":
            calls.append((depth, code.co_filename.removeprefix(PACKAGE), code.co_name))
            depth += 1
        elif event == "return":
            depth -= 1
            if code is NumberWriter.__call__.__code__:
                sys.setprofile(None)

    sys.setprofile(on_event)
    function(*arguments)
    sys.setprofile(None)
    return calls


def main():
    """Follow for three odometry messages in simulated time, the last of which is traced."""
    arguments = ["--ros-args", "-p", "use_sim_time:=true"]
    rclpy.init(args=arguments)
    node, trajectory = UkTorqueController(), build_trajectory(Defaults().read)
    node.create_subscription(JointState, TORQUES, print, 10)
    while not node.torques.is_heard:
        rclpy.spin_once(node, timeout_sec=0.1)
    start = SECOND
    times = [0.05 * i for i in range(40)]
    points = [reference_point(trajectory.at(time), time) for time in times]
    node.on_reference(serialize_message(writing.reference(points, start, *FRAMES)))
    for stamp in range(start, start + 3 * PERIOD, PERIOD):
        node.get_clock().set_ros_time_override(
            Time(nanoseconds=stamp, clock_type=ClockType.ROS_TIME)
        )
        reference = trajectory.at((stamp - start) / SECOND)
        state = State(reference.pose, reference.velocity)
        odometry = serialize_message(writing.odometry(state, stamp, *FRAMES))
        calls = traced(node.on_odometry, odometry)
    assert node.controller.mode is Mode.FOLLOWING, node.controller.mode
    for depth, file, name in calls:
        print(depth, file, name)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
