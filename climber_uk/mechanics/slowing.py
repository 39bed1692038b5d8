"""Slowing down in bends: the path parameter s as a function of u, which grows at a steady rate.

du/ds = ρ(s) >= 1 is a spline, so s(u) has four derivatives. A spline's values lie between its
coefficients nearby, and each of these is at least as high as the path needs it wherever its basis
function reaches: so ρ is nowhere too low.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.elementary import Derivatives

QUARTIC = 4
# cells of s are halved until none bends by more, and ρ is not much higher than in the next
MAX_BEND, CONTRAST, HALVINGS = 0.15, 1.25, 24  # [rad], ratio
WITHIN = np.linspace(1e-6, 1 - 1e-6, 9)  # shares of a cell at which it is sampled, not at its ends
MARGIN = 1.01  # for peaks between the samples


@dataclass(frozen=True)
class SpeedLimits:
    """Limits of a climber on its path: of speed on straights, yaw rate and acceleration."""

    rate: float  # of u [m/s]
    yaw_rate: float  # [rad/s]
    acceleration: float  # [m/s²]


@dataclass(frozen=True)
class Slowed:
    """The path parameter s(u), both from 0, with du/ds = ρ."""

    slowness: Any  # scipy's BSpline: s (...) to ρ (...)
    parameter: Any  # its integral: s (...) to u (...)
    cells: Array  # (n + 1,) s between which ρ is one polynomial
    parameters: Array  # (n + 1,) u at these

    @property
    def length(self) -> float:
        """Extent of u [m]."""
        return float(self.parameters[-1])

    def progress(self, u: Array) -> Derivatives:
        """s and its derivatives by u at u (...), from 0 to `length`."""
        cell = np.clip(np.searchsorted(self.parameters, u, "right") - 1, 0, len(self.cells) - 2)
        low, high = self.cells[cell], self.cells[cell + 1]
        s = np.clip(np.interp(u, self.parameters, self.cells), low, high)
        for _ in range(60):  # Newton's method, within bounds that close in
            ahead = self.parameter(s) - u
            low, high = np.where(ahead <= 0, s, low), np.where(ahead >= 0, s, high)
            better = s - ahead / self.slowness(s)
            better = np.where((better < low) | (better > high), (low + high) / 2, better)
            done = np.abs(better - s) <= 8e-15 * self.cells[-1]
            s = better
            if done.all():
                break
        rho, rho_1, rho_2 = (self.slowness(s, order) for order in range(3))
        return s, 1 / rho, -rho_1 / rho**3, (3 * rho_1**2 - rho * rho_2) / rho**5


def slowed(curve: Any, length: float, closed: bool, spacing: float, limits: SpeedLimits) -> Slowed:
    """s(u) along `curve`, a BSpline of s from 0 to `length` [m], so slow that the limits hold.

    σ² = 1/ρ² changes by no more than 4 within `spacing` [m], whatever the limits. Raises
    `ValueError` where the path turns on the spot.
    """
    from scipy.interpolate import BSpline  # slow to import: for waypoints only

    # most d(σ²)/ds of σ = 1/ρ
    most = min(2**0.5 * limits.acceleration / max(limits.rate, 1e-9) ** 2, 4.0 / spacing)
    size, needed = _cells(curve, length if closed else None, length, most, limits, spacing / 64)
    mode: Any = "wrap" if closed else "edge"
    steps = np.pad(size, QUARTIC, mode)
    knots = np.concatenate([[0.0], np.cumsum(steps)]) - steps[:QUARTIC].sum()
    knots[QUARTIC], knots[-QUARTIC - 1] = 0.0, length
    reach = np.lib.stride_tricks.sliding_window_view(np.pad(needed, QUARTIC, mode), QUARTIC + 1)
    slowness = BSpline(knots, reach.max(axis=1), QUARTIC)
    parameter = slowness.antiderivative()
    parameter.c = parameter.c - parameter(0.0)
    cells = knots[QUARTIC:-QUARTIC]
    return Slowed(slowness, parameter, cells, parameter(cells))


def _cells(
    curve: Any, period: float | None, length: float, most: float, limits: SpeedLimits, least: float
) -> tuple[Array, Array]:
    """Sizes (n,) [m] of cells, fine enough for the bends, and the least ρ (n,) of each."""
    edges = np.unique(np.clip(curve.t, 0.0, length))
    start, size = edges[:-1], np.diff(edges)
    curvature, needed = _sample(curve, start, size, limits)
    mode: Any = "edge" if period is None else "wrap"
    for _ in range(HALVINGS):
        foreseen = _slowness_ahead(start + size / 2, needed, period, most)
        beside = np.pad(foreseen, 1, mode)
        contrast = np.maximum(beside[:-2], beside[2:]) / foreseen
        bends = curvature * size > MAX_BEND
        next_to = np.pad(size, 1, mode)
        wide = bends | ((contrast > CONTRAST) & (size > least))
        wide |= size > 2.1 * np.minimum(next_to[:-2], next_to[2:])
        if not wide.any():
            return size, foreseen
        parts = 1 + wide
        start, size, bends = (np.repeat(x, parts) for x in (start, size / parts, bends))
        curvature, needed = np.repeat(curvature, parts), np.repeat(needed, parts)
        second = np.flatnonzero(np.repeat(wide, parts))[1::2]
        start[second] += size[second]
        curvature[bends], needed[bends] = _sample(curve, start[bends], size[bends], limits)
    x, y = curve(start[np.argmax(curvature)])
    raise ValueError(f"the path turns on the spot at ({x:.4g}, {y:.4g}) m: leave points out there")


def _sample(curve: Any, start: Array, size: Array, limits: SpeedLimits) -> tuple[Array, Array]:
    """Largest curvature |dθ/ds| (n,) [rad/m], and least ρ (n,), of cells, by samples."""
    s = start[:, None] + size[:, None] * WITHIN
    p_1, p_2 = np.moveaxis(curve(s, 1), -1, 0), np.moveaxis(curve(s, 2), -1, 0)
    square = p_1[0] ** 2 + p_1[1] ** 2
    curvature = (np.abs(p_1[0] * p_2[1] - p_1[1] * p_2[0]) / square).max(axis=1)
    bend = np.hypot(*p_2).max(axis=1)
    needed = np.maximum(
        curvature * (MARGIN * limits.rate / limits.yaw_rate),
        np.sqrt(bend * (2**0.5 * limits.rate**2 / limits.acceleration)),
    )
    # beside a reversal |p'| is a little above 1, and more so between the places looked at
    excess = np.maximum(np.sqrt(square.max(axis=1)) - 1.0, 0.0)
    return curvature, np.maximum(needed, 1.0 + 1.25 * excess)


def _slowness_ahead(middle: Array, needed: Array, period: float | None, most: float) -> Array:
    """Least ρ (n,) that is >= `needed` and whose 1/ρ² changes by at most `most` [1/m]."""
    number, square = len(middle), needed**-2.0
    if period is not None:
        middle = np.concatenate([middle - period, middle, middle + period])
        square = np.tile(square, 3)
    rise = most * middle
    square = np.minimum.accumulate(square - rise) + rise
    square = np.minimum.accumulate((square + rise)[::-1])[::-1] - rise
    return np.asarray(square[number : 2 * number] if period is not None else square) ** -0.5
