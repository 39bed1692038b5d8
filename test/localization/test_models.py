"""How the state goes on and what sensors show of it: Jacobians, and values by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from climber_uk.localization import models
from climber_uk.localization.models import BIAS, CREEP, HEADING, SCALE, Late, Travel
from climber_uk.localization.options import LocalizationOptions

STATES = st.tuples(
    st.floats(-10, 10),
    st.floats(-10, 10),
    st.floats(-7, 7),
    st.floats(-0.1, 0.1),
    st.floats(-0.1, 0.1),
    st.floats(-0.2, 0.2),
    st.floats(-0.5, 0.5),
    st.floats(-0.5, 0.5),
    st.floats(-0.3, 0.3),
    st.floats(-0.3, 0.3),
    st.floats(-1, 1),
    st.floats(-1, 1),
).map(np.array)
TRAVELS = st.builds(
    Travel,
    duration=st.floats(0.001, 0.1),
    distance=st.floats(-0.2, 0.2),
    path=st.floats(0, 0.2),
    yaw_rate=st.floats(-3, 3),
    is_gyro=st.booleans(),
    scrubbed=st.floats(0, 0.3),
    slipped=st.floats(-0.1, 0.1),
    dragged=st.floats(-0.1, 0.1),
)
STEP = 1e-6


def difference(function, state):
    """Derivative of a function (n,) by the state, by central differences."""
    columns = [
        (function(state + side) - function(state - side)) / (2 * STEP)
        for side in STEP * np.eye(len(state))
    ]
    return np.stack(columns, axis=1)


@given(state=STATES, travel=TRAVELS, pull=st.floats(0, 1))
def test_the_jacobian_of_a_travel_is_its_derivative(state, travel, pull):
    found = models.advanced_jacobian(state, travel, pull)
    expected = difference(lambda state: models.advanced(state, travel, pull), state)
    np.testing.assert_allclose(found, expected, atol=1e-8)


@given(
    state=STATES,
    late=st.builds(Late, turned=st.floats(-1, 1), by_bias=st.floats(0, 0.2)),
    along_wall=st.floats(0, 9.81),
)
def test_the_jacobian_of_gravity_is_its_derivative(state, late, along_wall):
    found = models.gravity_jacobian(state, late, along_wall)
    expected = difference(lambda state: models.gravity(state, late, along_wall), state)
    np.testing.assert_allclose(found, expected, atol=1e-7)


@given(state=STATES, lever=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_the_jacobian_of_a_fix_is_its_derivative(state, lever):
    found = models.fixed_jacobian(state, lever)
    expected = difference(lambda state: models.fixed(state, lever), state)
    np.testing.assert_allclose(found, expected, atol=1e-7)


def test_a_climber_that_rolls_up_a_vertical_wall_sags_by_its_creep():
    state = np.array([1.0, 2.0, math.pi / 2, 0.0, 0.1, 0.03, *[0] * 6])
    after = models.advanced(state, Travel(0.1, 0.2, 0.2, 0.0, True), pull=1.0)
    np.testing.assert_allclose(after[:3], [1.0, 2.0 + 0.2 * 0.9 - 0.2 * 0.03, math.pi / 2])


def test_a_climber_that_turns_on_the_spot_sags_too_and_a_gyros_bias_is_no_turn():
    state = np.array([0.0, 0.0, 0.0, 0.5, 0.0, 0.03, *[0] * 6])
    travel = Travel(0.1, 0.0, 0.2, 0.5, True)
    np.testing.assert_allclose(models.advanced(state, travel, 1.0)[:3], [0, -0.006, 0], atol=1e-15)
    by_wheels = models.advanced(state, travel._replace(is_gyro=False), 1.0)
    assert by_wheels[HEADING] == pytest.approx(0.05)


def test_wheels_that_slip_along_in_a_turn_go_less_far_uphill_and_further_downhill():
    slips, travel = [0.5, 0.4], Travel(0.1, 0.05, 0.05, 0.0, True, slipped=0.01, dragged=0.01)
    for heading, way in ((math.pi / 2, 0.05 - 0.005 - 0.004), (-math.pi / 2, -0.05 + 0.001)):
        state = np.array([0.0, 0.0, heading, *[0] * 7, *slips])
        assert models.advanced(state, travel, 1.0)[1] == pytest.approx(way)
        assert models.advanced(state, travel, 0.0)[1] == pytest.approx(math.copysign(0.045, way))
    back = travel._replace(distance=-0.05, dragged=-0.01)
    assert models.advanced(state, back, 0.0)[1] == pytest.approx(0.045)


def test_gravity_is_forwards_where_the_climber_looks_up_and_to_the_left_where_it_looks_along_x():
    for heading, force in ((math.pi / 2, (9.81, 0)), (0.0, (0, 9.81)), (math.pi, (0, -9.81))):
        state = np.array([0, 0, heading, *[0] * 9])
        np.testing.assert_allclose(models.gravity(state, Late(0, 0), 9.81), force, atol=1e-12)


@pytest.mark.parametrize("inclination", [0.0, 180.0])
def test_on_floor_and_ceiling_gravity_and_creep_weigh_nothing(inclination):
    options = LocalizationOptions(inclination=inclination)
    assert models.share_along_wall(options) == pytest.approx(0, abs=1e-15)
    state, late = np.array([0, 0, 1.0, *[0] * 9]), Late(0, 0)
    jacobian = models.gravity_jacobian(state, late, options.gravity_along_wall)
    np.testing.assert_allclose(jacobian[:, : models.FORWARD_BIAS], 0, atol=1e-14)


def test_noise_does_not_depend_on_how_often_it_is_added():
    options = LocalizationOptions()
    once = models.process_noise(Travel(1.0, 0.5, 0.5, 0.2, True), options)
    part = models.process_noise(Travel(0.01, 0.005, 0.005, 0.2, True), options)
    np.testing.assert_allclose(100 * part, once)
    assert once[BIAS] == options.gyro_bias_walk**2
    assert once[CREEP] == 0
    assert once[SCALE] > 0


def test_without_a_gyro_a_turn_is_as_uncertain_as_the_wheels():
    options = replace(LocalizationOptions(), turn_noise=0.1)
    noise = models.process_noise(Travel(1.0, 0.0, 0.3, 1.0, False), options)
    assert noise[HEADING] == pytest.approx(0.01 * (1.0 + 0.3 / options.half_track))
