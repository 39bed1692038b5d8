import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.control.constraints import Exact, Guidance, rows, tracking_error
from climber_uk.control.controller import Controller, Timing, limited
from climber_uk.mechanics.climber import Climber, State, across, along
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.udwadia_kalaba import constraint_force
from climber_uk.simulation.plant import Plant

PAPER = Trajectory(Ellipse(), ConstantRate())
START = State(np.array([0.0, 6.0, 0.0]), np.array([10.0, 0.0, -0.6]))
PERIOD = 0.005  # [s]


def closed_loop(controller, trajectory, state, duration, delay=0):
    """Tracking errors (n, 3) and torques (n, 2); torques act `delay` periods after they are due."""
    plant = Plant(controller.climber, PERIOD / 2)
    first = controller.command(state, trajectory.at(controller.timing.lookahead), np.zeros(2))
    queue = [first.torques] * delay
    errors, torques = [], []
    for k in range(round(duration / PERIOD)):
        time = k * PERIOD
        errors.append(tracking_error(state.pose, trajectory.at(time)))
        reference = trajectory.at(time + controller.timing.lookahead)
        held = queue[0] if queue else (torques[-1] if torques else np.zeros(2))
        torques.append(controller.command(state, reference, held).torques)
        queue.append(torques[-1])
        state = plant.advance(state, queue.pop(0), steps=2)
    return np.array(errors), np.array(torques)


def rms(errors):
    return np.sqrt(np.mean(errors[:, 0] ** 2 + errors[:, 1] ** 2))


@pytest.mark.parametrize("constraints", [Guidance(), Exact()], ids=["guidance", "exact"])
def test_the_papers_ellipse_is_tracked_to_hundredths_of_a_millimetre(constraints):
    errors, _ = closed_loop(Controller(Climber(), constraints, Timing()), PAPER, START, 20.0)
    assert rms(errors) <= 0.02e-3
    assert np.hypot(*errors[:, :2].T).max() <= 0.15e-3


def test_prediction_takes_the_error_of_holding_a_torque_away():
    def error(timing, delay):
        controller = Controller(Climber(), Exact(), timing)
        return rms(closed_loop(controller, PAPER, START, 10.0, delay)[0])

    without = error(Timing(predict=False), 0)
    assert error(Timing(), 0) < without / 20
    known = error(Timing(transport_delay=PERIOD), 1)
    unknown = error(Timing(), 1)
    assert known < unknown / 5
    assert known < 0.2e-3


@settings(max_examples=50, deadline=None)
@given(st.floats(0, 20), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(5, 12))
def test_the_closed_form_is_the_udwadia_kalaba_force(time, offset, turned, v):
    """At 1e-12: A is orthonormal and M weighs x and y alike, so Qc = M Aᵀ b - Q."""
    climber = Climber(max_wheel_torque=1e9)
    reference = PAPER.at(time)
    state = State.rolling(reference.pose + np.array([offset, -offset, turned]), v, turned)
    for constraints in (Guidance(), Exact()):
        command = Controller(climber, constraints, Timing(predict=False)).command(
            state, reference, np.zeros(2)
        )
        A, b = rows(state, constraints.demand(state, reference))
        Q = climber.applied_force(state.heading, 1.0)
        Qc = constraint_force(climber.mass_matrix, Q, A, b)
        expected = [along(state.heading, Qc), across(state.heading, Qc), Qc[2]]
        scale = 1 + np.abs(Qc).max()
        np.testing.assert_allclose(command.constraint_force, expected, atol=1e-12 * scale)
        torques = climber.wheel_torques(expected[0], expected[2])
        np.testing.assert_allclose(command.torques, torques, atol=1e-12 * scale)


@pytest.mark.parametrize("seed", range(8))
def test_guidance_comes_back_from_far_off_without_spinning(seed):
    random = np.random.default_rng(seed)
    trajectory = Trajectory(Ellipse(), RestToRest(rate=1.0, ramp_time=3.0, laps=9))
    offset = np.array([*random.uniform(-0.5, 0.5, 2), random.uniform(-1, 1)])
    climber = Climber(max_wheel_torque=4.0)
    start = State(trajectory.at(0.0).pose + offset, np.zeros(3))
    errors, torques = closed_loop(Controller(climber, Guidance(), Timing()), trajectory, start, 4.0)
    assert np.hypot(*errors[600:, :2].T).max() < 0.01  # from 3 s on
    assert np.abs(errors[:, 2]).max() < np.pi / 2 + 1
    assert np.abs(torques).max() <= 4.0


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(0.1, 10))
def test_the_limit_keeps_the_turn_before_the_drive(right, left, limit):
    wanted = np.array([right, left])
    got = limited(wanted, limit)
    assert np.abs(got).max() <= limit * (1 + 1e-12)
    if np.abs(wanted).max() <= limit:
        np.testing.assert_allclose(got, wanted, atol=1e-12)
    turn = (right - left) / 2
    assert (got[0] - got[1]) / 2 == pytest.approx(np.clip(turn, -limit, limit), abs=1e-9)


def test_saturation_is_told():
    reference = PAPER.at(0.0)
    for limit, expected in ((20.0, False), (0.5, True)):
        controller = Controller(Climber(max_wheel_torque=limit), Guidance(), Timing())
        assert bool(controller.command(START, reference, np.zeros(2)).saturated) is expected


def test_holding_torques_keep_the_climber_where_it_is():
    climber = Climber(seal_friction_coefficient=0.0)
    controller, plant = Controller(climber, Guidance(), Timing()), Plant(climber, 0.0025)
    state = State.rolling(np.array([0.0, 0.0, 1.0]), 0.3, 0.4)
    for _ in range(1000):
        state = plant.advance(state, controller.holding(state, braking_rate=5.0), steps=2)
    np.testing.assert_allclose(state.velocity, 0, atol=1e-6)


def test_times_without_sense_are_refused():
    with pytest.raises(ValueError, match=r"control_period=0.0 must be > 0 \[s\]"):
        Timing(control_period=0.0)
    with pytest.raises(ValueError, match=r"transport_delay=-1.0 must be >= 0 \[s\]"):
        Timing(transport_delay=-1.0)
