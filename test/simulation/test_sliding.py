from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from climber_uk.mechanics.adhesion import Grip, Magnetic, NoAdhesion
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact, FourWheeled, Tracked, Wheeled
from climber_uk.mechanics.friction import FRICTION
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.wall import Plane
from climber_uk.simulation.inputs import NO_PUSH, Inputs, PlantState
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.rigid_body import RigidBody
from climber_uk.simulation.sliding import ContactStepper

PAPER = Climber()
FLOOR = replace(PAPER, inclination=0.0)
ON_WEIGHT = Contact(adhesion=NoAdhesion())
RIM = 2e-5 / 0.027**2  # [kg] of each wheel
TRACTION = 0.8 * 49.05  # [N]


def kinetic(climber, state):
    """Energy of a body and two rims that move on their own."""
    d, v = climber.half_track, state.forward_speed
    rims = state.slip + v + d * state.yaw_rate * np.array([1, -1])
    body = (climber.mass - 2 * RIM) * (state.velocity[:2] @ state.velocity[:2])
    turning = (climber.yaw_inertia - 2 * RIM * d**2) * state.yaw_rate**2
    return (body + turning + RIM * (rims @ rims)) / 2


def test_wheels_that_spin_pull_with_their_friction_and_no_more():
    plant = Plant(FLOOR, 0.0025, ON_WEIGHT, slip=True)
    torques = np.array([2.0, 2.0])  # 148 N > 39 N
    end = plant.advance(State(np.zeros(3), np.zeros(3)), torques, steps=200)
    assert end.forward_speed == pytest.approx(0.5 * TRACTION / (5 - 2 * RIM), rel=1e-9)
    spin = 0.5 * (2.0 / 0.027 - TRACTION / 2) / RIM - end.forward_speed
    np.testing.assert_allclose(end.slip, spin, rtol=1e-9)
    assert plant.wheel_rates(end) * 0.027 == pytest.approx(end.forward_speed + end.slip)


def test_wheels_pushed_sideways_slide_as_far_as_their_friction_lets_them():
    # 30 N to the left, to 39.24 N of traction: held; 60 N: (60 - 39.24) N for 1 s
    plant, start = Plant(FLOOR, 0.0025, ON_WEIGHT, slip=True), State(np.zeros(3), np.zeros(3))
    held = plant.advance(start, np.zeros(2), 400, np.array([0.0, 30.0, 0.0]))
    assert not held.velocity.any()
    end = plant.advance(start, np.zeros(2), 400, np.array([0.0, 60.0, 0.0]))
    expected = (60 - TRACTION) / (5 - 2 * RIM)
    assert end.side_slip == pytest.approx(expected, rel=1e-9)
    assert end.pose[1] == pytest.approx(expected / 2, rel=1e-3)  # first order in the step


def test_wheels_that_slid_are_caught_again_and_roll_on():
    plant = Plant(FLOOR, 0.0025, ON_WEIGHT, slip=True)
    start = State(np.zeros(3), np.array([1.0, 0.5, 0.0]))
    end = plant.advance(start, np.zeros(2), steps=200)
    assert not end.slip.any()
    assert end.side_slip == pytest.approx(0, abs=1e-15)
    # slid sideways for 0.5 m/s over 7.8 m/s², and rolled on without loss
    assert end.forward_speed == pytest.approx(1.0, rel=1e-9)
    assert end.pose[1] == pytest.approx(0.5**2 / 2 / (TRACTION / (5 - 2 * RIM)), rel=0.01)


def test_a_climber_without_traction_slides_down_sideways_and_a_dry_one_does_not():
    wet, dry = Grip(wheel_friction_coefficient=0.1), Grip(wheel_friction_coefficient=0.8)
    weak = replace(PAPER, suction_pressure=1500.0)  # 33.84 N of the seal < 49.05 N
    start = State(np.zeros(3), np.zeros(3))
    kept = Plant(weak, 0.0025, Contact(grip=dry), slip=True).advance(start, np.zeros(2), 400)
    assert not kept.velocity.any()
    slid = Plant(weak, 0.0025, Contact(grip=wet), slip=True).advance(start, np.zeros(2), 400)
    pull = 49.05 - 33.84 - 0.1 * 0.53 * 90
    assert slid.velocity[1] == pytest.approx(-pull / (5 - 2 * RIM), rel=1e-6)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(["coulomb", "viscous", "stribeck"]),
    st.sampled_from([0.0, 0.1]),
    st.sampled_from([Wheeled(), FourWheeled(), Tracked()]),
)
def test_a_part_of_a_step_takes_no_more_energy_than_the_motors_give(seed, law, radius, locomotion):
    random = np.random.default_rng(seed)
    grip = Grip(random.uniform(0, 1), seal_radius=radius)
    contact = Contact(friction=FRICTION[law](), locomotion=locomotion, grip=grip)
    sliding = ContactStepper(RigidBody(PAPER, contact, Plane(), 0.0025), slip=True)
    y = np.concatenate([random.normal(size=6), np.zeros(3)])
    slip, torques, h = random.normal(size=2) * 3, random.normal(size=2), 0.0025
    given = Inputs.of(PAPER, torques, NO_PUSH)
    end, slipping, _ = sliding._implicit_step(y, slip, given, load=79.5, h=h)
    before = PlantState(y[:3], y[3:6], y[6:], slip)
    after = PlantState(end[:3], end[3:6], end[6:], slipping)
    d = PAPER.half_track * after.yaw_rate * np.array([1, -1])
    work = h * (torques / 0.027) @ (after.slip + after.forward_speed + d)
    gained = kinetic(PAPER, after) - kinetic(PAPER, before) + 49.05 * (end[1] - y[1])
    assert gained <= work + 1e-11


@pytest.mark.parametrize("seed", range(5))
def test_coasting_energy_never_grows_from_slip_to_roll_to_rest(seed):
    random = np.random.default_rng(seed)
    plant = Plant(FLOOR, 0.0025, Contact(adhesion=Magnetic(30.0)), slip=True)
    state = PlantState(np.zeros(3), random.normal(size=3), np.zeros(3), random.normal(size=2) * 5)
    was = kinetic(FLOOR, state)
    for _ in range(300):
        state = plant.advance(state, np.zeros(2), steps=1)
        now = kinetic(FLOOR, state)
        assert now <= was * (1 + 1e-9)
        was = now
    assert not state.slip.any()
    assert abs(state.side_slip) < 1e-12


def test_tracks_stop_a_turn_where_their_scrubbing_says():
    # 0.5 · 49.05 N · 0.3 m / 4 = 1.839 N m on 0.33 kg m² from 1 rad/s
    contact = Contact(adhesion=NoAdhesion(), locomotion=Tracked())
    plant = Plant(FLOOR, 0.0025, contact)
    end = plant.advance(State.rolling(np.zeros(3), 0.0, 1.0), np.zeros(2), steps=200)
    assert end.yaw_rate == 0
    expected = 0.33 / (2 * 0.5 * 49.05 * 0.3 / 4)
    assert end.pose[2] == pytest.approx(expected, rel=1e-3)  # the last step is of first order


def test_tracks_do_not_turn_until_the_torques_beat_their_scrubbing():
    contact = Contact(adhesion=NoAdhesion(), locomotion=Tracked())
    plant, start = Plant(FLOOR, 0.0025, contact), State(np.zeros(3), np.zeros(3))
    resistance = 0.5 * 49.05 * 0.3 / 4
    for part, turns in ((0.999, False), (1.001, True)):
        torques = FLOOR.wheel_torques(0.0, part * resistance)
        end = plant.advance(start, torques, steps=400)
        expected = (part - 1) * resistance / 0.33 if turns else 0.0
        assert end.yaw_rate == pytest.approx(expected, rel=1e-9)


def test_a_ring_that_turns_alone_is_stopped_by_its_radius_times_its_friction():
    # 56.4 N · 0.1 m on 0.33 kg m²
    plant = Plant(FLOOR, 0.001, Contact(grip=Grip(seal_radius=0.1)))
    end = plant.advance(State.rolling(np.zeros(3), 0.0, 1.0), np.zeros(2), steps=20)
    assert end.yaw_rate == pytest.approx(1 - 0.02 * 5.64 / 0.33, rel=1e-9)
    assert plant.advance(end, np.zeros(2), steps=100).yaw_rate == 0


def test_the_rings_ellipse_is_near_the_integral_over_a_ring():
    body = RigidBody(PAPER, Contact(grip=Grip(seal_radius=0.1)), Plane(), 0.001)
    for v, rim in ((1.0, 0.0), (0.0, 1.0), (1.0, 1e-6), (1.0, 0.3), (1.0, 1.0), (0.3, 1.0)):

        def force(a, v=v, rim=rim):
            x, y = v - rim * np.sin(a), rim * np.cos(a)
            return x / np.hypot(x, y)

        def moment(a, v=v, rim=rim):
            x, y = v - rim * np.sin(a), rim * np.cos(a)
            return (-x * np.sin(a) + y * np.cos(a)) / np.hypot(x, y)

        exact = [quad(f, 0, 2 * np.pi, limit=200)[0] / 2 / np.pi for f in (force, moment)]
        f, m, _ = body._ring(v, rim / 0.1, [])
        got = np.array([f, m / 0.1]) / PAPER.seal_friction
        edge = 1e-9 if 0 in (v, rim) else 0.2
        np.testing.assert_allclose(got, exact, atol=edge)


def test_turning_on_the_spot_a_ring_lets_the_climber_sink():
    # a turning seal holds like a viscous one: f v / (R ω) against the weight
    plant = Plant(PAPER, 0.001, Contact(grip=Grip(seal_radius=0.1)))
    state, turning = UPRIGHT, 3.0
    for _ in range(1500):
        state = State(UPRIGHT.pose, np.array([0.0, state.velocity[1], turning]))
        state = plant.advance(state, np.zeros(2), steps=1)
    ratio = 49.05 / PAPER.seal_friction
    assert state.velocity[1] == pytest.approx(-0.3 * ratio / np.sqrt(1 - ratio**2), rel=0.05)


BUILT = Climber(
    suction_pressure=8000.0, wheel_load_share=0.8, seal_friction_coefficient=0.6
)  # as config/climber.yaml
SCRUBBING = [FourWheeled(), Tracked(scrub_friction_coefficient=0.8)]


def turned(plant, seconds):
    """A climber that is made to turn at 0.4 rad/s and drive at 0.2 m/s, at its end."""
    state, climber = State(np.zeros(3), np.zeros(3)), plant.climber
    for _ in range(round(seconds / plant.step)):
        moment = 33.0 + 50.0 * (0.4 - state.yaw_rate)
        drive = 57.6 + 200.0 * (0.2 - state.forward_speed) + 49.05 * np.sin(state.heading)
        state = plant.advance(state, climber.wheel_torques(drive, moment), steps=1)
    return state, climber.wheel_torques(drive, moment)


@pytest.mark.parametrize("locomotion", SCRUBBING)
def test_what_scrubs_sags_on_a_wall_while_it_turns_and_not_on_a_floor(locomotion):
    contact = Contact(locomotion=locomotion)
    slips = [
        abs(turned(Plant(climber, 0.0025, contact, slip=True), 0.5)[0].side_slip)
        for climber in (BUILT, replace(BUILT, inclination=0.0))
    ]
    assert slips[0] > 0.02 > 0.004 > slips[1]


@pytest.mark.parametrize("locomotion", SCRUBBING)
def test_its_sag_is_that_of_the_equations_of_sliding_wheels(locomotion):
    """Five equations of smooth motion, in which every wheel slides, integrated apart."""
    plant = Plant(BUILT, 0.0025, Contact(locomotion=locomotion), slip=True)
    start, torques = turned(plant, 0.5)
    end = plant.advance(start, torques, steps=40)
    climber, rows = BUILT, []
    for side, rim in ((0.3, 3), (-0.3, 4)):
        for x in locomotion.footholds:
            rows += [(side, rim, x)]

    def rates(_, y):
        v, u, omega, *rims, heading = y
        pull = -49.05 * np.array([np.sin(heading), np.cos(heading)])
        seal = climber.seal_friction * np.array([v, u]) / np.hypot(v, u)
        force = np.array([*(pull - seal), 0.0])
        at_rims = torques / 0.027
        for side, rim, x in rows:
            lever = 0.05 * pull[1] / 0.6 * (-1 if side > 0 else 1)
            pitch = 0.05 * pull[0] * x / 2 / sum(f * f for f in locomotion.footholds)
            load = (384.0 / 2 + lever) / len(locomotion.footholds) + pitch
            s = np.array([v + side * omega - rims[rim - 3], u + x * omega])
            f = -0.8 * load * s / np.hypot(*s)
            force += [f[0], f[1], side * f[0] + x * f[1]]
            at_rims[rim - 3] -= f[0]
        mass, inertia = 5 - 2 * RIM, 0.33 - 2 * RIM * 0.09
        turning = omega * np.array([u, -v])
        return [*(force[:2] / mass + turning), force[2] / inertia, *(at_rims / RIM), omega]

    d = 0.3 * start.yaw_rate * np.array([1, -1])
    rims = start.slip + start.forward_speed + d
    y = [start.forward_speed, start.side_slip, start.yaw_rate, *rims, start.heading]
    v, u, omega, *_ = solve_ivp(rates, (0, 0.1), y, "LSODA", rtol=1e-9, atol=1e-12).y[:, -1]
    assert end.forward_speed == pytest.approx(v, rel=0.01)
    assert end.side_slip == pytest.approx(u, rel=0.03)
    assert end.yaw_rate == pytest.approx(omega, rel=0.01)


@pytest.mark.parametrize("locomotion", SCRUBBING)
def test_at_rest_it_holds_until_the_torques_beat_its_scrubbing(locomotion):
    contact = Contact(locomotion=locomotion, adhesion=Magnetic(400.0))
    plant, start = Plant(BUILT, 0.0025, contact, slip=True), State(np.zeros(3), np.zeros(3))
    resistance = locomotion.turning_resistance(400.0)
    for part, turns in ((0.5, False), (1.1, True)):
        end = plant.advance(start, BUILT.wheel_torques(0.0, part * resistance), steps=40)
        assert bool(end.velocity.any()) == turns


def test_a_wheel_slips_where_its_own_margin_is_below_1():
    weak = replace(BUILT, suction_pressure=5000.0)
    plant, start = Plant(weak, 0.0025, slip=True), State(np.zeros(3), np.zeros(3))
    for torque, slips in ((2.4, False), (2.9, True)):
        torques = np.array([torque, -torque])
        margin, _ = plant.margins(start, torques)
        assert (margin < 1) == slips
        assert plant.advance(start, torques, steps=1).slip.any() == slips


UPRIGHT = State(np.array([0.0, 6.0, np.pi / 2]), np.zeros(3))
