"""Slowing down in the bends of a path: its parameter s by one, u, that goes on at a steady rate.

du/ds = ρ(s) >= 1 is a spline, so s(u) has four derivatives. A spline's values lie between its
coefficients nearby, and each of these is at least as high as the path needs it wherever its basis
function reaches: so ρ is nowhere too low.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from climber_uk.mechanics import Array
from climber_uk.mechanics.elementary import Derivatives

DEGREE = 4
# cells of s are halved until none turns by more, and ρ is not much higher than in the next
LARGEST_CELL_TURN, CONTRAST, HALVINGS = 0.15, 1.25, 24  # [rad], ratio
FINEST = 2.0**-12  # of the spacing of knots, to which cells are halved for the contrast
STEEPER = 1.2  # times as fast as foreseen that speed may change, before cells are halved for it
MOST_CELLS = 800_000  # about 8000 sharp corners
SLOWEST = 1e6  # times as slow as planned; of far more, squares are lost beside 1
WITHIN = np.linspace(1e-6, 1 - 1e-6, 9)  # where a cell is looked at: beside ends that turn back
MARGIN = 1.01  # for what peaks in between


@dataclass(frozen=True)
class SpeedLimits:
    """What a climber must not exceed on its path."""

    rate: float  # [m/s] of u
    yaw_rate: float  # [rad/s]
    acceleration: float  # [m/s²]
    # s (m + 1,) where legs begin and the last ends, and the speed (m,) [m/s] of each
    legs: tuple[Array, Array] | None = None

    def speed(self, s: Array) -> Array:
        """Most speed (...) [m/s] at s (...); infinite if legs have none."""
        if self.legs is None:
            return np.full(s.shape, np.inf)
        ends, speeds = self.legs
        return speeds[np.clip(np.searchsorted(ends, s, "right") - 1, 0, len(speeds) - 1)]


@dataclass(frozen=True)
class Slowed:
    """s(u), both from 0."""

    slowness: Any  # scipy's BSpline: s (...) to ρ (...)
    parameter: Any  # its integral: s (...) to u (...)
    cells: Array  # (n + 1,) s between which ρ is one polynomial
    parameters: Array  # (n + 1,) u at these

    @property
    def length(self) -> float:
        """Extent of u."""
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
    """s(u) along `curve`, a BSpline of s from 0 to `length`, so slow that the limits hold.

    At no rate it would have to be slower than that within less than `spacing` [m]. Raises
    `ValueError` with the place of what cannot be looked at.
    """
    from scipy.interpolate import BSpline  # slow to import: for waypoints only

    # most d(σ²)/ds of σ = 1/ρ
    most = min(2**0.5 * limits.acceleration / max(limits.rate, 1e-9) ** 2, 4.0 / spacing)
    size, needed = _cells(curve, length if closed else None, length, most, limits, FINEST * spacing)
    mode: Any = "wrap" if closed else "edge"
    steps = np.pad(size, DEGREE, mode)
    knots = np.concatenate([[0.0], np.cumsum(steps)]) - steps[:DEGREE].sum()
    knots[DEGREE], knots[-DEGREE - 1] = 0.0, length
    slowness = BSpline(knots, _reaching(needed, mode), DEGREE)
    parameter = slowness.antiderivative()
    parameter.c = parameter.c - parameter(0.0)
    cells = knots[DEGREE:-DEGREE]
    return Slowed(slowness, parameter, cells, parameter(cells))


def _cells(
    curve: Any, period: float | None, length: float, most: float, limits: SpeedLimits, least: float
) -> tuple[Array, Array]:
    """Sizes (n,) of cells in which ρ varies little, and the ρ (n,) needed in each."""
    edges = np.unique(np.clip(curve.t, 0.0, length))
    start, size = edges[:-1], np.diff(edges)
    _check_number(start)
    curvature, needed = _look(curve, start, size, limits)
    mode: Any = "edge" if period is None else "wrap"
    for number in range(2 * HALVINGS):
        foreseen = _foreseen(start + size / 2, needed, period, most)
        beside = np.pad(foreseen, 1, mode)
        contrast = np.maximum(beside[:-2], beside[2:]) / foreseen
        is_bent = curvature * size > LARGEST_CELL_TURN
        if number >= HALVINGS and is_bent.any():
            break
        next_to = np.pad(size, 1, mode)
        wide = is_bent | ((contrast > CONTRAST) & (size > least))
        wide |= size > 2.1 * np.minimum(next_to[:-2], next_to[2:])
        if not wide.any():
            wide = _beside_steep(size, foreseen, most, mode)
        if not wide.any() or number == 2 * HALVINGS - 1:
            return size, foreseen
        parts = 1 + wide
        start, size, is_bent = (np.repeat(x, parts) for x in (start, size / parts, is_bent))
        curvature, needed = np.repeat(curvature, parts), np.repeat(needed, parts)
        _check_number(start)
        second = np.flatnonzero(np.repeat(wide, parts))[1::2]
        start[second] += size[second]
        curvature[is_bent], needed[is_bent] = _look(curve, start[is_bent], size[is_bent], limits)
    x, y = curve(start[np.argmax(curvature)])
    raise ValueError(f"the path turns on the spot at ({x:.4g}, {y:.4g}) m: leave points out there")


def _reaching(needed: Array, mode: Any) -> Array:
    """Coefficients (n + 4,) of ρ: each the highest of the cells that its basis function reaches."""
    return sliding_window_view(np.pad(needed, DEGREE, mode), DEGREE + 1).max(axis=1)


def _beside_steep(size: Array, needed: Array, most: float, mode: Any) -> Any:
    """Cells (n,) to halve, as they are larger than others where ρ rises or falls too steeply.

    Where ρ leaves the reach of a large cell, it does so in the width of the small ones beside it.
    """
    coefficients = _reaching(needed, mode)
    around = sliding_window_view(np.pad(size, DEGREE, mode), DEGREE + 2)
    slope = DEGREE * np.diff(coefficients) / around[:, 1:-1].sum(axis=1)
    rho = (coefficients[1:] + coefficients[:-1]) / 2
    steep = np.flatnonzero(np.abs(slope) / rho**3 > STEEPER * most / 2)
    largest = around[steep] > 0.9 * around[steep].max(axis=1, keepdims=True)
    chosen = (steep[:, None] + np.arange(DEGREE + 2))[largest] - DEGREE
    number, wide = len(size), np.zeros(len(size), bool)
    wide[chosen % number if mode == "wrap" else np.clip(chosen, 0, number - 1)] = True
    return wide


def _check_number(cells: Array) -> None:
    if len(cells) > MOST_CELLS:
        raise ValueError(
            f"too many bends: they take more than {MOST_CELLS} pieces, as about 8000 sharp "
            "corners do: leave points out, or drive it in parts"
        )


def _look(curve: Any, start: Array, size: Array, limits: SpeedLimits) -> tuple[Array, Array]:
    """Most |dθ/ds| [rad/m], and the ρ needed, of cells (n,)."""
    s = start[:, None] + size[:, None] * WITHIN
    p_1, p_2 = np.moveaxis(curve(s, 1), -1, 0), np.moveaxis(curve(s, 2), -1, 0)
    square = p_1[0] ** 2 + p_1[1] ** 2
    curvature = (np.abs(p_1[0] * p_2[1] - p_1[1] * p_2[0]) / square).max(axis=1)
    bend = np.hypot(*p_2).max(axis=1)
    needed = np.maximum(
        curvature * (MARGIN * limits.rate / limits.yaw_rate),
        np.sqrt(bend * (2**0.5 * limits.rate**2 / limits.acceleration)),
    )
    needed = np.maximum(needed, (limits.rate / limits.speed(s)).max(axis=1))
    if not (needed < SLOWEST).all():
        x, y = np.round(curve(start[np.argmax(needed)]), 6)
        least = limits.rate / SLOWEST
        raise ValueError(f"at ({x:g}, {y:g}) m it must be slower than {least:.3g} m/s, too slow")
    # beside a reversal |p'| is a little above 1, and more so between the places looked at
    excess = np.maximum(np.sqrt(square.max(axis=1)) - 1.0, 0.0)
    return curvature, np.maximum(needed, 1.0 + 1.25 * excess)


def _foreseen(middle: Array, needed: Array, period: float | None, most: float) -> Array:
    """ρ (n,) at least as `needed`, with which 1/ρ² changes by no more than `most` a metre."""
    number, square = len(middle), needed**-2.0
    if period is not None:
        middle = np.concatenate([middle - period, middle, middle + period])
        square = np.tile(square, 3)
    rise = most * middle
    square = np.minimum.accumulate(square - rise) + rise
    square = np.minimum.accumulate((square + rise)[::-1])[::-1] - rise
    return np.asarray(square[number : 2 * number] if period is not None else square) ** -0.5
