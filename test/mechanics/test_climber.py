import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.mechanics.climber import Climber, no_slip
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.udwadia_kalaba import constrained_acceleration

PAPER = Climber()
angles = st.floats(-10, 10)
speeds = st.floats(-5, 5)
torque_pairs = st.tuples(st.floats(-20, 20), st.floats(-20, 20)).map(np.array)


def rolling(heading, v, omega):
    return State.rolling(np.array([1.0, 2.0, heading]), v, omega)


def test_derived_numbers_of_the_paper_are_those_by_hand():
    assert PAPER.seal_friction == pytest.approx(0.47 * 0.8 * 2500 * 0.06)  # 56.4 N
    assert PAPER.weight_along_wall == pytest.approx(49.05)


@pytest.mark.parametrize(("inclination", "share"), [(0, 0), (30, 0.5), (90, 1), (180, 0)])
def test_only_the_part_of_the_weight_along_the_wall_pulls(inclination, share):
    weight = Climber(inclination=inclination).weight_along_wall
    assert weight == pytest.approx(49.05 * share, abs=1e-12)


@pytest.mark.parametrize(
    ("inclination", "gravity"), [(0, 9.81), (60, 4.905), (90, 0), (180, -9.81)]
)
def test_gravity_presses_onto_a_floor_and_pulls_off_a_ceiling(inclination, gravity):
    got = Climber(inclination=inclination).gravity_into_wall
    assert got == pytest.approx(gravity, abs=1e-12)


@given(angles, speeds, speeds, torque_pairs, st.sampled_from([-1.0, 0.0, 1.0]))
def test_rolling_is_the_udwadia_kalaba_motion_under_no_slip(heading, v, omega, torques, direction):
    state = rolling(heading, v, omega)
    Q = PAPER.applied_force(heading, direction)
    Q = Q + rolling(heading, *PAPER.force_and_moment(torques)).velocity
    A, b = no_slip(state)
    expected = constrained_acceleration(PAPER.mass_matrix, Q, A[None], np.array([b]))
    got = PAPER.rolling_acceleration(state, torques, direction)
    np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-10)


@given(torque_pairs)
def test_torques_survive_the_way_to_forces_and_back(torques):
    drive, turn = PAPER.force_and_moment(torques)
    np.testing.assert_allclose(PAPER.wheel_torques(drive, turn), torques, atol=1e-12)


@given(torque_pairs)
def test_torques_add_up_to_the_drive_and_differ_by_the_yaw_moment(torques):
    drive, moment = PAPER.force_and_moment(torques)
    assert drive == pytest.approx(torques.sum() / 0.027, abs=1e-9)
    assert moment == pytest.approx(0.3 * (torques[0] - torques[1]) / 0.027, abs=1e-9)


def test_wheels_turn_as_fast_as_the_wall_passes_under_them():
    # turning on the spot: right wheel forwards, left wheel backwards
    np.testing.assert_allclose(
        PAPER.wheel_rates(rolling(0.3, 0.0, 1.0)), [0.3 / 0.027, -0.3 / 0.027]
    )


def test_one_call_serves_many_climbers():
    random = np.random.default_rng(3)
    state = State(random.normal(size=(2, 7, 3)), random.normal(size=(2, 7, 3)))
    torques = random.normal(size=(2, 7, 2))
    together = PAPER.rolling_acceleration(state, torques, 1.0)
    for index in np.ndindex(2, 7):
        alone = PAPER.rolling_acceleration(
            State(state.pose[index], state.velocity[index]), torques[index], 1.0
        )
        np.testing.assert_allclose(together[index], alone, rtol=1e-13)


@pytest.mark.parametrize(
    ("name", "value", "bound"),
    [
        ("mass", -5.0, r"mass=-5.0 must be > 0 \[kg\]"),
        ("wheel_radius", 0.0, r"wheel_radius=0.0 must be > 0 \[m\]"),
        ("wheel_load_share", 1.2, "wheel_load_share=1.2 must be <= 1"),
        ("inclination", float("nan"), "inclination=nan must be a finite number"),
        ("suction_area", "wide", "suction_area='wide' must be a finite number"),
    ],
)
def test_an_impossible_parameter_is_named_with_its_bound(name, value, bound):
    with pytest.raises(ValueError, match=bound):
        dataclasses.replace(PAPER, **{name: value})


def test_a_climber_may_be_many_and_each_is_checked():
    many = dataclasses.replace(PAPER, mass=np.array([4.0, 5.0]), inclination=np.array([0.0, 90.0]))
    np.testing.assert_allclose(many.weight_along_wall, [0, 49.05])
    with pytest.raises(ValueError, match=r"mass=.*-1.0.* must be > 0 \[kg\]"):
        dataclasses.replace(PAPER, mass=np.array([4.0, -1.0]))
    with pytest.raises(ValueError, match=r"mass=.*nan.* must be a finite number"):
        dataclasses.replace(PAPER, mass=np.array([4.0, np.nan, 3.0]))
