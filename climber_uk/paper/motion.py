"""Motions of the paper's climber over 20 s, and the integrators that make them."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import no_slip
from climber_uk.mechanics.quantities import State
from climber_uk.paper.consistent import PAPER_PATH, ConsistentSystem
from climber_uk.paper.printed import PrintedSystem
from climber_uk.simulation.plant import Plant

DURATION = 20.0  # [s]
LOST_RADIUS = 100.0  # [m] from the origin, at which a motion ends
START = np.array([0.0, 6.0, 0.0, 10.0, 0.0, -0.6])  # (q, v) as printed

# Relative and absolute tolerance
PRINTED_TOLERANCE = (1e-12, 1e-12)
COARSE_TOLERANCE = (1e-3, 1e-3)
DEFAULT_TOLERANCE = (1e-3, 1e-6)  # of SciPy's RK45, as of MATLAB's ode45

Derivative = Callable[[float, Array], Array]


@dataclass(frozen=True)
class PaperMotion:
    """Motion, torques and constraint residual of a climber at n instants."""

    time: Array  # (n,) [s]
    pose: Array  # (n, 3) x [m], y [m], θ [rad]
    velocity: Array  # (n, 3) q̇
    torques: Array  # (n, 2) right, left [N m]
    third: Array  # (n,) [m/s²] of (18), sinθ ẍ - cosθ ÿ + v ω: third component of the printed Qc

    @property
    def error(self) -> Array:
        """Distance from the path in x and y, (n, 2) [m]."""
        return self.pose[:, :2] - PAPER_PATH.at(self.time).pose[:, :2]

    @property
    def side_slip(self) -> Array:
        """Velocity across the heading, to the left (n,) [m/s]."""
        return State(self.pose, self.velocity).side_slip

    @property
    def drive_torques(self) -> Array:
        """Qc1 = τR + τL and Qc2 = τR - τL (19), (n, 2) [N m]."""
        right, left = self.torques.T
        return np.stack([right + left, right - left], axis=-1)


def dormand_prince(
    derivative: Derivative,
    tolerance: tuple[float, float],
    start: Array = START,
    times: Array | None = None,
) -> tuple[Array, Array]:
    """Times (n,) and y (n, 6): at the integrator's own steps, or interpolated to `times`.

    Raises `RuntimeError` if it gets stuck or lost.
    """

    def distance_left(_: float, y: Array) -> float:
        return LOST_RADIUS - float(np.hypot(abs(y[0]), abs(y[1])))

    distance_left.terminal = True  # type: ignore[attr-defined]
    relative, absolute = tolerance
    solution = solve_ivp(
        derivative,
        (0.0, DURATION),
        start.astype(derivative(0.0, start).dtype),
        method="RK45",
        t_eval=times,
        events=distance_left,
        rtol=relative,
        atol=absolute,
    )
    if not solution.success:
        raise RuntimeError(f"stuck at {solution.t[-1]:.3f} s: {solution.message}")
    if solution.status == 1:
        raise RuntimeError(f"lost at {solution.t_events[0][0]:.3f} s")
    return solution.t, solution.y.T


def semi_implicit_euler(derivative: Derivative, step: float) -> tuple[Array, Array]:
    """As `dormand_prince`, by fixed steps: first v, and with the new v then q."""
    times = np.arange(round(DURATION / step) + 1) * step
    y = [START]
    for time, after in itertools.pairwise(times.tolist()):
        new = y[-1] + step * np.concatenate([np.zeros(3), derivative(time, y[-1])[3:]])
        new[:3] += step * derivative(after, new)[:3]
        y.append(new)
    return times, np.array(y)


def runge_kutta(
    derivative: Derivative, step: float, after_step: Derivative | None = None
) -> tuple[Array, Array]:
    """As `dormand_prince`, by the classic method; `after_step` may replace y (time, y)."""
    times = np.arange(round(DURATION / step) + 1) * step
    y = [START]
    for time, after in itertools.pairwise(times.tolist()):
        middle = time + step / 2
        k1 = derivative(time, y[-1])
        k2 = derivative(middle, y[-1] + step / 2 * k1)
        k3 = derivative(middle, y[-1] + step / 2 * k2)
        k4 = derivative(after, y[-1] + step * k3)
        end = y[-1] + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        y.append(end if after_step is None else after_step(after, end))
    return times, np.array(y)


def printed_motion(system: PrintedSystem, corrected: bool, times: Array, y: Array) -> PaperMotion:
    """Motion of y (n, 6), integrated from (30) or (26) of the printed system."""
    q, v = y[:, :3], y[:, 3:]
    Qc = system.constraint_force(times, q, v)
    derivative = system.corrected if corrected else system.uncorrected
    velocity = derivative(times, y)[:, :3]
    return PaperMotion(times, q, velocity, system.torques(Qc), Qc[:, 2])


def consistent_motion(
    system: ConsistentSystem, corrected: bool, times: Array, y: Array
) -> PaperMotion:
    """Motion of y (n, 6), integrated from (30) or (26) of the consistent system."""
    state = State(y[:, :3], y[:, 3:])
    if corrected:
        state = system.corrected_state(state, system.path.at(times))
    acceleration = system.uncorrected(times, np.concatenate([state.pose, state.velocity], -1))
    torques = system.torques(times, state)
    third = _no_slip_residual(state, acceleration[:, 3:])
    return PaperMotion(times, state.pose, state.velocity, torques, third)


def open_loop(system: ConsistentSystem, step: float) -> PaperMotion:
    """The climber without side slip under the torques τ(t) alone, by (30) and Runge-Kutta.

    It is the plant of the simulation, but for the torques: these are functions of time also within
    a step, where `Plant` holds them. As there, v is replaced by q̇ after each step.
    """

    def rolling(y: Array) -> State:
        # (30) with the no-slip row in closed form: v without its part across the heading
        state = State(y[:3], y[3:])
        return State.rolling(state.pose, state.forward_speed, state.yaw_rate)

    def derivative(time: float, y: Array) -> Array:
        state, torques = rolling(y), torques_at[float(time)]
        direction = np.sign(state.forward_speed)
        q_2 = system.climber.rolling_acceleration(state, torques, direction)
        return np.concatenate([state.velocity, q_2])

    def project(_: float, y: Array) -> Array:
        return np.concatenate([y[:3], rolling(y).velocity])

    whole = np.arange(round(DURATION / step) + 1) * step
    instants = np.concatenate([whole, whole + step / 2])
    torques_at = dict(zip(instants.tolist(), system.reference_torques(instants), strict=True))
    times, y = runge_kutta(derivative, step, project)
    return _rolled(system, times, y, system.reference_torques(times))


def driven_by(system: ConsistentSystem, printed: PaperMotion, step: float) -> PaperMotion:
    """The simulated climber under the torques (25) of a printed motion, held for `step` each."""
    plant = Plant(system.climber, step)
    times = np.arange(round(DURATION / step) + 1) * step
    torques = np.stack(
        [np.interp(times + step / 2, printed.time, tau) for tau in printed.torques.T], axis=-1
    )
    states = [State(START[:3], START[3:])]
    for tau in torques[:-1]:
        states.append(plant.advance(states[-1], tau, steps=1))
    y = np.array([np.concatenate([state.pose, state.velocity]) for state in states])
    return _rolled(system, times, y, torques)


def _rolled(system: ConsistentSystem, times: Array, y: Array, torques: Array) -> PaperMotion:
    state = State(y[:, :3], y[:, 3:])
    direction = np.sign(state.forward_speed)
    q_2 = system.climber.rolling_acceleration(state, torques, direction)
    return PaperMotion(times, state.pose, state.velocity, torques, _no_slip_residual(state, q_2))


def _no_slip_residual(state: State, acceleration: Array) -> Array:
    A, b = no_slip(state)
    return np.sum(A * acceleration, axis=-1) - b
