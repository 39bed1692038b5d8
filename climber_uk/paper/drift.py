"""Drift off the path in 1000 s: (26), (30), Baumgarte, Braun and Goldfarb, and projection.

The rows are those of `ConsistentSystem`. They determine q̈ whatever M and Q are, here in closed
form and on floats, which is a hundred times faster than the general solution that it equals.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import ode

from climber_uk.mechanics import Array
from climber_uk.mechanics.quantities import State
from climber_uk.paper.consistent import PAPER_PATH
from climber_uk.paper.motion import START

SEMI_AXES = 10.0, 6.0  # [m] of (21)
SAMPLE_TIME = 0.1  # [s] between the instants kept
LOST_DISTANCE = 100.0  # [m] off the path, at which a run ends

Floats = tuple[float, ...]  # ẋ, ẏ, θ̇, ẍ, ÿ, θ̈
# of sin t, cos t, x, y, θ, ẋ, ẏ, θ̇
Derivative = Callable[[float, float, float, float, float, float, float, float], Floats]
Projection = Callable[[float, float, float], Floats]


@dataclass(frozen=True)
class Drift:
    """A long integration, with n instants that are kept."""

    time: Array  # (n,) [s]
    error: Array  # (n,) [m] distance from the path's point of that time
    side_slip: Array  # (n,) [m/s] of the integrated v
    evaluations: int

    @property
    def largest(self) -> float:
        """Largest error [m]; infinite for a run that got lost."""
        return float(np.max(self.error)) if np.max(self.error) < LOST_DISTANCE else math.inf

    def slip_at(self, time: float) -> float:
        """Side slip of v [m/s] at a time [s]."""
        return float(np.interp(time, self.time, self.side_slip))

    def window(self, start: float, end: float) -> float:
        """Largest error [m] between two times [s]; infinite if the run got lost before."""
        inside = self.error[(self.time >= start) & (self.time <= end)]
        return float(np.max(inside)) if inside.size and self.largest < LOST_DISTANCE else math.inf


def stabilised(natural_frequency: float, hidden_rate: float) -> Derivative:
    """(26) with Baumgarte's gains ω_n [rad/s] and λ [1/s]."""
    K_d, K_p = 2 * natural_frequency, natural_frequency**2
    a, b = SEMI_AXES

    def derivative(
        S: float, C: float, x: float, y: float, heading: float, x_1: float, y_1: float, omega: float
    ) -> Floats:
        c, s = math.cos(heading), math.sin(heading)
        e_x1, e_y1 = a * C - x_1, -b * S - y_1
        u_x = -a * S + K_d * e_x1 + K_p * (a * S - x)
        u_y = -b * C + K_d * e_y1 + K_p * (b * C - y)
        v = c * x_1 + s * y_1
        v_1, across, sideways = c * u_x + s * u_y, c * u_y - s * u_x, v * omega
        x_2, y_2 = c * v_1 - s * sideways, s * v_1 + c * sideways
        u_x1 = -a * C + K_d * (-a * S - x_2) + K_p * e_x1
        u_y1 = b * S + K_d * (-b * C - y_2) + K_p * e_y1
        hidden = -2 * v_1 * omega + c * u_y1 - s * u_x1 - hidden_rate * (sideways - across)
        return x_1, y_1, omega, x_2, y_2, hidden / v

    return derivative


uncorrected = stabilised(0.0, 0.0)


def path_velocity(S: float, C: float, heading: float) -> Floats:
    """The q̇ that meets the velocity-level rows ẋ, ẏ and hidden; S = sin t, C = cos t."""
    a, b = SEMI_AXES
    c, s = math.cos(heading), math.sin(heading)
    x_1, y_1 = a * C, -b * S
    return x_1, y_1, (s * a * S - c * b * C) / (c * x_1 + s * y_1)


def forward_velocity(S: float, C: float, heading: float) -> Floats:
    """The q̇ that meets the forward, no-slip and hidden rows; S = sin t, C = cos t."""
    x_1, y_1, omega = path_velocity(S, C, heading)
    c, s = math.cos(heading), math.sin(heading)
    v = c * x_1 + s * y_1
    return v * c, v * s, omega


def corrected_to(projection: Projection) -> Derivative:
    """(30), all rows at the corrected velocity."""

    def derivative(
        S: float, C: float, x: float, y: float, heading: float, x_1: float, y_1: float, omega: float
    ) -> Floats:
        return uncorrected(S, C, x, y, heading, *projection(S, C, heading))

    return derivative


def embedded(rate: float) -> Derivative:
    """(30) with what Braun and Goldfarb embed: violations are taken off at `rate` [1/s].

    A virtual impulse brings the position back, a virtual force the integrated v; theirs are as
    strong as one step undoes, 1/h.
    """
    a, b = SEMI_AXES

    def derivative(
        S: float, C: float, x: float, y: float, heading: float, x_1: float, y_1: float, omega: float
    ) -> Floats:
        velocity = path_velocity(S, C, heading)
        acceleration = uncorrected(S, C, x, y, heading, *velocity)[3:]
        forces = zip(acceleration, velocity, (x_1, y_1, omega), strict=True)
        return (
            velocity[0] + rate * (a * S - x),
            velocity[1] + rate * (b * C - y),
            velocity[2],
            *(of + rate * (must_be - is_now) for of, must_be, is_now in forces),
        )

    return derivative


def corrected_literally(
    S: float, C: float, x: float, y: float, heading: float, x_1: float, y_1: float, omega: float
) -> Floats:
    """(30), all rows at v, as it stands."""
    a, b = SEMI_AXES
    c, s = math.cos(heading), math.sin(heading)
    yaw_rate = (s * a * S - c * b * C) / (c * x_1 + s * y_1)
    return a * C, -b * S, yaw_rate, *uncorrected(S, C, x, y, heading, x_1, y_1, omega)[3:]


# By name: how to integrate, and whether to project x, y and v after each step.
METHODS: dict[str, tuple[Derivative, bool]] = {
    "uncorrected (26)": (uncorrected, False),
    "corrected (30)": (corrected_to(path_velocity), False),
    "Baumgarte": (stabilised(5.0, 10.0), False),
    "Braun & Goldfarb": (embedded(100.0), False),
    "position projection": (uncorrected, True),
    "(30), rows at v": (corrected_literally, False),
    "(30), forward and no-slip rows": (corrected_to(forward_velocity), False),
}
COMPARED = tuple(METHODS)[:5]
WITHOUT_PROJECTION = COMPARED[:4]


def runge_kutta(method: str, step: float, duration: float, start: Array = START) -> Drift:
    """The classic method with a fixed `step` [s], a divisor of 0.1 s, from y = (q, v) (6,).

    Under projection, errors are those before it: after it x and y have none.
    """
    derivative, project = METHODS[method]
    steps = round(SAMPLE_TIME / step)
    samples = round(duration / SAMPLE_TIME)
    half, sixth = step / 2, step / 6
    y = tuple(start.tolist())
    kept = []
    for sample in range(samples):
        times = sample * SAMPLE_TIME + half * np.arange(2 * steps + 1)
        S, C = np.sin(times).tolist(), np.cos(times).tolist()
        for i in range(0, 2 * steps, 2):
            p0, p1, p2, p3, p4, p5 = y
            a0, a1, a2, a3, a4, a5 = derivative(S[i], C[i], *y)
            b0, b1, b2, b3, b4, b5 = derivative(
                *(S[i + 1], C[i + 1], p0 + half * a0, p1 + half * a1, p2 + half * a2),
                *(p3 + half * a3, p4 + half * a4, p5 + half * a5),
            )
            c0, c1, c2, c3, c4, c5 = derivative(
                *(S[i + 1], C[i + 1], p0 + half * b0, p1 + half * b1, p2 + half * b2),
                *(p3 + half * b3, p4 + half * b4, p5 + half * b5),
            )
            d0, d1, d2, d3, d4, d5 = derivative(
                *(S[i + 2], C[i + 2], p0 + step * c0, p1 + step * c1, p2 + step * c2),
                *(p3 + step * c3, p4 + step * c4, p5 + step * c5),
            )
            y = end = (
                p0 + sixth * (a0 + 2 * (b0 + c0) + d0),
                p1 + sixth * (a1 + 2 * (b1 + c1) + d1),
                p2 + sixth * (a2 + 2 * (b2 + c2) + d2),
                p3 + sixth * (a3 + 2 * (b3 + c3) + d3),
                p4 + sixth * (a4 + 2 * (b4 + c4) + d4),
                p5 + sixth * (a5 + 2 * (b5 + c5) + d5),
            )
            if project:
                y = projected(S[i + 2], C[i + 2], y[2])
        kept.append((float(times[-1]), *end))
    return _drift(np.array([(0.0, *start.tolist()), *kept]), 4 * steps * samples)


def projected(S: float, C: float, heading: float) -> Floats:
    """State with x, y on the path and q̇ on the velocity-level rows; θ stays."""
    a, b = SEMI_AXES
    return a * S, b * C, heading, *path_velocity(S, C, heading)


def dormand_prince(method: str, tolerance: float, duration: float) -> Drift:
    """Dormand and Prince's 4(5), relative and absolute tolerance alike, without projection.

    It is SciPy's compiled DOPRI5: a hundred thousand steps in `solve_ivp` would take a minute.
    """
    derivative, _ = METHODS[method]
    kept: list[Floats] = []
    evaluations = 0

    def counted(time: float, y: Array) -> Floats:
        nonlocal evaluations
        evaluations += 1
        return derivative(math.sin(time), math.cos(time), *y.tolist())

    def keep(time: float, y: Array) -> int:
        kept.append((time, *y.tolist()))
        a, b = SEMI_AXES
        off = math.hypot(y[0] - a * math.sin(time), y[1] - b * math.cos(time))
        return 0 if off < LOST_DISTANCE else -1

    solver = ode(counted).set_integrator(
        "dopri5", rtol=tolerance, atol=tolerance, nsteps=100_000_000
    )
    solver.set_solout(keep)
    solver.set_initial_value(START, 0.0)
    solver.integrate(duration)
    return _drift(np.array(kept), evaluations)


def _drift(kept: Array, evaluations: int) -> Drift:
    time, pose, velocity = kept[:, 0], kept[:, 1:4], kept[:, 4:]
    offset = pose[:, :2] - PAPER_PATH.at(time).pose[:, :2]
    error = np.hypot(*offset.T)
    return Drift(time, error, np.abs(State(pose, velocity).side_slip), evaluations)
