"""Attempts to reproduce the errors that the paper prints: 1.8e-3 m in x and 0.6 m in y.

Each is an integrator of the printed system, with one reading of it.
"""

import itertools
from collections.abc import Callable
from functools import partial

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.paper.consistent import PAPER_PATH
from climber_uk.paper.motion import (
    COARSE_TOLERANCE,
    DEFAULT_TOLERANCE,
    DURATION,
    START,
    Derivative,
    dormand_prince,
    runge_kutta,
    semi_implicit_euler,
)
from climber_uk.paper.printed import GAINS, PrintedSystem

COLUMNS = ("attempt", "(26) x [m]", "(26) y [m]", "(30) x [m]", "(30) y [m]")
# ode45 gives four points a step by default, three of them interpolated.
INTERPOLATED = np.linspace(0, DURATION, 2001)
MAX_EVALUATIONS = 10_000  # a multiple of what any attempt needs that ends

Integrator = Callable[[Derivative], tuple[Array, Array]]  # times (n,) [s] and y (n, 6)


def explicit_euler(derivative: Derivative, step: float) -> tuple[Array, Array]:
    """Times (n,) and y (n, 6) by Euler's method with a fixed step [s]."""
    times = np.arange(round(DURATION / step) + 1) * step
    y = [START]
    for time in times[:-1]:
        y.append(y[-1] + step * derivative(time, y[-1]))
    return times, np.array(y)


def _limited(derivative: Derivative) -> Derivative:
    """`derivative`, which raises `RuntimeError` after `MAX_EVALUATIONS`."""
    calls = itertools.count(1)

    def limited(time: float, y: Array) -> Array:
        if next(calls) > MAX_EVALUATIONS:
            raise RuntimeError(f"stuck at {time:.3f} s: {MAX_EVALUATIONS} evaluations")
        return derivative(time, y)

    return limited


def _from_yaw_rate(yaw_rate: float) -> Integrator:
    """The default integrator, from another yaw rate [rad/s] than the printed -6/10."""
    return partial(DEFAULT, start=np.array([*START[:5], yaw_rate]))


DEFAULT = partial(dormand_prince, tolerance=DEFAULT_TOLERANCE)
# By name: the reading of (8), and the integrator.
ATTEMPTS: dict[str, tuple[str, Integrator]] = {
    "tolerance 1e-3": ("real part", partial(dormand_prince, tolerance=COARSE_TOLERANCE)),
    "tolerance 1e-3, absolute 1e-6": ("real part", DEFAULT),
    "the same, interpolated": ("real part", partial(DEFAULT, times=INTERPOLATED)),
    "yaw rate +6/10 at the start": ("real part", _from_yaw_rate(0.6)),
    "yaw rate 0 at the start": ("real part", _from_yaw_rate(0.0)),
    **{f"gain {name}": (name, DEFAULT) for name in GAINS if name != "real part"},
    "explicit Euler, 10 ms": ("real part", partial(explicit_euler, step=0.01)),
    "semi-implicit Euler, 10 ms": ("real part", partial(semi_implicit_euler, step=0.01)),
    "semi-implicit Euler, 5 ms": ("real part", partial(semi_implicit_euler, step=0.005)),
    "Runge-Kutta, 10 ms": ("real part", partial(runge_kutta, step=0.01)),
}


def attempt(name: str) -> tuple[str, ...]:
    """Largest x and y errors of (26) and of (30), as text in the order of `COLUMNS`."""
    gain, integrate = ATTEMPTS[name]
    system = PrintedSystem(gain=gain)
    cells = [name]
    for derivative in (system.uncorrected, system.corrected):
        try:
            times, y = integrate(_limited(derivative))
        except RuntimeError as why:
            cells += [str(why).split(":")[0], ""]
            continue
        error = np.abs(y[:, :2] - PAPER_PATH.at(times).pose[:, :2]).max(axis=0)
        cells += [f"{e:.3g}" for e in error]
    return tuple(cells)
