"""The highest rate at which a path's limits hold, by bisection; ramps last as long as before.

And the files by which the nodes drive the fastest law, which is `time_optimal`'s.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from climber_uk.closed_loop.start import begun_at
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.fastest_law import Tabulated, write_table
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.wall import PLANE, Wall
from climber_uk.messages.topics import PLANNER
from climber_uk.parameters.changed_parameters import write_changed
from climber_uk.path_check.demands import demands

WIDEST, HALVINGS = 16.0, 12  # times slower and faster than planned; to 0.1 %


def fastest(
    trajectory: Trajectory,
    climber: Climber,
    contact: Contact,
    margin: float,
    wall: Wall = PLANE,
) -> Trajectory | None:
    """The trajectory at its highest rate, up to `WIDEST` times the planned one; None: at no rate.

    Slipping is to be a `margin` away.
    """

    def at(log: float) -> Trajectory:
        law = trajectory.law
        faster = replace(law, rate=law.rate * math.exp(log))  # type: ignore[type-var]
        return replace(trajectory, law=faster)

    def holds(log: float) -> bool:
        found = demands(at(log), climber, contact, margin, wall)
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


def write_fastest(
    trajectory: Trajectory, params: Path, planner: Mapping[str, Any], directory: Path
) -> Path:
    """Write the law of a trajectory, and `params` with it, into a directory; return the latter.

    `planner` are the planner's parameters that are not as in `params`, or that name files.
    The climber begins where the path does, at rest.
    """
    law = trajectory.law
    assert isinstance(law, Tabulated)
    write_table(directory / "fastest.csv", law.period, law.table)
    changes = {
        PLANNER: {
            **planner,
            "time_law": "fastest",
            "fastest.file": "fastest.csv",
            # so that interpolation between points keeps what the law is smooth by
            "point_period": 2 * law.period,
        },
        **begun_at(trajectory),
    }
    path = directory / "fastest.yaml"
    write_changed(params, changes, path)
    return path
