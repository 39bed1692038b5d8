"""Which fixes to believe: those that the estimate may expect, and others once they agree.

A fix passes if its innovation's χ² is below the quantile of a share of good fixes. Of refused ones
in a row, enough that differ from their mean by no more than their noise are believed: what is
wrong then is the estimate, or the place of what is measured to.
"""

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from climber_uk.localization.kalman import Estimate, corrected, distance
from climber_uk.localization.models import HEADING, fixed, fixed_jacobian
from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import Array
from climber_uk.mechanics.elementary import wrapped


class Fix(NamedTuple):
    """An absolute measurement of n parts of the pose, in the wall's frame."""

    stamp: int  # [ns] of measuring
    parts: tuple[int, ...]  # which: of (x, y, θ)
    values: Array  # (n,) [m], [rad]
    noise: Array  # (n, n) covariance
    lever: tuple[float, float] = (0.0, 0.0)  # [m] of what is measured: forwards, left of the centre

    def moved(self, x: float, y: float, yaw: float) -> "Fix":
        """The same where the frame of its values has its origin at (x, y) [m], turned by a yaw.

        Raises `ValueError` where only one of x and y is measured, and the yaw turns it.
        """
        number = {part: index for index, part in enumerate(self.parts)}
        turn, offset = np.eye(len(self.parts)), np.array([(x, y, yaw)[part] for part in self.parts])
        if yaw != 0 and len({0, 1} & set(self.parts)) == 1:
            raise ValueError("x and y have to be measured both where their frame is turned")
        if yaw != 0 and 0 in number:
            cosine, sine, both = math.cos(yaw), math.sin(yaw), [number[0], number[1]]
            turn[np.ix_(both, both)] = [[cosine, -sine], [sine, cosine]]
        values, noise = turn @ self.values + offset, turn @ self.noise @ turn.T
        return self._replace(values=values, noise=noise)

    def innovation(self, estimate: Estimate) -> Array:
        """What it is off an estimate (n,) [m], [rad]."""
        parts = list(self.parts)
        off = self.values - fixed(estimate.mean, self.lever)[parts]
        return np.where(np.array(parts) == HEADING, wrapped(off), off)

    def jacobian(self, estimate: Estimate) -> Array:
        """Derivative (n, 12) of what it measures by the state."""
        return fixed_jacobian(estimate.mean, self.lever)[list(self.parts)]


class Verdict(NamedTuple):
    """Whether a fix is taken, and how."""

    taken: bool
    said: str  # what is to be said of it; '' of a good one
    believed: bool = False  # against the estimate


class Gate:
    """Remembers what was refused since the last fix that passed."""

    def __init__(self, options: LocalizationOptions) -> None:
        self.limits = [quantile(options.gate_probability, parts) for parts in (1, 2, 3)]
        self.refused: deque[tuple[Fix, Array]] = deque(maxlen=options.agreeing_fixes)
        self.ratio = 0.0  # χ² of the last innovation by its limit

    def judge(self, estimate: Estimate, fix: Fix) -> Verdict:
        """Verdict on a fix, of the estimate at its stamp."""
        innovation, jacobian = fix.innovation(estimate), fix.jacobian(estimate)
        limit = self.limits[len(fix.parts) - 1]
        self.ratio = distance(estimate, innovation, jacobian, fix.noise) / limit
        if self.ratio <= 1:
            self.refused.clear()
            return Verdict(True, "")
        self.refused.append((fix, innovation))
        off = ", ".join(f"{part:.3g}" for part in innovation)
        if self._agree(limit):
            count = len(self.refused)
            self.refused.clear()
            return Verdict(True, f"off by {off}: believed, as {count} in a row agree", True)
        return Verdict(False, f"off by {off}: {self.ratio:.3g} times what may be")

    def _agree(self, limit: float) -> bool:
        if len(self.refused) < (self.refused.maxlen or 0):
            return False
        if len({fix.parts for fix, _ in self.refused}) > 1:
            return False
        mean = np.mean([innovation for _, innovation in self.refused], axis=0)
        return all(
            (innovation - mean) @ np.linalg.solve(fix.noise, innovation - mean) <= limit
            for fix, innovation in self.refused
        )


def corrected_by(estimate: Estimate, fix: Fix) -> Estimate:
    """Estimate after a fix."""
    return corrected(estimate, fix.innovation(estimate), fix.jacobian(estimate), fix.noise)


def told_anew(estimate: Estimate, fix: Fix) -> Estimate:
    """Estimate that believes a fix only, of the parts that it measures."""
    parts = list(fix.parts)
    mean, covariance = estimate.mean.copy(), estimate.covariance.copy()
    told = estimate.mean[: HEADING + 1].copy()
    told[parts] = fix.values
    centre = 2 * told - fixed(told, fix.lever)  # less the lever, at the heading of then
    centre[HEADING] = mean[HEADING] + wrapped(told[HEADING] - mean[HEADING])
    mean[parts] = centre[parts]
    by_heading = fix.jacobian(estimate)[:, HEADING] * (HEADING not in parts)
    noise = fix.noise + np.outer(by_heading, by_heading) * covariance[HEADING, HEADING]
    covariance[parts, :] = 0.0
    covariance[:, parts] = 0.0
    covariance[np.ix_(parts, parts)] = noise
    return Estimate(mean, covariance)


def quantile(probability: float, parts: int) -> float:
    """What χ² of 1 to 3 `parts` is below with a `probability`; by bisection, without scipy."""
    low, high = 0.0, 1000.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if chi_square(middle, parts) < probability else (low, middle)
    return high


def chi_square(value: float, parts: int) -> float:
    """Probability that χ² of 1 to 3 `parts` is below `value`."""
    if parts == 2:
        return 1 - math.exp(-value / 2)
    tail = math.sqrt(2 * value / math.pi) * math.exp(-value / 2) if parts == 3 else 0.0
    return math.erf(math.sqrt(value / 2)) - tail
