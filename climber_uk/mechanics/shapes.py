"""Shapes: curves p(s) in the wall's frame with three derivatives by their path parameter s.

A new shape is one class, a `Shape` with `length`, `closed` and `derivatives`, and one entry in
`SHAPES`, or an entry point `climber_uk.shapes` of another package.
"""

import math
from typing import Any, ClassVar, Protocol

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.lanes import Lanes
from climber_uk.mechanics.waypoints import Waypoints
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.registry import Variants


class Shape(Protocol):
    """A curve; s runs from 0 to `length`, then around again if the curve is closed."""

    @property
    def closed(self) -> bool:
        """Whether p(s + length) = p(s), derivatives included."""

    @property
    def length(self) -> float:
        """Extent of s: an angle [rad] for round shapes, else a distance [m]."""

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """p, p', p'', p''' at s (...), each (..., 2); p' is never zero."""

    # Defaults, which hold for most shapes:

    def at_rate(self, rate: float) -> "Shape":
        """The path for a law of this `rate`: its parameter is stretched where it must be slow."""
        return self

    @property
    def reversals(self) -> Array:
        """Places s (k,), in order, where the climber must rest and then go back the way it came."""
        return np.empty(0)

    @property
    def rests(self) -> tuple[Array, Array]:
        """Places s (n,), in order, where it rests on its way, and for how long (n,) [s]."""
        return self.reversals, np.zeros(len(self.reversals))

    @property
    def tags(self) -> tuple[tuple[float, str], ...]:
        """Places s, in order, and what is told when the climber reaches them."""
        return ()

    def gear(self, s: Array) -> Any:
        """1, or -1 between an odd number of reversals and the next, where the tail goes first."""
        return 1.0

    def segment(self, s: Array) -> Any:
        """Number of the last point that it has passed, from 1, of those that it leads through."""
        return 1

    @property
    def stations(self) -> Array:
        """Places s (n,), in order, so dense that no extreme of the path is missed."""
        return np.linspace(0.0, self.length, 4001)


@parameters
class Ellipse(Shape):
    """p = (a sin s, b cos s): from the top, clockwise; the paper's path (21)."""

    semi_axis_x: float = parameter(10.0, "m", "semi-axis a along x", above=0)
    semi_axis_y: float = parameter(6.0, "m", "semi-axis b along y", above=0)

    closed: ClassVar[bool] = True
    length: ClassVar[float] = 2 * math.pi

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        a, b = self.semi_axis_x, self.semi_axis_y
        p_1 = _points(a * np.cos(s), -b * np.sin(s))
        p_2 = _points(-a * np.sin(s), -b * np.cos(s))
        return -p_2, p_1, p_2, -p_1


@parameters
class Circle(Shape):
    """p = r (cos s, sin s): anticlockwise."""

    radius: float = parameter(1.0, "m", "radius r of the circle", above=0)

    closed: ClassVar[bool] = True
    length: ClassVar[float] = 2 * math.pi

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        p = self.radius * _points(np.cos(s), np.sin(s))
        p_1 = self.radius * _points(-np.sin(s), np.cos(s))
        return p, p_1, -p, -p_1


@parameters
class Lemniscate(Shape):
    """p = (a sin s, b sin 2s): a figure of eight through its centre."""

    half_width: float = parameter(1.0, "m", "extent a along x", above=0)
    half_height: float = parameter(0.5, "m", "extent b along y", above=0)

    closed: ClassVar[bool] = True
    length: ClassVar[float] = 2 * math.pi

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        a, b = self.half_width, self.half_height
        return (
            _points(a * np.sin(s), b * np.sin(2 * s)),
            _points(a * np.cos(s), 2 * b * np.cos(2 * s)),
            _points(-a * np.sin(s), -4 * b * np.sin(2 * s)),
            _points(-a * np.cos(s), -8 * b * np.cos(2 * s)),
        )


@parameters
class Line(Shape):
    """p = s (cos α, sin α): a straight line from the origin."""

    length: float = parameter(1.0, "m", "length of the line", above=0)
    direction: float = parameter(0.0, "rad", "angle α of the line, anticlockwise from x")

    closed: ClassVar[bool] = False

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        unit = np.array([math.cos(self.direction), math.sin(self.direction)])
        p = s[..., None] * unit
        return p, unit + 0 * p, 0 * p, 0 * p


@parameters
class SineWave(Shape):
    """p = (s, A sin(2π s/λ)): along x, swinging in y."""

    length: float = parameter(2.0, "m", "extent of the path along x", above=0)
    amplitude: float = parameter(0.2, "m", "amplitude A along y")
    wavelength: float = parameter(1.0, "m", "wavelength λ along x", above=0)

    closed: ClassVar[bool] = False

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        A, n = self.amplitude, 2 * math.pi / self.wavelength
        return (
            _points(s, A * np.sin(n * s)),
            _points(1 + 0 * s, A * n * np.cos(n * s)),
            _points(0 * s, -A * n**2 * np.sin(n * s)),
            _points(0 * s, -A * n**3 * np.cos(n * s)),
        )


SHAPES = Variants[type[Shape]](
    {
        "ellipse": Ellipse,
        "circle": Circle,
        "lemniscate": Lemniscate,
        "line": Line,
        "sine_wave": SineWave,
        "waypoints": Waypoints,
        "lanes": Lanes,
    },
    "shapes",
)


def _points(x: Array | float, y: Array | float) -> Array:
    return np.stack(np.broadcast_arrays(x, y), axis=-1).astype(float)
