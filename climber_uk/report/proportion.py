"""The probability of an event, by how often it happened."""

import math
from statistics import NormalDist

Z = NormalDist().inv_cdf(0.975)


def wilson(count: int, number: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a probability, of `count` events in `number` trials.

    As `scipy.stats.binomtest` has it, which takes a second to import.
    """
    share, more = count / number, Z**2 / number
    middle = share + more / 2
    half = math.sqrt(more * (share * (1 - share) + more / 4))
    return max((middle - half) / (1 + more), 0.0), min((middle + half) / (1 + more), 1.0)
