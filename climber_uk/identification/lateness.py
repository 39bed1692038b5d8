"""Delay and lag of first order by which torques act later than assumed, by search.

A delay of δ adds -a₁ δ τ to the speed, and -b₁ δ τ to the yaw rate. Where that coefficient shows,
the delay and lag with the least cost are taken, and the coefficient is fitted all the same: what is
left of the delay's error counts in the other intervals.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from climber_uk.identification.identified import IN_TIME
from climber_uk.identification.integral_equations import Equations
from climber_uk.identification.window_fit import WindowFit

Columns = Mapping[str, tuple[int, ...]]

# [s] tried first; the last ones are the most that is found
DELAYS, LAGS = (0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2), (0.0, 0.02, 0.04, 0.08)
SURE = 4.0  # standard deviations, above which a delay is significant
EVALUATIONS = 60

# of delay and lag, then of the kind
EquationsAt = Callable[[float, float], Callable[[str], Sequence[Equations]]]


def lateness(
    fits: Mapping[str, WindowFit], columns: Columns, equations_at: EquationsAt
) -> tuple[float, float]:
    """Delay and lag [s]; `fits` are those for none, with the delay's coefficient as their last.

    `columns` are the others, and `equations_at` gives the equations of the same windows.
    """
    if not any(is_late(fit) for fit in fits.values()):
        return IN_TIME
    from scipy.optimize import minimize  # slow to import: for what is late only

    def cost(late: Sequence[float]) -> float:
        equations = equations_at(*np.abs(late).tolist())
        return sum(
            WindowFit.standardised(equations(kind), columns[kind], fit.noise).cost
            for kind, fit in fits.items()
        )

    tried = [(delay, lag) for delay in DELAYS for lag in LAGS]
    delay, lag = tried[int(np.argmin([cost(late) for late in tried]))]
    simplex = [(delay, lag), (delay + DELAYS[1] / 2, lag), (delay, lag + LAGS[1] / 2)]
    options = {"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-2, "maxfev": EVALUATIONS}
    best = np.abs(minimize(cost, simplex[0], method="Nelder-Mead", options=options).x)
    delay, lag = np.minimum(best, [DELAYS[-1], LAGS[-1]]).tolist()
    return delay, lag


def is_late(fit: WindowFit) -> bool:
    """Whether the last coefficient differs from zero."""
    return abs(float(fit.coefficients[-1])) > SURE * fit.deviation(-1)
