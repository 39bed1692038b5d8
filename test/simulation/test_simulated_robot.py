from dataclasses import replace

import numpy as np
import pytest

from climber_uk.mechanics.adhesion import Suction
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.inputs import FellOff
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import Parts, Physics, Push, SimulatedRobot

BUILT = Climber(
    seal_friction_coefficient=0.6,
    wheel_load_share=0.8,
    suction_pressure=8000.0,
    max_wheel_torque=4.0,
)
UPRIGHT = State(np.array([0.0, 3.0, np.pi / 2]), np.zeros(3))
STEP = 0.0025


CONTACT, PHYSICS, MOTORS = Contact(), Physics(), Motors()


def robot(contact=CONTACT, physics=PHYSICS, motors=MOTORS, start=UPRIGHT, **options):
    plant = Plant(BUILT, STEP, contact, **options)
    return SimulatedRobot(Parts(plant, motors, Sensors(), physics), start, 0.005)


def run(robot, time, push=None):
    for _ in range(round(time / STEP)):
        robot.advance(np.zeros(2), *([push] if push else []))


def test_by_default_it_is_the_plant():
    one, state = robot(), State.rolling(np.array([0.0, 3.0, 0.7]), 0.2, 0.1)
    one.state = state
    for number in range(200):
        torques = np.array([1.0, 0.9]) * np.cos(number / 10)
        one.advance(torques)
        state = Plant(BUILT, STEP).advance(state, torques, 1)
    np.testing.assert_array_equal(one.state.pose, state.pose)


def test_suction_lost_at_5_s_lets_it_slide_where_friction_ends_and_fall_where_it_tips():
    # f = 0.2 · 0.6 · 0.06 P holds 49.05 N down to 6812.5 Pa; P S l/2 = m g h at 327 Pa
    losing = Contact(adhesion=Suction(pump_time=1.0))
    one = robot(losing, Physics(pressure_loss_time=5.0))
    run(one, 5.0)
    assert one.pressure == 8000.0
    assert not one.state.velocity.any()
    slides = falls = None
    while falls is None:
        try:
            one.advance(np.zeros(2))
        except FellOff as fall:
            falls, what = one.time, fall.what
        if slides is None and one.state.velocity.any():
            slides = one.time
    assert what == "tip margin"
    assert slides == pytest.approx(5 + np.log(8000 / 6812.5), abs=2 * STEP)
    assert falls == pytest.approx(5 + np.log(8000 / 327), abs=2 * STEP)
    assert one.state.pose[1] < 3.0


def test_where_pump_and_leak_balance_the_pressure_stays():
    one = robot(Contact(adhesion=Suction(pump_time=0.5, leak_time=2.0)))
    run(one, 0.1)
    assert one.pressure == pytest.approx(6400.0, rel=1e-12)


def test_after_a_fall_its_state_is_the_last_one_on_the_wall():
    one = robot(physics=Physics(pressure_loss_time=0.01))
    run(one, 0.01)
    before = one.state
    with pytest.raises(FellOff):
        one.advance(np.zeros(2))
    assert one.state is before
    assert one.time == 0.01


def test_changed_parts_are_taken_up():
    one = robot()
    plant = one.parts.plant
    weak = replace(plant, climber=replace(plant.climber, suction_pressure=2000.0))
    one.take(one.parts._replace(plant=weak))
    run(one, 0.1)
    assert one.pressure == 2000.0
    assert one.state.velocity[1] < 0


def test_a_push_turns_with_the_climber_if_it_is_told_so():
    one = robot(contact=Contact(), start=State(np.array([0.0, 3.0, np.pi / 2]), np.zeros(3)))
    wrench = np.array([200.0, 0.0, 0.0])
    np.testing.assert_allclose(Push(wrench, in_body=True).on(one.state), [0, 200, 0], atol=1e-12)
    run(one, 0.5, Push(wrench, in_body=True))
    upwards = (200 - 49.05 - BUILT.seal_friction) / 5
    assert one.state.velocity[1] == pytest.approx(upwards * 0.5, rel=1e-9)


def test_margins_are_those_of_the_torques_that_act():
    one = robot(motors=Motors(torque_lag=0.01))
    one.advance(np.array([1.0, 1.0]))
    drive = 2 / 0.027 * (1 - np.exp(-0.25))
    slip, tip = one.margins()
    assert slip == pytest.approx(0.8 * 384 / drive)  # 384 N on the wheels
    assert tip == pytest.approx(480 * 0.125 / (49.05 * 0.05))
