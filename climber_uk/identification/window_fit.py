"""A robust fit of linear equations in windows, its test, and the errors of its coefficients.

The soft L1 norm of the residuals is minimised, by reweighted least squares. Three errors of a
coefficient are estimated:

- by what differs from window to window, whatever its distribution: a jackknife over the windows;
- by white noise, which shows what is not excited at all: an error is never less than that;
- by model errors that are collinear with the coefficient: see `Misfit`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from climber_uk.identification.integral_equations import Equations
from climber_uk.identification.recorded_motion import Indices
from climber_uk.mechanics import Array, transpose

ITERATIONS, REFINEMENTS = 10, 3
CLEAR = 3.0  # standard deviations beyond which a residual counts less and less
ROUNDING = 1e-13
MEDIAN = 1.4826  # standard deviation of what is normal, by the median of its absolute value
STRANGE, FEW = 6.0, 0.1  # times the usual misfit of a window; largest share of such windows
SLIGHT = 1e-4  # [m/s²] or the like: a misfit below it is none
CHANCE = 1e-3  # probability that noise alone fails the test of fit


@dataclass(frozen=True)
class Misfit:
    """Accelerations that are missing in the equations of each window, and their noise.

    Noise is taken to be white, by differences from one time to the next: what is slower is no noise
    of a sensor, or cannot be distinguished from an acceleration. `excess` is what remains beyond
    it, 0 where the test (χ² of all windows) does not fail.
    """

    found: Array  # (n, 2) constant in the window, and changing in it
    noise: Array  # (n, 2) standard deviation
    excess: Array  # (2,)

    @classmethod
    def of(cls, found: Array, noise: Array, coefficients: int) -> "Misfit":
        """Test the accelerations `found` (n, 2) by a fit of this number of coefficients."""
        count = len(found)
        freedom = max(1, count - coefficients)
        ratio = ((found / noise) ** 2).sum(axis=0)
        beyond = np.mean(found**2, axis=0) * count / freedom - np.mean(noise**2, axis=0)
        fails = chdtrc(freedom, ratio) < CHANCE
        return cls(found, noise, np.where(fails, np.sqrt(np.maximum(beyond, 0.0)), 0.0))

    @property
    def strange(self) -> NDArray[np.bool_]:
        """Which windows (n,) fit much worse than most, as of a push, a bump or a stop; only few."""
        usual = np.maximum(MEDIAN * np.median(np.abs(self.found), axis=0), self.noise + SLIGHT)
        worst = np.max(np.abs(self.found) / usual, axis=1)
        limit = np.quantile(worst, 1 - FEW)
        return worst > max(STRANGE, limit)

    @property
    def ratio(self) -> float:
        """χ² of the constant ones by the number of windows: about 1 for a model that fits."""
        return float(np.mean((self.found[:, 0] / self.noise[:, 0]) ** 2))


@dataclass(frozen=True)
class WindowFit:
    """Equations of all windows in standard deviations: target = design · coefficients + noise."""

    design: Array  # (rows, c)
    target: Array  # (rows,)
    lacking: Array  # (rows, 2) see `Equations`
    quantity: Indices  # (rows,) number of what is measured
    ends: Indices  # (windows,) row after the last of each
    noise: Array  # (q,) standard deviations

    @classmethod
    def of(
        cls, windows: Sequence[Equations], columns: Sequence[int], noise: Array, least: float = 0.1
    ) -> "WindowFit":
        """Fit of the coefficients in `columns`; standard deviations of noise are estimated, too.

        They begin with `noise` (q,), and do not fall below `least` times that.
        """
        whole = cls.standardised(windows, columns, noise)
        for _ in range(REFINEMENTS):
            quantities = range(len(noise))
            spread = [np.median(np.abs(whole.residuals[whole.quantity == q])) for q in quantities]
            turned_out = np.maximum(whole.noise * MEDIAN * np.array(spread), least * noise)
            whole = cls.standardised(windows, columns, turned_out)
        return whole

    @classmethod
    def standardised(
        cls, windows: Sequence[Equations], columns: Sequence[int], noise: Array
    ) -> "WindowFit":
        """Fit of the coefficients in `columns`, with a `noise` (q,) that is known."""
        parts, chosen = [], list(columns)
        for one in windows:
            quantity = np.repeat(np.arange(one.measured), len(one.target) // one.measured)
            scale = noise[quantity][:, None]
            start, _ = np.linalg.qr(one.start / scale)
            rows = np.column_stack([one.design[:, chosen], one.target, one.lacking]) / scale
            rows -= start @ (start.T @ rows)
            parts.append((rows[:, : len(chosen)], rows[:, -3], rows[:, -2:], quantity))
        ends = np.cumsum([len(part[1]) for part in parts])
        design, target, lacking, quantity = map(np.concatenate, zip(*parts, strict=True))
        return cls(design, target, lacking, quantity, ends, noise)

    @cached_property
    def coefficients(self) -> Array:
        """Coefficients (c,)."""
        weights: Array = np.ones(len(self.target))
        for _ in range(ITERATIONS):
            weighted = weights[:, None] * self.design
            found = _inverse(weighted.T @ self.design) @ (weighted.T @ self.target)
            weights = _weights(self.target - self.design @ found)
        return found

    @cached_property
    def residuals(self) -> Array:
        """Residuals (rows,), in standard deviations."""
        return self.target - self.design @ self.coefficients

    @property
    def cost(self) -> float:
        """Sum of the soft L1 norm of the residuals."""
        squares = (self.residuals / CLEAR) ** 2
        return float(2 * CLEAR**2 * np.sum(np.sqrt(1 + squares) - 1))

    @cached_property
    def information(self) -> Array:
        """Jᵀ W J of each window (n, c, c), by design J and weights W: the normal equations."""
        return self._by_window(lambda J, w: J.T @ (w[:, None] * J), self.design, self._weights)

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the coefficients (c, c), if noise is white."""
        return _inverse(self.information.sum(axis=0))

    @cached_property
    def changes(self) -> Array:
        """Changes of the coefficients (n, c) without each of the windows."""
        rows = self.design, self._weights, self.residuals
        g = self._by_window(lambda J, w, r: J.T @ (w * r), *rows)
        rest = self.information.sum(axis=0) - self.information
        return (_inverse(rest) @ g[..., None])[..., 0]

    def deviation(self, number: int) -> float:
        """Standard deviation of a coefficient, by differences of the windows or by noise."""
        n, changes = len(self.ends), self.changes[:, number]
        white = float(self.covariance[number, number])
        return float(np.sqrt(max((n - 1) / n * float(changes @ changes), white)))

    @cached_property
    def pulls(self) -> Array:
        """Changes of the coefficients (n, 2, c) by an acceleration of 1 missing in a window."""
        rows = self.design, self._weights, self.lacking
        return self._by_window(lambda J, w, F: F.T @ (w[:, None] * J), *rows) @ self.covariance

    @cached_property
    def misfit(self) -> Misfit:
        """Accelerations that are missing in the equations, and the test."""
        parts = (self._split(part) for part in (self.lacking, self.residuals, self.quantity))
        white = self._white()
        found, noise = [], []
        for F, r, quantity in zip(*parts, strict=True):
            inverse = _inverse(F.T @ F)
            shown = (white[quantity][:, None] * F) @ inverse
            found.append(inverse @ (F.T @ r))
            noise.append(np.sqrt((shown**2).sum(axis=0)))
        return Misfit.of(np.array(found), np.array(noise), self.design.shape[1])

    def bias(self, slopes: Array) -> Array:
        """Largest error (p,) of p parameters by what is missing in the equations.

        `slopes` (p, c) are their derivatives by the coefficients.
        """
        return (np.abs(self.pulls @ slopes.T) * self.misfit.excess[:, None]).sum(axis=(0, 1))

    def _white(self) -> Array:
        """Standard deviation (q,) of the white part of residuals, from their differences."""
        windows = [*zip(self._split(self.residuals), self._split(self.quantity), strict=True)]
        white = []
        for number in range(len(self.noise)):
            steps = np.concatenate([np.diff(r[quantity == number]) for r, quantity in windows])
            white.append(MEDIAN * np.median(np.abs(steps)) / np.sqrt(2))
        return np.maximum(white, ROUNDING)

    @cached_property
    def _weights(self) -> Array:
        return _weights(self.residuals)

    def _by_window(self, function: Callable[..., Array], *rows: NDArray[Any]) -> Array:
        """Function of each window's part of some arrays of rows (n, ...)."""
        return np.stack([function(*w) for w in zip(*map(self._split, rows), strict=True)])

    def _split(self, rows: NDArray[Any]) -> list[NDArray[Any]]:
        return np.split(rows, self.ends[:-1])


def _weights(residuals: Array) -> Array:
    return 1 / np.sqrt(1 + (residuals / CLEAR) ** 2)


def _inverse(matrix: Array) -> Array:
    """Inverse (..., p, p) of positive semidefinite matrices; enormous where there is none."""
    scale = np.sqrt(np.maximum(np.diagonal(matrix, axis1=-2, axis2=-1), ROUNDING**2))
    both = scale[..., :, None] * scale[..., None, :]
    values, vectors = np.linalg.eigh(matrix / both)
    inverse: Array = (vectors / np.maximum(values, ROUNDING)[..., None, :]) @ transpose(vectors)
    return inverse / both
