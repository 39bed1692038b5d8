from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import TwistStamped, Vector3Stamped, WrenchStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from reference_points import reference_point
from sensor_msgs.msg import BatteryState, FluidPressure, JointState
from std_msgs.msg import Bool, Float64MultiArray
from std_srvs.srv import SetBool
from trajectory_msgs.msg import MultiDOFJointTrajectory

from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Circle
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.messages import reading, writing

pytestmark = pytest.mark.nodes

NAME = "uk_torque_controller"
UNGUARDED = [  # no torque moves what is told here
    *("guard.max_disturbance:=0.0", "guard.stall_time:=0.0", "guard.response_time:=0.0")
]
CIRCLE = Trajectory(Circle(), ConstantRate(rate=0.5))


class Loop:
    """What a robot and a planner would say, a step at a time, and what the controller answers."""

    def __init__(self, world, *parameters, trajectory=CIRCLE):
        self.world, self.trajectory = world, trajectory
        if NAME not in world.processes:
            world.start_node(NAME, *UNGUARDED, *parameters)
        self.torques = world.listen(JointState, "wheel_torques")
        self.odometry = world.speak(Odometry, "odom")
        self.reference = world.speak(MultiDOFJointTrajectory, "reference")
        self.begin = self.now()

    def now(self):
        return self.world.node.get_clock().now().nanoseconds

    def plan(self, seconds=60.0):
        times = np.arange(0.0, seconds, 0.25)
        points = [reference_point(self.trajectory.at(time), time) for time in times]
        self.reference.publish(writing.reference(points, self.begin, "odom", "base_link"))

    def tell(self, spoil=lambda message: None, age=0, at=None):
        stamp = at or self.now() - age
        here = self.trajectory.at((stamp - self.begin) * 1e-9)
        message = writing.odometry(State(here.pose, here.velocity), stamp, "odom", "base_link")
        spoil(message)
        self.odometry.publish(message)
        return stamp

    def until(self, condition, what, **how):
        """Tell odometry again and again, as a robot does, until torques meet a condition."""

        seen = len(self.torques)

        def met():
            self.tell(**how)
            return any(condition(list(m.effort)) for m in self.torques[seen + 1 :])

        self.world.wait(met, what)

    def follows(self):
        self.until(any, "torque of a controller that follows")

    def is_safe(self, **how):
        self.until(lambda effort: effort == [0.0, 0.0], "safe output", **how)


def spoil_nan(message):
    message.pose.pose.position.x = float("nan")


def spoil_frame(message):
    message.header.frame_id = "map"


def spoil_child_frame(message):
    message.child_frame_id = "base_footprint"


def spoil_orientation(message):
    message.pose.pose.orientation.w = 0.0
    message.pose.pose.orientation.z = 0.0


class Repeating:
    """Tells poses and twists of some messages over and over again, with the stamps of now."""

    def __init__(self, number=10):
        self.number, self.told = number, []

    def __call__(self, message):
        if len(self.told) < self.number:
            self.told.append((message.pose, message.twist))
        else:
            message.pose, message.twist = self.told[0]
            self.told.append(self.told.pop(0))


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"spoil": Repeating()}, "it is back where it was"),
        ({"spoil": spoil_nan}, "is not finite"),
        ({"spoil": spoil_frame}, "frame_id='map' must be 'odom'"),
        ({"spoil": spoil_child_frame}, "'base_footprint' must be 'base_link': see base_frame, "),
        ({"spoil": spoil_orientation}, "must be a unit turn about z"),
        ({"age": 2_000_000_000}, "from the clock, too far"),
    ],
    ids=[
        "repeats itself",
        "not finite",
        "wrong frame",
        "wrong child frame",
        "no orientation",
        "stale stamp",
    ],
)
def test_bad_odometry_gets_the_safe_output_and_good_one_is_followed_again(world, how, said):
    # what repeats itself leaps back first: with less that is a fault of its own, until it rests
    loop = Loop(world, "odometry_timeout:=1.0", "max_twist_error:=1.0")
    loop.plan()
    loop.follows()
    loop.until(lambda _: said in world.log(NAME), said, **how)
    loop.is_safe(**how)
    loop.follows()
    world.wait(lambda: "safe output: ok again" in world.log(NAME), "word of the recovery")
    told = [line for line in world.log(NAME).splitlines() if "safe output" in line]
    # a slow machine may hold up odometry in between
    assert not any(said in line and said in later for line, later in pairwise(told))


def test_odometry_that_leaves_its_plane_is_said_once(world):
    def upright(message):
        message.pose.pose.position.z = 0.2

    loop = Loop(world, "odometry_timeout:=1.0")
    loop.plan()
    loop.follows()
    said = "odom: position.z changes (0 to 0.2 m; x and y are to be along the wall)"
    loop.until(lambda _: said in world.log(NAME), said, spoil=upright)
    loop.until(any, "torques all the same", spoil=upright)
    assert world.log(NAME).count("position.z") == 1


def test_odometry_that_stops_is_noticed_and_followed_when_it_comes_back(world):
    loop = Loop(world)
    loop.plan()
    loop.follows()
    world.wait(lambda: list(loop.torques[-1].effort) == [0.0, 0.0], "safe output")
    world.wait(lambda: "safe output: no odometry" in world.log(NAME), "word of it")
    loop.follows()


def test_a_reference_that_is_missing_or_ends_gets_the_safe_output(world):
    # of a slow one, that it does not wait for who is held up and then ahead of it
    slow = Trajectory(Circle(), ConstantRate(rate=1e-3))
    loop = Loop(world, "odometry_timeout:=1.0", trajectory=slow)
    loop.is_safe()
    no_reference = "safe output: no reference"
    world.wait(lambda: no_reference in world.log(NAME), "word of it")
    loop.plan(seconds=(loop.now() - loop.begin) * 1e-9 + 4.0)
    loop.follows()
    loop.until(lambda _: no_reference in world.log(NAME).partition("ok again")[2], "word of it")
    loop.is_safe()


def test_hold_carries_the_weight_in_place_of_zero_torque(world):
    loop = Loop(world, "safe_output:=hold", "odometry_timeout:=1.0", "braking_rate:=0.0")
    # the circle is travelled upwards at first: about 49 N of weight on two wheels of 0.027 m
    loop.until(lambda effort: 0.1 < effort[0] == effort[1] < 0.663, "holding torque")


def test_disabled_it_gives_the_safe_output_until_it_is_enabled(world):
    loop = Loop(world, "odometry_timeout:=1.0")
    status = world.listen(DiagnosticArray, "/diagnostics")
    loop.plan()
    loop.follows()
    assert world.call(SetBool, f"{NAME}/enable", SetBool.Request(data=False)).success
    loop.is_safe()

    def told():
        return [told for m in status for told in m.status if "disabled" in told.message]

    assert world.wait(told, "word of it in diagnostics")[0].level == DiagnosticStatus.WARN
    status.clear()
    assert world.call(SetBool, f"{NAME}/enable", SetBool.Request(data=True)).success
    loop.follows()
    # no odometry comes any more: it is not well for long
    world.wait(lambda: DiagnosticStatus.OK in [m.status[0].level for m in status], "all well")


def test_a_manager_of_nodes_decides_when_it_listens_and_when_it_follows(world):
    def change(transition):
        request = ChangeState.Request(transition=Transition(id=transition))
        assert world.call(ChangeState, f"{NAME}/change_state", request).success

    world.start_node(NAME, *UNGUARDED, "autostart:=false", "odometry_timeout:=1.0")
    response = world.call(SetBool, f"{NAME}/enable", SetBool.Request(data=True))
    assert (response.success, response.message) == (False, "unconfigured")
    assert world.node.count_subscribers("odom") == 0
    change(Transition.TRANSITION_CONFIGURE)
    loop = Loop(world)
    loop.plan()
    loop.is_safe()
    change(Transition.TRANSITION_ACTIVATE)
    loop.follows()
    change(Transition.TRANSITION_DEACTIVATE)
    loop.is_safe()
    change(Transition.TRANSITION_CLEANUP)
    world.wait(lambda: world.node.count_subscribers("odom") == 0, "silence")
    change(Transition.TRANSITION_CONFIGURE)
    world.wait(loop.odometry.get_subscription_count, "subscriber again")
    assert world.call(SetBool, f"{NAME}/enable", SetBool.Request(data=True)).success
    loop.plan()
    loop.follows()
    change(Transition.TRANSITION_ACTIVE_SHUTDOWN)
    assert world.end(NAME) == 0


def test_a_reference_without_accelerations_is_refused_and_the_last_one_kept(world):
    loop = Loop(world, "odometry_timeout:=1.0")
    loop.plan()
    loop.follows()
    points = [reference_point(CIRCLE.at(time), time) for time in (0.0, 1.0)]
    message = writing.reference(points, loop.begin, "odom", "base_link")
    message.points[1].accelerations = []
    loop.reference.publish(message)
    world.wait(lambda: "point 2 must have one" in world.log(NAME), "warning")
    loop.follows()


def set_parameter(world, name, value):
    if isinstance(value, int):
        value = ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=value)
    else:
        value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value)
    request = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
    return world.call(SetParameters, f"{NAME}/set_parameters", request).results[0]


def test_a_reference_that_moves_sideways_is_refused_with_numbers_and_the_last_one_kept(world):
    loop = Loop(world)
    loop.plan()
    loop.follows()
    point = CIRCLE.at(1.0)
    points = [reference_point(CIRCLE.at(time), time) for time in (0.0, 1.0, 2.0)]
    turned = replace(point, pose=point.pose + np.array([0.0, 0.0, 1.0]))
    points[1] = reference_point(turned, 1.0)
    loop.reference.publish(writing.reference(points, loop.begin, "odom", "base_link"))
    world.wait(lambda: "reference: refused" in world.log(NAME), "word of the refusal")
    assert "point 2 moves sideways" in world.log(NAME)
    assert "57.3° off its heading" in world.log(NAME)
    loop.follows()


def test_gains_change_while_running_but_not_geometry_and_not_beyond_bounds(world):
    world.start_node(NAME)
    assert set_parameter(world, "guidance.frequency", 20.0).successful
    assert set_parameter(world, "guidance.frequency", 20).successful
    refused = set_parameter(world, "guidance.frequency", -1.0)
    assert not refused.successful
    assert "frequency" in refused.reason
    assert not set_parameter(world, "wheel_radius", 0.05).successful
    assert set_parameter(world, "suction_pressure", 8.0).successful
    assert "suction_pressure=8 [Pa] is hardly meant" in world.log(NAME)


def test_the_torques_answer_the_odometry_and_effort_commands_say_the_same(world):
    patient = "odometry_timeout:=10.0"
    loop = Loop(world, "effort_commands:=true", "effort_order:=right_left", patient)
    efforts = world.listen(Float64MultiArray, "effort_controller/commands")
    loop.plan()
    loop.follows()
    world.wait(lambda: efforts, "effort commands")
    stamps = {reading.nanoseconds(m.header.stamp): m for m in loop.torques}
    told = loop.tell()
    assert told not in stamps

    def answers():
        return [m for m in loop.torques if reading.nanoseconds(m.header.stamp) == told]

    answer = world.wait(answers, "answer")[0]
    left, right = answer.effort
    assert list(answer.name) == ["left_wheel_joint", "right_wheel_joint"]
    assert not answer.position
    world.wait(lambda: any(list(m.data) == [right, left] for m in efforts), "the same torques")


def test_the_speeds_beside_the_torques_are_on_cmd_vel_as_well_if_that_is_on(world):
    radius, half_track = 0.05, 0.2
    loop = Loop(
        world,
        *("publish_cmd_vel:=true", "motors:=velocity"),
        *(f"wheel_radius:={radius}", f"half_track:={half_track}"),
    )
    twists = world.listen(TwistStamped, "cmd_vel")
    loop.plan()

    def rates(twist):
        v, omega = twist.twist.linear.x, twist.twist.angular.z
        return [(v - half_track * omega) / radius, (v + half_track * omega) / radius]

    def both():
        """Answers with speeds that have come on both topics; one stamp may have a second answer."""
        loop.tell()
        come = [(m.header.stamp, pytest.approx(rates(m), rel=1e-12, abs=1e-12)) for m in twists]
        answers = (m for m in loop.torques if any(m.velocity))
        return [m for m in answers if (m.header.stamp, list(m.velocity)) in come]

    answer = world.wait(both, "the same speeds on both topics")[0]
    assert {m.header.frame_id for m in twists} == {"base_link"}
    assert any(answer.effort)


def test_the_safe_output_has_no_speeds(world):
    loop = Loop(world, "motors:=velocity")
    loop.plan()
    loop.follows()
    loop.until(
        lambda effort: not any(effort),
        "safe output",
        spoil=lambda m: setattr(m, "child_frame_id", ""),
    )
    safe = [m for m in loop.torques if not any(m.effort)]
    assert all(list(m.velocity) == [0.0, 0.0] for m in safe)


def test_a_second_climber_keeps_to_its_namespace(world):
    world.start(NAME, "--ros-args", "-r", "__ns:=/second")
    wanted = {"/second/odom", "/second/reference", f"/second/{NAME}/tracking_error"}

    def names():
        return {name for name, _ in world.node.get_topic_names_and_types()}

    world.wait(lambda: wanted <= names(), "topics of the namespace")
    assert not names() & {"/odom", "/reference", "/wheel_torques"}


def test_what_the_model_does_not_expect_is_published(world):
    loop = Loop(world, "odometry_timeout:=1.0")
    disturbances = world.listen(WrenchStamped, f"{NAME}/disturbance")
    loop.plan()
    # this robot goes its way whatever the torques are
    loop.until(lambda _: any(m.wrench.force.x for m in disturbances), "disturbance")
    assert disturbances[-1].header.frame_id == "base_link"
    assert not disturbances[-1].wrench.force.y


def test_suction_that_is_lost_stops_the_climber_and_its_margins_tell(world):
    loop = Loop(world, "odometry_timeout:=1.0", "least_pressure:=2000.0")
    margins = world.listen(Vector3Stamped, f"{NAME}/margins")
    status = world.listen(DiagnosticArray, "/diagnostics")
    pressure = world.speak(FluidPressure, "suction_pressure")
    loop.plan()
    loop.follows()
    world.wait(lambda: margins, "margins")
    assert margins[-1].vector.z == pytest.approx(0.53 * 2500 * 0.06)  # wheels' load, k P S
    before = margins[-1].vector.y
    absolute = 101325.0 - 2500.0
    pressure.publish(FluidPressure(fluid_pressure=absolute))
    refused = "must be from 0 to 12500 [Pa], a difference"
    loop.until(lambda _: f"fluid_pressure={absolute:g} {refused}" in world.log(NAME), "word of it")
    assert margins[-1].vector.z == pytest.approx(0.53 * 2500 * 0.06)
    pressure.publish(FluidPressure(fluid_pressure=2100.0))
    loop.until(lambda _: margins[-1].vector.z < 70, "less load on the wheels")
    assert margins[-1].vector.y == pytest.approx(before * 2100 / 2500)
    assert margins[-1].vector.x > 0
    pressure.publish(FluidPressure(fluid_pressure=1999.0))
    loop.is_safe()
    world.wait(lambda: "safe output: suction pressure too low" in world.log(NAME), "word of it")
    world.wait(
        lambda: any(s.level == DiagnosticStatus.ERROR for m in status[-2:] for s in m.status),
        "error",
    )
    pressure.publish(FluidPressure(fluid_pressure=2500.0))
    loop.follows()


def test_wheels_that_stand_while_odometry_goes_are_told_and_stop_it(world):
    loop = Loop(world, "odometry_timeout:=1.0", "guard.encoder_distance:=0.01")
    joints, names = (
        world.speak(JointState, "joint_states"),
        ["left_wheel_joint", "right_wheel_joint"],
    )
    loop.plan()
    loop.until(lambda _: "encoders: not heard" in world.log(NAME), "word of it")
    joints.publish(JointState(name=names, position=[1.0]))
    world.wait(lambda: "joint_states: refused (1 positions of 2" in world.log(NAME), "a refusal")

    def is_told():
        joints.publish(JointState(name=names, position=[1.0, 2.0]))
        loop.tell()
        return "the wheels turn otherwise than odometry says (the " in world.log(NAME)

    world.wait(is_told, "word of it")
    loop.is_safe()


def test_an_emergency_stop_lasts_until_it_is_enabled_and_a_low_battery_stops_it(world):
    stops = ["stops.emergency_stop:=true", "stops.least_charge:=0.2"]
    loop = Loop(world, "odometry_timeout:=1.0", *stops)
    button = world.speak(Bool, "emergency_stop")
    battery = world.speak(BatteryState, "battery_state")
    enable = SetBool.Request(data=True)
    loop.plan()
    loop.follows()
    button.publish(Bool(data=True))
    loop.is_safe()
    world.wait(lambda: "safe output: emergency stop (pressed)" in world.log(NAME), "word of it")
    speakers = button, battery, loop.odometry, loop.reference
    # a button stays pressed over these
    for label, heard in (("deactivate", 1), ("cleanup", 0), ("configure", 1), ("activate", 1)):
        change = ChangeState.Request(transition=Transition(label=label))
        assert world.call(ChangeState, f"{NAME}/change_state", change).success
        world.wait(lambda n=heard: {s.get_subscription_count() for s in speakers} == {n}, label)
    loop.plan()
    seen = len(loop.torques)
    world.wait(lambda: loop.tell() and len(loop.torques) > seen + 50, "answers")
    assert not any(any(message.effort) for message in loop.torques[seen:])
    button.publish(Bool(data=False))
    battery.publish(BatteryState(percentage=87.0, voltage=24.0))
    world.wait(lambda: "battery_state: refused (percentage=87" in world.log(NAME), "a refusal")
    loop.is_safe()
    assert world.call(SetBool, f"{NAME}/enable", enable).success
    loop.follows()
    battery.publish(BatteryState(percentage=0.19, voltage=24.0))
    loop.is_safe()
    # it may have said so much that it waits with this
    loop.until(lambda _: "battery low (19% < 20%)" in world.log(NAME), "word of it")
