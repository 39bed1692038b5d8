"""Distributions from which a parameter of each run is drawn: x = F⁻¹(u), u uniform in (0, 1).

u of run k is the k-th number of a stream that the seed and the parameter's name determine. A new
distribution is one class with `quantile`, and one entry in `DISTRIBUTIONS`.
"""

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from scipy.special import ndtr, ndtri

from climber_uk.mechanics import Array

EXTREMES = np.array([2.0**-54, 1 - 2.0**-53])  # the least and the largest u that there can be


class Distribution(Protocol):
    """A distribution, by its quantile function."""

    def quantile(self, share: Array) -> Array:
        """Values (n,) below which a `share` (n,) of all draws is: F⁻¹."""


@dataclass(frozen=True)
class Uniform:
    """`[lowest, highest]`, all equally likely."""

    lowest: float
    highest: float

    def __post_init__(self) -> None:
        if not self.lowest <= self.highest:
            raise ValueError(f"highest={self.highest} must be >= lowest={self.lowest}")

    def quantile(self, share: Array) -> Array:
        """See `Distribution`."""
        return self.lowest + (self.highest - self.lowest) * share


@dataclass(frozen=True)
class Normal:
    """`[mean, deviation]`, or `[mean, deviation, lowest, highest]`: what is beyond is not drawn."""

    mean: float
    deviation: float
    lowest: float = -math.inf
    highest: float = math.inf

    def __post_init__(self) -> None:
        if not self.deviation > 0:
            raise ValueError(f"deviation={self.deviation} must be > 0")
        if not self.lowest < self.highest:
            raise ValueError(f"highest={self.highest} must be > lowest={self.lowest}")
        low, high = self._shares
        if not low < high:
            raise ValueError(
                f"lowest={self.lowest}, highest={self.highest}: too far from mean={self.mean} to "
                f"be drawn with deviation={self.deviation}"
            )

    @property
    def _sign(self) -> float:
        """-1 for the upper tail, which is drawn as the lower one: shares near 0 are exact."""
        return -1.0 if self.lowest > self.mean else 1.0

    @property
    def _shares(self) -> tuple[float, float]:
        ends = self._sign * (np.array([self.lowest, self.highest]) - self.mean) / self.deviation
        low, high = sorted(ndtr(ends).tolist())
        return low, high

    def quantile(self, share: Array) -> Array:
        """See `Distribution`."""
        low, high = self._shares
        share = share if self._sign > 0 else 1 - share
        value = self.mean + self._sign * self.deviation * ndtri(low + (high - low) * share)
        return np.clip(value, self.lowest, self.highest)


@dataclass(frozen=True)
class Lognormal:
    """`[median, deviation of the logarithm]`, or that and `lowest, highest`."""

    median: float
    deviation: float
    lowest: float = 0.0
    highest: float = math.inf

    def __post_init__(self) -> None:
        if not (self.median > 0 and self.lowest >= 0):
            raise ValueError(f"median={self.median}, lowest={self.lowest} must be > 0, >= 0")
        _ = self._logarithm

    @property
    def _logarithm(self) -> Normal:
        with np.errstate(divide="ignore"):
            median, lowest, highest = np.log([self.median, self.lowest, self.highest]).tolist()
        return Normal(median, self.deviation, lowest, highest)

    def quantile(self, share: Array) -> Array:
        """See `Distribution`."""
        return np.exp(self._logarithm.quantile(share))


@dataclass(frozen=True)
class Categorical:
    """`[value, ...]`, or `{value: weight, ...}`."""

    values: tuple[float, ...]
    weights: tuple[float, ...]

    def __post_init__(self) -> None:
        if not (min(self.weights, default=0) >= 0 and 0 < sum(self.weights) < math.inf):
            raise ValueError(f"weights={list(self.weights)} must be >= 0, and one of them > 0")

    def quantile(self, share: Array) -> Array:
        """See `Distribution`."""
        ends = np.cumsum(self.weights) / math.fsum(self.weights)
        ends[np.flatnonzero(self.weights)[-1] :] = 1.0
        return np.array(self.values)[np.searchsorted(ends, share, side="right")]


DISTRIBUTIONS: dict[str, type[Distribution]] = {
    "uniform": Uniform,
    "normal": Normal,
    "lognormal": Lognormal,
    "choice": Categorical,
}


def distribution(given: Any) -> Distribution:
    """Distribution from `{name: its numbers}` of a file; `ValueError` if there is no such."""
    if not (isinstance(given, dict) and len(given) == 1 and next(iter(given)) in DISTRIBUTIONS):
        raise ValueError(f"{given} must be a value or one of {', '.join(DISTRIBUTIONS)}")
    [(name, numbers)] = given.items()
    if name == "choice" and numbers and isinstance(numbers, list | dict):
        weights = list(numbers.values()) if isinstance(numbers, dict) else [1.0] * len(numbers)
        return Categorical(
            tuple(_numbers(name, list(numbers))), tuple(_numbers("weights", weights))
        )
    try:
        return DISTRIBUTIONS[name](*_numbers(name, numbers))
    except TypeError:
        wanted = (DISTRIBUTIONS[name].__doc__ or "").rstrip(".")
        raise ValueError(f"{name} {numbers} must be {wanted}") from None


def drawn(from_: Distribution, seed: int, name: str, first: int, number: int) -> Array:
    """Values (number,) of a parameter, drawn for the runs from `first` on."""
    stream = np.random.PCG64(np.random.SeedSequence([seed, *name.encode()]))
    stream.advance(first)
    shares = np.random.Generator(stream).random(number)
    return from_.quantile(np.clip(shares, *EXTREMES))


def extremes(of: Distribution) -> tuple[float, float]:
    """The least and the largest value that can be drawn."""
    if isinstance(of, Categorical):
        return min(of.values), max(of.values)
    low, high = of.quantile(EXTREMES).tolist()
    return low, high


def _numbers(name: str, given: Any) -> list[float]:
    is_list = isinstance(given, list)
    if not is_list or any(isinstance(g, bool) or not isinstance(g, int | float) for g in given):
        raise ValueError(f"{name} {given} must be a list of numbers")
    if not all(math.isfinite(g) for g in given):
        raise ValueError(f"{name} {given} must be finite")
    return [float(g) for g in given]
