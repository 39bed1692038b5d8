import itertools

import numpy as np
import pytest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry, Path
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.preview import joined
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Circle
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.messages import reading, writing
from climber_uk.messages.references import preview

pytestmark = pytest.mark.nodes


def start(world, *parameters):
    world.start_node(
        "trajectory_publisher", "shape:=circle", "rest_to_rest.ramp_time:=0.5", *parameters
    )
    return world.listen(MultiDOFJointTrajectory, "reference")


def test_the_reference_starts_at_the_stamp_of_the_first_odometry(world):
    references = start(world)
    world.start_node("plant_simulator")
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    paths = []
    world.node.create_subscription(Path, "reference_path", paths.append, latched)
    world.wait(lambda: len(references) > 5, "previews")
    world.wait(lambda: paths, "path")
    begin = reading.nanoseconds(references[0].header.stamp)
    whole = joined(preview(message, "odom") for message in references)
    trajectory = Trajectory(Circle(), RestToRest(ramp_time=0.5))
    for time in whole.times:
        expected = trajectory.at((time - begin) * 1e-9)
        got = whole.at(int(time))
        np.testing.assert_allclose(got.pose[:2], expected.pose[:2], atol=1e-12)
        np.testing.assert_allclose(np.sin(got.heading - expected.heading), 0, atol=1e-12)
        np.testing.assert_allclose(got.velocity, expected.velocity, atol=1e-12)
        np.testing.assert_allclose(got.acceleration, expected.acceleration, atol=1e-9)
    assert len(paths[0].poses) == 400


def test_without_autostart_it_waits_for_its_service_and_stop_brings_it_to_rest(world):
    references = start(world, "autostart:=false", "stop_time:=0.3")
    world.start_node("plant_simulator")
    stop = world.call(Trigger, "trajectory_publisher/stop", Trigger.Request())
    assert (stop.success, stop.message) == (False, "not started")
    assert not references
    assert world.call(Trigger, "trajectory_publisher/start", Trigger.Request()).success
    world.wait(lambda: len(references) > 8, "previews")
    assert world.call(Trigger, "trajectory_publisher/stop", Trigger.Request()).success

    def at_rest():
        last = references[-1].points
        return all(
            point.velocities[0].linear.x == 0 == point.velocities[0].linear.y for point in last
        )

    world.wait(at_rest, "rest")
    # what is near is never taken back: 0.3 s from where each preview begins
    points, taken_back = {}, []
    for message in references:
        begin = reading.nanoseconds(message.points[0].time_from_start)
        for point in message.points:
            time = reading.nanoseconds(point.time_from_start)
            if points.setdefault(time, point) != point:
                taken_back.append(time - begin)
                points[time] = point
    assert min(taken_back) > 0.3 * SECOND


def test_a_stick_without_stamps_drives_too(world):
    references = start(world, "autostart:=false", "by_hand.input:=twist", "by_hand.ramp_time:=0.2")
    world.start_node("plant_simulator")
    stick, asked = world.speak(Twist, "cmd_vel"), Twist()
    asked.linear.x, asked.angular.z = 0.1, -0.2

    def drives():
        stick.publish(asked)
        rates = (point.velocities[0] for message in references[-1:] for point in message.points)
        told = [(np.hypot(of.linear.x, of.linear.y), of.angular.z) for of in rates]
        return pytest.approx((0.1, -0.2)) in told

    world.wait(drives, "a reference as fast as the stick asks for")


@pytest.mark.parametrize("seconds", [pytest.param(0, marks=pytest.mark.soak), 5])
def test_where_the_clock_goes_back_the_trajectory_starts_again_and_goes_on(world, seconds):
    references = start(world, "use_sim_time:=true")
    clock, odometry = world.speak(Clock, "/clock"), world.speak(Odometry, "odom")
    at_rest = State(np.zeros(3), np.zeros(3))

    def goes_on_from(begin, seconds):
        """In a time that goes on in steps of 20 ms, some seconds are published."""
        references.clear()
        stamps = itertools.count(begin * SECOND, SECOND // 50)

        def is_ahead():
            stamp = next(stamps)
            clock.publish(Clock(clock=writing.time(stamp)))
            odometry.publish(writing.odometry(at_rest, stamp, "odom", "base_link"))
            told = [m for m in references if reading.nanoseconds(m.header.stamp) >= begin * SECOND]
            told = [m for m in told if reading.nanoseconds(m.header.stamp) <= stamp]
            return told and told[-1].points[-1].time_from_start.sec >= seconds

        world.wait(is_ahead, f"a trajectory that goes on after {begin} s")
        return next(stamps) / SECOND - begin

    def is_refused():
        clock.publish(Clock(clock=writing.time(-1)))  # before 1970: rclpy would end
        return "/clock: refused" in world.log("trajectory_publisher")

    goes_on_from(200, seconds)
    world.wait(is_refused, "word of it")
    assert goes_on_from(1, 5) < 20


def test_waypoints_are_relative_to_the_parameter_file_that_names_them(world, tmp_path):
    (tmp_path / "lanes.csv").write_text("x;y\n0;0\n1,5;0\n1,5;0,3\n")
    config = tmp_path / "lanes.yaml"
    config.write_text(
        "/**/trajectory_publisher:\n  ros__parameters:\n"
        "    shape: waypoints\n    waypoints:\n      file: lanes.csv\n"
    )
    world.start_node("trajectory_publisher", config=config)
    paths = []
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    world.node.create_subscription(Path, "reference_path", paths.append, latched)
    world.start_node("plant_simulator")
    world.wait(lambda: paths, "path")
    end = paths[0].poses[-1].pose.position
    np.testing.assert_allclose([end.x, end.y], [1.5, 0.3], atol=1e-9)


def test_lanes_begin_where_the_climber_is_nearest_to_them(world):
    (world.directory / "strip.csv").write_text("0 0\n3 0\n3 0.45\n0 0.45\n")
    area = f"lanes.area:={world.directory / 'strip.csv'}"
    world.start_node("trajectory_publisher", "shape:=lanes", area)
    references = world.listen(MultiDOFJointTrajectory, "reference")
    world.start_node("plant_simulator", "initial_x:=2.9", "initial_y:=0.3")
    world.wait(lambda: references, "previews")
    begin = references[0].points[0].transforms[0].translation
    assert (begin.x, begin.y) == pytest.approx((2.8, 0.245), abs=0.02)
