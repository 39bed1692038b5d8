"""A path that comes from outside, while another is driven, as a trajectory."""

from dataclasses import dataclass

from climber_uk.mechanics import Array
from climber_uk.mechanics.summary import Summary, summary
from climber_uk.mechanics.time_laws import TimeLaw
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.waypoints import Polyline, Rounding


@dataclass(frozen=True)
class Manner:
    """How a path is driven whose places only are given."""

    rounding: Rounding
    law: TimeLaw
    reverse_gear: bool = False


def planned(places: Array, manner: Manner) -> tuple[Trajectory, Summary]:
    """Trajectory through `places` (n, 2) [m]; `ValueError` if it cannot be driven, and where.

    It takes two seconds for 50 000 places, and all is computed that would take long later.
    """
    shape = Polyline.through(places, manner.rounding)
    trajectory = Trajectory(shape, manner.law, manner.reverse_gear)
    return trajectory, summary(trajectory)
