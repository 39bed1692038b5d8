"""The wall under a climber, and gravity on it: g (s_x, s_y) along the wall, g_n into it.

    plane      s = sin(inclination), towards -y turned by `tilt`;  g_n = g cos(inclination)
    cylinder   the same with inclination(y) = inclination + y/R, and ẏ²/R more into the wall

x and y are lengths on the wall: a cylinder unrolls without stretching, so that nothing else in the
equations of motion changes. A new wall is one class, a `Wall`, and one entry in `WALLS`, or an
entry point `climber_uk.walls` of another package.
"""

import math
from typing import Any, ClassVar, Protocol

from climber_uk.mechanics.climber import DEGREE, GRAVITY
from climber_uk.mechanics.elementary import cos, sin
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.registry import Variants


class Wall(Protocol):
    """A wall's shape; `inclination` [deg] at the origin: 0 floor, 90 vertical, 180 ceiling."""

    flat: ClassVar[bool]

    def along(self, inclination: Any, y: Any) -> tuple[Any, Any]:
        """Components (s_x, s_y) of gravity along the wall, by g, at y (...) [m]; each (...)."""

    def into(self, inclination: Any, y: Any, y_speed: Any) -> Any:
        """g_n (...) [m/s²] into the wall, with the centripetal part at ẏ = `y_speed` [m/s]."""


@parameters
class Plane(Wall):
    """A flat wall; y points uphill unless it is tilted."""

    tilt: float = parameter(
        0.0, "deg", "angle from -y to downhill, anticlockwise", at_least=-180, at_most=180
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
class Cylinder(Wall):
    """A tank or a pipe with a horizontal axis along x; y runs around it."""

    radius: float = parameter(2.0, "m", "radius R: > 0 inside the cylinder, < 0 on its outside")

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


WALLS = Variants[type[Wall]]({"plane": Plane, "cylinder": Cylinder}, "walls")
