"""The paper's 20 s at a tolerance of 1e-12: its system as printed, and the consistent one.

By the method of the paper's ode45, Dormand and Prince's 4(5), as `make paper` integrates it and in
compiled code, and by the same authors' 8(5,3). Errors are distances from the ellipse at the steps.
"""

import math
from collections.abc import Callable

import numpy as np
from scipy.integrate import ode
from side_by_side import in_turns, table, timed

from climber_uk.mechanics import Array
from climber_uk.paper.consistent import PAPER_PATH
from climber_uk.paper.drift import METHODS
from climber_uk.paper.motion import DURATION, PRINTED_TOLERANCE, START, dormand_prince
from climber_uk.paper.printed import PrintedSystem

SLOW = 5  # of the rounds asked for, one in so many: as printed it takes seconds
MOST = 1e-10  # [m] that a consistent climber may be off
Solution = tuple[Array, Array]  # times (n,), y (n, 6)


def compiled(code: str, derivative: Callable[[float, Array], object]) -> Solution:
    """Steps of SciPy's `dopri5` or `dop853`."""
    kept: list[Array] = []
    solver = ode(derivative)
    relative, absolute = PRINTED_TOLERANCE
    solver.set_integrator(code, rtol=relative, atol=absolute, nsteps=100_000_000)
    solver.set_solout(lambda time, y: kept.append(np.array([time, *y])))
    solver.set_initial_value(START, 0.0)
    solver.integrate(DURATION)
    return np.array(kept)[:, 0], np.array(kept)[:, 1:]


def consistent(code: str, method: str) -> Solution:
    """The consistent system, on floats."""
    derivative, _ = METHODS[method]
    return compiled(code, lambda t, y: derivative(math.sin(t), math.cos(t), *y.tolist()))


def ways(method: str) -> dict[str, Callable[[], Solution]]:
    """Integrations of (26) or of (30), ours first."""
    printed = PrintedSystem()
    derivative = printed.corrected if "(30)" in method else printed.uncorrected
    return {
        "consistent, 8(5,3)": lambda: consistent("dop853", method),
        "consistent, 4(5)": lambda: consistent("dopri5", method),
        "as printed, 8(5,3)": lambda: compiled("dop853", derivative),
        "as printed, 4(5)": lambda: compiled("dopri5", derivative),
        "as printed, 4(5), solve_ivp": lambda: dormand_prince(derivative, PRINTED_TOLERANCE),
    }


def largest_error(solution: Solution) -> float:
    """Largest distance from the ellipse (21) [m]."""
    times, y = solution
    x, y = (y[:, :2] - PAPER_PATH.at(times).pose[:, :2]).T
    return float(np.hypot(x, y).max())


def compare(rounds: int) -> None:
    """Check and print the tables."""
    for method in ("uncorrected (26)", "corrected (30)"):
        print(f"\n{method:<54}{'steps':>10}{'off [m]':>20}")
        for name, run in ways(method).items():
            solution = run()
            off = largest_error(solution)
            print(f"{name:<54}{len(solution[0]) - 1:>10}{off:>20.2g}")
            if name.startswith("consistent") and not off <= MOST:
                raise SystemExit(f"{name}: {off:g} off, must be <= {MOST:g} [m]")
        runs = {name: timed(run) for name, run in ways(method).items()}
        times = in_turns(runs, -(-rounds // SLOW))
        table(f"20 s at 1e-12, {method}", times, "ms", lambda time: time * 1e3)
