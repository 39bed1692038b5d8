"""Mass, inertia, friction and geometry of a climber from how it moved and what drove it.

The coefficients of `integral_equations`,

    a = (1/(m r), μ/m, c/m)      b = (d/(J r), D/J)      and with wheel angles  r  and  r/d,

are fitted to all windows at once by robust least squares. Intervals are those of a jackknife over
the windows, so that they hold whatever noise and errors of the model do within a window, but not
less than white noise leaves: what a motion does not excite shows there.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from climber_uk.analysis.integral_equations import (
    Cut,
    Equations,
    equations,
    seal_load,
    standardised,
)
from climber_uk.analysis.recorded_motion import Indices, RecordedMotion
from climber_uk.mechanics import Array, transpose
from climber_uk.mechanics.climber import Climber

Choice = NDArray[np.bool_]
UNITS = {
    "mass": "kg",
    "seal_friction_coefficient": "",
    "viscous_friction": "N s/m",
    "yaw_inertia": "kg m²",
    "turning_resistance": "N m s",
    "wheel_radius": "m",
    "half_track": "m",
}
NAMES = tuple(UNITS)
RESISTANCES = np.array([False, False, True, False, True, False, False])  # which there need not be
OF_WHEELS = np.array([False] * 5 + [True] * 2)  # which wheel angles tell
CUT, LEAST_WINDOWS, REFINEMENTS, ITERATIONS = Cut(), 5, 3, 10
CLEAR = 3.0  # standard deviations beyond which a residual counts less and less
SPREAD = 0.05  # of the speed: least difference of speeds that shows viscous friction
KNOWN = 0.1  # of a value, or of all that drives: the widest interval that is of use
# [SI] of speed, way; yaw rate, heading; way; heading: noise to begin with, and a tenth of it is the
# least that is believed of a sensor.
NOISE = ((1e-2, 1e-3), (1e-2, 1e-3), (1e-3,), (1e-3,))
QUANTILE = 0.975
ROUNDING = 1e-13


class Extent(NamedTuple):
    """What drove a climber and how it moved, root mean squares of the windows' means."""

    drive: float  # [N]
    turn: float  # [N m]
    load: float  # [N] of the seal
    speed: float  # [m/s]
    yaw_rate: float  # [rad/s]
    speed_spread: float  # [m/s] standard deviation of the windows' speeds


@dataclass(frozen=True)
class Identified:
    """Parameters in the order of `NAMES`, and what they were found from."""

    values: Array  # (7,) those that were not sought are the climber's, or zero
    half_widths: Array  # (7,) of the 95 % intervals
    sought: Choice  # (7,)
    noise: Array  # (q,) standard deviation of each measured quantity
    residuals: list[Array]  # (q) of (times in windows,), in these
    extent: Extent
    windows: list[Indices]  # the times in each

    def __getitem__(self, name: str) -> float:
        return float(self.values[NAMES.index(name)])

    @property
    def friction(self) -> float:
        """Of the seal and viscous, at the motion's speed [N]."""
        seal = self["seal_friction_coefficient"] * self.extent.load
        return seal + self["viscous_friction"] * self.extent.speed

    def is_clear(self, name: str) -> bool:
        """Whether zero is not in the interval of a parameter that was sought."""
        return abs(self[name]) > self.half_widths[NAMES.index(name)] > 0

    @property
    def uncertainty(self) -> Array:
        """Half widths as shares of the value, or of all drive or turn if that is more (7,)."""
        drive, turn, load, speed, yaw_rate, _ = np.maximum(self.extent, ROUNDING)
        whole = np.array([0, drive / load, drive / speed, 0, turn / yaw_rate, 0, 0])
        return self.half_widths / np.maximum(np.abs(self.values), whole)

    @property
    def known(self) -> Choice:
        """Which intervals are narrow enough to be of use (7,)."""
        known: Choice = self.uncertainty <= KNOWN
        return known


@dataclass(frozen=True)
class System:
    """Equations of all windows in standard deviations: target = design · coefficients + noise."""

    design: Array  # (rows, 7, or 5 without wheel angles)
    target: Array  # (rows,)
    quantity: Indices  # (rows,) number of what is measured
    ends: Indices  # (windows,) row after the last of each

    @classmethod
    def of(cls, windows: list[list[Equations]], noise: Array) -> "System":
        """System of the kinds of equations in each window, of quantities with `noise` (q,)."""
        rows = [standardised(kinds, noise) for kinds in windows]
        ends = np.cumsum([len(target) for _, target, _ in rows])
        design, target, quantity = map(np.concatenate, zip(*rows, strict=True))
        return cls(design, target, quantity, ends)

    def solved(self, sought: Choice) -> tuple[Array, Array]:
        """Coefficients (7,), 0 where not `sought`, and residuals (rows,) of their soft L1 fit."""
        design = self.design[:, sought[: self.design.shape[1]]]
        weights: Array = np.ones(len(self.target))
        for _ in range(ITERATIONS):
            weighted = weights[:, None] * design
            fit = _inverse(weighted.T @ design) @ (weighted.T @ self.target)
            residuals = self.target - design @ fit
            weights = _weights(residuals)
        coefficients = np.zeros(7)
        coefficients[sought] = fit
        return coefficients, residuals

    def half_widths(self, values: Array, sought: Choice, residuals: Array) -> Array:
        """Of the 95 % intervals (7,): N is what a window tells, N⁻¹ g what it changes."""
        step, width = 1e-20, self.design.shape[1]
        slopes = [_coefficients(values + 1j * step * unit).imag / step for unit in np.eye(7)]
        jacobian = self.design @ np.stack(slopes, axis=1)[:width, sought]
        rows = jacobian, _weights(residuals), residuals
        parts = (np.split(part, self.ends[:-1]) for part in rows)
        each = [(J.T @ (w[:, None] * J), J.T @ (w * r)) for J, w, r in zip(*parts, strict=True)]
        N, g = (np.stack(both) for both in zip(*each, strict=True))
        count, squares = len(N), (_inverse(N.sum(axis=0) - N) @ g[..., None])[..., 0] ** 2
        jackknife = np.sqrt((count - 1) / count * squares.sum(axis=0))
        # as many degrees of freedom as if the windows' changes were normal, each with its variance
        ratio = squares.sum(axis=0) ** 2 / np.maximum((squares**2).sum(axis=0), ROUNDING**9)
        freedom = np.clip(3 * ratio - 2, 1, count - 1)
        white = np.sqrt(np.diagonal(_inverse(N.sum(axis=0))))
        half_widths = np.zeros(7)
        half_widths[sought] = np.maximum(
            student.ppf(QUANTILE, freedom) * jackknife, student.ppf(QUANTILE, count - 1) * white
        )
        return half_widths


def identify(motion: RecordedMotion, climber: Climber, cut: Cut = CUT) -> Identified:
    """Parameters of a climber that is believed to be `climber`; raises `ValueError`.

    Viscous friction and turning resistance that a motion does not show are taken for none.
    """
    windows = cut.windows(motion)
    if len(windows) < LEAST_WINDOWS:
        raise ValueError(
            f"{len(windows)} windows of {cut.window} s in motion must be >= {LEAST_WINDOWS}"
        )
    each = [equations(motion, climber, window) for window in windows]
    extent = _extent(motion, climber, windows)
    sought = ~OF_WHEELS | (motion.wheel_angles is not None)
    if extent.speed_spread < SPREAD * extent.speed:
        # noise would look like a difference of speeds, and tell that it makes none in friction
        sought[NAMES.index("viscous_friction")] = False
    found = Identified(*_fitted(each, climber, sought), extent, windows)
    needless = RESISTANCES & ~found.known
    if needless.any():
        found = Identified(*_fitted(each, climber, sought & ~needless), extent, windows)
    return found


def predicted(motion: RecordedMotion, climber: Climber, cut: Cut = CUT) -> Identified:
    """What would be found of `climber` if it moved like this, with the noise to begin with."""
    windows = cut.windows(motion)
    each = [equations(motion, climber, window) for window in windows]
    noise, values, sought = _noise(each), _believed(climber), ~OF_WHEELS
    system = System.of(each, noise)
    half_widths = system.half_widths(values, sought, 0 * system.target)
    extent = _extent(motion, climber, windows)
    return Identified(values, half_widths, sought, noise, [], extent, windows)


def _fitted(
    windows: list[list[Equations]], climber: Climber, sought: Choice
) -> tuple[Array, Array, Choice, Array, list[Array]]:
    """First fields of `Identified`, with the noise as it turns out to be."""
    noise = _noise(windows)
    least = 0.1 * noise
    for _ in range(REFINEMENTS):
        system, used = System.of(windows, noise), noise
        coefficients, residuals = system.solved(sought)
        each = [residuals[system.quantity == number] for number in range(len(noise))]
        noise = np.maximum(noise * [1.4826 * np.median(np.abs(one)) for one in each], least)
    values = _parameters(coefficients, climber)
    return values, system.half_widths(values, sought, residuals), sought, used, each


def _noise(windows: list[list[Equations]]) -> Array:
    kinds = zip(NOISE, windows[0], strict=False)
    return np.concatenate([sigmas[-kind.measured :] for sigmas, kind in kinds])


def _believed(climber: Climber) -> Array:
    return np.array([getattr(climber, name, 0.0) for name in NAMES])


def _coefficients(values: Array) -> Array:
    """Coefficients (7,) of parameters (7,)."""
    m, mu, c, J, D, r, d = values
    return np.array([1 / (m * r), mu / m, c / m, d / (J * r), D / J, r, r / d])


def _parameters(coefficients: Array, climber: Climber) -> Array:
    """Parameters (7,) of coefficients (7,); the climber's where these make no sense."""
    a_1, a_2, a_3, b_1, b_2, radius, per_track = coefficients.tolist()
    r = radius or climber.wheel_radius
    d = _quotient(r, per_track, climber.half_track)
    m, J = _quotient(1 / r, a_1, climber.mass), _quotient(d / r, b_1, climber.yaw_inertia)
    return np.array([m, a_2 * m, a_3 * m, J, b_2 * J, r, d])


def _quotient(dividend: float, divisor: float, believed: float) -> float:
    """Quotient, or what is believed if it were beyond a thousand times that."""
    return dividend / divisor if divisor > 1e-3 * dividend / believed else believed


def _extent(motion: RecordedMotion, climber: Climber, windows: list[Indices]) -> Extent:
    ends = np.array([window[[0, -1]] for window in windows]).T
    quantities = np.column_stack([motion.time, motion.impulse, motion.way, motion.pose[:, 2]])
    time, right, left, way, turned = (quantities[ends[1]] - quantities[ends[0]]).T
    drive, turn = climber.drive_and_turn(np.column_stack([right, left]) / time[:, None])
    each = (drive, turn, seal_load(motion, climber), way / time, turned / time)
    rms = [np.sqrt(np.mean(values**2)) for values in each]
    return Extent(*map(float, (*rms, np.std(np.abs(way / time)))))


def _weights(residuals: Array) -> Array:
    """Of residuals (...) in the soft L1 fit."""
    weights: Array = 1 / np.sqrt(1 + (residuals / CLEAR) ** 2)
    return weights


def _inverse(matrix: Array) -> Array:
    """Inverse (..., p, p) of positive semidefinite matrices; enormous where there is none."""
    scale = np.sqrt(np.maximum(np.diagonal(matrix, axis1=-2, axis2=-1), ROUNDING**2))
    both = scale[..., :, None] * scale[..., None, :]
    values, vectors = np.linalg.eigh(matrix / both)
    inverse: Array = (vectors / np.maximum(values, ROUNDING)[..., None, :]) @ transpose(vectors)
    return inverse / both
