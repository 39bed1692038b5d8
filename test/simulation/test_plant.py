from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from climber_uk.mechanics.climber import Climber, State, no_slip
from climber_uk.mechanics.udwadia_kalaba import constrained_acceleration, velocity_correction
from climber_uk.simulation.plant import Plant

PAPER = Climber()
SLIPPERY = replace(PAPER, seal_friction_coefficient=0.0)


def reduced(climber, state, torques, duration):
    """Oracle: (11), (15) and (12) in x, y, θ, v, ω, without stops; by Dormand-Prince 8(5,3)."""
    drive = torques.sum() / climber.wheel_radius
    turn = climber.half_track * (torques[0] - torques[1]) / climber.wheel_radius
    friction = climber.seal_friction * np.sign(state.forward_speed)

    def rates(_, y):
        force = drive - friction - climber.weight_along_wall * np.sin(y[2])
        return [
            y[3] * np.cos(y[2]),
            y[3] * np.sin(y[2]),
            y[4],
            force / climber.mass,
            turn / climber.yaw_inertia,
        ]

    start = [*state.pose, state.forward_speed, state.yaw_rate]
    end = solve_ivp(rates, (0, duration), start, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    return State.rolling(end[:3], end[3], end[4])


def random_drive(random, state):
    """Torques that keep the climber going, but turn it and speed it up at random."""
    drive = PAPER.seal_friction + PAPER.weight_along_wall * np.sin(state.heading)
    return PAPER.wheel_torques(drive + 5 * random.normal(), -0.4 * state.yaw_rate + random.normal())


@pytest.mark.parametrize("seed", range(3))
def test_random_torques_move_it_as_the_reduced_equations_say(seed):
    random = np.random.default_rng(seed)
    plant = Plant(PAPER, 0.001)
    state = oracle = State.rolling(np.array([0.0, 6.0, 0.3]), 6.0, -0.6)
    for _ in range(200):
        torques = random_drive(random, state)
        state = plant.advance(state, torques, steps=100)
        oracle = reduced(PAPER, oracle, torques, 0.1)
        assert np.abs(state.pose - oracle.pose)[:2].max() < 1e-9
        assert abs(state.side_slip) < 1e-9
    assert state.forward_speed > 0  # else the oracle would be none


def test_its_derivative_is_that_of_the_generic_equations():
    random = np.random.default_rng(4)
    for _ in range(50):
        q, v = random.normal(size=3), random.normal(size=3)
        torques = random.normal(size=2)
        got = Plant(PAPER, 0.01)._derivative(np.concatenate([q, v]), torques, 1.0)
        M = PAPER.mass_matrix
        row, _ = no_slip(State(q, v))
        q_1 = velocity_correction(M, row[None], np.zeros(1), v)
        _, b = no_slip(State(q, q_1))
        Q = PAPER.applied_force(q[2], 1.0) + PAPER.wheel_force(q[2], torques)
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


@pytest.mark.parametrize("heading", [0.0, 0.7, np.pi / 2, -np.pi / 2, 3.0])
def test_friction_holds_the_climber_still_on_the_vertical_wall(heading):
    start = State(np.array([0.0, 6.0, heading]), np.zeros(3))
    end = Plant(PAPER, 0.0025).advance(start, np.zeros(2), steps=24_000)  # 60 s
    assert np.abs(end.pose - start.pose).max() < 1e-9
    assert not end.velocity.any()


@pytest.mark.parametrize(("pressure", "slides"), [(2174.5, False), (2174.0, True)])
def test_it_slides_just_below_the_critical_pressure(pressure, slides):
    # 5 · 9.81 = 0.47 · 0.8 · 0.06 P at 2174.2 Pa
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


def test_a_step_that_is_none_is_refused():
    with pytest.raises(ValueError, match=r"step=0.0 must be > 0 \[s\]"):
        Plant(PAPER, 0.0)
