"""The wall under a climber, and gravity on it: g (s_x, s_y) along the wall, g_n into it.

    plane      s = sin(inclination), towards -y turned by `tilt`;  g_n = g cos(inclination)
    cylinder   the same with inclination(y) = inclination + y/R, and ẏ²/R more into the wall
    tank       curved along x, its axis along y: gravity turned by x/R about y, and ẋ²/R
    cone       the same inclination everywhere, uphill to its apex (or from it)
    sphere     curved either way: gravity turned by √(x² + y²)/R, and (ẋ² + ẏ²)/R

x and y are lengths on the wall. Cylinders, tanks and cones unroll without stretching: nothing
else in the equations of motion changes. A sphere does not: lengths are right on lines through the
origin, and across them by (x² + y²)/6R² too long, which is neglected. A new wall is one class, a
`Wall`, and one entry in `WALLS`, or an entry point `climber_uk.walls` of another package.
"""

from collections.abc import Callable
from typing import Any, ClassVar, Protocol

from climber_uk.mechanics.climber import DEGREE, GRAVITY, Climber
from climber_uk.mechanics.elementary import cos, everywhere, select, sin, sqrt, with_sign_of
from climber_uk.mechanics.quantities import Motion
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.registry import Variants


class Wall(Protocol):
    """A wall's shape; `inclination` [deg] at the origin: 0 floor, 90 vertical, 180 ceiling."""

    flat: ClassVar[bool]

    def along(self, inclination: Any, x: Any, y: Any) -> tuple[Any, Any]:
        """Components (s_x, s_y) of gravity along the wall, by g, at (x, y) [m]; each (...)."""

    def into(self, inclination: Any, x: Any, y: Any, x_speed: Any, y_speed: Any) -> Any:
        """g_n (...) [m/s²] into the wall, with the centripetal part at (ẋ, ẏ) (...) [m/s]."""


@parameters
class Plane(Wall):
    """A flat wall; y points uphill unless it is tilted."""

    tilt: float = parameter(
        0.0, "deg", "angle from -y to downhill, anticlockwise", at_least=-180, at_most=180
    )

    flat: ClassVar[bool] = True

    def along(self, inclination: Any, x: Any, y: Any) -> tuple[Any, Any]:
        """See `Wall`."""
        pull, tilt = sin(inclination * DEGREE), self.tilt * DEGREE
        return pull * sin(tilt) + 0.0 * y, -pull * cos(tilt) + 0.0 * y

    def into(self, inclination: Any, x: Any, y: Any, x_speed: Any, y_speed: Any) -> Any:
        """See `Wall`."""
        return GRAVITY * cos(inclination * DEGREE) + 0.0 * y


@parameters
class Cylinder(Wall):
    """A tank or a pipe with a horizontal axis along x; y runs around it."""

    radius: float = parameter(
        2.0, "m", "radius R: > 0 inside the cylinder, < 0 on its outside", nonzero=True
    )

    flat: ClassVar[bool] = False

    def along(self, inclination: Any, x: Any, y: Any) -> tuple[Any, Any]:
        """See `Wall`."""
        return 0.0 * y, -sin(inclination * DEGREE + y / self.radius)

    def into(self, inclination: Any, x: Any, y: Any, x_speed: Any, y_speed: Any) -> Any:
        """See `Wall`."""
        steep = inclination * DEGREE + y / self.radius
        return GRAVITY * cos(steep) + y_speed * y_speed / self.radius


@parameters
class Tank(Wall):
    """A tank or a hull whose axis is along y: upright where `inclination` is 90."""

    radius: float = parameter(
        5.0, "m", "radius R: > 0 inside the tank, < 0 on its outside", nonzero=True
    )

    flat: ClassVar[bool] = False

    def along(self, inclination: Any, x: Any, y: Any) -> tuple[Any, Any]:
        """See `Wall`."""
        ahead, _ = _turned(inclination, 0.0, x / self.radius)
        return ahead, -sin(inclination * DEGREE) + 0.0 * y

    def into(self, inclination: Any, x: Any, y: Any, x_speed: Any, y_speed: Any) -> Any:
        """See `Wall`."""
        _, into = _turned(inclination, 0.0, x / self.radius)
        return GRAVITY * into + x_speed * x_speed / self.radius


@parameters
class Cone(Wall):
    """A cone with a vertical axis; its apex is uphill of the origin, or downhill.

    Uphill: a roof, or for an `inclination` above 90 the inside of an upturned funnel; downhill: the
    inside of a hopper, or its outside. An inclination of 90 is none: that is a `Tank`.
    """

    distance: float = parameter(
        5.0,
        "m",
        "distance from the origin to the apex: > 0 it is uphill, < 0 downhill",
        nonzero=True,
    )

    flat: ClassVar[bool] = False

    def _to_apex(self, x: Any, y: Any) -> tuple[Any, Any, Any]:
        """Direction (e_x, e_y) to the apex, and how far it is [m]."""
        ahead = self.distance - y
        far = sqrt(x * x + ahead * ahead)
        return -x / far, ahead / far, far

    def along(self, inclination: Any, x: Any, y: Any) -> tuple[Any, Any]:
        """See `Wall`."""
        e_x, e_y, _ = self._to_apex(x, y)
        downhill = -with_sign_of(1.0, self.distance) * sin(inclination * DEGREE)
        return downhill * e_x, downhill * e_y

    def into(self, inclination: Any, x: Any, y: Any, x_speed: Any, y_speed: Any) -> Any:
        """See `Wall`; across the generator the curvature is tan(inclination) by the distance."""
        e_x, e_y, far = self._to_apex(x, y)
        around = x_speed * e_y - y_speed * e_x
        steepness = sin(inclination * DEGREE) / cos(inclination * DEGREE)
        curvature = -with_sign_of(1.0, self.distance) * steepness / far
        return GRAVITY * cos(inclination * DEGREE) + curvature * around * around


@parameters
class Sphere(Wall):
    """A spherical tank or bulb."""

    radius: float = parameter(
        5.0, "m", "radius R: > 0 inside the sphere, < 0 on its outside", nonzero=True
    )

    flat: ClassVar[bool] = False

    def along(self, inclination: Any, x: Any, y: Any) -> tuple[Any, Any]:
        """See `Wall`."""
        e_x, e_y, far = self._from_origin(x, y)
        before = -sin(inclination * DEGREE) * e_y
        change = _turned(inclination, before, far / self.radius)[0] - before
        return change * e_x, -sin(inclination * DEGREE) + change * e_y

    def into(self, inclination: Any, x: Any, y: Any, x_speed: Any, y_speed: Any) -> Any:
        """See `Wall`."""
        _, e_y, far = self._from_origin(x, y)
        _, into = _turned(inclination, -sin(inclination * DEGREE) * e_y, far / self.radius)
        return GRAVITY * into + (x_speed * x_speed + y_speed * y_speed) / self.radius

    def _from_origin(self, x: Any, y: Any) -> tuple[Any, Any, Any]:
        """Direction (e_x, e_y) from the origin, and how far it is [m]."""
        far = sqrt(x * x + y * y)
        safe = select(far > 0, far, 1.0)
        return x / safe, y / safe, far


PLANE = Plane()  # that is not tilted


def told(read: Callable[..., Any], name: str) -> Wall | None:
    """Wall of a name in `WALLS`, its parameters as `read(kind, prefix)` has them.

    None of a plane that is not tilted, which the climber's inclination tells.
    """
    wall: Wall = read(WALLS[name], f"{name}.")
    return None if isinstance(wall, Plane) and everywhere(wall.tilt == 0) else wall


def weight_beyond(
    wall: Wall, climber: Climber, motion: Motion, time: float = 0.0
) -> tuple[Any, Any]:
    """What the weight pulls forwards and to the left [N] beyond its part on an untilted plane.

    In the middle of the next `time` [s], at the speeds of now.
    """
    way, turn = 0.5 * time * motion.speed, 0.5 * time * motion.yaw_rate
    cosine, sine = motion.cosine - turn * motion.sine, motion.sine + turn * motion.cosine
    x, y = motion.x + way * motion.cosine, motion.y + way * motion.sine
    s_x, s_y = wall.along(climber.inclination, x, y)
    weight = climber.mass * GRAVITY
    x, y = weight * s_x, weight * s_y + climber.weight_along_wall
    return x * cosine + y * sine, y * cosine - x * sine


def weight(wall: Wall | None, climber: Climber, motion: Motion) -> tuple[Any, Any]:
    """What the weight pulls forwards and to the left [N]; on None, an untilted plane."""
    forward = -climber.weight_along_wall * motion.sine
    left = -climber.weight_along_wall * motion.cosine
    if wall is None:
        return forward, left
    forward_beyond, left_beyond = weight_beyond(wall, climber, motion)
    return forward + forward_beyond, left + left_beyond


def gravity(wall: Wall | None, climber: Climber, motion: Motion) -> tuple[Any, Any]:
    """Gravity into the wall, with its centripetal part, and along it [m/s²]; see `weight`."""
    if wall is None:
        return climber.gravity_into_wall, climber.weight_along_wall / climber.mass
    at = climber.inclination, motion.x, motion.y
    s_x, s_y = wall.along(*at)
    speeds = motion.speed * motion.cosine, motion.speed * motion.sine
    return wall.into(*at, *speeds), GRAVITY * sqrt(s_x * s_x + s_y * s_y)


def _turned(inclination: Any, ahead: Any, angle: Any) -> tuple[Any, Any]:
    """Gravity ahead and into the wall, by g, once the wall has turned upwards by `angle` [rad].

    At first it is `ahead` and cos(inclination).
    """
    into = cos(inclination * DEGREE)
    return ahead * cos(angle) - into * sin(angle), into * cos(angle) + ahead * sin(angle)


WALLS = Variants[type[Wall]](
    {"plane": Plane, "cylinder": Cylinder, "tank": Tank, "cone": Cone, "sphere": Sphere}, "walls"
)
