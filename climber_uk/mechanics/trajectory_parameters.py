"""The trajectory that parameters describe, for nodes and campaigns."""

from collections.abc import Callable
from typing import Any

from climber_uk.mechanics.shapes import SHAPES
from climber_uk.mechanics.time_laws import TIME_LAWS
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.parameters.declaration import parameter, parameters


@parameters
class TrajectoryParameters:
    """The trajectory: a shape, a time law, and where they begin."""

    shape: str = parameter("ellipse", "", "shape of the path", choices=SHAPES)
    time_law: str = parameter("rest_to_rest", "", "how the path is travelled", choices=TIME_LAWS)
    reverse_gear: bool = parameter(False, "", "whether the climber's tail goes first")
    origin_x: float = parameter(0.0, "m", "x of the shape's origin")
    origin_y: float = parameter(0.0, "m", "y of the shape's origin")


TYPES: list[tuple[type, str]] = [
    (TrajectoryParameters, ""),
    *((kind, f"{name}.") for name, kind in {**SHAPES, **TIME_LAWS}.items()),
]
"""Classes of parameters that `build_trajectory` reads, each with the prefix of its names."""


def build_trajectory(read: Callable[..., Any]) -> Trajectory:
    """Trajectory whose parameters `read(class, prefix)` gives; `ValueError` if they make none."""
    plan = read(TrajectoryParameters)
    return Trajectory(
        shape=read(SHAPES[plan.shape], f"{plan.shape}."),
        law=read(TIME_LAWS[plan.time_law], f"{plan.time_law}."),
        reverse_gear=plan.reverse_gear,
        origin=(plan.origin_x, plan.origin_y),
    )
