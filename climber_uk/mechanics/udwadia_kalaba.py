"""Constrained motion without multipliers: Qc = M^(1/2) B⁺ (b - A a), B = A M^(-1/2) (8).

Arrays may carry leading axes, over which every function broadcasts: M (..., n, n) symmetric
positive definite, Q, v (..., n), A (..., p, n) of any rank, b (..., p). Knows no robot.
"""

import numpy as np

from climber_uk.mechanics import Array, solve, times, transpose

# Singular values of B below this share of the largest count as zero: far above the rounding
# (1e-16) that a dependent row leaves behind, far below any constraint that is meant.
RANK_TOLERANCE = 1e-11


def constraint_force(M: Array, Q: Array, A: Array, b: Array) -> Array:
    """Constraint force Qc (8), shape (..., n): the least one, in Gauss's sense, with A q̈ = b.

    Raises `ValueError` naming the shapes that do not fit, or if M is not symmetric positive
    definite.
    """
    _check_shapes(M, A, Q=Q, b=b)
    L, B, w = _whitened(M, A, Q)
    return times(L, _least(B, b - times(B, w)))


def constrained_acceleration(M: Array, Q: Array, A: Array, b: Array) -> Array:
    """Acceleration q̈ = a + M^(-1/2) B⁺ (b - A a), a = M⁻¹ Q (10), shape (..., n).

    Raises `ValueError` as `constraint_force` does.
    """
    _check_shapes(M, A, Q=Q, b=b)
    L, B, w = _whitened(M, A, Q)
    return solve(transpose(L), w + _least(B, b - times(B, w)))


def velocity_correction(M: Array, A: Array, b_q: Array, v: Array) -> Array:
    """Corrected velocity v + M^(-1/2) B⁺ (b_q - A v) (30), shape (..., n): A q̇ = b_q holds.

    Raises `ValueError` as `constraint_force` does.
    """
    _check_shapes(M, A, v=v, b_q=b_q)
    L, B, _ = _whitened(M, A, v)
    return v + solve(transpose(L), _least(B, b_q - times(A, v)))


def _whitened(M: Array, A: Array, Q: Array) -> tuple[Array, Array, Array]:
    """L, B = A L⁻ᵀ and w = L⁻¹ Q, with M = L Lᵀ.

    Any such factor serves as well as the symmetric root M^(1/2): B changes by a rotation, which
    B⁺ undoes. So no square root of a matrix is taken. A a = B w, M^(1/2) B⁺ = L B⁺.
    """
    if np.max(np.abs(M - transpose(M))) > 1e-12 * np.max(np.abs(M)):
        raise ValueError("M must be symmetric")
    try:
        L: Array = np.linalg.cholesky(M)
    except np.linalg.LinAlgError as error:
        raise ValueError("M must be positive definite") from error
    leading = np.broadcast_shapes(A.shape[:-2], Q.shape[:-1])
    rows = np.concatenate(
        [
            np.broadcast_to(A, leading + A.shape[-2:]),
            np.broadcast_to(Q, leading + Q.shape[-1:])[..., None, :],
        ],
        axis=-2,
    )
    whitened = transpose(np.linalg.solve(L, transpose(rows)))
    return L, whitened[..., :-1, :], whitened[..., -1, :]


def _least(B: Array, residual: Array) -> Array:
    """B⁺ times `residual`."""
    left: Array
    left, singular, right = np.linalg.svd(B, full_matrices=False)
    kept = singular > RANK_TOLERANCE * np.max(singular, axis=-1, keepdims=True, initial=0)
    coordinates = times(transpose(left), residual)
    scaled = np.divide(coordinates, singular, out=np.zeros_like(coordinates), where=kept)
    return times(transpose(right), scaled)


def _check_shapes(M: Array, A: Array, **vectors: Array) -> None:
    """Raise `ValueError` with all shapes unless M is (..., n, n), A (..., p, n) and vectors fit."""
    shapes = {name: np.shape(array) for name, array in {"M": M, "A": A, **vectors}.items()}
    square, rows = shapes["M"][-2:], shapes["A"][-2:]
    fits = len(square) == len(rows) == 2 and square[0] == square[1] == rows[1]
    lengths = {"Q": square[-1:], "v": square[-1:], "b": rows[:1], "b_q": rows[:1]}
    if not fits or any(shapes[name][-1:] != lengths[name] for name in vectors):
        listed = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(f"shapes do not fit: {listed}; want M (n, n), A (p, n), Q, v (n,), b (p,)")
