"""The messages of a topic as arrays, by their stamps."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from climber_uk.analysis.taking import WIDEST
from climber_uk.mechanics import Array
from climber_uk.messages.reading import LARGEST


@dataclass(frozen=True)
class Recorded:
    """The n messages of one topic, each stamp once, in the order of the stamps."""

    stamps: NDArray[np.int64]  # (n,) [ns]
    arrivals: NDArray[np.int64]  # (n,) log times [ns]
    values: Array  # (n, k)
    unfit: int = 0  # messages left out: not finite, or absurd
    repeated: int = 0  # with a stamp that one before had
    late: int = 0  # recorded after one with a later stamp

    @classmethod
    def of(
        cls, parts: Collection[tuple[NDArray[np.int64], NDArray[np.int64], Array]]
    ) -> "Recorded":
        """Stamps, log times and values in parts; of those sent twice the first counts."""
        if not parts:
            return cls(np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, WIDEST)))
        stamps, arrivals, values = (np.concatenate(part) for part in zip(*parts, strict=True))
        order = np.argsort(arrivals, kind="stable")
        stamps, arrivals, values = stamps[order], arrivals[order], values[order]
        with np.errstate(invalid="ignore"):
            fit = (np.abs(values) <= LARGEST).all(axis=1)
        stamps, arrivals, values = stamps[fit], arrivals[fit], values[fit]
        late = int(np.sum(np.diff(stamps) < 0))
        found, first = np.unique(stamps, return_index=True)
        return cls(
            *(found, arrivals[first], values[first]),
            unfit=int(np.sum(~fit)),
            repeated=len(stamps) - len(found),
            late=late,
        )

    def __len__(self) -> int:
        return len(self.stamps)

    def where(self, chosen: Any) -> "Recorded":
        """Those that a mask or a slice chooses."""
        return replace(
            self,
            stamps=self.stamps[chosen],
            arrivals=self.arrivals[chosen],
            values=self.values[chosen],
        )

    def within(self, first: int, last: int) -> "Recorded":
        """Those with a stamp from `first` to `last`."""
        return self.where((self.stamps >= first) & (self.stamps <= last))
