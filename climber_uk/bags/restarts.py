"""Where time starts again in a recording: the simulation was restarted, or the clock set back."""

from itertools import pairwise

import numpy as np

from climber_uk.mechanics import Stamps

AROUND = 5  # messages before and after, by which it is told


def restarts(stamps: Stamps) -> list[int]:
    """Places in the stamps (n,) of one topic, in the order of arrival, where they start again.

    There the next few all lie before most of the last few, and go on from each other. A message
    that comes late, or with a wrong stamp, lies back or ahead too, but those around it do not.
    """
    found: list[int] = []
    for i in (np.flatnonzero(np.diff(stamps) < 0) + 1).tolist():
        before, after = np.sort(stamps[max(0, i - AROUND) : i]), stamps[i : i + AROUND]
        is_new = not found or i - found[-1] >= AROUND
        goes_on = len(after) == AROUND and after[-1] >= after[0]
        if is_new and goes_on and after.max() < before[len(before) // 2]:
            found.append(i)
    return found


def windows(stamps: Stamps, arrivals: Stamps) -> list[tuple[float, float]]:
    """Log times [ns] between which each run was recorded, by messages in the order of arrival."""
    borders = [(int(arrivals[i - 1]) + int(arrivals[i])) / 2 for i in restarts(stamps)]
    return list(pairwise([-np.inf, *borders, np.inf]))
