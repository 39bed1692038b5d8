from contextlib import nullcontext, suppress
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from climber_uk.mechanics.adhesion import ADHESION, Grip, Magnetic
from climber_uk.mechanics.climber import Climber, no_slip
from climber_uk.mechanics.contact import LOCOMOTION, Contact, Tracked, Wheeled
from climber_uk.mechanics.friction import FRICTION, Coulomb, LuGre, Stribeck, Viscous
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.udwadia_kalaba import constrained_acceleration, velocity_correction
from climber_uk.mechanics.wall import WALLS, Cylinder, Plane
from climber_uk.simulation.inputs import NO_PUSH, FellOff, Inputs, NotFinite, PlantState
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.rigid_body import RigidBody

PAPER = Climber()
UPRIGHT = State(np.array([0.0, 6.0, np.pi / 2]), np.zeros(3))
GEARED = replace(PAPER, rotor_inertia=0.002)  # 5.5 kg at the rims, that weigh nothing
SLIPPERY = replace(PAPER, seal_friction_coefficient=0.0)


def reduced(climber, state, torques, duration):
    """Oracle: (11), (15) and (12) in x, y, θ, v, ω, without stops; by Dormand-Prince 8(5,3)."""
    drive = torques.sum() / climber.wheel_radius
    turn = climber.half_track * (torques[0] - torques[1]) / climber.wheel_radius
    friction = climber.seal_friction * np.sign(state.forward_speed)
    rims = 2 * climber.rotor_inertia / climber.wheel_radius**2

    def rates(_, y):
        force = drive - friction - climber.weight_along_wall * np.sin(y[2])
        return [
            y[3] * np.cos(y[2]),
            y[3] * np.sin(y[2]),
            y[4],
            force / (climber.mass + rims),
            turn / (climber.yaw_inertia + rims * climber.half_track**2),
        ]

    start = [*state.pose, state.forward_speed, state.yaw_rate]
    end = solve_ivp(rates, (0, duration), start, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return State.rolling(end[:3], end[3], end[4])


def random_drive(random, state):
    """Torques that keep the climber going, but turn it and speed it up at random."""
    drive = PAPER.seal_friction + PAPER.weight_along_wall * np.sin(state.heading)
    return PAPER.wheel_torques(drive + 5 * random.normal(), -0.4 * state.yaw_rate + random.normal())


@pytest.mark.parametrize(("seed", "climber"), [(0, PAPER), (1, PAPER), (2, GEARED)])
def test_random_torques_move_it_as_the_reduced_equations_say(seed, climber):
    random = np.random.default_rng(seed)
    plant = Plant(climber, 0.001)
    state = oracle = State.rolling(np.array([0.0, 6.0, 0.3]), 6.0, -0.6)
    for _ in range(80):
        torques = random_drive(random, state)
        state = plant.advance(state, torques, steps=100)
        oracle = reduced(climber, oracle, torques, 0.1)
        assert np.abs(state.pose - oracle.pose)[:2].max() < 1e-9
        assert abs(state.side_slip) < 1e-9
    assert state.forward_speed > 0  # else the oracle would be none


def test_its_derivative_is_that_of_the_generic_equations():
    random = np.random.default_rng(4)
    for _ in range(50):
        q, v = random.normal(size=3), random.normal(size=3)
        torques = random.normal(size=2)
        body = RigidBody(PAPER, Contact(), Plane(), 0.01)
        inputs = Inputs.of(PAPER, torques, NO_PUSH)
        got = body.derivative(np.concatenate([q, v]), inputs, 1.0)
        M = PAPER.mass_matrix
        row, _ = no_slip(State(q, v))
        q_1 = velocity_correction(M, row[None], np.zeros(1), v)
        _, b = no_slip(State(q, q_1))
        driven = State.rolling(q, *PAPER.force_and_moment(torques)).velocity
        Q = PAPER.applied_force(q[2], 1.0) + driven
        v_1 = constrained_acceleration(M, Q, row[None], np.array([b]))
        np.testing.assert_allclose(got, np.concatenate([q_1, v_1]), rtol=1e-12, atol=1e-12)


def test_halving_the_step_shows_the_fourth_order():
    start = State.rolling(np.array([0.0, 0.0, 0.3]), 6.0, 1.0)
    torques = np.array([1.4, 1.5])
    exact = reduced(PAPER, start, torques, 2.0).pose
    errors = [
        np.abs(Plant(PAPER, 2.0 / n).advance(start, torques, n).pose - exact).max()
        for n in (20, 40, 80)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 4, atol=0.3)


def test_wheels_that_may_slip_and_do_not_turn_the_same_rotors():
    for geared in (PAPER, GEARED):
        climber = replace(geared, suction_pressure=8000.0, wheel_load_share=0.8)
        states = [State.rolling(np.array([0.0, 6.0, 0.3]), 0.5, -0.2)] * 2
        for plant in (0, 1):
            body = Plant(climber, 0.001, slip=bool(plant))
            states[plant] = body.advance(states[plant], np.array([1.9, 1.8]), steps=300)
        np.testing.assert_allclose(states[0].pose, states[1].pose, atol=1e-6)
        np.testing.assert_allclose(states[0].velocity, states[1].velocity, atol=1e-5)


@pytest.mark.parametrize("heading", [0.0, -np.pi / 2, 3.0])
def test_friction_holds_the_climber_still_on_the_vertical_wall(heading):
    start = State(np.array([0.0, 6.0, heading]), np.zeros(3))
    end = Plant(PAPER, 0.0025).advance(start, np.zeros(2), steps=8_000)  # 20 s
    assert np.abs(end.pose - start.pose).max() < 1e-9
    assert not end.velocity.any()


@pytest.mark.parametrize(("part", "slides"), [(1 + 1e-6, False), (1 - 1e-6, True)])
def test_it_slides_just_below_the_critical_pressure(part, slides):
    pressure = part * 5 * 9.81 / (0.47 * 0.8 * 0.06)  # 2174.2 Pa
    start = State(np.array([0.0, 6.0, np.pi / 2]), np.zeros(3))
    climber = replace(PAPER, suction_pressure=pressure)
    end = Plant(climber, 0.0025).advance(start, np.zeros(2), steps=4000)
    assert (end.pose[1] < start.pose[1]) is np.bool_(slides)
    if slides:
        fall = (climber.weight_along_wall - climber.seal_friction) / climber.mass
        assert start.pose[1] - end.pose[1] == pytest.approx(fall * 10**2 / 2, rel=1e-9)


def test_friction_stops_a_sliding_climber_where_the_brakes_law_says():
    floor = replace(PAPER, inclination=0.0)
    start = State.rolling(np.array([0.0, 0.0, 0.5]), 1.0, 0.0)
    end = Plant(floor, 0.0025).advance(start, np.zeros(2), steps=400)
    assert np.hypot(*end.pose[:2]) == pytest.approx(5.0 / (2 * floor.seal_friction), rel=1e-9)
    assert not end.velocity[:2].any()


def test_a_climber_that_stops_against_friction_may_go_back():
    steep = replace(PAPER, suction_pressure=500.0)  # friction 11 N holds 49 N of weight no more
    start = State.rolling(np.array([0.0, 0.0, np.pi / 2]), 1.0, 0.0)
    up = (steep.weight_along_wall + steep.seal_friction) / steep.mass
    down = (steep.weight_along_wall - steep.seal_friction) / steep.mass
    end = Plant(steep, 0.0025).advance(start, np.zeros(2), steps=400)
    height = 1 / (2 * up) - down * (1.0 - 1 / up) ** 2 / 2
    assert end.pose[1] == pytest.approx(height, rel=1e-9)


def test_a_climber_that_turns_on_the_spot_breaks_away_where_weight_beats_friction():
    weak = replace(PAPER, suction_pressure=1500.0)  # friction 33.84 N < 49.05 N of weight
    start = State(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    plant, state, time = Plant(weak, 0.0025), start, 0.0
    while not state.velocity[:2].any():
        assert not state.pose[:2].any()
        state, time = plant.advance(state, np.zeros(2), steps=1), time + 0.0025
    breakaway = np.arcsin(weak.seal_friction / weak.weight_along_wall)  # heading, at 1 rad/s
    assert breakaway < time <= breakaway + 0.0025 + 1e-12


def test_a_side_slip_put_in_is_taken_out_by_the_correction():
    start = State(np.zeros(3), np.array([1.0, 0.2, 0.0]))
    end = Plant(SLIPPERY, 0.0025).advance(start, np.zeros(2), steps=1)
    assert abs(end.side_slip) < 1e-15


@pytest.mark.parametrize(("part", "slides"), [(1 - 1e-6, False), (1 + 1e-6, True)])
def test_it_slides_just_above_the_critical_inclination(part, slides):
    # 0.47 · 0.8 · 0.06 · 1500 = 33.84 N hold 49.05 N up to 43.6 degrees
    climber = replace(
        PAPER, suction_pressure=1500.0, inclination=part * np.degrees(np.arcsin(33.84 / 49.05))
    )
    end = Plant(climber, 0.0025).advance(UPRIGHT, np.zeros(2), steps=400)
    assert bool(end.velocity.any()) is slides


@pytest.mark.parametrize("slip", [False, True])
def test_viscous_friction_lets_it_slide_at_its_terminal_speed(slip):
    # f v / v₁ = m g
    expected = 0.1 * 49.05 / PAPER.seal_friction
    contact = Contact(friction=Viscous(speed=0.1))
    plant = Plant(PAPER, 0.0025, contact, slip=slip)
    end = plant.advance(UPRIGHT, np.zeros(2), steps=2000)
    assert end.velocity[1] == pytest.approx(-expected, rel=1e-6)


@pytest.mark.parametrize("law", [Viscous(speed=1e-6), Stribeck(viscous=1e6)], ids=str)
def test_friction_too_stiff_for_its_step_is_followed_all_the_same(law):
    drive = 2 * PAPER.seal_friction
    torques = PAPER.wheel_torques(drive + 49.05, 0.0)
    end = Plant(PAPER, 0.0025, Contact(friction=law)).advance(UPRIGHT, torques, steps=40)
    assert law.level(PAPER.seal_friction, float(end.forward_speed)) == pytest.approx(drive)


@pytest.mark.parametrize(("part", "falls"), [(1 + 1e-6, False), (1 - 1e-6, True)])
def test_it_tips_off_the_wall_just_below_its_tip_over_pressure(part, falls):
    pressure = part * 49.05 * 0.05 / 0.125 / 0.06  # 327 Pa
    plant = Plant(replace(PAPER, suction_pressure=pressure), 0.0025)
    if not falls:
        plant.advance(UPRIGHT, np.zeros(2), steps=1)
        return
    with pytest.raises(FellOff, match="tip margin 1 is below 1") as fall:
        plant.advance(UPRIGHT, np.zeros(2), steps=1)
    assert fall.value.value == pytest.approx(part)


@pytest.mark.parametrize(("part", "falls"), [(1 + 1e-6, False), (1 - 1e-6, True)])
def test_it_falls_off_a_ceiling_just_below_the_pressure_that_carries_it(part, falls):
    climber = replace(PAPER, suction_pressure=part * 49.05 / 0.06, inclination=180.0)
    with pytest.raises(FellOff, match="force onto the wall") if falls else nullcontext():
        Plant(climber, 0.0025).advance(UPRIGHT, np.zeros(2), steps=1)


def test_on_its_way_up_a_pipe_it_falls_where_magnets_no_longer_hold_it():
    # at 1 m/s, F₀ + m g cos(y/R) + m ẏ²/R = 40 + 49.05 cos(y/R) + 2.5 N
    contact = Contact(adhesion=Magnetic(force_at_contact=40.0), grip=Grip(centre_height=0.0))
    plant = Plant(replace(PAPER, inclination=0.0), 0.0025, contact, Cylinder(2.0))
    edge = 2.0 * np.arccos(-42.5 / 49.05)

    def at(height):
        return State.rolling(np.array([0.0, height, np.pi / 2]), 1.0, 0.0)

    plant.advance(at(edge - 1e-6), np.zeros(2), steps=1)
    with pytest.raises(FellOff, match=r"force onto the wall -.* is below 0 \[N\]"):
        plant.advance(at(edge + 1e-6), np.zeros(2), steps=1)


def test_in_a_pipe_it_rolls_as_a_pendulum_swings():
    contact = Contact(adhesion=Magnetic())
    plant = Plant(replace(PAPER, inclination=0.0), 0.0025, contact, Cylinder(2.0))
    start = State(np.array([0.0, 1.0, np.pi / 2]), np.zeros(3))
    end = plant.advance(start, np.zeros(2), steps=1000)

    def swing(_, y):
        return [y[1], -9.81 * np.sin(y[0] / 2.0)]

    expected = solve_ivp(swing, (0, 2.5), [1.0, 0.0], "DOP853", rtol=1e-12, atol=1e-12).y[0, -1]
    assert end.pose[1] == pytest.approx(expected, abs=1e-9)


def test_a_tilted_plane_pulls_along_x():
    plant = Plant(SLIPPERY, 0.0025, wall=Plane(tilt=90.0))
    end = plant.advance(State(np.zeros(3), np.zeros(3)), np.zeros(2), steps=400)
    np.testing.assert_allclose(end.pose, [9.81 / 2, 0, 0], atol=1e-9)


@pytest.mark.parametrize(
    "friction",
    [Coulomb(), pytest.param(Stribeck(), marks=pytest.mark.soak)],
    ids=["coulomb", "stribeck"],
)
@pytest.mark.parametrize(
    "options",
    [{}, {"slip": True}, {"radius": 0.12}, {"tracks": True}, {"radius": 0.12, "slip": True}],
    ids=str,
)
def test_it_stays_where_it_is_with_whatever_sticks(friction, options):
    contact = Contact(
        friction=friction,
        locomotion=Tracked() if options.get("tracks") else Wheeled(),
        grip=Grip(seal_radius=options.get("radius", 0.0)),
    )
    start = State(np.array([0.0, 6.0, 0.7]), np.zeros(3))
    plant = Plant(PAPER, 0.005, contact, slip=options.get("slip", False))
    end = plant.advance(start, np.zeros(2), steps=2_000)  # 10 s
    assert np.abs(end.pose - start.pose).max() < 1e-9
    assert not end.velocity.any()


@pytest.mark.parametrize(
    ("heading", "slip"),
    [pytest.param(0.3, False, marks=pytest.mark.soak), (0.3, True), (np.pi / 2, False)],
)
def test_lugre_gives_way_a_little_and_then_does_not_drift(heading, slip):
    law, start = LuGre(), State(np.array([0.0, 6.0, heading]), np.zeros(3))
    plant = Plant(PAPER, 0.0025, Contact(friction=law), slip=slip)
    settled = plant.advance(start, np.zeros(2), steps=4000)  # 10 s
    deflection = np.hypot(*(settled.pose - start.pose)[:2])
    # the weight is let go at once: it swings to at most twice where the spring holds it, but near
    # break-away the bristles slip meanwhile
    spring = 49.05 * np.sin(heading) / law.stiffness(PAPER.seal_friction)
    assert spring <= deflection < (2 * spring if heading < 1 else 0.01)
    end = plant.advance(settled, np.zeros(2), steps=4000)  # 10 s
    assert np.abs(end.pose - settled.pose).max() < 2e-10


def driven(state, random, climber, demand):
    """Torques that chase a speed and a turning rate, whatever rubs."""
    speed, turning = demand
    drive = climber.weight_along_wall * np.sin(state.heading) + 60.0 * np.sign(speed)
    drive += 40.0 * (speed - state.forward_speed) + random.normal()
    return climber.wheel_torques(drive, 2.0 * (turning - state.yaw_rate) + random.normal() / 10)


FINE = 0.00125  # [s]: where friction turns round, the rule below is of second order only
BALANCES = {
    "coulomb": Plant(PAPER, FINE),
    "viscous": Plant(PAPER, FINE, Contact(friction=Viscous())),
    "stribeck": Plant(PAPER, FINE, Contact(friction=Stribeck(viscous=0.3))),
    "lugre": Plant(PAPER, 0.0025, Contact(friction=LuGre(viscous=0.3))),
    "ring": Plant(PAPER, FINE, Contact(grip=Grip(seal_radius=0.12))),
    "pipe": Plant(replace(PAPER, inclination=30.0), FINE, wall=Cylinder(5.0)),
    "tilted": Plant(PAPER, FINE, wall=Plane(tilt=30.0)),
    "gripping": Plant(PAPER, FINE, Contact(grip=Grip(100.0)), slip=True),
}
OFTEN = "lugre", "gripping"  # the others for soak


def friction_power(plant, state):
    """Of the seal, from the plant's own law [W]."""
    more = PlantState.of(state).deflection.tolist()
    v, omega = float(state.forward_speed), float(state.yaw_rate)
    force, moment, _ = plant._body._ring(v, omega, more)
    return -force * v - moment * omega


def energy(plant, state):
    """Of motion, and of height: the way up is found by integrating the slope."""
    climber, wall = plant.climber, plant.wall
    x, y, _ = state.pose
    if wall.flat:
        s_x, s_y = wall.along(climber.inclination, 0.0, 0.0)
        height = -(s_x * x + s_y * y)
    else:
        height = -wall.radius * np.cos(np.radians(climber.inclination) + y / wall.radius)
    speeds = climber.mass * state.forward_speed**2 + climber.yaw_inertia * state.yaw_rate**2
    return speeds / 2 + climber.mass * 9.81 * height


@pytest.mark.parametrize("seconds", [20, pytest.param(60, marks=pytest.mark.soak)])
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in OFTEN else pytest.mark.soak) for name in BALANCES],
)
def test_over_some_random_driving_not_a_millionth_of_the_energy_is_lost(name, seconds):
    plant, random = BALANCES[name], np.random.default_rng(5)
    climber, state = plant.climber, State(np.array([0.0, 6.0, 0.3]), np.zeros(3))
    start, work, done = energy(plant, state), 0.0, 0.0
    for number in range(10 * seconds):  # of 100 ms
        if number % 20 == 0:
            demand = random.uniform(0.2, 1.0) * random.choice([-1, 1]), random.uniform(-1, 1)
            push = random.normal(size=3) * [3.0, 3.0, 0.3]
        torques = driven(state, random, climber, demand)
        drive, turn = climber.force_and_moment(torques)

        def powers(state, drive=drive, turn=turn, push=push):
            motors = drive * state.forward_speed + turn * state.yaw_rate
            return np.array([motors, push @ state.velocity, friction_power(plant, state)])

        for _ in range(round(0.05 / plant.step)):  # Simpson's rule over two steps
            middle = plant.advance(state, torques, 1, push)
            end = plant.advance(middle, torques, 1, push)
            parts = plant.step / 3 * (powers(state) + 4 * powers(middle) + powers(end))
            work, done, state = work + parts.sum(), done + np.abs(parts).sum(), end
    assert done > 20 * seconds  # [J]
    assert energy(plant, state) - start == pytest.approx(work, abs=1e-6 * done)


def test_with_friction_enough_slip_mode_is_the_plant_that_does_not_slip():
    trajectory, step = Trajectory(Ellipse(), ConstantRate()), 0.005
    start = trajectory.at(0.0)
    rolling = slipping = State(start.pose, start.velocity)
    firm, loose = Plant(PAPER, step), Plant(PAPER, step, Contact(grip=Grip(5.0)), slip=True)
    for number in range(1000):
        now = trajectory.at((number + 0.5) * step)
        drive = 5 * now.forward_acceleration + PAPER.seal_friction + 49.05 * np.sin(now.heading)
        torques = PAPER.wheel_torques(drive, 0.33 * now.acceleration[2])
        rolling = firm.advance(rolling, torques, 1)
        slipping = loose.advance(slipping, torques, 1)
    assert np.abs(rolling.pose - slipping.pose).max() < 1e-6
    assert np.hypot(*(rolling.pose - trajectory.at(5.0).pose)[:2]) < 0.1  # it was the ellipse


@settings(max_examples=40, deadline=None)
@given(
    mass=st.floats(0.1, 1e3),
    pressure=st.floats(0, 1e5),
    inclination=st.floats(0, 180),
    law=st.sampled_from(list(FRICTION)),
    adhesion=st.sampled_from(list(ADHESION)),
    locomotion=st.sampled_from(list(LOCOMOTION)),
    wall=st.sampled_from(list(WALLS)),
    grip=st.builds(
        Grip,
        wheel_friction_coefficient=st.floats(0, 10),
        wheel_inertia=st.floats(1e-9, 1e-5),
        seal_radius=st.sampled_from([0.0, 1e-3, 0.1, 1.0]),
    ),
    slip=st.booleans(),
    torques=st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=1, max_size=5),
    speeds=st.tuples(st.floats(-10, 10), st.floats(-10, 10)),
)
def test_whatever_it_is_given_its_numbers_stay_finite_or_it_says_why_not(
    mass, pressure, inclination, law, adhesion, locomotion, wall, grip, slip, torques, speeds
):
    climber = Climber(mass=mass, suction_pressure=pressure, inclination=inclination)
    contact = Contact(
        adhesion=ADHESION[adhesion](),
        grip=grip,
        friction=FRICTION[law](),
        locomotion=LOCOMOTION[locomotion](),
    )
    plant = Plant(climber, 0.005, contact, WALLS[wall](), slip)
    state = State.rolling(np.zeros(3), *speeds)
    with suppress(FellOff, NotFinite):
        for pair in torques:
            state = plant.advance(state, np.array(pair), steps=3)
            assert np.isfinite(state.pose).all()
            assert np.isfinite(state.velocity).all()


def test_numbers_that_end_are_told():
    with pytest.raises(NotFinite):
        Plant(PAPER, 0.0025).advance(UPRIGHT, np.array([1e308, -3.0]), steps=50)


def test_a_wheel_heavier_than_the_climber_is_refused():
    with pytest.raises(ValueError, match=r"wheel_inertia=1.0 must be <"):
        Plant(PAPER, 0.0025, Contact(grip=Grip(wheel_inertia=1.0)), slip=True)


def test_a_step_that_is_none_is_refused():
    with pytest.raises(ValueError, match=r"step=0.0 must be > 0 \[s\]"):
        Plant(PAPER, 0.0)
