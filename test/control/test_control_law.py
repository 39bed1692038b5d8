from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.control import model
from climber_uk.control.constraint_set import demanded, rows
from climber_uk.control.control_law import Braking, ControlInput, ControlLaw, ControlOptions
from climber_uk.control.exact import Exact
from climber_uk.control.guidance import Guidance
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import (
    DesiredAcceleration,
    Motion,
    State,
    Torques,
    Wrench,
    across,
    along,
)
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.udwadia_kalaba import constraint_force
from climber_uk.parameters.declaration import parameter
from climber_uk.simulation.plant import Plant

PAPER = Trajectory(Ellipse(), ConstantRate())
START = State(np.array([0.0, 6.0, 0.0]), np.array([10.0, 0.0, -0.6]))
PERIOD = 0.005  # [s]


def situation(state, held=(0.0, 0.0), disturbance=(0.0, 0.0)):
    return ControlInput(state.motion, Torques(*held), Wrench(*disturbance), PERIOD)


@settings(max_examples=50, deadline=None)
@given(
    st.floats(0, 20),
    st.floats(-0.1, 0.1),
    st.floats(-0.1, 0.1),
    st.floats(5, 12),
    st.tuples(st.floats(-30, 30), st.floats(-3, 3)),
    st.sampled_from([0.0, 1e-3]),
)
def test_the_closed_form_is_the_udwadia_kalaba_force(time, offset, turned, v, disturbance, rotors):
    """At 1e-12: A is orthonormal and M weighs x and y alike, so Qc = M Aᵀ b - Q."""
    climber = Climber(max_wheel_torque=1e9, rotor_inertia=rotors)
    reference = PAPER.at(time)
    state = State.rolling(reference.pose + np.array([offset, -offset, turned]), v, turned)
    for constraints, solver in product((Guidance(), Exact()), ("closed_form", "generic")):
        options = ControlOptions(predict=False, solver=solver)
        command = ControlLaw(climber, constraints, options).command(
            situation(state, disturbance=disturbance), reference.target
        )
        A, b = rows(state, demanded(constraints, state, reference))
        pushed = State.rolling(np.array([0.0, 0.0, state.heading]), disturbance[0], disturbance[1])
        Q = climber.applied_force(state.heading, 1.0) + pushed.velocity
        Qc = constraint_force(climber.mass_matrix_at(state.heading), Q, A, b)
        expected = [along(state.heading, Qc), across(state.heading, Qc), Qc[2]]
        scale = 1 + np.abs(Qc).max()
        np.testing.assert_allclose(command.constraint_force, expected, atol=1e-12 * scale)
        torques = climber.wheel_torques(expected[0], expected[2])
        np.testing.assert_allclose(command.torques, torques, atol=1e-12 * scale)
        np.testing.assert_allclose(command.lost, 0, atol=1e-12 * scale)


@dataclass(frozen=True)
class Rows:
    """Guidance with rows of its own, which nobody has solved by hand."""

    guidance: Guidance = Guidance()  # noqa: RUF009 - it is frozen

    def prepare(self, target):
        return self.guidance.prepare(target)

    def rows(self, prepared, state):
        desired = self.guidance.desired_acceleration(prepared, state.motion)
        A, b = rows(state, desired)
        return 2.0 * A[::-1], 2.0 * b[::-1], desired.speed


def test_constraints_that_give_rows_need_no_closed_form():
    options = ControlOptions(solver="generic")
    given = situation(START, disturbance=(3.0, -0.4)), PAPER.at(0.1).target
    wanted, got = (ControlLaw(Climber(), c, options).command(*given) for c in (Guidance(), Rows()))
    np.testing.assert_allclose(got.torques, wanted.torques, rtol=1e-12)


bounds = st.tuples(st.floats(-20, 20), st.floats(0, 20)).map(lambda b: (b[0], b[0] + b[1]))


@given(st.floats(-50, 50), st.floats(-50, 50), bounds, bounds)
def test_limits_keep_the_turn_before_the_drive(right, left, right_bounds, left_bounds):
    climber = Climber()
    wrench = climber.wrench(right, left)
    *done, one, other, _ = climber.saturate(*wrench, right_bounds, left_bounds)
    got = one, other
    np.testing.assert_allclose(done, climber.wrench(*got), atol=1e-9)
    for torque, (low, high) in zip(got, (right_bounds, left_bounds), strict=True):
        assert low <= torque <= high  # not beyond it by as little as rounding
    turn, drive = (right - left) / 2, (right + left) / 2
    # the nearest turn that any torques within the bounds give, then the nearest drive beside it
    turns = [(a - b) / 2 for a in right_bounds for b in left_bounds]
    best_turn = np.clip(turn, min(turns), max(turns))
    assert (got[0] - got[1]) / 2 == pytest.approx(best_turn, abs=1e-9)
    lowest = max(right_bounds[0] - best_turn, left_bounds[0] + best_turn)
    highest = min(right_bounds[1] - best_turn, left_bounds[1] + best_turn)
    assert (got[0] + got[1]) / 2 == pytest.approx(np.clip(drive, lowest, highest), abs=1e-9)


@settings(max_examples=300, deadline=None)
@given(
    st.floats(0.01, 50),
    st.sampled_from([0.0, 30.0, 400.0]),
    st.sampled_from([0.0, 3.0, 1000.0]),
    st.tuples(st.floats(-12, 12), st.floats(-30, 30), st.floats(-300, 300), st.floats(-300, 300)),
    st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
    st.booleans(),
)
def test_no_torque_is_beyond_its_limit_by_as_little_as_rounding(
    limit, no_load, rate, motion, shares, many
):
    climber = Climber(max_wheel_torque=limit, no_load_wheel_rate=no_load)
    law = ControlLaw(climber, Guidance(), ControlOptions(max_torque_rate=rate))
    v, omega, drive, turn = (np.full(3, x) for x in motion) if many else motion
    pose = np.zeros((3, 3) if many else 3)
    at = State.rolling(pose, v, omega)
    held = limit * np.array(shares)
    if many:
        held = np.repeat(held[:, None], 3, axis=1)
    of = ControlInput(at.motion, Torques(*held), Wrench(drive, turn), PERIOD)
    for wheels in law.command(of, PAPER.at(0.0).target).wheels, law.braking(of, Braking(5.0, 5.0)):
        bounds = climber.bounds(at.motion)
        for torque, before, (low, high) in zip(wheels, held, bounds, strict=True):
            assert np.all(np.abs(torque) <= limit)
            assert np.all((low <= torque) & (torque <= high))
            if rate > 0:  # where the motor can hold what it held
                nearest = np.clip(before, low, high)
                assert np.all(np.abs(torque - nearest) <= rate * PERIOD * (1 + 1e-12) + 1e-14)


@dataclass(frozen=True)
class Pushing:
    """As a control law of another package: a force and a moment of where the climber is."""

    stiffness: float = parameter(30.0, "N/m", "of place")

    def wrench(self, climber, target, motion):
        pull = self.stiffness * (target.x - motion.x)
        return Wrench(pull + climber.weight_along_wall * motion.sine, target.yaw_rate)


@pytest.mark.parametrize("predict", [False, True])
def test_a_control_law_of_forces_has_prediction_disturbance_and_limits_around_it(predict):
    climber, target = Climber(max_wheel_torque=0.3), PAPER.at(0.1).target
    options, other = ControlOptions(predict=predict), Pushing()
    law = ControlLaw(climber, Guidance(), options, other)
    now = situation(START, held=(0.3, 0.2), disturbance=(4.0, -0.5))
    command = law.command(now, target)
    at, acting = now.motion, climber.wrench(*now.held)
    for _ in range(2 if predict else 1):  # with the torques held, and then with the first answer
        if predict:
            moved = np.add(acting, now.disturbance)
            at = model.predict(climber, now.motion, *moved, options.lookahead(PERIOD))
        wanted = np.subtract(other.wrench(climber, target, at), now.disturbance)
        acting = climber.saturate(*wanted, *climber.bounds(START.motion))[:2]
    assert command.demanded == pytest.approx(tuple(wanted), abs=1e-12)
    assert command.lateral == pytest.approx(
        climber.mass * at.speed * at.yaw_rate + climber.weight_along_wall * at.cosine
    )
    assert np.abs(command.torques).max() <= 0.3
    assert np.abs(command.lost).max() > 0.1


@pytest.mark.parametrize("turning", [0.0, 1e-16, 2.0])
def test_without_prediction_torques_are_for_the_motion_that_is_told(turning):
    """Whatever has been learnt to resist its turn: the safe output came for each 1e-16 N m."""
    law = ControlLaw(Climber(), Guidance(), ControlOptions(predict=False))
    now = situation(START, held=(0.3, 0.2))._replace(turning=turning)
    assert law.command(now, PAPER.at(0.1).target).motion == now.motion


@dataclass(frozen=True)
class Kind:
    """A law of forces, and of accelerations, that answers in another kind of number."""

    number: type

    def wrench(self, climber, target, motion):
        return Wrench(self.number(3), self.number(-1))

    def prepare(self, target):
        return target

    def desired_acceleration(self, prepared, motion):
        return DesiredAcceleration(*map(self.number, (1, -1, 0, 0)))


@pytest.mark.parametrize("number", [int, Fraction, np.float64, np.float32, np.int64, np.array])
@pytest.mark.parametrize("of_forces", [False, True])
def test_a_law_of_somebody_else_s_may_answer_with_any_kind_of_number(number, of_forces):
    """What is compared and told by it further on is made of Python's own."""

    def command(number):
        given = (Guidance(), ControlOptions(), Kind(number)) if of_forces else (Kind(number),)
        return ControlLaw(Climber(), *given).command(
            situation(START, disturbance=(4.0, -0.5)), PAPER.at(0.1).target
        )

    told = command(number)
    told = [*told.wheels, *told.demanded, *told.lost, told.lateral, told.forward, told.yaw_rate]
    assert {type(one) for one in told} == {float}
    np.testing.assert_allclose(told[:2], command(float).wheels, rtol=1e-6)


def test_what_the_limits_take_away_is_told():
    reference = PAPER.at(0.0)
    for limit, is_cut in ((20.0, False), (0.2, True)):
        law = ControlLaw(Climber(max_wheel_torque=limit), Guidance(), ControlOptions())
        command = law.command(situation(START), reference.target)
        assert np.abs(command.torques).max() <= limit
        assert bool(np.abs(command.lost).max() > 1e-9) is is_cut
        demanded = np.add(law.climber.force_and_moment(command.torques), command.lost)
        force = command.constraint_force
        np.testing.assert_allclose(demanded, [force[0], force[2]], atol=1e-9)


def test_a_dc_motor_has_less_torque_the_faster_its_wheel_and_full_torque_to_brake():
    climber = Climber(no_load_wheel_rate=400.0)  # START turns its wheels at 364 and 377 rad/s
    law = ControlLaw(climber, Guidance(), ControlOptions())
    uphill = replace(PAPER.at(0.0), acceleration=np.array([500.0, 0.0, 0.0]))
    torques = law.command(situation(START), uphill.target).torques
    rates = climber.wheel_rates(START)
    assert (torques <= 20.0 * (1 - rates / 400.0) + 1e-12).all()
    assert (torques > 0).all()
    braking = replace(PAPER.at(0.0), acceleration=np.array([-500.0, 0.0, 0.0]))
    torques = law.command(situation(START), braking.target).torques
    assert torques.min() == -20.0


def test_a_torque_changes_no_faster_than_its_limit():
    options = ControlOptions(max_torque_rate=40.0)
    law = ControlLaw(Climber(), Guidance(), options)
    hard = replace(PAPER.at(0.0), acceleration=np.array([200.0, 0.0, 50.0]))
    held = np.array([0.3, -0.1])
    command = law.command(situation(START, held), hard.target)
    assert np.abs(command.torques - held).max() == pytest.approx(40.0 * PERIOD)
    assert command.fits  # what is yet to come is not lost: the reference does not wait for it


def test_holding_torques_keep_the_climber_where_it_is():
    climber = Climber(seal_friction_coefficient=0.0)
    law, plant = ControlLaw(climber, Guidance(), ControlOptions()), Plant(climber, 0.0025)
    state = State.rolling(np.array([0.0, 0.0, 1.0]), 0.3, 0.4)
    for _ in range(1000):
        torques = law.braking(situation(state), Braking(5.0, 5.0))
        state = plant.advance(state, np.array(torques), steps=2)
    np.testing.assert_allclose(state.velocity, 0, atol=1e-6)


@pytest.mark.parametrize("constraints", [Guidance(), Exact()], ids=["guidance", "exact"])
@pytest.mark.parametrize("limit", [1.2, 20.0])
def test_one_call_serves_many_climbers(constraints, limit):
    random, n = np.random.default_rng(9), 40
    climber = Climber(max_wheel_torque=limit)
    law = ControlLaw(climber, constraints, ControlOptions(max_torque_rate=1000.0))
    reference = PAPER.at(1.0)
    pose = reference.pose + random.normal(size=(n, 3)) * 0.1
    motion = State.rolling(pose, 8 + random.normal(size=n), random.normal(size=n)).motion
    held, disturbance = random.normal(size=(2, n)), 10 * random.normal(size=(2, n))
    many = ControlInput(motion, Torques(*held), Wrench(*disturbance), PERIOD)
    together = law.command(many, reference.target)
    lost = np.broadcast_to(np.transpose(together.lost), (n, 2))
    for i in range(n):
        one = ControlInput(
            Motion(*(float(number[i]) for number in motion)),
            Torques(*held[:, i].tolist()),
            Wrench(*disturbance[:, i].tolist()),
            PERIOD,
        )
        alone = law.command(one, reference.target)
        for got, expected in (
            (together.torques[i], alone.torques),
            (together.constraint_force[i], alone.constraint_force),
            (lost[i], alone.lost),
        ):
            np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-12 * 100)
