import re
import time
from itertools import pairwise

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import FluidPressure, JointState
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory
from world import TIMEOUT

from climber_uk.mechanics import SECOND
from climber_uk.messages import reading, writing
from climber_uk.messages.names import Names

pytestmark = pytest.mark.nodes

LEFT, RIGHT = "left_wheel_joint", "right_wheel_joint"


def torques(right, left, stamp=0):
    return writing.wheel_torques(np.array([right, left]), stamp, Names().wheels)


def stamp(message):
    return reading.nanoseconds(message.header.stamp)


def test_in_simulated_time_it_steps_once_for_each_torque_that_answers_it(world):
    world.start_node("plant_simulator", "simulated_time:=true", "initial_speed:=1.0")
    odometry, clock = world.listen(Odometry, "odom"), world.listen(Clock, "/clock")
    answers = world.speak(JointState, "wheel_torques")
    world.wait(lambda: clock, "clock to be heard")  # while time stands still it is repeated
    for step in range(5):
        now = 1_000_000_000 + step * 5_000_000
        world.wait(lambda now=now: odometry and stamp(odometry[-1]) == now, f"odometry {step}")
        answers.publish(torques(1.0, 1.0, now - 5_000_000))  # an old one: no step for it
        answers.publish(torques(1.0, 1.2, now))
    states = {stamp(m): m for m in odometry}
    assert len(states) >= 5
    told = {max(states), *(time for time in states if time % 10_000_000 == 0)}
    world.wait(lambda: {reading.nanoseconds(m.clock) for m in clock} >= told, "clock")
    wrenched = states[1_000_000_000 + 4 * 5_000_000]
    # (τR - τL) d / (r J) for 20 ms
    turning = -0.2 * 0.3 / 0.027 / 0.33
    assert wrenched.twist.twist.angular.z == pytest.approx(turning * 0.02, rel=1e-9)


def test_a_board_that_takes_speeds_reads_those_of_the_command(world):
    motors = "motors:=velocity", "servo_time_constant:=0.0", "velocity_resolution:=0.027"
    world.start_node("plant_simulator", "simulated_time:=true", "inclination:=0.0", *motors)
    odometry = world.listen(Odometry, "odom")
    answers = world.speak(JointState, "wheel_torques")

    def twist_after(step, command):
        now = 1_000_000_000 + step * 5_000_000
        world.wait(lambda: odometry and stamp(odometry[-1]) == now, f"odometry {step}")
        command.header.stamp = writing.time(now)
        answers.publish(command)
        world.wait(lambda: stamp(odometry[-1]) > now, f"odometry after {step}")
        return odometry[-1].twist.twist

    for step in range(20):
        command = JointState(name=[RIGHT, LEFT], velocity=[4.4, 1.6], effort=[-9.0, -9.0])
        twist = twist_after(step, command)
    assert twist.linear.x == pytest.approx(0.027 * (4 + 2) / 2, abs=1e-6)
    assert twist.angular.z == pytest.approx(0.027 * (4 - 2) / 0.6, abs=1e-6)
    for step in range(20, 60):
        twist = twist_after(step, torques(3.0, 3.0))  # which has no speeds
    assert twist.linear.x == pytest.approx(0.0, abs=1e-6)
    said = "refused, standstill instead (0 velocities must be 2)"
    world.wait(lambda: said in world.log("plant_simulator"), "what is wrong")


def test_in_simulated_time_a_start_in_motion_waits_while_time_goes_on(world):
    """A planner with a start delay needs the time; without it nobody would ever begin."""
    world.start_node("plant_simulator", "simulated_time:=true", "initial_speed:=1.0")
    odometry = world.listen(Odometry, "odom")
    answers = world.speak(JointState, "wheel_torques")
    for step, torque in enumerate([0.0, 0.0, 0.0, 1.0, 1.0]):
        now = 1_000_000_000 + step * 5_000_000
        world.wait(lambda now=now: odometry and stamp(odometry[-1]) == now, f"odometry {step}")
        answers.publish(torques(torque, torque, now))
    places = {stamp(m): m.pose.pose.position.x for m in odometry}
    assert places[1_015_000_000] == 0.0 < places[1_020_000_000]


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


def send_until_it_acts(world, commands, joints, torque):
    """Again and again: a slow machine may take longer to hear of it than it is valid."""

    def acts():
        commands.publish(torques(torque, torque))
        return joints and joints[-1].effort[0] == torque

    world.wait(acts, "torque to act")


@pytest.mark.parametrize(
    ("kind", "said"),
    [("nan", "must be finite"), ("names", "names ['left', 'right']"), ("length", "1 efforts")],
)
def test_a_bad_torque_is_dropped_with_one_warning(world, kind, said):
    world.start_node("plant_simulator", "inclination:=0.0", "command_timeout:=5.0")
    joints = world.listen(JointState, "joint_states")
    commands = world.speak(JointState, "wheel_torques")
    send_until_it_acts(world, commands, joints, 5.0)
    for _ in range(3):
        commands.publish(bad(kind))
    world.wait(lambda: joints[-1].effort[0] == 0.0, "zero torque in its place")
    send_until_it_acts(world, commands, joints, 5.0)
    log = world.log("plant_simulator")
    assert log.count(said) == 1
    assert log.count("wheel_torques: ok again") == 1


def test_a_stale_torque_acts_no_more_and_a_new_one_does(world):
    world.start_node("plant_simulator", "inclination:=0.0", "command_timeout:=1.0")
    joints = world.listen(JointState, "joint_states")
    commands = world.speak(JointState, "wheel_torques")

    for _ in range(2):
        send_until_it_acts(world, commands, joints, 2.0)
        world.wait(lambda: joints[-1].effort[0] == 0.0, "torque to become stale")
    said = re.findall("torque command: (stale|ok again)", world.log("plant_simulator"))
    assert said[0] == said[-1] == "stale"
    assert len(said) >= 3
    assert all(one != other for one, other in pairwise(said))  # each change once


def test_torques_beyond_the_limit_are_cut(world):
    patient = "command_timeout:=5.0"
    world.start_node("plant_simulator", "inclination:=0.0", "max_wheel_torque:=3.0", patient)
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

    def has_moved():
        commands.publish(torques(5.0, 5.0))  # one may be stale when a slow machine heeds it
        return odometry and odometry[-1].pose.pose.position.x > 2.001

    world.wait(has_moved, "motion")
    world.wait(lambda: not any(m.twist.twist.linear.x for m in odometry[-9:]), "rest")
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


class Answering:
    """Answers every odometry once, with torques that are a function of its stamp."""

    def __init__(self, world, namespace="", torque=lambda time: 0.0):
        self.world, self.states, self.torque = world, {}, torque
        self.commands = world.speak(JointState, f"{namespace}wheel_torques")
        self.heard = world.listen(Odometry, f"{namespace}odom")
        self.truth = world.listen(Odometry, f"{namespace}ground_truth")

    def answer(self):
        """Answer what is new; return how many stamps there have been."""
        for message in self.heard:
            if stamp(message) not in self.states:
                self.states[stamp(message)] = message
                torque = self.torque(stamp(message) * 1e-9 - 1.0)
                self.commands.publish(torques(torque, 0.9 * torque, stamp(message)))
        self.heard.clear()
        return len(self.states)

    def answer_all(self):
        """The same, with what is on its way; looks are counted, as a slow machine has few."""
        for _ in range(15):
            self.world.spin(0.02)
            self.answer()
        return len(self.states)

    def places(self):
        return [(s, m.pose.pose.position.x, m.twist.twist.linear.x) for s, m in self.states.items()]


def test_the_pace_of_time_does_not_change_the_trajectory(world):
    factors, periods, runs = (0.5, 1.0, 0.0), 100, []
    for number, factor in enumerate(factors):
        world.start(
            "plant_simulator",
            *("--ros-args", "-r", f"__ns:=/n{number}", "-p", "simulated_time:=true"),
            *("-p", "inclination:=30.0", "-p", f"real_time_factor:={factor}"),
        )
        world.processes[f"plant_{number}"] = world.processes.pop("plant_simulator")
        runs.append(Answering(world, f"n{number}/", lambda t: 3.0 * np.sin(5 * t)))
    begun = [0.0] * len(factors)
    took = [0.0] * len(factors)

    def all_done():
        for number, one in enumerate(runs):
            count = one.answer()
            if count and not begun[number]:
                begun[number] = time.monotonic()
            if count > periods and not took[number]:
                took[number] = time.monotonic() - begun[number]
        return all(took)

    world.wait(all_done, "all to have gone half a second")
    first, *others = (one.places()[: periods + 1] for one in runs)
    assert len({speed for _, _, speed in first}) > periods / 2
    for other in others:
        assert other == first
    for factor, passed in zip(factors[:2], took[:2], strict=True):
        assert passed > 0.8 * periods * 0.005 / factor


def test_paused_it_goes_on_step_by_step_and_only_when_asked(world):
    world.start_node("plant_simulator", "simulated_time:=true", "inclination:=0.0")
    answering = Answering(world)
    world.wait(lambda: answering.answer() > 3, "motion")
    assert world.call(SetBool, "plant_simulator/pause", SetBool.Request(data=True)).success
    answering.answer_all()
    for _ in range(2):
        before = answering.answer()
        assert world.call(Trigger, "plant_simulator/step", Trigger.Request()).success
        world.wait(lambda before=before: answering.answer() > before, "one step")
        assert answering.answer_all() == before + 1
    assert world.call(SetBool, "plant_simulator/pause", SetBool.Request(data=False)).success
    world.wait(lambda: answering.answer() > before + 20, "going on")
    refused = world.call(Trigger, "plant_simulator/step", Trigger.Request())
    assert (refused.success, refused.message) == (False, "not paused")


def test_on_the_wall_clock_a_pause_is_left_out(world):
    world.start_node("plant_simulator", "inclination:=0.0", "initial_x:=2.0")
    odometry = world.listen(Odometry, "odom")
    world.wait(lambda: len(odometry) > 5, "odometry")

    def is_behind_after_a_pause():
        world.call(SetBool, "plant_simulator/pause", SetBool.Request(data=True))
        until, before = time.monotonic() + 1.2, world.log("plant_simulator")
        world.wait(lambda: time.monotonic() > until, "time to pass")
        seen = len(odometry)
        world.call(SetBool, "plant_simulator/pause", SetBool.Request(data=False))
        world.wait(lambda: len(odometry) > seen + 50, "odometry again")
        return "s behind" in world.log("plant_simulator").removeprefix(before)

    # a slow machine may be behind after one, but not after each of them
    assert not all(is_behind_after_a_pause() for _ in range(5))
    gaps = np.diff([stamp(m) for m in odometry])
    assert gaps.max() > 1_000_000_000  # the pause, of which nothing was told
    assert (gaps > 0).all()


def pushed(frame, x, at):
    message = WrenchStamped()
    message.header.frame_id = frame
    message.header.stamp = writing.time(at)
    message.wrench.force.x = x
    return message


@pytest.mark.parametrize(("frame", "direction"), [("odom", 0.0), ("base_link", -1.0)])
def test_a_push_acts_in_its_frame_from_its_stamp_until_it_is_too_old(world, frame, direction):
    # rolling down the wall would need 56.4 N more; heading is -y, so x of the wall is sideways
    world.start_node(
        "plant_simulator",
        *("simulated_time:=true", "suction_area:=0.06", "push_timeout:=0.1"),
        "initial_heading:=-1.5707963267948966",
    )
    answering = Answering(world)
    pushes = world.speak(WrenchStamped, "push")
    begin = 1_200_000_000
    pushes.publish(pushed("map", 1000.0, begin))
    pushes.publish(pushed(frame, 107.35, begin))  # 100 N more than friction leaves of the weight
    world.wait(lambda: "push: ok again" in world.log("plant_simulator"), "the push")
    world.wait(lambda: answering.answer() > 61, "0.3 s")
    speed = {s: m.twist.twist.linear.x for s, m in answering.states.items()}
    assert not any(v for s, v in speed.items() if s <= begin)
    assert speed[begin + 100_000_000] == pytest.approx(-2.0 * direction, abs=1e-9)
    assert "frame_id='map' must be 'odom' or 'base_link'" in world.log("plant_simulator")


def levels(diagnostics, name):
    return [s.level for m in diagnostics for s in m.status if s.name.endswith(name)]


def test_suction_lost_it_slides_then_falls_says_so_and_reset_revives_it(world):
    world.start_node(
        "plant_simulator",
        *("simulated_time:=true", "initial_heading:=1.5", "suction.pump_time:=0.2"),
        *("pressure_loss_time:=0.1", "pressure_loss_level:=0.0"),
    )
    answering = Answering(world)
    diagnostics = world.listen(DiagnosticArray, "/diagnostics")

    def fallen():
        answering.answer()
        return "fell off: tip margin" in world.log("plant_simulator")

    world.wait(fallen, "the fall")
    answering.answer()
    speeds = [m.twist.twist.linear.x for m in answering.states.values()]
    assert not any(speeds[:20])  # until 0.1 s
    assert speeds[-1] < -0.5
    # P S l/2 = m g h at 327 Pa, of 2500 Pa
    fell_at = max(answering.states) * 1e-9 - 1.0
    assert fell_at == pytest.approx(0.1 + 0.2 * np.log(2500 / 327), abs=0.006)
    error = DiagnosticStatus.ERROR
    world.wait(lambda: error in levels(diagnostics, "plant_simulator"), "the error")
    last, until = max(answering.states), time.monotonic() + 0.5
    world.wait(lambda: time.monotonic() > until, "silence")
    assert all(stamp(m) <= last for m in answering.heard)
    assert world.call(Trigger, "plant_simulator/reset", Trigger.Request()).success
    world.wait(lambda: answering.answer() and max(answering.states) > last, "odometry")
    assert answering.states[max(answering.states)].pose.pose.position.y == 0.0
    assert "climber: ok again" in world.log("plant_simulator")


def test_the_pump_follows_a_setpoint_until_that_is_stale_and_never_above_its_full_pressure(world):
    world.start_node(
        "plant_simulator",
        *("simulated_time:=true", "suction.pump_time:=0.02", "setpoint_timeout:=0.2"),
    )
    answering = Answering(world)
    told = world.listen(FluidPressure, "suction_pressure")
    setpoint = world.speak(FluidPressure, "suction_setpoint")

    def comes_to(pressure):
        def is_there():
            answering.answer()
            return told and abs(told[-1].fluid_pressure - pressure) < 1.0

        world.wait(is_there, f"{pressure} Pa")

    for number in (-1.0, float("nan")):
        setpoint.publish(FluidPressure(fluid_pressure=number))
    world.wait(lambda: "must be from 0" in world.log("plant_simulator"), "the refusal")
    for number in (2400.0, 9000.0, 2450.0):
        setpoint.publish(FluidPressure(fluid_pressure=number))
        comes_to(min(number, 2500.0))
    comes_to(2500.0)
    assert "suction setpoint: stale; full pressure instead" in world.log("plant_simulator")
    assert max(message.fluid_pressure for message in told) <= 2500.0


def test_the_lowest_margins_are_told_20_times_a_second_and_alarm_in_diagnostics(world):
    world.start_node("plant_simulator", "simulated_time:=true")
    margins = world.listen(Vector3Stamped, "plant_simulator/margins")
    diagnostics = world.listen(DiagnosticArray, "/diagnostics")
    world.wait(lambda: DiagnosticStatus.WARN in levels(diagnostics, ": margins"), "a warning")
    answering = Answering(world, torque=lambda t: 0.0 if t < 0.1 else 1.5)
    world.wait(lambda: answering.answer() > 40, "0.2 s")
    world.wait(lambda: any(stamp(m) == 1_200_000_000 for m in margins), "margins")
    by_stamp = {stamp(m): m.vector for m in margins}
    assert all(number % 50_000_000 == 0 for number in by_stamp)
    rest, driving = by_stamp[1_050_000_000], by_stamp[1_150_000_000]
    # 0.8 · 79.5 N against 49.05 N sideways, then against 105.6 N along as well
    assert (rest.x, rest.z) == pytest.approx((0.8 * 79.5 / 49.05, 79.5))
    assert driving.x < 0.8 * 79.5 / 105.5
    assert rest.y == pytest.approx(150 * 0.125 / (49.05 * 0.05))
    world.wait(lambda: DiagnosticStatus.ERROR in levels(diagnostics, ": margins"), "an error")


def test_late_noisy_odometry_runs_in_lock_step_beside_the_truth(world):
    world.start_node(
        "plant_simulator",
        *("simulated_time:=true", "inclination:=0.0", "odometry_delay:=0.01"),
        *("position_noise:=0.01", "seed:=7"),
    )
    answering = Answering(world, torque=lambda t: 2.0)
    world.wait(lambda: answering.answer() > 40 and len(answering.truth) > 40, "0.2 s")
    truth = {stamp(m): m.pose.pose.position.x for m in answering.truth}
    off = [m.pose.pose.position.x - truth.get(s, 0.0) for s, m in answering.states.items()]
    assert min(answering.states) == 990_000_000
    assert 0.004 < np.std(off) < 0.02
    assert list(truth.values())[-1] > 0.01


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        (["real_time_factor:=2.0"], "real_time_factor=2.0 needs simulated_time=True"),
        (["odometry_delay:=0.007"], "odometry_delay=0.007 must be a multiple"),
        (["wall:=cylinder", "cylinder.radius:=0.0"], "cylinder.radius=0.0 must not be 0"),
        (["friction:=dry"], "friction='dry' must be one of coulomb, viscous"),
        (["slip:=true", "wheel_inertia:=1.0"], "wheel_inertia=1.0 must be <"),
    ],
)
def test_what_cannot_be_simulated_is_refused_with_one_line(world, parameters, said):
    assert world.start_node("plant_simulator", *parameters).wait(TIMEOUT) == 1
    (line,) = world.log("plant_simulator").splitlines()
    assert said in line
    del world.processes["plant_simulator"]


def test_time_does_not_run_until_the_one_that_is_waited_for_listens_to_all(world):
    world.start_node("plant_simulator", "simulated_time:=true", "wait_for:=test")
    odometry = world.listen(Odometry, "odom")
    heard = {"joint_states": JointState, "wheel_torques": JointState}
    for topic, kind in heard.items():
        world.subscribe(kind, topic)
    stepped = world.call(SetBool, "plant_simulator/pause", SetBool.Request(data=False))
    assert "1.000 s" in stepped.message
    assert not odometry
    world.subscribe(MultiDOFJointTrajectory, "reference")
    world.wait(lambda: odometry, "first odometry")
    assert reading.nanoseconds(odometry[0].header.stamp) == SECOND
    assert "test listens" in world.log("plant_simulator")
