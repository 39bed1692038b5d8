"""The walls of `climber_uk.mechanics.wall` in space, for an engine that knows no unrolled ones.

Where the wall's x and y begin, the world's axes are those of the wall: x and y along it, z off it.
All are arrays over n places, and keep no state.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import DEGREE
from climber_uk.mechanics.wall import Cone, Cylinder, Plane, Sphere, Tank, Wall


class Surface(Protocol):
    """A wall in space."""

    def at(self, places: Array) -> tuple[Array, Array]:
        """Points (n, 3) [m] of places (n, 2) [m], and frames (n, 3, 3) there.

        A frame's columns are along the wall's x and y, and off it.
        """

    def under(self, points: Array) -> Array:
        """Places (n, 2) [m] nearest to points (n, 3) [m], within half of a turn around."""

    @property
    def turn(self) -> tuple[float, float]:
        """How far x and y go around the wall [m]; infinite if they do not."""
        return math.inf, math.inf


@dataclass(frozen=True)
class Flat(Surface):
    """A plane."""

    def at(self, places: Array) -> tuple[Array, Array]:
        """See `Surface`."""
        points = np.concatenate([places, np.zeros((len(places), 1))], axis=1)
        return points, np.broadcast_to(np.eye(3), (len(places), 3, 3))

    def under(self, points: Array) -> Array:
        """See `Surface`."""
        return points[:, :2]


@dataclass(frozen=True)
class Bent(Surface):
    """A wall of one radius R [m], > 0 inside it: a cylinder along an axis, or a sphere."""

    radius: float
    ways: tuple[float, float]  # 1 for each of x and y that goes around, else 0

    def at(self, places: Array) -> tuple[Array, Array]:
        """See `Surface`: of a place, what is bent is `far` in a direction e."""
        bent = places * self.ways
        far = np.hypot(*bent.T)[:, None]
        e, off = np.zeros((len(places), 3)), np.array([0.0, 0.0, 1.0])
        e[:, :2] = bent / np.where(far > 0, far, 1.0)
        sine, versine = np.sin(far / self.radius), 2 * np.sin(far / self.radius / 2) ** 2
        points = self.radius * (sine * e + versine * off)
        points[:, :2] += places - bent
        turned = sine * off - versine * e  # e has become e + turned
        axes = np.eye(3)[:2] + turned[:, None] * e[:, :2, None]
        normal = (1 - versine) * off - sine * e
        return points, np.stack([axes[:, 0], axes[:, 1], normal], axis=-1)

    def under(self, points: Array) -> Array:
        """See `Surface`."""
        along, inside = points[:, :2] * self.ways, math.copysign(1.0, self.radius)
        out = np.hypot(*along.T)
        far = abs(self.radius) * np.arctan2(out, inside * (self.radius - points[:, 2]))
        stretched = along * (far / np.where(out > 0, out, 1.0))[:, None]
        return stretched + points[:, :2] * (1 - np.array(self.ways))

    @property
    def turn(self) -> tuple[float, float]:
        """See `Surface`; a sphere has ends at half a turn."""
        around = 2 * math.pi * abs(self.radius) if sum(self.ways) == 1 else math.inf
        x, y = (around if way else math.inf for way in self.ways)
        return x, y


@dataclass(frozen=True)
class Conical(Surface):
    """A cone with a vertical axis, its apex at (0, distance, 0) [m]; ends at half a turn."""

    distance: float
    inclination: float  # [rad]

    def at(self, places: Array) -> tuple[Array, Array]:
        """See `Surface`: what is ψ about the apex in the plane is ψ / cos(inclination) in space."""
        side = math.copysign(1.0, self.distance)
        apex = np.array([0.0, self.distance, 0.0])
        from_apex = places - apex[:2]
        psi = np.arctan2(side * from_apex[:, 0], -side * from_apex[:, 1])
        turned = self._about_axis(psi / math.cos(self.inclination))
        far = np.zeros((len(places), 3))
        far[:, 1] = -side * np.hypot(*from_apex.T)
        points = np.einsum("nij,nj->ni", turned, far) + apex
        back = np.zeros((len(places), 3, 3))
        back[:, 0, 0] = back[:, 1, 1] = np.cos(psi)
        back[:, 0, 1], back[:, 1, 0], back[:, 2, 2] = np.sin(psi), -np.sin(psi), 1.0
        return points, turned @ back

    def under(self, points: Array) -> Array:
        """See `Surface`."""
        i, from_apex = self.inclination, points - [0.0, self.distance, 0.0]
        side = math.copysign(1.0, self.distance * math.cos(i))
        out = from_apex @ [0.0, -math.cos(i), math.sin(i)]
        angle = np.arctan2(side * from_apex[:, 0], side * out)
        far = np.einsum("nji,nj->ni", self._about_axis(angle), from_apex)[:, 1]
        psi = angle * math.cos(i)
        return np.stack([-far * np.sin(psi), far * np.cos(psi) + self.distance], axis=1)

    def _about_axis(self, angle: Array) -> Array:
        """Matrices (n, 3, 3) that turn by angles (n,) [rad] about what is up."""
        up = np.array([0.0, math.sin(self.inclination), math.cos(self.inclination)])
        cross = np.cross(np.eye(3), up)
        c, s = np.cos(angle)[:, None, None], np.sin(angle)[:, None, None]
        return np.eye(3) + s * cross + (1 - c) * cross @ cross


def surface(wall: Wall, inclination: float) -> Surface:
    """A wall in space, of an `inclination` [deg]; `ValueError` for one that is not known."""
    match wall:
        case Plane():
            return Flat()
        case Cylinder(radius):
            return Bent(radius, (0.0, 1.0))
        case Tank(radius):
            return Bent(radius, (1.0, 0.0))
        case Sphere(radius):
            return Bent(radius, (1.0, 1.0))
        case Cone(distance):
            return Conical(distance, inclination * DEGREE)
    raise ValueError(f"wall: {type(wall).__name__} is not in this model of MuJoCo")
