"""The node `markers`, told by hand what it draws; what is drawn where: test_drawing."""

import numpy as np
import pytest
from geometry_msgs.msg import Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from reference_points import reference_point
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import MultiDOFJointTrajectory
from visualization_msgs.msg import MarkerArray

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.reference import Reference
from climber_uk.messages import reading, writing
from climber_uk.messages.names import Names
from climber_uk.ros.running import PUBLISH_PERIOD

pytestmark = pytest.mark.nodes
NAMESPACE, FRAMES = "climber_1", ("climber_1/odom", "climber_1/base_link")
ALL = {"climber": 4, "way": 1, "reference": 1, "wheel_torques": 2, "constraint_force": 1}
STEP = SECOND // 100  # [ns]


class Told:
    """Publishes, each time it is called, all that the node listens to, 10 ms later."""

    def __init__(self, world):
        self.stamp = 100 * SECOND
        self.publishers = {
            name: world.speak(kind, f"{NAMESPACE}/{name}")
            for name, kind in (
                ("reference", MultiDOFJointTrajectory),
                ("wheel_torques", JointState),
                ("uk_torque_controller/constraint_force", WrenchStamped),
                ("uk_torque_controller/margins", Vector3Stamped),
                ("odom", Odometry),
            )
        }

    def messages(self):
        stamp, (odom, base) = self.stamp, FRAMES
        rest = np.zeros(3)
        ahead = Reference(np.array([1.1, 2.0, 0.0]), rest, rest, np.zeros(2))
        points = [reference_point(ahead, time) for time in (0.0, 1.0)]
        state = State.rolling(np.array([1.0, 2.0, 0.0]), 0.1, 0.0)
        return {
            "reference": writing.reference(points, stamp, odom, base),
            "wheel_torques": writing.wheel_torques(np.array([2.0, -1.0]), stamp, Names().wheels),
            "uk_torque_controller/constraint_force": writing.wrench((60.0, -20.0, 0), stamp, base),
            "uk_torque_controller/margins": writing.vector((2.0, 9.0, 300.0), stamp, base),
            "odom": writing.odometry(state, stamp, odom, base),
        }

    def __call__(self, *, but=()):
        self.stamp += STEP
        for name, message in self.messages().items():
            if name not in but:
                self.publishers[name].publish(message)


def groups(array):
    """Markers of a message by what comes after the namespace."""
    found = {}
    for marker in array.markers:
        namespace, group = marker.ns.split("/")
        assert namespace == NAMESPACE
        found.setdefault(group, []).append(marker)
    return found


def points(marker):
    return [(point.x, point.y) for point in marker.points]


def test_all_that_is_told_is_drawn_in_the_namespace_and_what_is_old_is_not(world):
    world.start("markers", "--ros-args", "-r", f"__ns:=/{NAMESPACE}")
    drawn = world.listen(MarkerArray, f"{NAMESPACE}/markers")
    tell = Told(world)

    def counts():
        return drawn and {name: len(found) for name, found in groups(drawn[-1]).items()}

    def colour():
        plate = groups(drawn[-1])["climber"][0]
        return plate.color.r, plate.color.g

    # that of a slip margin of 2, which may come last
    world.wait(lambda: tell() or (counts() == ALL and colour() == (1, 1)), "drawing of all")
    seen = groups(drawn[-1])
    assert {marker.header.frame_id for marker in drawn[-1].markers} == {FRAMES[0]}
    plate = seen["climber"][0]
    assert (plate.pose.position.x, plate.pose.position.y) == (1, 2)
    assert max(points(seen["reference"][0]))[0] == pytest.approx(1.1 + 0.9 * 0.3)
    right, left = (points(arrow) for arrow in seen["wheel_torques"])
    np.testing.assert_allclose(right, [(1, 1.7), (1 + 2 * 0.3, 1.7)])
    np.testing.assert_allclose(left, [(1, 2.3), (1 - 1 * 0.3, 2.3)])
    (force,) = (points(arrow) for arrow in seen["constraint_force"])
    np.testing.assert_allclose(force, [(1, 2), (1 + 60 * 0.005, 2 - 20 * 0.005)])
    stamps = [reading.nanoseconds(array.markers[0].header.stamp) for array in drawn]
    assert len(stamps) <= (stamps[-1] - stamps[0]) / PUBLISH_PERIOD + 2  # told 5 times as often

    silent = set(tell.publishers) - {"odom"}
    world.wait(lambda: tell(but=silent) or counts() == {"climber": 4, "way": 1}, "what is left")
    assert "refused" not in world.log("markers")
