"""The path (21) as constraint of wheels that do not slip: A q̈ = b with the row (21) hides.

    forward   [cosθ sinθ 0] q̈ = t·u              u = p̈_d + K_d ė + K_p e, t = (cosθ, sinθ)
    no-slip   [sinθ -cosθ 0] q̈ = -v ω            (18)
    hidden    [0 0 v] q̈ = -2 v̇ ω + n·u̇ - λ φ     φ = v ω - n·u = 0, n = (-sinθ, cosθ)

Without gains (K_p = K_d = λ = 0) this is the path itself, as (22); with them it is Baumgarte's
stabilisation. M = diag(m, m, J) is a mass, and `udwadia_kalaba` does the rest.

Corrected by (30), the velocity-level rows (27) are the path's own, ẋ and ẏ, and φ = 0. Forward
and no-slip would say the same of ẋ and ẏ, but through the heading, the error of which they would
carry into the position. The hidden row depends on v, and b does: both are taken at the corrected
velocity, or v, which nothing pulls back, would run away from q̇.
"""

from dataclasses import dataclass

import numpy as np

from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.climber import Climber, no_slip
from climber_uk.mechanics.quantities import State, across, along
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.udwadia_kalaba import (
    constrained_acceleration,
    constraint_force,
    velocity_correction,
)
from climber_uk.paper.printed import PAPER_CLIMBER

PAPER_PATH = Trajectory(Ellipse(), ConstantRate())


@dataclass(frozen=True)
class ConsistentSystem:
    """Climber and path with a constraint that two wheels can meet; y (..., 6) is (q, v)."""

    climber: Climber = PAPER_CLIMBER
    path: Trajectory = PAPER_PATH
    natural_frequency: float = 0.0  # [rad/s] ω_n: K_p = ω_n², K_d = 2 ω_n
    hidden_rate: float = 0.0  # [1/s] λ

    def rows(self, state: State, reference: Reference) -> tuple[Array, Array]:
        """Rows A (..., 3, 3) and b (..., 3) of the constraints: forward, no-slip, hidden."""
        heading, v, omega = state.heading, state.forward_speed, state.yaw_rate
        K_d, K_p = 2 * self.natural_frequency, self.natural_frequency**2
        u = self._demand(state, reference)
        e_1 = (reference.velocity - state.velocity)[..., :2]

        slip_row, slip_b = no_slip(state)
        v_1 = along(heading, u)
        cosine, sine = np.cos(heading), np.sin(heading)
        p_2 = pack(v_1 * cosine - v * omega * sine, v_1 * sine + v * omega * cosine)
        u_1 = reference.jerk + K_d * (reference.acceleration[..., :2] - p_2) + K_p * e_1
        phi = v * omega - across(heading, u)
        hidden_b = -2 * v_1 * omega + across(heading, u_1) - self.hidden_rate * phi

        zero = 0 * v
        A = np.stack([pack(cosine, sine, zero), slip_row, pack(zero, zero, v)], axis=-2)
        return A, pack(v_1, slip_b, hidden_b)

    def velocity_rows(self, state: State, reference: Reference) -> tuple[Array, Array]:
        """Rows A (..., 3, 3) and b_q (..., 3) of (27), at velocity level: ẋ, ẏ, hidden."""
        v = state.forward_speed
        zero, one = 0 * v, 0 * v + 1
        A = np.stack([pack(one, zero, zero), pack(zero, one, zero), pack(zero, zero, v)], axis=-2)
        x_1, y_1, _ = unpack(reference.velocity)
        return A, pack(x_1, y_1, across(state.heading, self._demand(state, reference)))

    def corrected_state(self, state: State, reference: Reference) -> State:
        """State with q̇ of (30) for a velocity, its rows taken at that velocity."""
        M = self.climber.mass_matrix
        for _ in range(2):  # first ẋ and ẏ, by which the hidden row is then right
            A, b_q = self.velocity_rows(state, reference)
            state = State(state.pose, velocity_correction(M, A, b_q, state.velocity))
        return state

    def constraint_force(self, time: Array | float, state: State) -> Array:
        """Qc (..., 3) of (8), in the wall's frame [N, N m]."""
        A, b = self.rows(state, self.path.at(time))
        return constraint_force(self.climber.mass_matrix, self._applied(state), A, b)

    def torques(self, time: Array | float, state: State) -> Array:
        """Wheel torques (..., 2): Qc without the part that is the wheels' lateral reaction."""
        Qc = self.constraint_force(time, state)
        return self.climber.wheel_torques(along(state.heading, Qc), unpack(Qc)[2])

    def reference_torques(self, time: Array | float) -> Array:
        """Torques τ(t) (..., 2) [N m] that keep a climber on the path once it is on it."""
        reference = self.path.at(time)
        return self.torques(time, State(reference.pose, reference.velocity))

    def uncorrected(self, time: Array | float, y: Array) -> Array:
        """Derivative of y by (26)."""
        state = State(y[..., :3], y[..., 3:])
        return np.concatenate([state.velocity, self._acceleration(time, state)], axis=-1)

    def corrected(self, time: Array | float, y: Array) -> Array:
        """Derivative of y by (30), all rows at the corrected velocity."""
        state = self.corrected_state(State(y[..., :3], y[..., 3:]), self.path.at(time))
        return np.concatenate([state.velocity, self._acceleration(time, state)], axis=-1)

    def corrected_literally(self, time: Array | float, y: Array) -> Array:
        """Derivative of y by (30), all rows at v, as it stands: v parts from q̇."""
        state = State(y[..., :3], y[..., 3:])
        A, b_q = self.velocity_rows(state, self.path.at(time))
        q_1 = velocity_correction(self.climber.mass_matrix, A, b_q, state.velocity)
        return np.concatenate([q_1, self._acceleration(time, state)], axis=-1)

    def _acceleration(self, time: Array | float, state: State) -> Array:
        A, b = self.rows(state, self.path.at(time))
        return constrained_acceleration(self.climber.mass_matrix, self._applied(state), A, b)

    def _applied(self, state: State) -> Array:
        """Q (..., 3) without the wheels, in the wall's frame [N, N m]."""
        return self.climber.applied_force(state.heading, np.sign(state.forward_speed))

    def _demand(self, state: State, reference: Reference) -> Array:
        """u (..., 2) [m/s²]: the acceleration that path and gains demand."""
        e = (reference.pose - state.pose)[..., :2]
        e_1 = (reference.velocity - state.velocity)[..., :2]
        p_2 = reference.acceleration[..., :2]
        return p_2 + 2 * self.natural_frequency * e_1 + self.natural_frequency**2 * e
