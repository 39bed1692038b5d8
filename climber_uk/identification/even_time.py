"""Filters of samples at nearly even times, with gaps: derivatives, and lags of first order."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from climber_uk.mechanics import Array

GAP, MISSING = 0.1, 2.5  # [s], and typical times from one sample to the next: a gap is more
LEAST_LAG = 1e-5  # [s]


def gaps(time: Array) -> NDArray[np.bool_]:
    """Whether there is a gap between each time and the next (n - 1,)."""
    steps = np.diff(time)
    return steps > max(GAP, MISSING * float(np.median(steps)))


def rate(time: Array, gone: Array, smoothing: float) -> Array:
    """Derivative (n,) of `gone` (n,), by cubics over `smoothing` [s] to either side."""

    def slope(values: Array, step: float) -> Array:
        half = min(max(2, round(smoothing / step)), (len(values) - 1) // 2)
        if half < 2:
            return np.gradient(values, step) if len(values) > 1 else 0 * values
        from scipy.signal import savgol_filter  # slow to import

        return savgol_filter(values, 2 * half + 1, 3, deriv=1, delta=step)

    return _evenly(time, gone, slope)


def lagging(time: Array, values: Array, lag: float) -> Array:
    """`values` (n,) after a lag of first order [s]; exact if they are piecewise linear."""
    if lag < LEAST_LAG:
        return values

    from scipy.signal import lfilter  # slow to import

    def filtered(even: Array, step: float) -> Array:
        decay, ratio = np.exp(-step / lag), lag / step
        line = [1 - ratio * (1 - decay), ratio * (1 - decay) - decay]
        return even[0] + lfilter(line, [1, -decay], even - even[0])

    return _evenly(time, values, filtered)


def _evenly(time: Array, values: Array, function: Callable[[Array, float], Array]) -> Array:
    """Apply a function of even values and their step [s] to `values` (n,), from gap to gap."""
    made = np.zeros_like(values)
    for part in np.split(np.arange(len(values)), np.flatnonzero(gaps(time)) + 1):
        own = time[part]
        step = float(np.median(np.diff(own))) if len(part) > 1 else 1.0
        even = own[0] + step * np.arange(round(np.ptp(own) / step) + 1)
        made[part] = np.interp(own, even, function(np.interp(even, own, values[part]), step))
    return made
