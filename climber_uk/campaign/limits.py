"""Metrics of a run, and the limits within which it succeeds."""

from collections.abc import Callable

import numpy as np

from climber_uk.closed_loop.outcome import Outcome
from climber_uk.mechanics import Array
from climber_uk.report.comparison import MetricBound

METRICS: dict[str, tuple[str, Callable[[Outcome], Array]]] = {
    "rms_distance": ("m", lambda outcome: outcome.rms),
    "max_distance": ("m", lambda outcome: outcome.worst),
    "end_distance": ("m", lambda outcome: outcome.last),
    "settling_time": ("s", lambda outcome: outcome.settled),
    "peak_torque": ("N m", lambda outcome: outcome.peak_torque),
    "saturation": ("%", lambda outcome: 100 * outcome.saturated),
    "lowest_slip_margin": ("", lambda outcome: outcome.slip_margin),
    "lowest_tip_margin": ("", lambda outcome: outcome.tip_margin),
    "fell": ("", lambda outcome: np.isfinite(outcome.fell).astype(float)),
    "fall_time": ("s", lambda outcome: outcome.fell),
}


class Limit(MetricBound):
    """A bound that a metric must keep, as max_distance < 0.05."""

    metrics = METRICS

    def __str__(self) -> str:
        return f"{self.metric} {self.operator} {self.bound:.12g}"

    def excess(self, values: Array) -> Array:
        """Excess (n,) of values (n,) over the bound; infinite for nan."""
        over = values - self.bound
        over = {"<": over, ">": -over}.get(self.operator[0], np.abs(over))
        return np.where(np.isnan(over), np.inf, over)


def verdicts(limits: tuple[Limit, ...], metrics: dict[str, Array]) -> list[str]:
    """Verdict of each run: 'ok', or the limits that it broke."""
    held = np.array([limit.holds(metrics[limit.metric]) for limit in limits])
    return [
        "; ".join(str(limit) for limit, holds in zip(limits, run, strict=True) if not holds) or "ok"
        for run in held.T
    ]
