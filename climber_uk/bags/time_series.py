"""The messages of a topic as arrays: as they were recorded, and in the order of their stamps."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from climber_uk.bags.extraction import FAULTS, WIDEST, Faults
from climber_uk.mechanics import Array, Stamps


class Samples(NamedTuple):
    """n messages of one topic, fit or not."""

    stamps: Stamps  # (n,) [ns]
    arrivals: Stamps  # (n,) log times [ns]
    values: Array  # (n, k)
    faults: Faults  # (n,) what is wrong with each, an index of `extraction.FAULTS`

    def where(self, chosen: Any) -> "Samples":
        """Those that a mask, or places (m,), choose."""
        return Samples(*(array[chosen] for array in self))

    @property
    def fit(self) -> "Samples":
        """Those with nothing wrong."""
        return self.where(self.faults == 0)


@dataclass(frozen=True)
class TimeSeries:
    """The n messages of one topic, each stamp once, in the order of the stamps."""

    stamps: NDArray[np.int64]  # (n,) [ns]
    arrivals: NDArray[np.int64]  # (n,) log times [ns]
    values: Array  # (n, k)
    unfit: Mapping[str, int] = field(default_factory=dict)  # messages left out, by the reason
    repeated: int = 0  # with a stamp that one before had
    late: int = 0  # recorded after one with a later stamp

    @classmethod
    def of(cls, parts: Collection[Samples]) -> "TimeSeries":
        """The fit messages of some parts; of those with one stamp the first recorded counts."""
        if not parts:
            return cls(np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, WIDEST)))
        samples = in_order(parts)
        counts = np.bincount(samples.faults, minlength=len(FAULTS)).tolist()
        unfit = {why: n for why, n in zip(FAULTS, counts, strict=True) if why and n}
        samples = samples.fit
        late = int(np.sum(np.diff(samples.stamps) < 0))
        stamps, first = np.unique(samples.stamps, return_index=True)
        repeated = len(samples.stamps) - len(stamps)
        return cls(stamps, samples.arrivals[first], samples.values[first], unfit, repeated, late)

    def __len__(self) -> int:
        return len(self.stamps)

    def where(self, chosen: Any) -> "TimeSeries":
        """Those that a mask or a slice chooses."""
        return replace(
            self,
            stamps=self.stamps[chosen],
            arrivals=self.arrivals[chosen],
            values=self.values[chosen],
        )

    def within(self, first: int, last: int) -> "TimeSeries":
        """Those with a stamp from `first` to `last`."""
        return self.where((self.stamps >= first) & (self.stamps <= last))


def in_order(parts: Collection[Samples]) -> Samples:
    """All messages of some parts, of which there is one at least, in the order of log times."""
    joined = Samples(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
    return joined.where(np.argsort(joined.arrivals, kind="stable"))
