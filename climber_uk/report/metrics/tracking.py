"""How well the climber followed its reference."""

from collections.abc import Callable
from functools import partial

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.messages.topics import REFERENCE_TIME
from climber_uk.report.metrics.metric import (
    NAN,
    Case,
    Metric,
    deviation,
    largest,
    mean,
    percentile,
    rms,
)
from climber_uk.report.trajectory_errors import absolute_errors, relative_errors

STRETCH = 1.0  # [s] over which drift is measured

QUANTITIES: dict[str, tuple[str, str, Callable[[Case], Array]]] = {
    "distance": ("m", "distance from the reference", lambda case: case.run.distance),
    "along_track": ("m", "error along the reference's heading", lambda case: case.run.error[:, 0]),
    "cross_track": ("m", "error across the reference's heading", lambda case: case.run.error[:, 1]),
    "heading": ("rad", "heading error", lambda case: case.run.error[:, 2]),
}
STATISTICS: dict[str, tuple[str, Callable[[Array], float]]] = {
    "rms": ("root mean square of the {}", rms),
    "p50": ("median size of the {}", partial(percentile, percent=50)),
    "p95": ("size of the {} that 95 % do not exceed", partial(percentile, percent=95)),
    "p99": ("size of the {} that 99 % do not exceed", partial(percentile, percent=99)),
    "max": ("largest size of the {}", largest),
}


def _statistic(statistic: str, quantity: str) -> Metric:
    description, evaluate = STATISTICS[statistic]
    unit, meaning, values = QUANTITIES[quantity]
    name = f"{statistic}_{quantity}"
    return Metric(name, unit, description.format(meaning), lambda case: evaluate(values(case)))


def settling_time(case: Case) -> float:
    """Time of the first message from which on the distance stays below `settled` [s]."""
    distance, time = case.run.distance, case.run.time
    outside = np.flatnonzero(~(distance < case.settled) & np.isfinite(distance))
    after = int(outside[-1]) + 1 if len(outside) else 0
    later = np.flatnonzero(np.isfinite(distance[after:]))
    return float(time[after + later[0]]) if len(later) else NAN


def _with_reference(case: Case) -> tuple[Array, Array, Array]:
    known = np.isfinite(case.run.reference[:, 0])
    return case.run.reference[known], case.run.pose[known], case.run.time[known]


def _absolute(case: Case) -> Array:
    reference, pose, _ = _with_reference(case)
    return absolute_errors(reference, pose)


def _relative(case: Case) -> Array:
    reference, pose, time = _with_reference(case)
    return relative_errors(reference, pose, time, STRETCH) if len(time) else np.empty((0, 2))


TRUTH = (
    Metric(
        "truth_rms_distance",
        "m",
        "root mean square of the true distance from the reference: by `ground_truth`, of a "
        "simulation or of what watches from outside, where that was recorded",
        lambda case: rms(case.run.truth_distance),
    ),
    Metric(
        "truth_max_distance",
        "m",
        "largest true distance from the reference",
        lambda case: largest(case.run.truth_distance),
    ),
)
METRICS = (
    *TRUTH,
    *(_statistic(statistic, quantity) for quantity in QUANTITIES for statistic in STATISTICS),
    Metric(
        "end_distance",
        "m",
        "distance from the reference at the last odometry message that has one",
        lambda case: float(_absolute(case)[-1, 0]) if len(_absolute(case)) else NAN,
    ),
    Metric(
        "settling_time",
        "s",
        "from the start until the distance stays below 1 cm (`--settled`); unknown if it does not",
        settling_time,
    ),
    Metric(
        "reference_waited",
        "s",
        "how much later than planned the reference was at the end: it waits where it is not "
        "followed, and distances are from where it waits; unknown without `reference_time`",
        lambda case: largest(case.run.recorded[REFERENCE_TIME].values[-1:, 0]),
    ),
    Metric(
        "ape_rmse",
        "m",
        "absolute pose error (translation, not aligned), root mean square: as `evo_ape`",
        lambda case: rms(_absolute(case)[:, 0]),
    ),
    Metric(
        "ape_mean", "m", "mean of the absolute pose error", lambda case: mean(_absolute(case)[:, 0])
    ),
    Metric(
        "ape_std",
        "m",
        "standard deviation of the absolute pose error",
        lambda case: deviation(_absolute(case)[:, 0]),
    ),
    Metric(
        "rpe_rmse",
        "m",
        "relative pose error (translation) over stretches of 1 s, one after the other, root mean "
        "square: as `evo_rpe` with as many frames",
        lambda case: rms(_relative(case)[:, 0]),
    ),
    Metric(
        "rpe_rotation_rmse",
        "rad",
        "relative pose error (rotation), likewise",
        lambda case: rms(_relative(case)[:, 1]),
    ),
)
