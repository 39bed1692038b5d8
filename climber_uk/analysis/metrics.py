"""A run in numbers."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from climber_uk.analysis.recorded_run import RecordedRun
from climber_uk.mechanics import Array


@dataclass(frozen=True)
class Metric:
    """A number of a run, in a unit in which it reads well."""

    name: str
    value: float
    unit: str


def metrics(run: RecordedRun) -> list[Metric]:
    """Tracking, torque, slip and latency of a run; nan where the bag has no such message."""
    along, across, heading = np.abs(run.error).T
    millimetres = 1e3 * run.distance
    microseconds = 1e6 * run.latency
    return [
        Metric("duration", float(run.time[-1]), "s"),
        Metric("odometry messages", len(run.time), ""),
        Metric("position error, RMS", _rms(millimetres), "mm"),
        Metric("position error, maximum", _largest(millimetres), "mm"),
        Metric("position error, at the end", float(millimetres[-1]), "mm"),
        Metric("along-track error, maximum", _largest(1e3 * along), "mm"),
        Metric("cross-track error, RMS", _rms(1e3 * across), "mm"),
        Metric("cross-track error, maximum", _largest(1e3 * across), "mm"),
        Metric("heading error, RMS", _rms(1e3 * heading), "mrad"),
        Metric("heading error, maximum", _largest(1e3 * heading), "mrad"),
        Metric("wheel torque, RMS", _rms(run.torques), "N m"),
        Metric("wheel torque, peak", _largest(run.torques), "N m"),
        Metric("side slip, maximum", _largest(run.side_slip), "m/s"),
        Metric("slip margin, lowest", _lowest(run.margins[:, 0]), ""),
        Metric("slip margin below 1", _share(run.margins[:, 0] < 1), "%"),
        Metric("tip margin, lowest", _lowest(run.margins[:, 1]), ""),
        Metric("loop latency, median", _quantile(microseconds, 0.5), "µs"),
        Metric("loop latency, 99 %", _quantile(microseconds, 0.99), "µs"),
    ]


def table(rows: list[Metric]) -> str:
    """Return the metrics as lines of text."""
    return "\n".join(f"{row.name:<28} {row.value:>12.6g} {row.unit}" for row in rows)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else float("nan")


def _largest(values: Array) -> float:
    return float(np.max(np.abs(values))) if values.size else float("nan")


def _lowest(values: Array) -> float:
    return float(np.min(values)) if values.size else float("nan")


def _share(holds: Any) -> float:
    return 100 * float(np.mean(holds)) if holds.size else float("nan")


def _quantile(values: Array, share: float) -> float:
    return float(np.quantile(values, share)) if values.size else float("nan")
