"""Where time starts again in a recording: the simulation was restarted, or the clock set back."""

from itertools import pairwise

import numpy as np

from climber_uk.mechanics import Stamps

LASTING = 5  # messages, one after the other, that lie before one received earlier


def restarts(stamps: Stamps) -> list[int]:
    """Places in the stamps (n,) of one topic, in the order of arrival, where they start again.

    A single message that comes late lies back too, but the next ones do not go on from it.
    """
    back = np.flatnonzero(np.diff(stamps) < 0) + 1
    return [int(i) for i in back if _go_on(stamps[i : i + LASTING], stamps[i - 1])]


def _go_on(stamps: Stamps, before: int) -> bool:
    forwards = bool((np.diff(stamps) >= 0).all())
    return len(stamps) == LASTING and forwards and bool(stamps[-1] < before)


def windows(stamps: Stamps, arrivals: Stamps) -> list[tuple[float, float]]:
    """Log times [ns] between which each run was recorded, by messages in the order of arrival."""
    borders = [(int(arrivals[i - 1]) + int(arrivals[i])) / 2 for i in restarts(stamps)]
    return list(pairwise([-np.inf, *borders, np.inf]))
