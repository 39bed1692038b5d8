"""A polyline with its corners rounded: a quintic spline p(s), C⁴ but where it reverses.

Its control points are points of the polyline P, c_i = P(ξ_i) with ξ_i the mean of five knots:
Schoenberg's variation diminishing spline. So it stays in the hull of the few control points
nearby, goes straight where these do, |p'| <= 1 as P' has length 1, and

    |p(s) - P(s)| <= Σ N_i(s) |ξ_i - s| <= 0.6245 h

where knots are h apart around corners; in the middle of long straights they may be rare.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from climber_uk.mechanics import Array

QUINTIC = 5
MOMENT = 0.62448  # most of Σ N_i(s) |ξ_i - s| / h, halfway between two knots
# shares of the tolerance: points nearer than NEAR to one that is kept are left out, and may have
# been near to one that is left out itself; the rest, but for the turn of a reversal, is rounding
NEAR = 1 / 6
ROUNDING = 0.6
LONG_LEG = 12  # [h] from which on a leg has few knots in its middle
REACH = 4  # [h] around a corner in which no knots are left out


@dataclass(frozen=True)
class Rounded:
    """A curve p(s) within a tolerance of a polyline, s from 0 to `length`."""

    curve: Any  # scipy's BSpline: s (...) to p (..., 2)
    length: float  # [m] of the polyline
    closed: bool
    reversals: Array  # (k,) s where it goes back the way it came, with one tangent
    legs: Array  # (m,) s where a leg of the polyline begins, and where the last ends
    numbers: Any  # (m,) of the points there, as they were given, from 1
    start: float = 0.0  # s of the first point: a closed curve with reversals begins at one


def rounded(points: Array, tolerance: float, reversal_angle: float) -> Rounded:
    """Curve within `tolerance` [m] of the polyline through `points` (n, 2) [m].

    Where the polyline turns back, within `reversal_angle` [rad] of the way it came, the curve
    does so as well. It is closed if its ends are nearer than a sixth of the tolerance and the
    number of reversals is even. Raises `ValueError`.
    """
    near, spacing = NEAR * tolerance, ROUNDING * tolerance / MOMENT
    closed = len(points) > 2 and math.dist(points[0], points[-1]) < near
    kept = _thinned(points, near, closed)
    corners = points[kept]
    if len(corners) < 2 + closed or (corners[0] == corners[1]).all():
        raise ValueError(f"all points are within {near:.3g} m, a sixth of the tolerance")
    back = _reversals(corners, reversal_angle, closed)
    if closed and len(back) % 2:  # it ends tail first where it began
        closed, back = False, back[back > 0]
    start = 0
    if closed and len(back):
        start = back[0]
        kept = np.concatenate([kept[start:-1], kept[: start + 1]])
        corners = points[kept]
        back = back - start
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    length = float(s[-1])
    breaks = _breaks(s, back, closed, spacing)
    make = _periodic if closed and not len(back) else _clamped
    curve = make(s, corners, breaks, s[back])
    first = float(s[-1 - start]) % length
    return Rounded(curve, length, closed, s[back], s, kept + 1, first)


def _thinned(points: Array, near: float, closed: bool) -> Any:
    """Indices (m,) of points that are at least `near` [m] from the one before; both ends stay."""
    places = points.tolist()
    kept, end = [0], 0 if closed else len(places) - 1
    for i, point in enumerate(places):
        if math.dist(point, places[kept[-1]]) >= near:
            kept.append(i)
    while len(kept) > 1 and math.dist(places[kept[-1]], places[end]) < near:
        kept.pop()
    return np.array([*kept, end])


def _reversals(corners: Array, angle: float, closed: bool) -> Any:
    """Indices (k,) of the corners at which the polyline turns back within `angle` [rad]."""
    legs = np.diff(corners, axis=0)
    unit = legs / np.hypot(*legs.T)[:, None]
    cosine = np.sum(unit * np.roll(unit, 1, axis=0), axis=1)  # at the beginning of each leg
    cosine[0] = cosine[0] if closed else 1.0
    return np.flatnonzero(cosine < -math.cos(angle))


def _breaks(s: Array, back: Array, closed: bool, spacing: float) -> Array:
    """Knots (m,) [m], at most `spacing` [m] apart, but for the middle of long legs."""
    is_long = np.diff(s) > LONG_LEG * spacing
    is_fixed = np.append(is_long, True) | np.append(True, is_long)
    is_fixed[back] = True
    fixed, is_long = s[is_fixed], is_long[np.flatnonzero(is_fixed)[:-1]]
    numbers = np.where(is_long, 1, np.ceil(np.diff(fixed) / spacing)).astype(int)
    steps = np.repeat(np.diff(fixed) / numbers, numbers)
    within = np.arange(numbers.sum()) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    places = [np.repeat(fixed[:-1], numbers) + steps * within, s[-1:]]
    after, before = fixed[:-1][is_long], fixed[1:][is_long]
    offset = step = spacing
    while len(after):
        # the ends of an open path are no corners
        places += [after[closed | (after > 0)] + offset, before[closed | (before < s[-1])] - offset]
        step = step if offset < REACH * spacing else 2 * step
        offset += step
        goes_on = before - after > 2 * offset + step
        after, before = after[goes_on], before[goes_on]
    return np.sort(np.concatenate(places))


def _periodic(s: Array, corners: Array, breaks: Array, _: Array) -> Any:
    """Closed spline through the polyline's control points, without an end."""
    from scipy.interpolate import BSpline  # slow to import: for waypoints only

    steps = np.pad(np.diff(breaks), QUINTIC, "wrap")
    knots = np.concatenate([[0.0], np.cumsum(steps)]) - steps[:QUINTIC].sum()
    knots[QUINTIC:-QUINTIC] = breaks
    control = _along(s, corners, _means(knots) % s[-1])
    return BSpline(knots, control, QUINTIC, extrapolate="periodic")


def _clamped(s: Array, corners: Array, breaks: Array, reversals: Array) -> Any:
    """Spline that meets the polyline at both its ends and where it turns back."""
    from scipy.interpolate import BSpline

    times = np.where(np.isin(breaks, reversals), QUINTIC, 1)
    times[[0, -1]] = QUINTIC + 1
    knots = np.repeat(breaks, times)
    control = _along(s, corners, _means(knots))
    # one tangent on both sides of a reversal: halfway between those of its legs
    tips = np.searchsorted(knots, reversals, "right") - QUINTIC - 1
    before, after = np.where(tips > 0, tips, len(control) - 1) - 1, tips + 1
    come, go = control[tips] - control[before], control[after] - control[tips]
    come_size, go_size = np.hypot(*come.T)[:, None], np.hypot(*go.T)[:, None]
    heading = come / come_size - go / go_size
    heading /= np.hypot(*heading.T)[:, None]
    control[before] = control[tips] - come_size * heading
    control[after] = control[tips] - go_size * heading
    return BSpline(knots, control, QUINTIC)


def _means(knots: Array) -> Array:
    """Means (n,) [m] of the inner knots of each basis function: where its control point is."""
    return np.lib.stride_tricks.sliding_window_view(knots[1:-1], QUINTIC).mean(axis=1)


def _along(s: Array, corners: Array, places: Array) -> Array:
    """Points (n, 2) [m] of the polyline at distances (n,) [m] along it."""
    return np.stack([np.interp(places, s, x) for x in corners.T], axis=1)
