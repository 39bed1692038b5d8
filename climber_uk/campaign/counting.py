"""Quantiles, histograms and rank correlations of more runs than memory holds.

Each takes the runs batch by batch, as often as it must, and keeps counts of a fixed size.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from climber_uk.mechanics import Array

SIGN = np.uint64(1 << 63)
ROUNDING = 1e-12
BITS = 8  # of the values, that each pass determines


class Batches(Protocol):
    """Runs that can be read repeatedly, a bounded number at a time, in the same order."""

    def batches(self, names: Sequence[str]) -> Iterator[dict[str, Array]]:
        """Columns (n,) of these names, from the first runs to the last."""


class Histogram(NamedTuple):
    """Histogram of the finite values."""

    counts: Array  # (bins,)
    edges: Array  # (bins + 1,)
    infinite: int  # number of infinite values


def quantiles(runs: Batches, names: Sequence[str], shares: Sequence[float]) -> dict[str, Array]:
    """Exact quantiles (shares,) of each column, as `numpy.nanquantile` by "inverted_cdf".

    The k-th value has the highest bits that the k-th of all highest bits has, and so on downwards.
    """
    numbers = sum(_numbers(batch, names) for batch in runs.batches(names))
    left = np.maximum(np.ceil(np.outer(numbers, shares) - 1), 0).astype(int)
    known = np.zeros(left.shape, np.uint64)
    for shift in range(64 - BITS, -1, -BITS):
        counts = np.zeros((*left.shape, 1 << BITS), int)
        for batch in runs.batches(names):
            for of_column, column, name in zip(counts, known, names, strict=True):
                keys = _keys(batch[name]) >> shift
                for count, key in zip(of_column, column, strict=True):
                    found = keys[keys >> BITS == key] & ((1 << BITS) - 1)
                    count += np.bincount(found.astype(int), minlength=1 << BITS)
        ends = counts.cumsum(axis=-1)
        digits = np.count_nonzero(ends <= left[..., None], axis=-1)
        left -= np.take_along_axis(ends - counts, digits[..., None], axis=-1)[..., 0]
        known = known << BITS | digits.astype(np.uint64)
    return dict(zip(names, _values(known), strict=True))


def _numbers(batch: dict[str, Array], names: Sequence[str]) -> Array:
    """Count of values that are not nan, of each column."""
    return np.array([np.count_nonzero(~np.isnan(batch[name])) for name in names])


def _keys(values: Array) -> Any:
    """Unsigned integers (n,) in the order of floats (n,); nan is the largest."""
    bits = np.where(np.isnan(values), np.nan, values + 0.0).view(np.uint64)  # 0.0 for -0.0, too
    return np.where(bits & SIGN, ~bits, bits | SIGN)


def _values(keys: Any) -> Array:
    """Floats of keys: the inverse of `_keys`."""
    return np.where(keys & SIGN, keys ^ SIGN, ~keys).view(np.float64)


def histograms(runs: Batches, names: Sequence[str], bins: int) -> dict[str, Histogram]:
    """Histogram of each column, as `numpy.histogram` from its least to its largest finite value."""
    ends = dict.fromkeys(names, (np.inf, -np.inf))
    for batch in runs.batches(names):
        for name, (low, high) in ends.items():
            finite = batch[name][np.isfinite(batch[name])]
            ends[name] = finite.min(initial=low), finite.max(initial=high)
    ends = {name: _wide(*low_high) for name, low_high in ends.items()}
    edges = {name: np.histogram_bin_edges([], bins, range=of) for name, of in ends.items()}
    counts, infinite = {name: np.zeros(bins, int) for name in names}, dict.fromkeys(names, 0)
    for batch in runs.batches(names):
        for name in names:
            finite = batch[name][np.isfinite(batch[name])]
            counts[name] += np.histogram(finite, bins, range=ends[name])[0]
            infinite[name] += len(batch[name]) - len(finite)
    return {name: Histogram(counts[name], edges[name], infinite[name]) for name in names}


def _wide(low: float, high: float) -> tuple[float, float]:
    if low > high:  # nothing is finite
        return 0.0, 1.0
    if high - low <= ROUNDING * max(abs(low), abs(high)):  # too near for bins between
        return low - 0.5, high + 0.5
    return low, high


def rank_correlations(
    runs: Batches, rows: Sequence[str], columns: Sequence[str], some: dict[str, Array]
) -> Array:
    """Spearman's (rows, columns), of ranks that are exact at the values of `some` runs.

    Values between two of those have the mean rank of all that are between these two.
    """
    names = [*dict.fromkeys([*rows, *columns])]
    edges = {name: np.unique(some[name]) for name in names}
    counts = {name: np.zeros(2 * len(edges[name]) + 1) for name in names}
    for batch in runs.batches(names):
        for name, count in counts.items():
            count += np.bincount(_cells(edges[name], batch[name]), minlength=len(count))
    ranks = {name: np.cumsum(n) - n / 2 - n.sum() / 2 for name, n in counts.items()}  # mean: 0
    products = np.zeros((len(rows), len(columns)))
    for batch in runs.batches(names):
        own = {name: ranks[name][_cells(edges[name], batch[name])] for name in names}
        products += np.array([own[n] for n in rows]) @ np.array([own[n] for n in columns]).T
    spread = {name: np.sqrt(counts[name] @ ranks[name] ** 2) for name in names}
    with np.errstate(invalid="ignore"):  # nan for what is the same in all runs
        return products / np.outer([spread[n] for n in rows], [spread[n] for n in columns])


def _cells(edges: Array, values: Array) -> Any:
    """Cell (n,) of each value: 1, 3, … are at the edges, 0, 2, … between them."""
    return np.searchsorted(edges, values) + np.searchsorted(edges, values, side="right")
