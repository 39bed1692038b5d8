"""The fastest time law within the limits along a path (docs/theory.md, §9.3).

Time-optimal path parametrisation (Pham & Pham 2018, doi 10.1109/TRO.2018.2819195): on a grid of
places, a pass backwards finds the largest X = ṡ² from which the climber can still come to rest in
time, a pass forwards takes the largest U = s̈. That changes its acceleration abruptly: sampled in
time it is the table of the time law `fastest`, which is smooth. What smoothing takes too much of,
the limits are tightened there for, and it is done again.
"""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.fastest_law import DEGREE, Tabulated, spline
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.wall import PLANE, Wall
from climber_uk.path_check.demands import reserves
from climber_uk.path_check.path_limits import Limits, PathLimits

PERIOD = 0.005  # [s] of the table: smoothing takes `DEGREE` + 1 of these
STEP, TURN = 0.01, 0.03  # [m], [rad] of the path between two places, at most
LEAST_STEPS, MOST_STEPS = 400, 40_000
LOOKS = 20  # at the path in each `STEP`, for how much it turns
SPEEDS = np.linspace(0.0, 1.0, 33)  # of the largest ṡ, at which bounds of U are computed
ROUNDS = 20  # of tightening
AT_FIRST = 0.999  # share of the limits
KEPT, AIM = 1.0001, 1.0005  # least reserve that is enough, and that is aimed at if it is not
MORE, LEAST_SHARE = 1.2, 0.8  # times what is lacking that limits are tightened by, in a round
CLOSELY = 0.0025  # [s] between two times at which a smooth law is looked at, at most


class TimeOptimal(NamedTuple):
    """A trajectory by the fastest law; and what it would take without smoothing."""

    trajectory: Trajectory
    abrupt: float  # [s]


def time_optimal(
    trajectory: Trajectory,
    climber: Climber,
    contact: Contact,
    limits: Limits,
    period: float = PERIOD,
    wall: Wall = PLANE,
) -> TimeOptimal:
    """The path of a trajectory by the fastest law, sampled each `period` [s].

    Raises `ValueError` naming the place where the climber cannot go on.
    """
    trajectory = unstretched(trajectory)
    rests, dwell = trajectory.course.rests
    inner = (rests > 0) & (rests < trajectory.course.length)
    places = np.concatenate([[0.0], rests[inner], [trajectory.course.length]])
    s = _grid(trajectory, places)
    along = PathLimits.of(trajectory, climber, contact, wall, limits, s, AT_FIRST)
    dwells = np.append(dwell[inner], 0.0)
    X, U = _optimum(along, places)
    abrupt = _sampled(s, X, U, places, dwells, period)[1]
    for _ in range(ROUNDS):
        table, _ = _sampled(s, X, U, places, dwells, period)
        if (tighter := _tightened(along, period, table)) is None:
            law = Tabulated(period, table)
            return TimeOptimal(replace(trajectory, law=law), abrupt)
        along = replace(along, tighter=tighter)
        try:
            X, U = _optimum(along, places)
        except ValueError:  # what is left of the limits is too little
            break
    smoothing = (DEGREE + 1) * period
    raise ValueError(
        f"no law that is smooth within {smoothing:g} s keeps the limits: "
        "smooth it less, or round its corners more"
    )


def unstretched(trajectory: Trajectory) -> Trajectory:
    """The path of a trajectory, whose parameter is not stretched, by a law that does not matter."""
    length = trajectory.shape.at_rate(0.0).length
    table = np.repeat([0.0, length], DEGREE + 1)
    return replace(trajectory, law=Tabulated(PERIOD, table))


def _grid(trajectory: Trajectory, places: Array) -> Array:
    """Places s (n,) to look at, of which `places` are some."""
    ends = np.linspace(0.0, trajectory.course.length, 4001)
    length = float(np.hypot(*np.diff(_pose(trajectory, ends)[:, :2], axis=0).T).sum())
    count = int(np.clip(length / STEP, LEAST_STEPS, MOST_STEPS))
    fine = np.union1d(np.linspace(0.0, trajectory.course.length, LOOKS * count + 1), places)
    fine = np.union1d(fine, trajectory.course.stations)
    pose = _pose(trajectory, fine)
    way = np.hypot(*np.diff(pose[:, :2], axis=0).T)
    turn = np.abs(np.mod(np.diff(pose[:, 2]) + np.pi / 2, np.pi) - np.pi / 2)
    done = np.concatenate([[0.0], np.cumsum(way * (count / length) + turn / TURN)])
    even = np.interp(np.linspace(0.0, done[-1], int(done[-1]) + 2), done, fine)
    s = np.union1d(even, places)
    close = np.diff(s, prepend=-np.inf) < 1e-9 * s[-1]
    return s[~close | np.isin(s, places)]


def _pose(trajectory: Trajectory, s: Array) -> Array:
    return trajectory.at_progress((s, 1 + 0 * s, 0 * s, 0 * s)).pose


def _optimum(along: PathLimits, places: Array) -> tuple[Array, Array]:
    """X (n,) at the places of the grid, and U (n - 1,) between them."""
    largest = along.largest()
    largest[np.isin(along.s, places)] = 0.0
    X = _passes(along, largest)
    if along.climber.no_load_wheel_rate:  # bounds of U bend where a motor has nothing left
        X = _passes(along, np.minimum(largest, 1.2 * X + 1e-3 * X.max() * (largest > 0)))
    return X, np.diff(X) / (2 * np.diff(along.s))


def _passes(along: PathLimits, largest: Array) -> Array:
    """X (n,), no larger than `largest` (n,), where it rests if that is 0."""
    s = along.s
    step = 2 * np.diff(s)
    speeds = largest[:, None] * SPEEDS**2
    low, high = along.interval(speeds * (1 - 1e-9))
    ends_low = speeds[:-1] + step[:, None] * np.minimum(low[:-1], np.finfo(float).max)
    most = largest.copy()
    for k in range(len(s) - 2, -1, -1):  # backwards: from where it can still slow down
        fits = ends_low[k] <= most[k + 1]
        if largest[k] == 0.0:
            continue
        last = len(fits) - 1 - int(np.argmax(fits[::-1]))
        if not fits[last]:
            along.refuse_at(k, "it cannot slow down there in time")
        most[k] = speeds[k, last]
        if last + 1 < len(fits):
            below, above = ends_low[k, last], ends_low[k, last + 1]
            share = (most[k + 1] - below) / (above - below)
            most[k] += share * (speeds[k, last + 1] - speeds[k, last])
    X = np.zeros_like(s)
    begins_high = speeds[1:] - step[:, None] * high[1:]
    for k in range(len(s) - 1):  # forwards: as hard as it can, by the bounds where it comes to
        if largest[k + 1] == 0.0:
            continue
        too_high = begins_high[k] > X[k]
        cell = int(np.argmax(too_high)) if too_high.any() else 0
        if too_high[0]:
            along.refuse_at(k, "it cannot go on there: its weight and friction are too much")
        share = _reached(X[k], step[k], largest[k + 1], high[k + 1], cell) if cell else 1.0
        X[k + 1] = min(most[k + 1], share * share * largest[k + 1])
    return X


def _reached(before: float, step: float, largest: float, high: Array, cell: int) -> float:
    """Share r of the fastest ṡ at which X = r² `largest` is `before` + `step` U(r).

    In a `cell` of `SPEEDS` U goes straight with r, as a motor's line does.
    """
    slope = (high[cell] - high[cell - 1]) / (SPEEDS[cell] - SPEEDS[cell - 1])
    at_none = high[cell - 1] - slope * SPEEDS[cell - 1]
    half = step * slope / 2
    root = half * half + largest * (before + step * at_none)
    reached = (half + math.sqrt(max(root, 0.0))) / largest
    return float(np.clip(reached, SPEEDS[cell - 1], SPEEDS[cell]))


def _sampled(
    s: Array, X: Array, U: Array, places: Array, dwells: Array, period: float
) -> tuple[Array, float]:
    """Table of the law, and its duration without smoothing [s]."""
    speed = np.sqrt(X)
    time = np.concatenate([[0.0], np.cumsum(2 * np.diff(s) / (speed[:-1] + speed[1:]))])
    still = np.zeros(DEGREE)
    ends = np.searchsorted(s, places)
    parts = [still]
    for first, last, dwell in zip(ends[:-1], ends[1:], dwells, strict=True):
        number = int(np.ceil((time[last] - time[first]) / period)) + 1
        at = np.minimum(time[first] + period * np.arange(number), time[last])
        k = np.clip(np.searchsorted(time, at, "right") - 1, first, last - 1)
        since = at - time[k]
        leg = s[k] + since * (speed[k] + since * U[k] / 2)
        rest = np.full(DEGREE + int(np.ceil(dwell / period)), s[last])
        parts += [np.clip(leg, s[first], s[last]), rest]
    table = np.maximum.accumulate(np.concatenate(parts))
    return np.append(table, table[-1]), float(time[-1] + dwells.sum())


def _tightened(along: PathLimits, period: float, table: Array) -> Any:
    """Shares (n,) of the limits, where the smooth law needs less than before; None: nowhere."""
    law = spline(period, table)
    parts = max(2, math.ceil(period / CLOSELY))
    count = parts * (len(table) - DEGREE)
    time = period / parts * np.arange(1, count)
    progress = tuple(law(time, order) for order in range(4))
    moves = progress[1] > 0
    reference = along.trajectory.at_progress(tuple(of[moves] for of in progress))
    left = reserves(reference, along.climber, along.contact, wall=along.wall)
    reserve = np.full(count - 1, np.inf)
    reserve[moves] = along.reserve(left, reference)
    if reserve.min() >= KEPT:
        return None
    lacking = np.flatnonzero(reserve < KEPT)
    share = np.maximum(1 - MORE * (AIM - reserve), LEAST_SHARE)
    tighter = np.ones_like(along.s)
    # what is smooth there comes from as long before and after
    reach = period * (DEGREE + 1) / 2
    first = np.searchsorted(along.s, law(np.maximum(time[lacking] - reach, 0.0)), "right") - 1
    last = np.searchsorted(along.s, law(np.minimum(time[lacking] + reach, time[-1])))
    for i, k, m in zip(lacking, first, last, strict=True):
        tighter[max(k, 0) : m + 1] = np.minimum(tighter[max(k, 0) : m + 1], share[i])
    return along.tighter * tighter
