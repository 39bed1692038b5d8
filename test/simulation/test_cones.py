import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from climber_uk.simulation.cones import Cone, impulse_against, solve_friction_impulses

numbers = st.floats(-10, 10)


@given(
    st.tuples(numbers, numbers, numbers).map(np.array),
    st.tuples(*[st.floats(0.01, 100)] * 3).map(np.array),
    st.floats(0, 10),
)
def test_an_impulse_stops_sliding_or_opposes_what_remains_of_it(sliding, yielding, limit):
    impulse = impulse_against(sliding, yielding, limit)
    size, remains = np.linalg.norm(impulse), sliding + yielding * impulse
    assert size <= limit * (1 + 1e-12)
    if np.abs(remains).max() > 1e-9 and limit > 1e-9:
        assert size == pytest.approx(limit, rel=1e-9)
        direction = remains / np.linalg.norm(remains)
        np.testing.assert_allclose(impulse, -limit * direction, atol=1e-6 * limit)


def test_a_block_on_a_cart_shares_its_momentum_until_both_move_alike():
    # 2 kg at 3 m/s on 4 kg at rest
    cone = Cone(np.array([[1.0, -1.0]]), 100.0)
    velocity, holds = solve_friction_impulses(
        np.array([3.0, 0.0]), np.array([0.5, 0.25]), [cone], np.zeros(2)
    )
    np.testing.assert_allclose(velocity, [1.0, 1.0])
    assert holds == [True]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
@example(2717, False)  # two that only just hold a third
def test_what_is_found_is_the_minimum_that_a_general_optimiser_finds(seed, many):
    random = np.random.default_rng(seed)
    before, masses = random.normal(size=4), random.uniform(0.5, 2.0, size=4)
    rows = [np.eye(2, 4), np.eye(2, 4, 2), np.array([[1.0, 0.0, -1.0, 0.0], [0, 1, 0, -1]])]
    rows += 2 * rows if many else []
    cones = [Cone(row.astype(float), random.uniform(0, 2)) for row in rows]
    start = random.choice([0.0, 1.0, 1e3]) * random.normal(size=4)
    found, _ = solve_friction_impulses(before, 1 / masses, cones, start)

    def cost(v):
        rubbing = sum(cone.limit * np.linalg.norm(cone.rows @ v) for cone in cones)
        return masses @ (v - before) ** 2 / 2 + rubbing

    best = min(
        minimize(cost, x, method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-14}).fun
        for x in (found, before)
    )
    assert cost(found) <= best + 1e-10
    assert masses @ found**2 <= masses @ before**2 + 1e-12
