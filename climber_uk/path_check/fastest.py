"""The highest rate at which a path's limits hold, by bisection; ramps last as long as before."""

import math
from dataclasses import replace

from climber_uk.mechanics.adhesion import Attachment
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.path_check.demands import demands

WIDEST, HALVINGS = 16.0, 12  # times slower and faster than planned; to 0.1 %


def fastest(
    trajectory: Trajectory, climber: Climber, attachment: Attachment, margin: float
) -> Trajectory | None:
    """The trajectory at its highest rate, up to `WIDEST` times the planned one; None: at no rate.

    Slipping is to be a `margin` away.
    """

    def at(log: float) -> Trajectory:
        law = trajectory.law
        faster = replace(law, rate=law.rate * math.exp(log))  # type: ignore[type-var]
        return replace(trajectory, law=faster)

    def holds(log: float) -> bool:
        found = demands(at(log), climber, attachment, margin)
        return all(limit.reserve >= 1 for limit in found.least())

    low, high = -math.log(WIDEST), math.log(WIDEST)
    if not holds(low):
        return None
    if holds(high):
        return at(high)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if holds(middle) else (low, middle)
    return at(low)
