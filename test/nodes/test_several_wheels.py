"""A climber with two wheels a side: their joints in the messages of all nodes."""

import pytest
from sensor_msgs.msg import JointState

from climber_uk.messages import reading

pytestmark = pytest.mark.nodes


def test_several_wheels_a_side_have_their_share_in_all_messages(world):
    commands = world.hear(JointState, "wheel_torques")
    joints = world.hear(JointState, "joint_states")
    config = "four_wheels.yaml"
    world.start_node("uk_torque_controller", "use_sim_time:=true", config=config)
    world.start_node("trajectory_publisher", "use_sim_time:=true", config=config)
    world.start_node("plant_simulator", "simulated_time:=true", config=config)
    world.wait(lambda: commands and joints and max(joints[-1].velocity) > 0.5, "motion")
    names = [f"{side}_{row}_wheel_joint" for side in ("left", "right") for row in ("front", "rear")]
    for message in (commands[-1], joints[-1]):
        assert list(message.name) == names
        for values in (message.velocity, message.effort):
            front_left, rear_left, front_right, rear_right = values
            assert (front_left, front_right) == (rear_left, rear_right)
    # what both ends of the line have is the same: the plant adds up what the controller shares out
    period = 5_000_000

    def both():
        """Torques that were commanded and that acted, of the same odometry."""
        told = {reading.nanoseconds(m.header.stamp): m.effort for m in commands}
        stamped = ((reading.nanoseconds(m.header.stamp) - period, m.effort) for m in joints)
        return [(told[stamp], acted) for stamp, acted in stamped if stamp in told]

    for commanded, acted in world.wait(both, "torques on both topics")[-20:]:
        assert list(acted) == pytest.approx(list(commanded))
