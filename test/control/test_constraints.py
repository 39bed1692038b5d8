import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from climber_uk.control.constraint_set import demanded, rows
from climber_uk.control.constraints import CONSTRAINTS
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.exact import Exact
from climber_uk.control.guidance import Guidance
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion, ReferencePoint, State, across
from climber_uk.mechanics.reference import tracking_error
from climber_uk.mechanics.shapes import Circle, Ellipse, Lemniscate
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.udwadia_kalaba import constrained_acceleration

TRAJECTORIES = [
    Trajectory(Ellipse(3, 2), RestToRest(rate=0.4, ramp_time=2)),
    Trajectory(Lemniscate(), RestToRest(rate=0.5, ramp_time=2), reverse_gear=True),
]
H = 1e-4  # [s] step of the finite differences

offsets = st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(-1, 1)).map(np.array)
speeds = st.floats(-2, 2)
cases = st.tuples(st.sampled_from(TRAJECTORIES), st.floats(0.1, 12), offsets, speeds, speeds)


def state_of(case):
    trajectory, time, offset, v, omega = case
    return State.rolling(trajectory.at(time).pose + offset, v, omega)


def predict(state, demand, h):
    """State after h [s] of rolling with constant v̇ and θ̈, by the midpoint of speed and heading."""
    v_1, turning, *_ = demand
    x, y, heading = state.pose
    v, omega = state.forward_speed, state.yaw_rate
    s = np.linspace(0, h, 9)  # Simpson's rule is exact here to far below the tolerances
    headings = heading + omega * s + turning * s**2 / 2
    weights = np.array([1, 4, 2, 4, 2, 4, 2, 4, 1]) * h / 24
    way = (v + v_1 * s) * weights
    pose = np.array([x + way @ np.cos(headings), y + way @ np.sin(headings), headings[-1]])
    return State.rolling(pose, v + v_1 * h, omega + turning * h)


def differences(function, state, demand, time):
    """Value, first and second time derivative of function(state, time) along the motion."""
    before, here, after = (function(predict(state, demand, h), time + h) for h in (-H, 0.0, H))
    return here, (after - before) / (2 * H), (after - 2 * here + before) / H**2


@pytest.mark.parametrize(
    ("speed", "ahead", "sign"),
    [(0.05, 0.5, 0), (0.05, -0.5, 1), (-0.05, -0.5, 0), (-0.05, 0.5, -1), (0.0, 0.5, -1)],
)
def test_ahead_of_a_reference_that_comes_it_overcomes_no_friction_to_go_back(speed, ahead, sign):
    slower, direction = overcome(speed, ahead)
    assert direction == pytest.approx(sign, abs=1e-3)
    assert np.sign(slower) == -np.sign(ahead)


def overcome(speed, ahead):
    """Acceleration of a climber at rest, and friction's share that is overcome."""
    target = ReferencePoint(0.0, 0.0, 0.0, speed, *(7 * [0.0]))
    motion, gains = Motion(ahead, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0), Guidance()
    law = ControlLaw(Climber(), gains)
    desired = gains.desired_acceleration(gains.prepare(target), motion)
    return desired.forward, law.direction(desired.speed, law.comes(target))


@pytest.mark.parametrize("ahead", [-1.5e-4, 1.5e-4])
def test_at_rest_the_sign_of_the_references_speed_changes_nothing(ahead):
    """It is but rounding there; and where it turns round, friction's share changes gradually."""
    assert overcome(1e-9, ahead)[1] == pytest.approx(overcome(-1e-9, ahead)[1], abs=1e-4)
    shares = [overcome(speed, ahead)[1] for speed in np.linspace(-0.01, 0.01, 2001)]
    assert np.abs(np.diff(shares)).max() <= 0.25  # a step of 0.01 mm/s


def test_however_slowly_a_reference_comes_to_rest_friction_is_overcome():
    assert overcome(2e-3, 0.0)[1] > 0.99
    assert overcome(0.0, 0.0)[1] == 0.0


@settings(deadline=None)
@given(cases)
def test_guidance_makes_speed_and_heading_errors_decay_as_it_says(case):
    trajectory, time, *_ = case
    gains = Guidance(
        frequency=6.0,
        damping=0.8,
        cross_track_gain=1.3,
        fade_speed=0.4,
        catch_up_share=0.8,
        catch_up_speed=1.5,
        turn_radius=0.5,
        turn_rate=3.0,
    )
    speed = abs(trajectory.at(time).speed)
    for bend in (1.5 / 0.8, np.sqrt(1.5**2 - 0.4**2)):  # where the ceilings begin
        assume(abs(speed - bend) > 0.01)
    state = state_of(case)
    demand = demanded(gains, state, trajectory.at(time))

    def speed_error(state, time):
        reference = trajectory.at(time)
        e_x, _, _ = tracking_error(state.pose, reference)
        v_d = reference.speed
        most = np.hypot(0.2, min(0.8 * abs(v_d), 1.5))
        if e_x * v_d > 0:
            most = np.hypot(v_d, 0.2)
        return state.forward_speed - v_d + most * np.tanh(6.0 / 1.6 * e_x / most)

    def heading_error(state, time):
        reference = trajectory.at(time)
        _, e_y, turned = tracking_error(state.pose, reference)
        v_d = reference.speed
        steering = 1.3 * v_d / np.sqrt(v_d**2 + 0.4**2 + (1.3 * v_d**2 / 4.0) ** 2)
        return turned + np.arctan(steering * e_y)

    reference_rate = differences(lambda _, time: trajectory.at(time).speed, state, demand, time)[1]
    value, _, _ = differences(speed_error, state, demand, time)
    expected = reference_rate - 2 * 0.8 * 6.0 * value
    assert demand.forward == pytest.approx(expected, abs=1e-5 * (1 + abs(expected)))

    value, rate, second = differences(heading_error, state, demand, time)
    fastest = min(np.hypot(speed, 0.4) / 0.5, 3.0)
    expected = -2 * 0.8 * 4.0 * (rate + fastest * np.tanh(4.0 / 1.6 * value / fastest))
    assert second == pytest.approx(expected, abs=1e-4 * (1 + abs(second)))


@settings(deadline=None)
@given(cases)
def test_the_hidden_constraint_decays_at_its_rate(case):
    trajectory, time, _, v, _ = case
    if abs(v) < 0.05:
        return  # singular at rest: see below
    constraints = Exact(natural_frequency=3.0, hidden_rate=8.0)
    state = state_of(case)
    demand = demanded(constraints, state, trajectory.at(time))

    def hidden(state, time):
        reference = trajectory.at(time)
        u = reference.acceleration + 6 * (reference.velocity - state.velocity)
        u = u + 9 * (reference.pose - state.pose)
        return state.forward_speed * state.yaw_rate - across(state.heading, u)

    value, rate, _ = differences(hidden, state, demand, time)
    assert rate == pytest.approx(-8.0 * value, abs=1e-4 * (1 + abs(rate) + abs(demand[1])))


@pytest.mark.parametrize("constraints", CONSTRAINTS.values(), ids=CONSTRAINTS)
@given(case=cases)
@settings(deadline=None)
def test_the_rows_solved_by_udwadia_kalaba_give_the_demand(constraints, case):
    trajectory, time, _, v, omega = case
    state, climber = state_of(case), Climber()
    v_1, turning, _, _ = demand = demanded(constraints(), state, trajectory.at(time))
    A, b = rows(state, demand)
    np.testing.assert_allclose(A @ A.T, np.eye(3), atol=1e-15)
    q_2 = constrained_acceleration(climber.mass_matrix, np.array([1.0, -2.0, 3.0]), A, b)
    cosine, sine = np.cos(state.heading), np.sin(state.heading)
    expected = [v_1 * cosine - v * omega * sine, v_1 * sine + v * omega * cosine, turning]
    np.testing.assert_allclose(q_2, expected, rtol=1e-12, atol=1e-12 * (1 + np.abs(b).max()))


@pytest.mark.parametrize("constraints", CONSTRAINTS.values(), ids=CONSTRAINTS)
def test_on_the_path_the_demand_is_that_of_the_path(constraints):
    trajectory = Trajectory(Circle(radius=2.0), ConstantRate(rate=0.7))
    reference = trajectory.at(1.0)
    state = State(reference.pose, reference.velocity)
    demand = demanded(constraints(), state, reference)
    np.testing.assert_allclose(demand, [0, 0, 1.4, 0.7], atol=1e-12)


def test_the_exact_set_asks_no_turn_of_a_climber_at_rest():
    reference = Trajectory(Circle(), ConstantRate()).at(0.0)
    v_1, turning, *_ = demanded(Exact(), State.rolling(reference.pose, 0.0, 0.5), reference)
    assert np.isfinite(v_1)
    assert turning == 0


def test_the_exact_set_overcomes_friction_towards_a_reference_that_has_come_to_its_end():
    reference = Trajectory(Circle(), RestToRest(rate=1.0)).at(1e3)
    behind = reference.pose - 0.01 * np.array(
        [np.cos(reference.heading), np.sin(reference.heading), 0.0]
    )
    state = State(behind, np.zeros(3))
    _, _, wanted, _ = demanded(Exact(natural_frequency=5.0), state, reference)
    assert wanted == pytest.approx(0.05, abs=1e-12)  # ω_n times the distance


def test_tracking_error_is_ahead_left_and_anticlockwise():
    reference = Trajectory(Circle(), ConstantRate()).at(0.0)  # at (1, 0), heading up
    error = tracking_error(np.array([0.7, 0.2, np.pi / 2 + 0.1 - 4 * np.pi]), reference)
    np.testing.assert_allclose(error, [0.2, 0.3, 0.1], atol=1e-12)


@pytest.mark.parametrize("constraints", CONSTRAINTS.values(), ids=CONSTRAINTS)
def test_one_call_serves_many_climbers(constraints):
    random = np.random.default_rng(5)
    reference = TRAJECTORIES[0].at(random.uniform(0, 10, size=6))
    state = State.rolling(
        reference.pose + random.normal(size=(6, 3)), random.normal(size=6), random.normal(size=6)
    )
    together = np.array(demanded(constraints(), state, reference))
    for i in range(6):
        one = type(reference)(
            *(getattr(reference, name)[i] for name in ("pose", "velocity", "acceleration", "jerk"))
        )
        alone = demanded(constraints(), State(state.pose[i], state.velocity[i]), one)
        np.testing.assert_allclose(together[:, i], alone, rtol=1e-11)
