"""Nonlinear model predictive control, by CasADi: one more rival."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np
from rivals import Weights, about, acceleration, inverse_dynamics, tracking_errors

from climber_uk.control.control_law import ForceLaw
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion, ReferencePoint, Wrench

STEPS, STEP = 8, 0.04  # of the horizon, and how long each is [s]


def error_rates(e: ca.SX, u: ca.SX, v_d: ca.SX, omega_d: ca.SX) -> ca.SX:
    """ė of `tracking_errors`, for accelerations u from the reference's."""
    e_x, e_y, turned, speed, turning = ca.vertsplit(e)
    v = v_d + speed
    return ca.vertcat(
        v * ca.cos(turned) - v_d + omega_d * e_y, v * ca.sin(turned) - omega_d * e_x, turning, u
    )


def horizon() -> ca.Function:
    """Hessian and gradient of the cost of inputs (2 STEPS,), by Gauss and Newton.

    Of inputs of before, errors (5,), the reference's v_d, v̇_d, ω_d, ω̇_d, weights (5,), and the
    cost to go P (5, 5).
    """
    inputs, errors, motion = ca.SX.sym("u", 2 * STEPS), ca.SX.sym("e", 5), ca.SX.sym("m", 4)
    weights, P = ca.SX.sym("q", 5), ca.SX.sym("P", 5, 5)
    v_d, v_d1, omega_d, omega_d1 = ca.vertsplit(motion)
    e, hessian, gradient = errors, STEP * ca.SX.eye(2 * STEPS), STEP * inputs
    for i in range(STEPS):
        u, middle = inputs[2 * i : 2 * i + 2], (i + 0.5) * STEP
        reference = v_d + middle * v_d1, omega_d + middle * omega_d1
        halfway = e + STEP / 2 * error_rates(e, u, *reference)
        e = e + STEP * error_rates(halfway, u, *reference)
        weight = P if i == STEPS - 1 else STEP * ca.diag(weights)
        J = ca.jacobian(e, inputs)
        hessian, gradient = hessian + J.T @ weight @ J, gradient + J.T @ weight @ e
    given = [inputs, errors, motion, weights, P]
    return ca.Function("horizon", given, [hessian, gradient], {"cse": True})


@lru_cache
def solver() -> ca.Function:
    """Inputs (2 STEPS,), better than those of before, from what `horizon` takes and the limits.

    `each` (2, 2) makes torques of an input, beside `torques` (2,) that no input adds to.
    """
    size = 2 * STEPS
    shapes = size, 5, 4, 5, (5, 5), (2, 2), 2, 1
    given = [ca.MX.sym("p", *np.atleast_1d(shape).tolist()) for shape in shapes]
    inputs, *_, each, torques, limit = given
    hessian, gradient = horizon()(*given[:5])
    to_torques = ca.kron(ca.DM.eye(STEPS), each)
    now = to_torques @ inputs + ca.repmat(torques, STEPS)
    qp = {"h": hessian.sparsity(), "a": to_torques.sparsity()}
    program = ca.conic("program", "daqp", qp, {"error_on_fail": False})
    change = program(h=hessian, g=gradient, a=to_torques, lba=-limit - now, uba=limit - now)["x"]
    return ca.Function("solver", given, [inputs + change])


@dataclass(frozen=True)
class NMPC(ForceLaw):
    """Least Σ (eᵀ Q e + uᵀ u) within the wheels' limits, and the LQR's cost to go after that.

    The errors' own dynamics are predicted, about a reference whose accelerations stay: no error
    needs no input. A real-time iteration (Diehl et al. 2005): one quadratic program an answer,
    about the inputs of the last one.
    """

    weights: Weights

    @cached_property
    def inputs(self) -> Array:
        """Those of the last answer (2 STEPS,), which it keeps."""
        return np.zeros(2 * STEPS)

    def wrench(self, climber: Climber, target: ReferencePoint, motion: Motion) -> Wrench:
        """See `ForceLaw`."""
        K, P = about(self.weights, target)
        e = tracking_errors(target, motion)
        forward_d, yaw_d = acceleration(target), target.yaw_acceleration
        wanted = target.speed - float(K[0, 0] * e[0] / K[0, 3])
        steady = [target.speed, forward_d, target.yaw_rate, yaw_d]
        (to_mean, to_twist), limit = climber.leverage, climber.max_wheel_torque
        mean, twist = to_mean * climber.mass, to_twist * climber.yaw_inertia
        each = np.array([[mean, twist], [mean, -twist]])
        torques = climber.torques(*inverse_dynamics(climber, motion, forward_d, yaw_d, wanted))
        given = self.inputs, e, steady, self.weights.diagonal, P, each, torques, limit
        self.inputs[:] = np.nan_to_num(solver()(*given).full().ravel())
        forward, yaw = self.inputs[:2].tolist()
        return inverse_dynamics(climber, motion, forward_d + forward, yaw_d + yaw, wanted)
