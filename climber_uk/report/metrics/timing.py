"""Latency, period and jitter of odometry and torques, and what of them was lost."""

import numpy as np

from climber_uk.mechanics import SECOND, Array
from climber_uk.report.metrics.metric import GAP, NAN, Case, Metric, deviation, largest, percentile


def periods(case: Case) -> Array:
    """Times between stamps of odometry (n - 1,) [s]."""
    return np.diff(case.run.time)


def period(case: Case) -> float:
    """Median period of the odometry [s]."""
    return percentile(periods(case), 50)


def missing(case: Case) -> float:
    """Number of odometry messages that are missing between the others."""
    usual = period(case)
    gaps = periods(case)[periods(case) > GAP * usual]
    return float(np.sum(np.round(gaps / usual) - 1))


def unrecorded(case: Case) -> float:
    """Number of those that torques answer all the same: a controller has got them."""
    run = case.run
    if len(run.unanswerable) > len(run.commands):
        return 0.0  # torques have stamps of their own
    (between,) = np.nonzero(
        (run.odometry.stamps[0] < run.unanswerable) & (run.unanswerable < run.odometry.stamps[-1])
    )
    unfit = sum(run.odometry.unfit.values())  # which are in the bag
    return float(min(max(0, len(between) - unfit), missing(case)))


def lost(case: Case) -> float:
    """Number of those that nobody got."""
    return missing(case) - unrecorded(case)


def unanswered(case: Case) -> float:
    """Number of odometry messages without torques, between the first and the last that has some."""
    answers = case.run.commands.stamps
    if not len(answers):
        return NAN
    odometry = case.run.odometry.within(answers[0], answers[-1]).stamps
    return float(np.sum(~np.isin(odometry, answers)))


METRICS = (
    Metric(
        "latency_p50",
        "s",
        "median time from an odometry's arrival at the recorder to that of its torques",
        lambda case: percentile(case.run.latency, 50),
    ),
    Metric(
        "latency_p99",
        "s",
        "latency that 99 % of the torques do not exceed",
        lambda case: percentile(case.run.latency, 99),
    ),
    Metric("latency_max", "s", "longest latency", lambda case: largest(case.run.latency)),
    Metric(
        "latency_jitter",
        "s",
        "standard deviation of the latency",
        lambda case: deviation(case.run.latency),
    ),
    Metric("odometry_period", "s", "median time from one stamp of odometry to the next", period),
    Metric(
        "odometry_jitter",
        "s",
        "standard deviation of the time from one arrival of odometry to the next, less the time "
        "by their stamps: of wall-clock runs only, a simulation has its own pace",
        lambda case: deviation(np.diff(case.run.odometry.arrivals) / SECOND - periods(case)),
    ),
    Metric("odometry_count", "", "odometry messages", lambda case: float(len(case.run.time))),
    Metric(
        "odometry_lost",
        "",
        "unanswered odometry messages missing in gaps of more than 1.5 periods between stamps",
        lost,
    ),
    Metric(
        "odometry_unrecorded",
        "",
        "odometry messages missing there that torques answer: the recorder lost them",
        unrecorded,
    ),
    Metric(
        "odometry_unanswered",
        "",
        "odometry messages without torques, between the first and the last answered one",
        unanswered,
    ),
    Metric(
        "odometry_unfit",
        "",
        "odometry messages left out: pose not finite, or absurd, or no unit turn about z",
        lambda case: float(sum(case.run.odometry.unfit.values())),
    ),
    Metric(
        "odometry_repeated",
        "",
        "odometry messages left out: one before had the same stamp",
        lambda case: float(case.run.odometry.repeated),
    ),
    Metric(
        "odometry_late",
        "",
        "odometry messages recorded after one with a later stamp",
        lambda case: float(case.run.odometry.late),
    ),
)
