"""The messages of a topic as arrays, by their stamps."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from climber_uk.bags.taking import FAULTS, WIDEST, Faults
from climber_uk.mechanics import Array, Stamps

# stamps (n,) and log times (n,) [ns], values (n, k), and what is wrong with them
FilePart = tuple[Stamps, Stamps, Array, Faults]


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
    def of(cls, parts: Collection[FilePart]) -> "TimeSeries":
        """Messages in parts; of those sent twice the first counts."""
        if not parts:
            return cls(np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, WIDEST)))
        stamps, arrivals, values, faults = in_order(parts)
        fit = faults == 0
        counts = np.bincount(faults, minlength=len(FAULTS)).tolist()
        unfit = {why: n for why, n in zip(FAULTS, counts, strict=True) if why and n}
        stamps, arrivals, values = stamps[fit], arrivals[fit], values[fit]
        late = int(np.sum(np.diff(stamps) < 0))
        found, first = np.unique(stamps, return_index=True)
        repeated = len(stamps) - len(found)
        return cls(found, arrivals[first], values[first], unfit, repeated, late)

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


def in_order(parts: Collection[FilePart]) -> FilePart:
    """All messages as one part, in the order in which they were recorded."""
    stamps, arrivals, values, faults = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.argsort(arrivals, kind="stable")
    return stamps[order], arrivals[order], values[order], faults[order]
