import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from climber_uk.mechanics.udwadia_kalaba import (
    constrained_acceleration,
    constraint_force,
    velocity_correction,
)

MASS = np.diag([5.0, 5.0, 0.33])


def kkt(M, Q, A, b):
    """Independent solution: multipliers of min (q̈ - a)ᵀ M (q̈ - a) under A q̈ = b."""
    n, p = len(Q), len(b)
    matrix = np.block([[M, A.T], [A, np.zeros((p, p))]])
    solution, *_ = np.linalg.lstsq(matrix, np.concatenate([Q, b]), rcond=1e-12)
    return solution[:n]


@st.composite
def problems(draw):
    """M symmetric positive definite, A of any rank, b consistent with A."""
    seed = draw(st.integers(0, 2**32 - 1))
    n = draw(st.integers(1, 12))
    p = draw(st.integers(1, n))
    rank = draw(st.integers(1, p))
    random = np.random.default_rng(seed)
    rotation = np.linalg.qr(random.normal(size=(n, n)))[0]
    M = (rotation * random.uniform(0.2, 20, n)) @ rotation.T
    left = np.linalg.qr(random.normal(size=(p, p)))[0][:, :rank]
    right = np.linalg.qr(random.normal(size=(n, n)))[0][:rank]
    A = (left * random.uniform(0.1, 3, rank)) @ right
    Q = random.normal(size=n) * 10
    return (M + M.T) / 2, Q, A, A @ random.normal(size=n)


@settings(max_examples=200, deadline=None)
@given(problems())
def test_motion_equals_that_of_an_independent_kkt_solution(problem):
    M, Q, A, b = problem
    q_2 = constrained_acceleration(M, Q, A, b)
    expected = kkt(M, Q, A, b)
    assert np.linalg.norm(q_2 - expected) <= 1e-9 * (1 + np.linalg.norm(expected))
    force = M @ expected - Q
    assert np.linalg.norm(constraint_force(M, Q, A, b) - force) <= 1e-9 * (
        np.linalg.norm(force) + np.linalg.norm(Q)
    )


@settings(max_examples=100, deadline=None)
@given(problems())
def test_corrected_velocity_obeys_the_constraint_and_moves_least(problem):
    M, v, A, b_q = problem
    corrected = velocity_correction(M, A, b_q, v)
    np.testing.assert_allclose(A @ corrected, b_q, atol=1e-9)
    np.testing.assert_allclose(corrected, kkt(M, M @ v, A, b_q), atol=1e-8)


def test_a_bead_on_an_incline_slides_as_by_hand():
    # mass 2 on the line y = x under gravity: half of g along each axis
    M, Q = 2 * np.eye(2), np.array([0.0, -2 * 9.81])
    A, b = np.array([[1.0, -1.0]]), np.array([0.0])
    np.testing.assert_allclose(constrained_acceleration(M, Q, A, b), [-4.905, -4.905])
    np.testing.assert_allclose(constraint_force(M, Q, A, b), [-9.81, 9.81])


def test_leading_axes_broadcast():
    random = np.random.default_rng(1)
    Q = random.normal(size=(4, 5, 3))
    A = random.normal(size=(5, 2, 3))
    b = random.normal(size=(4, 5, 2))
    together = constraint_force(MASS, Q, A, b)
    assert together.shape == (4, 5, 3)
    for i in range(4):
        for j in range(5):
            alone = constraint_force(MASS, Q[i, j], A[j], b[i, j])
            np.testing.assert_allclose(together[i, j], alone, atol=1e-12)
    corrected = velocity_correction(MASS, A, b, Q)
    np.testing.assert_allclose((A @ corrected[..., None])[..., 0], b, atol=1e-12)


@pytest.mark.parametrize(
    ("M", "A", "wrong"),
    [
        (np.eye(2), np.ones((1, 3)), r"M \(2, 2\)"),
        (np.ones((2, 3)), np.ones((1, 3)), r"M \(2, 3\)"),
        (np.eye(3), np.ones(3), r"A \(3,\)"),
        (np.eye(3), np.ones((2, 3)), r"b \(1,\)"),
    ],
)
def test_shapes_that_do_not_fit_are_named(M, A, wrong):
    with pytest.raises(ValueError, match=wrong):
        constraint_force(M, np.zeros(3), A, np.zeros(1))


@pytest.mark.parametrize(
    ("M", "wrong"),
    [(np.array([[1.0, 0.5], [0.0, 1.0]]), "symmetric"), (np.diag([1.0, -1.0]), "definite")],
)
def test_a_matrix_that_is_no_mass_is_refused(M, wrong):
    with pytest.raises(ValueError, match=wrong):
        constraint_force(M, np.zeros(2), np.ones((1, 2)), np.zeros(1))
