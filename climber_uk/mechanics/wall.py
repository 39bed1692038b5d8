"""The wall under a climber, and gravity on it: g (s_x, s_y) along the wall, g_n into it.

    plane      s = sin(inclination), towards -y turned by `tilt`;  g_n = g cos(inclination)
    cylinder   the same with inclination(y) = inclination + y/R, and ẏ²/R more into the wall

x and y are lengths on the wall: a cylinder unrolls without stretching, so that nothing else in the
equations of motion changes. A new wall is one class and one entry.
"""

import math
from typing import Any, ClassVar, Protocol

from climber_uk.mechanics.climber import DEGREE, GRAVITY
from climber_uk.mechanics.elementary import cos, sin
from climber_uk.parameters.declaration import parameter, parameters


class Wall(Protocol):
    """A wall; `inclination` [deg] is that at the origin: 0 floor, 90 vertical, 180 ceiling."""

    flat: ClassVar[bool]

    def along(self, inclination: Any, y: Any) -> tuple[Any, Any]:
        """Parts (s_x, s_y) of gravity along the wall at height `y` (...) [m], each (...)."""

    def into(self, inclination: Any, y: Any, y_speed: Any) -> Any:
        """g_n (...) [m/s²] into the wall, with what the way's curvature adds at ẏ = `y_speed`."""


@parameters
class Plane:
    """A flat wall; y points uphill unless it is tilted."""

    tilt: float = parameter(
        0.0, "deg", "by which downhill is turned from -y, anticlockwise", at_least=-180, at_most=180
    )

    flat: ClassVar[bool] = True

    def along(self, inclination: Any, y: Any) -> tuple[Any, Any]:
        """See `Wall`."""
        pull, tilt = sin(inclination * DEGREE), math.radians(self.tilt)
        return pull * math.sin(tilt) + 0.0 * y, -pull * math.cos(tilt) + 0.0 * y

    def into(self, inclination: Any, y: Any, y_speed: Any) -> Any:
        """See `Wall`."""
        return GRAVITY * cos(inclination * DEGREE) + 0.0 * y


@parameters
class Cylinder:
    """A tank or a pipe with a horizontal axis along x; y runs around it."""

    radius: float = parameter(2.0, "m", "of the cylinder R: > 0 inside it, < 0 outside")

    flat: ClassVar[bool] = False

    def __post_init__(self) -> None:
        if self.radius == 0:
            raise ValueError("radius=0.0 must not be 0 [m]")

    def along(self, inclination: Any, y: Any) -> tuple[Any, Any]:
        """See `Wall`."""
        return 0.0 * y, -sin(inclination * DEGREE + y / self.radius)

    def into(self, inclination: Any, y: Any, y_speed: Any) -> Any:
        """See `Wall`."""
        steep = inclination * DEGREE + y / self.radius
        return GRAVITY * cos(steep) + y_speed * y_speed / self.radius


WALLS: dict[str, type[Wall]] = {"plane": Plane, "cylinder": Cylinder}
