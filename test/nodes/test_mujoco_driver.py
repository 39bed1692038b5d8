"""The example driver whose robot is in MuJoCo, driven by the nodes in lock-step."""

import numpy as np
import pytest
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from climber_uk.messages import reading

pytestmark = pytest.mark.nodes

DRIVER, PERIOD = "mujoco_driver", 5_000_000  # [ns]
pytest.importorskip("mujoco", reason="an extra, `physics`, that `make test` does not install")


def nanoseconds(message):
    """Stamp of a message."""
    return reading.nanoseconds(message.header.stamp)


@pytest.mark.parametrize("motors", ["torque", "velocity"])
def test_the_nodes_drive_a_four_wheeled_robot_of_another_house(world, motors):
    config = "velocity.yaml" if motors == "velocity" else "climber.yaml"
    truth = world.hear(Odometry, "ground_truth")
    joints = world.hear(JointState, "joint_states")
    commands = world.hear(JointState, "wheel_torques")
    sides = [f"{side}_wheel_joint:='{side}_front, {side}_rear'" for side in ("left", "right")]
    given = ["locomotion:=four_wheeled", "wheel_inertia:=2.0e-4", "simulated_time:=true", *sides]
    sim = "use_sim_time:=true"
    world.start_node("uk_torque_controller", sim, *sides, config=config)
    world.start_node("trajectory_publisher", sim, "autostart:=false", config=config)
    start = world.node.create_client(Trigger, "trajectory_publisher/start")
    world.start_node(DRIVER, *given, config=config)
    world.wait(start.service_is_ready, "planner")
    world.wait(lambda: joints, "joint states")
    started = start.call_async(Trigger.Request())
    world.wait(started.done, "start")
    world.wait(lambda: truth[-1].pose.pose.position.x > 0.3, "way")
    places = np.array([(m.pose.pose.position.x, m.pose.pose.position.y) for m in truth])
    s = np.arange(0, 1, 1e-4)  # the figure of eight of both files
    path = np.stack([1.5 * np.sin(s), 3.0 + 0.75 * np.sin(2 * s)], axis=-1)
    off = [np.hypot(*(path - place).T).min() for place in places[::20]]
    assert max(off) < 0.01
    assert "refused" not in world.log(DRIVER)
    if motors == "torque":  # as much as is asked for: that of a side is shared by its wheels
        told = {nanoseconds(message): message.effort for message in joints}
        asked = {nanoseconds(message) + PERIOD: message.effort for message in commands}
        both = sorted(told.keys() & asked.keys())
        assert len(both) > 100
        np.testing.assert_allclose([told[i] for i in both], [asked[i] for i in both], atol=1e-9)
