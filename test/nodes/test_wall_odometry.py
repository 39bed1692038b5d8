"""The node `wall_odometry`: told by hand, and in the loop with plant and controller."""

import math

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from world import CONFIG, command

from climber_uk.bags.recorded_run import read_run
from climber_uk.mechanics import SECOND
from climber_uk.messages import reading, writing, writing_sensors
from climber_uk.report.metrics import Case, evaluate

pytestmark = pytest.mark.nodes
NODE = "wall_odometry"
STEP = SECOND // 200  # [ns]
TOPICS = {"joint_states": JointState, "imu": Imu, "pose": PoseWithCovarianceStamped}


class Told:
    """Publishes encoders, IMU and fixes of a climber that rests at a heading."""

    def __init__(self, world, heading=1.0, namespace=""):
        self.world, self.heading, self.stamp = world, heading, 100 * SECOND
        self.prefix = f"{namespace}/" if namespace else ""
        self.odometry = world.listen(Odometry, f"{self.prefix}odom")
        self.publishers = {
            name: world.speak(kind, self.prefix + name) for name, kind in TOPICS.items()
        }

    def publish(self, topic, message, **changed):
        """Publish a message with other fields than it has, by the ends of their paths."""
        message.header.stamp = writing.time(self.stamp)
        for path, value in changed.items():
            *above, last = path.split("__")
            inner = message
            for part in above:
                inner = getattr(inner, part)
            setattr(inner, last, value)
        self.publishers[topic].publish(message)

    def imu(self, **changed):
        message = writing_sensors.imu(f"{self.prefix}base_link", 1e-4, 1e-4)
        message.linear_acceleration.x = 9.81 * math.sin(self.heading)
        message.linear_acceleration.y = 9.81 * math.cos(self.heading)
        self.publish("imu", message, **changed)

    def joints(self, **changed):
        names = ["left_wheel_joint", "right_wheel_joint"]
        self.publish("joint_states", JointState(name=names, position=[0.5, 0.5]), **changed)

    def pose(self, x=0.0, y=0.0, **changed):
        message = writing_sensors.pose(f"{self.prefix}odom", 0.02**2, 0.0)
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        self.publish("pose", message, **changed)

    def go_on(self, has_imu=True):
        """A step later; the odometry that answers it, if there is one yet."""
        self.stamp += STEP
        if has_imu:
            self.imu()
        self.joints()
        return self.odometry and self.odometry[-1]

    def answered(self):
        """The odometry of the last step, which is waited for."""
        self.go_on()
        self.world.wait(self.is_answered, "answer to the encoders")
        return self.odometry[-1]

    def is_answered(self):
        return self.odometry and stamp_of(self.odometry[-1]) == self.stamp


def stamp_of(message):
    return reading.nanoseconds(message.header.stamp)


def test_each_message_of_the_encoders_is_answered_with_a_heading_that_nobody_told(world):
    world.start(NODE, "--ros-args", "-r", "__ns:=/climber_1")
    told = Told(world, heading=-2.0, namespace="climber_1")
    places = world.listen(PoseStamped, f"climber_1/{NODE}/map_to_odom")
    world.wait(told.go_on, "first odometry")
    for _ in range(100):
        odometry = told.answered()
    state = reading.state(odometry, "climber_1/odom", "climber_1/base_link")
    assert state.heading == pytest.approx(-2.0, abs=1e-3)
    assert np.hypot(*state.pose[:2]) < 0.03
    covariance = np.array(odometry.pose.covariance).reshape(6, 6)
    assert (np.linalg.eigvalsh(covariance) > 0).all()
    assert covariance[0, 0] == pytest.approx(0.01**2, rel=0.01)
    assert math.sqrt(covariance[5, 5]) == pytest.approx(0.1 / 9.81, rel=0.02)  # by biases
    assert (np.diagonal(np.array(odometry.twist.covariance).reshape(6, 6)) > 0).all()
    stamps = [stamp_of(message) for message in told.odometry]
    assert np.diff(stamps[-50:]).tolist() == [STEP] * 49
    told.pose(x=0.02)
    told.answered()
    world.wait(lambda: told.go_on() and places[-1].pose.position.x > 0.001, "correction in the map")
    assert places[-1].header.frame_id == "map"


def test_what_is_refused_has_one_line_that_says_why_and_is_told_in_diagnostics(world):
    world.start_node(NODE)
    diagnostics = world.listen(DiagnosticArray, "/diagnostics")
    told = Told(world)
    world.wait(told.go_on, "first odometry")
    for name, changed, said in (
        ("imu", {"header__frame_id": "imu_link"}, "frame_id='imu_link' must be 'base_link'"),
        ("pose", {"header__frame_id": "map"}, "frame_id='map' must be 'odom'"),
        ("joints", {"name": ["a", "b"]}, "must have 'left_wheel_joint' once"),
    ):
        getattr(told, name)(**changed)
        world.wait(lambda said=said: said in world.log(NODE), said)
    told.answered()
    told.pose(x=5.0)
    world.wait(lambda: "fix refused" in world.log(NODE), "refusal of a fix far off")
    told.answered()

    def values():
        found = [s for m in diagnostics for s in m.status if s.name == f"/{NODE}"]
        return {pair.key: pair.value for pair in found[-1].values} if found else {}

    world.wait(lambda: told.go_on() and values().get("fixes refused") == "1", "count of refusals")
    assert "times what may be" in values()["last remark"]
    assert "±" in values()["bias of the gyro [rad/s]"]
    assert world.log(NODE).count("must have 'left_wheel_joint' once") == 1
    told.pose()
    told.answered()
    told.stamp += 6 * SECOND
    said = "fixes: they have stopped"
    world.wait(lambda: told.go_on() and said in world.log(NODE), said)
    told.pose()
    world.wait(lambda: told.go_on() and "fixes: ok again" in world.log(NODE), "fixes")


def test_an_imu_that_stops_is_told_and_the_encoders_go_on(world):
    world.start_node(NODE)
    told = Told(world)
    world.wait(told.go_on, "first odometry")
    told.answered()
    said = "none: yaw rate by the wheels"
    world.wait(lambda: told.go_on(has_imu=False) and said in world.log(NODE), said)
    count = len(told.odometry)
    world.wait(lambda: told.go_on(has_imu=False) and len(told.odometry) > count + 5, "odometry")
    world.wait(lambda: told.go_on() and "samples of imu: ok again" in world.log(NODE), "IMU")


def test_on_a_floor_it_says_what_it_waits_for(world):
    world.start_node(NODE, "inclination:=0.0")
    told = Told(world)
    said = "start: waits (for heading to 0.1 rad)"
    world.wait(lambda: told.go_on() or said in world.log(NODE), said)
    assert not told.odometry


def test_the_climber_of_field_yaml_follows_its_path_by_what_its_sensors_tell(world, tmp_path):
    """In lock-step, through all nodes: true distances beside those that it believes."""
    run = tmp_path / "run"
    arguments = "--config", CONFIG / "field.yaml", "--output", run, "--duration", "3.5"
    world.run("run_demo", *command("run_demo"), *arguments)
    demo = world.processes["run_demo"]
    world.wait(lambda: demo.poll() is not None, "end of the run")
    assert demo.returncode == 0, world.log("run_demo")
    found = evaluate(Case(read_run(run / "bag")))
    assert found["truth_max_distance"] < 0.03
    assert found["safety_stops"] == found["odometry_unanswered"] == 0
    assert "refused" not in (run / f"{NODE}.log").read_text()
