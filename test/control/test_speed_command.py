"""Speeds for motors that take them, and the accelerations that a servo makes of these."""

import math

import numpy as np
import pytest
from climbs import CONFIG
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.control.build import build_controller
from climber_uk.control.control_law import ControlInput, ControlLaw, ControlOptions
from climber_uk.control.guidance import Guidance
from climber_uk.control.speed_command import STANDING, MotorBoard
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import (
    NO_TORQUES,
    Motion,
    ReferencePoint,
    State,
    Torques,
    Wrench,
)
from climber_uk.parameters.parameter_file import Values, read_file

PERIOD = 0.005  # [s]
DRIVING = 0.2 * math.cos(0.3), 0.2 * math.sin(0.3), 0.1
TARGET = ReferencePoint(0.0, 0.0, 0.3, *DRIVING, *[0.0] * 5)


@st.composite
def commands(draw, limits=(0.5, 2.0, 1e3)):
    """A climber that drives forwards, a situation, and its command: often limits cut it."""
    climber = Climber(
        max_wheel_torque=draw(st.sampled_from(limits)), inclination=draw(st.floats(0.0, 180.0))
    )
    number = st.floats(-1.0, 1.0)
    x, y, turned, v, omega = (draw(number) for _ in range(5))
    motion = Motion.at(0.005 * x, 0.005 * y, 0.3 + 0.3 * turned, 0.2 + 0.1 * v, 0.5 * omega)
    disturbance = Wrench(20.0 * draw(number), 3.0 * draw(number))
    friction = 10.0 * draw(number)
    situation = ControlInput(motion, NO_TORQUES, disturbance, PERIOD, 0, friction)
    options = ControlOptions(solver=draw(st.sampled_from(["closed_form", "generic"])))
    return climber, situation, ControlLaw(climber, Guidance(), options).command(situation, TARGET)


def accelerations(climber, motion, torques, disturbance):
    """v̇ and ω̇ by the whole system's equation (10), of a climber that drives forwards."""
    state = State.moving(motion)
    q_2 = climber.rolling_acceleration(state, np.array(torques), 1.0)
    v_1 = q_2[0] * motion.cosine + q_2[1] * motion.sine
    return v_1 + disturbance.force / climber.mass, q_2[2] + disturbance.moment / climber.yaw_inertia


@settings(max_examples=100, deadline=None)
@given(commands(), st.floats(0.0, 0.2))
def test_a_servo_accelerates_as_the_torques_would(case, time_constant):
    """Those that act, limits included: v + T v̇ and ω + T ω̇ at the middle of the period."""
    climber, situation, command = case
    learnt = Wrench(situation.disturbance.force - situation.friction, situation.disturbance.moment)
    speeds = MotorBoard(servo_time_constant=time_constant).speeds(climber, command, learnt)
    v_1, yaw_1 = accelerations(climber, command.motion, command.wheels, learnt)
    assert speeds.speed == pytest.approx(command.motion.speed + time_constant * v_1, abs=1e-9)
    assert speeds.yaw_rate == pytest.approx(command.motion.yaw_rate + time_constant * yaw_1)


@settings(max_examples=100, deadline=None)
@given(commands(), st.floats(1e-3, 0.2))
def test_of_a_servo_the_disturbance_is_its_own(case, time_constant):
    """(v* - v) / T + r / m is the acceleration of the torques, of which r is a part, too."""
    climber, situation, command = case
    learnt = Wrench(situation.disturbance.force - situation.friction, situation.disturbance.moment)
    board = MotorBoard(motors="velocity", servo_time_constant=time_constant)
    speeds = board.speeds(climber, command, learnt)
    v_1 = (speeds.speed - command.motion.speed) / time_constant + learnt.force / climber.mass
    yaw_1 = (speeds.yaw_rate - command.motion.yaw_rate) / time_constant
    yaw_1 += learnt.moment / climber.yaw_inertia
    expected = accelerations(climber, command.motion, command.wheels, learnt)
    assert (v_1, yaw_1) == pytest.approx(expected, rel=1e-6, abs=1e-6)


@settings(max_examples=50, deadline=None)
@given(commands(limits=[1e3]), st.floats(0.002, 0.2))
def test_held_for_a_period_a_servo_ends_where_it_should(case, time_constant):
    """(T + h/2)(1 - exp(-h/T)) is h to the second order."""
    climber, _, command = case
    board = MotorBoard(motors="velocity", servo_time_constant=time_constant)
    told = board.speeds(climber, command, Wrench(0.0, 0.0)).speed
    middle = command.motion.speed
    asked = (told - middle) / time_constant
    begin = middle - asked * PERIOD / 2
    end = told + (begin - told) * math.exp(-PERIOD / time_constant)
    most = PERIOD**3 / 12 / time_constant**2 * abs(asked)
    assert end == pytest.approx(begin + asked * PERIOD, abs=most + 1e-12)


def test_by_hand_on_the_floor():
    climber = Climber(mass=5.0, yaw_inertia=0.5, inclination=0.0, suction_pressure=0.0)
    motion = Motion.at(0.0, 0.0, 0.0, 0.2, 0.4)
    law = ControlLaw(climber, Guidance(), ControlOptions(predict=False))
    command = law.command(ControlInput(motion, NO_TORQUES, Wrench(0.0, 0.0), PERIOD), TARGET)
    command = command._replace(
        demanded=Wrench(5.0, 1.0), lost=Wrench(2.5, 0.5), forward=1.0, wheels=Torques(0.0, 0.0)
    )
    board = MotorBoard(motors="velocity", servo_time_constant=0.1)
    # 1 m/s² asked for, 0.5 lost; 10 N of disturbance that the servo has to make up for: 2 m/s²
    v, omega = board.speeds(climber, command, Wrench(-10.0, 0.25))
    assert v == pytest.approx(0.2 + 0.1 * (1.0 - 0.5 + 2.0))
    assert omega == pytest.approx(0.4 + 0.1 * (1.0 - 0.5) / 0.5)
    v, omega = MotorBoard(servo_time_constant=0.1).speeds(climber, command, Wrench(-10.0, 0.25))
    assert v == pytest.approx(0.2 + 0.1 * (1.0 - 0.5))
    assert omega == pytest.approx(0.4 + 0.1 * (1.0 - 0.5 + 0.25) / 0.5)


@pytest.mark.parametrize("motors", ["torque", "velocity"])
@pytest.mark.parametrize("safe_output", ["hold", "zero"])
def test_the_safe_output_of_motors_that_take_speeds_is_to_stand(motors, safe_output):
    given = {**read_file(CONFIG, "/uk_torque_controller"), "motors": motors}
    controller = build_controller(Values({**given, "safe_output": safe_output}), None)
    controller.enable(False)
    answer = controller.on_odometry(SECOND, SECOND, Motion.at(0.0, 3.0, 0.8, 0.2, 0.1))
    assert answer.speeds == STANDING
