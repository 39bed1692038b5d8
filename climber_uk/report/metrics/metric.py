"""What a metric is: a name for machines, a unit, a definition, and the function of a run."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from climber_uk.bags.run import RecordedRun
from climber_uk.mechanics import Array

NAN = float("nan")
GAP = 1.5  # periods between two stamps from which on a message is missing
PREFIXED = {"m", "rad", "s", "m/s"}  # units that may have one of the prefixes
PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


@dataclass(frozen=True)
class Case:
    """A run, and by what it is judged."""

    run: RecordedRun
    settled: float = 0.01  # [m] distance from the reference below which it has settled


@dataclass(frozen=True)
class Metric:
    """A number of a run, in SI units; nan if the bag has not what it takes."""

    name: str
    unit: str
    definition: str
    of: Callable[[Case], float]
    concerns: Callable[[Case], bool] = lambda _: True  # whether it applies to the climber


def rms(values: Array) -> float:
    """Root mean square of the finite values."""
    return _of_finite(lambda finite: np.sqrt(np.mean(finite**2)), values)


def largest(values: Array) -> float:
    """Largest size of the finite values."""
    return _of_finite(lambda finite: np.max(np.abs(finite)), values)


def lowest(values: Array) -> float:
    """Lowest of the finite values."""
    return _of_finite(np.min, values)


def mean(values: Array) -> float:
    """Mean of the finite values."""
    return _of_finite(np.mean, values)


def deviation(values: Array) -> float:
    """Standard deviation of the finite values."""
    return _of_finite(np.std, values)


def percentile(values: Array, percent: float) -> float:
    """Percentile of the sizes of the finite values, interpolated linearly."""
    return _of_finite(lambda finite: np.percentile(np.abs(finite), percent), values)


def share(holds: Any) -> float:
    """Share of true values [%]."""
    return 100 * float(np.mean(holds)) if len(holds) else NAN


def _of_finite(function: Callable[[Array], Any], values: Array) -> float:
    finite = values[np.isfinite(values)]
    return float(function(finite)) if finite.size else NAN


def prefix(values: Sequence[float], unit: str) -> tuple[float, str]:
    """Factor, and unit with a prefix, in which some values of one metric read well."""
    sizes = [abs(value) for value in values if np.isfinite(value)]
    if not sizes or unit not in PREFIXED:
        return 1.0, unit
    size, sign = next(
        ((size, sign) for size, sign in PREFIXES if max(sizes) >= 0.999999 * size), (1.0, "")
    )
    return 1 / size, sign + unit
