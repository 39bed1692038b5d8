"""A robust fit of linear equations in windows, and intervals for what nonlinearly depends on it.

Least squares of the residuals' soft L1 norm, by reweighting. The intervals are those of a jackknife
over the windows, so that they hold whatever noise and errors of the model do within a window; but
not narrower than white noise alone would make them, which tells what is not excited at all.
"""

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from climber_uk.analysis.integral_equations import Equations, standardised
from climber_uk.analysis.recorded_motion import Indices
from climber_uk.mechanics import Array, transpose

ITERATIONS = 10
CLEAR = 3.0  # standard deviations beyond which a residual counts less and less
QUANTILE = 0.975  # of intervals of 95 %
ROUNDING = 1e-13
NOTHING = 1e-100


@dataclass(frozen=True)
class WindowFit:
    """Equations of all windows in standard deviations: target = design · coefficients + noise."""

    design: Array  # (rows, coefficients)
    target: Array  # (rows,)
    quantity: Indices  # (rows,) number of what is measured
    ends: Indices  # (windows,) row after the last of each

    @classmethod
    def of(cls, windows: list[list[Equations]], noise: Array) -> "WindowFit":
        """Fit to all kinds of equations in each window, of quantities with `noise` (q,)."""
        rows = [standardised(kinds, noise) for kinds in windows]
        ends = np.cumsum([len(target) for _, target, _ in rows])
        design, target, quantity = map(np.concatenate, zip(*rows, strict=True))
        return cls(design, target, quantity, ends)

    def solved(self) -> tuple[Array, Array]:
        """Coefficients and residuals (rows,)."""
        weights: Array = np.ones(len(self.target))
        for _ in range(ITERATIONS):
            weighted = weights[:, None] * self.design
            coefficients = _inverse(weighted.T @ self.design) @ (weighted.T @ self.target)
            residuals = self.target - self.design @ coefficients
            weights = _weights(residuals)
        return coefficients, residuals

    def half_widths(self, slopes: Array, residuals: Array) -> Array:
        """Of the intervals of p parameters, by which the coefficients have `slopes` (c, p).

        N is what a window tells of them, and without the window they would change by N⁻¹ g.
        """
        rows = self.design @ slopes, _weights(residuals), residuals
        parts = (np.split(part, self.ends[:-1]) for part in rows)
        each = [(J.T @ (w[:, None] * J), J.T @ (w * r)) for J, w, r in zip(*parts, strict=True)]
        N, g = (np.stack(both) for both in zip(*each, strict=True))
        count, whole = len(N), N.sum(axis=0)
        squares = (_inverse(whole - N) @ g[..., None])[..., 0] ** 2
        jackknife = np.sqrt((count - 1) / count * squares.sum(axis=0))
        # as many degrees of freedom as the windows have if their changes are normal, each with a
        # variance of its own: E x⁴ = 3 (E x²)²
        ratio = squares.sum(axis=0) ** 2 / np.maximum((squares**2).sum(axis=0), NOTHING)
        freedom = np.clip(3 * ratio - 2, 1, count - 1)
        white = student.ppf(QUANTILE, count - 1) * np.sqrt(np.diagonal(_inverse(whole)))
        return np.maximum(student.ppf(QUANTILE, freedom) * jackknife, white)


def _weights(residuals: Array) -> Array:
    weights: Array = 1 / np.sqrt(1 + (residuals / CLEAR) ** 2)
    return weights


def _inverse(matrix: Array) -> Array:
    """Inverse (..., p, p) of positive semidefinite matrices; enormous where there is none."""
    scale = np.sqrt(np.maximum(np.diagonal(matrix, axis1=-2, axis2=-1), ROUNDING**2))
    both = scale[..., :, None] * scale[..., None, :]
    values, vectors = np.linalg.eigh(matrix / both)
    inverse: Array = (vectors / np.maximum(values, ROUNDING)[..., None, :]) @ transpose(vectors)
    return inverse / both
