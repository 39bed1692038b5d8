"""The climber as Xu & Liu (2017) print it: M q̈ = Q + Qc, Qc = M^(1/2) B⁺ (b - A a) (8), (14)-(25).

Literally, with what is questionable left in, as the yardstick for the consistent model. The first
row of M q̈ = Q + Qc is (14), the second (16), the third no-slip (18); A q̈ = b is the path (21).
This M is not symmetric, so that (8) is not Gauss's least force, and the principal root M^(1/2) is
complex at some headings. `udwadia_kalaba` refuses such an M, rightly; hence nothing of it is used
here. `GAINS` are the readings of (8) that a reader may try; the first one is ours.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import sqrtm

from climber_uk.mechanics import Array, pack, solve, times, transpose, unpack
from climber_uk.mechanics.climber import GRAVITY, Climber

PAPER_CLIMBER = Climber()
A = np.eye(2, 3)  # (23): the path asks for ẍ and ÿ
d = np.array([[1.0, 1.0], [1.0, -1.0], [0.0, 0.0]])  # Qc = d τ (24)


def _through_root(M: Array) -> Array:
    """M^(1/2) B⁺ with B = A M^(-1/2), complex where the principal root is, (..., 3, 2)."""
    root = sqrtm(M)
    B = transpose(np.linalg.solve(transpose(root), A.T))
    return root @ _pseudo_inverse(B)


# What Qc = gain · (b - A a) may mean when M is not symmetric. For a mass, all but (A M⁻¹)⁺, the
# least Qc in its plain norm, are the same.
GAINS: dict[str, Callable[[Array], Array]] = {
    # A q̈ = b still holds, A and b being real
    "real part": lambda M: np.real(_through_root(M)),
    # as solvers that take complex states would go on
    "kept complex": lambda M: _through_root(M).astype(complex),
    "modulus": lambda M: np.abs(_through_root(M)),
    "(A M⁻¹)⁺": lambda M: np.linalg.pinv(transpose(np.linalg.solve(transpose(M), A.T))),
    "Aᵀ (A M⁻¹ Aᵀ)⁺": lambda M: A.T @ np.linalg.pinv(A @ np.linalg.solve(M, A.T)),
}


@dataclass(frozen=True)
class PrintedSystem:
    """Climber and path as printed; y (..., 6) is (q, v), time (...) [s].

    Raises `ValueError` if `gain` is not one of `GAINS`.
    """

    climber: Climber = PAPER_CLIMBER
    semi_axis_x: float = 10.0  # [m]
    semi_axis_y: float = 6.0  # [m]
    gain: str = "real part"

    def __post_init__(self) -> None:
        if self.gain not in GAINS:
            raise ValueError(f"gain={self.gain!r} must be one of {', '.join(GAINS)}")

    def mass_matrix(self, q: Array) -> Array:
        """M (..., 3, 3) of (19)."""
        heading = unpack(q)[2]
        r, m = self.climber.wheel_radius, self.climber.mass
        inertia = self.climber.yaw_inertia * r / self.climber.half_track
        cosine, sine, zero = np.cos(heading), np.sin(heading), 0 * heading
        M = [
            [m * r * cosine, m * r * sine, zero],
            [zero, zero, zero + inertia],
            [sine, -cosine, zero],
        ]
        return np.moveaxis(np.array(M), (0, 1), (-2, -1))

    def force(self, q: Array, v: Array) -> Array:
        """Q (..., 3) of (19)."""
        heading = unpack(q)[2]
        x_1, y_1, omega = unpack(v)
        r, m = self.climber.wheel_radius, self.climber.mass
        cosine, sine = np.cos(heading), np.sin(heading)
        drag = self.climber.seal_friction * r + m * GRAVITY * r * sine
        return pack(
            m * r * sine * omega * x_1 - m * r * cosine * omega * y_1 - drag,
            0 * heading,
            -cosine * omega * x_1 - sine * omega * y_1,
        )

    def b(self, time: Array | float) -> Array:
        """Accelerations that the path demands (22), (..., 2)."""
        return pack(-self.semi_axis_x * np.sin(time), -self.semi_axis_y * np.cos(time))

    def b_q(self, time: Array | float) -> Array:
        """Velocities that the path demands (27), (..., 2)."""
        return pack(self.semi_axis_x * np.cos(time), -self.semi_axis_y * np.sin(time))

    def constraint_force(self, time: Array | float, q: Array, v: Array) -> Array:
        """Qc (..., 3) of (24)."""
        M = self.mass_matrix(q)
        a = solve(M, self.force(q, v))
        return times(GAINS[self.gain](M), self.b(time) - a[..., :2])

    def torques(self, Qc: Array) -> Array:
        """τ = d⁺ Qc (25), (..., 2) (right, left) [N m]: the third component of Qc is dropped."""
        return times(np.linalg.pinv(d), Qc)

    def uncorrected(self, time: Array | float, y: Array) -> Array:
        """Derivative of y by (26): q̇ = v, v̇ = M⁻¹ (Q + Qc)."""
        return self._derivative(time, y, corrected=False)

    def corrected(self, time: Array | float, y: Array) -> Array:
        """Derivative of y by (30): q̇ = v + M^(-1/2) B⁺ (b_q - A v) as well."""
        return self._derivative(time, y, corrected=True)

    def _derivative(self, time: Array | float, y: Array, corrected: bool) -> Array:
        q, v = y[..., :3], y[..., 3:]
        M, Q = self.mass_matrix(q), self.force(q, v)
        # M^(-1/2) B⁺ = M⁻¹ · M^(1/2) B⁺; solved for together with a = M⁻¹ Q
        solved = np.linalg.solve(M, np.concatenate([GAINS[self.gain](M), Q[..., None]], axis=-1))
        gain, a = solved[..., :2], solved[..., 2]
        v_1 = a + times(gain, self.b(time) - a[..., :2])
        q_1 = v + times(gain, self.b_q(time) - v[..., :2]) if corrected else v
        return np.concatenate([q_1, v_1], axis=-1)


def _pseudo_inverse(B: Array) -> Array:
    """B⁺ of B with full row rank, as A M^(-1/2) has; `np.linalg.pinv` takes 3 times as long."""
    left, singular, right = np.linalg.svd(B, full_matrices=False)
    return transpose(right.conj()) / singular[..., None, :] @ transpose(left.conj())
