"""The example driver whose robot is in MuJoCo, driven by the nodes in lock-step."""

import numpy as np
import pytest
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

pytestmark = pytest.mark.nodes

DRIVER = "mujoco_driver"
pytest.importorskip("mujoco", reason="an extra, `physics`, that `make test` does not install")


@pytest.mark.parametrize("motors", ["torque", "velocity"])
def test_the_nodes_drive_a_four_wheeled_robot_of_another_house(world, motors):
    config = "velocity.yaml" if motors == "velocity" else "climber.yaml"
    truth = world.hear(Odometry, "ground_truth")
    joints = world.hear(JointState, "joint_states")
    given = ["locomotion:=four_wheeled", "wheel_inertia:=2.0e-4", "simulated_time:=true"]
    sim = "use_sim_time:=true"
    world.start_node("uk_torque_controller", sim, config=config)
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
