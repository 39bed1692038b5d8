import numpy as np
import pytest
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from climber_uk.messages import reading, writing

pytestmark = pytest.mark.nodes

LEFT, RIGHT = "left_wheel_joint", "right_wheel_joint"


def torques(right, left, stamp=0):
    return writing.wheel_torques(np.array([right, left]), stamp, LEFT, RIGHT)


def stamp(message):
    return reading.nanoseconds(message.header.stamp)


def test_in_simulated_time_it_steps_once_for_each_torque_that_answers_it(world):
    world.start_node("plant_simulator", "simulated_time:=true", "initial_speed:=1.0")
    odometry, clock = world.listen(Odometry, "odom"), world.listen(Clock, "/clock")
    answers = world.speak(JointState, "wheel_torques")
    for step in range(5):
        now = 1_000_000_000 + step * 5_000_000
        world.wait(lambda now=now: odometry and stamp(odometry[-1]) == now, f"odometry {step}")
        answers.publish(torques(1.0, 1.0, now - 5_000_000))  # an old one: no step for it
        answers.publish(torques(1.0, 1.2, now))
    states = {stamp(m): m for m in odometry}
    assert len(states) >= 5
    world.wait(lambda: {reading.nanoseconds(m.clock) for m in clock} >= set(states), "clock")
    wrenched = states[1_000_000_000 + 4 * 5_000_000]
    # (τR - τL) d / (r J) for 20 ms
    turning = -0.2 * 0.3 / 0.027 / 0.33
    assert wrenched.twist.twist.angular.z == pytest.approx(turning * 0.02, rel=1e-9)


def test_a_torque_that_does_not_come_is_asked_for_again_and_reported(world):
    world.start_node("plant_simulator", "simulated_time:=true", "lockstep_timeout:=0.5")
    odometry = world.listen(Odometry, "odom")
    world.wait(
        lambda: "no torque for the odometry of 1.000 s" in world.log("plant_simulator"), "report"
    )
    world.wait(lambda: len(odometry) >= 3, "odometry to be repeated")
    assert {stamp(m) for m in odometry} == {1_000_000_000}
    world.speak(JointState, "wheel_torques").publish(torques(0.0, 0.0, 1_000_000_000))
    world.wait(lambda: "lock-step: ok again" in world.log("plant_simulator"), "recovery")


def bad(kind):
    message = torques(1.0, 1.0)
    if kind == "nan":
        message.effort = [float("nan"), 1.0]
    elif kind == "names":
        message.name = ["left", "right"]
    else:
        message.effort = [1.0]
    return message


@pytest.mark.parametrize(
    ("kind", "said"),
    [("nan", "must be finite"), ("names", "names ['left', 'right']"), ("length", "1 efforts")],
)
def test_a_bad_torque_is_dropped_with_one_warning(world, kind, said):
    world.start_node("plant_simulator", "inclination:=0.0", "command_timeout:=5.0")
    joints = world.listen(JointState, "joint_states")
    commands = world.speak(JointState, "wheel_torques")
    commands.publish(torques(5.0, 5.0))
    world.wait(lambda: joints and joints[-1].effort[0] == 5.0, "torque to act")
    for _ in range(3):
        commands.publish(bad(kind))
    world.wait(lambda: joints[-1].effort[0] == 0.0, "zero torque in its place")
    commands.publish(torques(5.0, 5.0))
    world.wait(lambda: joints[-1].effort[0] == 5.0, "recovery")
    log = world.log("plant_simulator")
    assert log.count(said) == 1
    assert log.count("wheel_torques: ok again") == 1


def test_a_stale_torque_acts_no_more_and_a_new_one_does(world):
    world.start_node("plant_simulator", "inclination:=0.0")
    joints = world.listen(JointState, "joint_states")
    commands = world.speak(JointState, "wheel_torques")
    for _ in range(2):
        commands.publish(torques(2.0, 2.0))
        world.wait(lambda: joints and joints[-1].effort[0] == 2.0, "torque to act")
        world.wait(lambda: joints[-1].effort[0] == 0.0, "torque to become stale")
    log = world.log("plant_simulator")
    assert log.count("torque command: stale") == 2
    assert log.count("torque command: ok again") == 1


def test_torques_beyond_the_limit_are_cut(world):
    world.start_node("plant_simulator", "inclination:=0.0", "max_wheel_torque:=3.0")
    joints = world.listen(JointState, "joint_states")
    commands = world.speak(JointState, "wheel_torques")
    commands.publish(torques(100.0, -100.0))
    world.wait(lambda: joints and list(joints[-1].effort) == [-3.0, 3.0], "cut torques")


def test_it_slides_when_the_suction_pressure_is_lowered(world):
    world.start_node("plant_simulator", "initial_heading:=1.5")
    odometry = world.listen(Odometry, "odom")
    world.wait(lambda: len(odometry) > 100, "odometry")
    assert not any(m.twist.twist.linear.x for m in odometry)
    value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=2000.0)
    request = SetParameters.Request(parameters=[Parameter(name="suction_pressure", value=value)])
    (result,) = world.call(SetParameters, "plant_simulator/set_parameters", request).results
    assert result.successful
    world.wait(lambda: odometry[-1].twist.twist.linear.x < -0.01, "sliding")


def test_reset_brings_the_climber_back_while_time_goes_on(world):
    world.start_node("plant_simulator", "inclination:=0.0", "initial_x:=2.0")
    odometry = world.listen(Odometry, "odom")
    commands = world.speak(JointState, "wheel_torques")
    commands.publish(torques(5.0, 5.0))
    world.wait(lambda: odometry and odometry[-1].pose.pose.position.x > 2.001, "motion")
    before = stamp(odometry[-1])
    assert world.call(Trigger, "plant_simulator/reset", Trigger.Request()).success
    world.wait(lambda: odometry[-1].pose.pose.position.x == 2.0, "start")
    assert stamp(odometry[-1]) > before


def test_odometry_says_where_it_is_and_how_sure_it_is(world):
    world.start_node("plant_simulator", "odom_frame:=wall", "base_frame:=climber")
    odometry = world.listen(Odometry, "odom")
    message = world.wait(lambda: odometry and odometry[-1], "odometry")
    assert (message.header.frame_id, message.child_frame_id) == ("wall", "climber")
    for covariance in (message.pose.covariance, message.twist.covariance):
        assert (np.diag(np.reshape(covariance, (6, 6))) > 0).all()
