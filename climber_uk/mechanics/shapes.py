"""Shapes: curves p(s) in the wall's frame with three derivatives by their path parameter s.

A new shape is one class with `length`, `closed` and `derivatives`, and one entry in `SHAPES`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Protocol

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.parameter import check, parameter


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


@dataclass(frozen=True)
class Ellipse:
    """p = (a sin s, b cos s): from the top, clockwise; the paper's path (21)."""

    semi_axis_x: float = parameter(10.0, "m", "semi-axis a along x", above=0)
    semi_axis_y: float = parameter(6.0, "m", "semi-axis b along y", above=0)

    closed: ClassVar[bool] = True
    length: ClassVar[float] = 2 * math.pi

    def __post_init__(self) -> None:
        check(self)

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        a, b = self.semi_axis_x, self.semi_axis_y
        p_1 = _points(a * np.cos(s), -b * np.sin(s))
        p_2 = _points(-a * np.sin(s), -b * np.cos(s))
        return -p_2, p_1, p_2, -p_1


@dataclass(frozen=True)
class Circle:
    """p = r (cos s, sin s): anticlockwise."""

    radius: float = parameter(1.0, "m", "radius", above=0)

    closed: ClassVar[bool] = True
    length: ClassVar[float] = 2 * math.pi

    def __post_init__(self) -> None:
        check(self)

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        p = self.radius * _points(np.cos(s), np.sin(s))
        p_1 = self.radius * _points(-np.sin(s), np.cos(s))
        return p, p_1, -p, -p_1


@dataclass(frozen=True)
class Lemniscate:
    """p = (a sin s, b sin 2s): a figure of eight through its centre."""

    half_width: float = parameter(1.0, "m", "extent a along x", above=0)
    half_height: float = parameter(0.5, "m", "extent b along y", above=0)

    closed: ClassVar[bool] = True
    length: ClassVar[float] = 2 * math.pi

    def __post_init__(self) -> None:
        check(self)

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        a, b = self.half_width, self.half_height
        return (
            _points(a * np.sin(s), b * np.sin(2 * s)),
            _points(a * np.cos(s), 2 * b * np.cos(2 * s)),
            _points(-a * np.sin(s), -4 * b * np.sin(2 * s)),
            _points(-a * np.cos(s), -8 * b * np.cos(2 * s)),
        )


@dataclass(frozen=True)
class Line:
    """p = s (cos α, sin α): straight on."""

    length: float = parameter(1.0, "m", "length", above=0)
    direction: float = parameter(0.0, "rad", "angle α from x")

    closed: ClassVar[bool] = False

    def __post_init__(self) -> None:
        check(self)

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        unit = np.array([math.cos(self.direction), math.sin(self.direction)])
        p = s[..., None] * unit
        return p, unit + 0 * p, 0 * p, 0 * p


@dataclass(frozen=True)
class SineWave:
    """p = (s, A sin(2π s/λ)): along x, swinging in y."""

    length: float = parameter(2.0, "m", "extent along x", above=0)
    amplitude: float = parameter(0.2, "m", "amplitude A")
    wavelength: float = parameter(1.0, "m", "wavelength λ", above=0)

    closed: ClassVar[bool] = False

    def __post_init__(self) -> None:
        check(self)

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        A, n = self.amplitude, 2 * math.pi / self.wavelength
        return (
            _points(s, A * np.sin(n * s)),
            _points(1 + 0 * s, A * n * np.cos(n * s)),
            _points(0 * s, -A * n**2 * np.sin(n * s)),
            _points(0 * s, -A * n**3 * np.cos(n * s)),
        )


@dataclass(frozen=True)
class Waypoints:
    """Quintic spline through the points of a text file, C⁴, s along the chords between them.

    Each line of the file holds x and y [m]. If the last point repeats the first, the path is
    closed; else its curvature is 0 at both ends. Raises `ValueError` naming the file and what
    is wrong in it.
    """

    file: str = parameter("", "", "text file with x and y of a point a line, in m")

    def __post_init__(self) -> None:
        check(self)
        _ = self._splines  # a bad file is found now, not when the climber starts

    @cached_property
    def _points(self) -> Array:
        try:
            points = np.loadtxt(Path(self.file).expanduser(), ndmin=2)
        except (OSError, ValueError) as error:
            raise ValueError(f"file={self.file!r}: {error}") from None
        if points.ndim != 2 or points.shape[1] != 2:
            raise ValueError(f"file={self.file!r}: want two columns, x and y")
        if len(points) < 2:
            raise ValueError(f"file={self.file!r}: {len(points)} point(s), want >= 2")
        if not np.isfinite(points).all():
            line = int(np.argwhere(~np.isfinite(points))[0, 0])
            raise ValueError(f"file={self.file!r}: point {line + 1} is not finite")
        return points

    @cached_property
    def _splines(self) -> tuple[Callable[[Array], Array], ...]:
        """The spline and its first three derivatives."""
        from scipy.interpolate import make_interp_spline  # slow to import: for this shape only

        points = self._points
        chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if not chords.all():
            number = int(np.argmin(chords)) + 2
            raise ValueError(f"file={self.file!r}: point {number} repeats the one before")
        straight = [(2, np.zeros(2)), (3, np.zeros(2))]
        spline = make_interp_spline(
            np.concatenate([[0.0], np.cumsum(chords)]),
            points,
            k=5,
            bc_type="periodic" if self.closed else (straight, straight),
        )
        return spline, spline.derivative(1), spline.derivative(2), spline.derivative(3)

    @property
    def closed(self) -> bool:
        """See `Shape`."""
        return len(self._points) > 2 and bool((self._points[0] == self._points[-1]).all())

    @cached_property
    def length(self) -> float:
        """See `Shape`."""
        return float(np.linalg.norm(np.diff(self._points, axis=0), axis=1).sum())

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        s = np.mod(s, self.length) if self.closed else s
        p, p_1, p_2, p_3 = (spline(s) for spline in self._splines)
        return p, p_1, p_2, p_3


SHAPES = {
    "ellipse": Ellipse,
    "circle": Circle,
    "lemniscate": Lemniscate,
    "line": Line,
    "sine_wave": SineWave,
    "waypoints": Waypoints,
}


def _points(x: Array | float, y: Array | float) -> Array:
    return np.stack(np.broadcast_arrays(x, y), axis=-1).astype(float)
