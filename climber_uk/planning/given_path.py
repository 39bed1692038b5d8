"""A path that comes from outside, while another is driven, as a trajectory."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from climber_uk.mechanics import Array
from climber_uk.mechanics.fastest_law import TabulatedLaw
from climber_uk.mechanics.summary import Summary, summary
from climber_uk.mechanics.time_laws import TIME_LAWS, TimeLaw
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.trajectory_parameters import TrajectoryParameters
from climber_uk.mechanics.waypoints import Polyline, Rounding


@dataclass(frozen=True)
class Manner:
    """How a path is driven whose places only are given."""

    rounding: Rounding
    law: TimeLaw
    reverse_gear: bool = False

    @classmethod
    def by(cls, read: Callable[..., Any], reverse_gear: bool) -> "Manner":
        """As waypoints are driven by the parameters that `read(class, prefix)` gives."""
        law = read(TrajectoryParameters).time_law
        if issubclass(TIME_LAWS[law], TabulatedLaw):
            law = "rest_to_rest"  # a table is of its own path
        rounding = read(Rounding, "waypoints.")
        return cls(rounding, read(TIME_LAWS[law], f"{law}."), reverse_gear)


def planned(places: Array, manner: Manner) -> tuple[Trajectory, Summary]:
    """Trajectory through `places` (n, 2) [m]; `ValueError` if it cannot be driven, and where.

    It takes two seconds for 50 000 places, and all is computed that would take long later.
    """
    shape = Polyline.through(places, manner.rounding)
    trajectory = Trajectory(shape, manner.law, manner.reverse_gear)
    return trajectory, summary(trajectory)
