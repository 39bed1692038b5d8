"""An area of the wall with holes, and where in it the climber's centre may be.

It keeps a clearance from all edges. A straight line comes nearer to an edge than that between two
places only, as what is nearer to an edge is convex: so all is found without offsetting polygons.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from climber_uk.mechanics import Array, cross
from climber_uk.mechanics.waypoint_file import blocks, read_text, read_waypoint_text

MOST_CORNERS = 300  # to look at them takes a time that grows with their square
SLACK = 1e-6  # [m] by which a distance is kept as well
ROUND = np.arange(8) * np.pi / 4  # directions from a corner in which a way around it may lead
FURTHER = 1.0 / np.cos(np.pi / 8) + 1e-6  # so that the straight lines between those keep clear
SHARPEST = 2 * np.pi / 3 + 1e-6  # [rad] of a corner around which a way may lead with a single turn


@dataclass(frozen=True)
class Area:
    """What is inside of an odd number of rings (n, 2) [m], and `clearance` [m] from their edges."""

    rings: tuple[Array, ...]
    clearance: float

    @cached_property
    def edges(self) -> tuple[Array, Array]:
        """Begin (n, 2) and end (n, 2) [m] of all edges."""
        ends = [np.roll(ring, -1, axis=0) for ring in self.rings]
        return np.concatenate(self.rings), np.concatenate(ends)

    def turned(self, angle: float) -> "Area":
        """The area, turned anticlockwise about the origin."""
        return Area(tuple(turned(ring, angle) for ring in self.rings), self.clearance)

    @cached_property
    def bends(self) -> Array:
        """By how much (n, 2) [rad] its ring bends to the left where each edge begins, and ends."""
        found = []
        for ring in self.rings:
            along = np.roll(ring, -1, axis=0) - ring
            angle = np.arctan2(*along.T[::-1])
            bend = (angle - np.roll(angle, 1) + np.pi) % (2 * np.pi) - np.pi
            found.append(np.c_[bend, np.roll(bend, -1)])
        return np.concatenate(found)

    def along_edges(self) -> Array:
        """Ways (n, 2, 2) [m], both ends of each, along all edges, at the clearance from them.

        Around a corner each leads on to where it meets the next, unless that is far off.
        """
        found = []
        clear = self.clearance + SLACK
        for begin, end, bends in zip(*self.edges, self.bends.tolist(), strict=True):
            angle = float(np.arctan2(*(end - begin)[::-1]))
            level = self.turned(-angle)
            (left, y), (right, _) = turned(np.array([begin, end]), -angle)
            for side in (-1, 1):
                before, beyond = (clear * _around(bend, side) for bend in bends)
                height = y + side * clear
                spans = level.spans(float(height)).clip(left - before, right + beyond)
                for a, b in spans[spans[:, 1] - spans[:, 0] > SLACK].tolist():
                    found.append(turned(np.array([[a, height], [b, height]]), angle))
        return np.array(found).reshape(-1, 2, 2)

    def spans(self, level: float) -> Array:
        """Stretches (n, 2) [m] of x where the climber's centre may be at a height y [m]."""
        inside = np.sort(self._crossed(np.array([level]))[0])
        inside = inside[np.isfinite(inside)].reshape(-1, 2)
        near = self._near(level)
        spans = []
        for low, high in inside.tolist():
            for left, right in near:
                if right <= low or left >= high:
                    continue
                if left > low:
                    spans.append((low, left))
                low = max(low, right)
            if high > low:
                spans.append((low, high))
        return np.array(spans).reshape(-1, 2)

    def _crossed(self, levels: Array) -> Array:
        """Where each edge crosses heights (n,) [m]: x (n, m) [m]; infinite where it does not."""
        (x, y), (x_2, y_2) = (ends.T for ends in self.edges)
        level = levels[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossed = x + (level - y) / (y_2 - y) * (x_2 - x)
        return np.where((y > level) != (y_2 > level), crossed, np.inf)

    def _near(self, level: float) -> list[tuple[float, float]]:
        """Stretches of x, in order, where an edge is nearer than the clearance."""
        c = self.clearance
        found = []
        for (x, y), (x_2, y_2) in zip(*(ends.tolist() for ends in self.edges), strict=True):
            along = np.array([x_2 - x, y_2 - y])
            across = c * np.array([-along[1], along[0]]) / np.hypot(*along)
            ends = [np.array([x, y]), np.array([x_2, y_2])]
            reach = [
                at + side * np.sqrt(c**2 - (level - height) ** 2)
                for at, height in ends
                if abs(level - height) < c
                for side in (-1, 1)
            ]
            for offset in (across, -across):
                (a, y_a), (b, y_b) = ends[0] + offset, ends[1] + offset
                if (y_a > level) != (y_b > level):
                    reach.append(a + (level - y_a) / (y_b - y_a) * (b - a))
            if reach:
                found.append((float(min(reach)), float(max(reach))))
        return sorted(found)

    def holds(self, points: Array) -> Array:
        """Whether the climber's centre may be at points (n, 2) [m]."""
        return np.array([self.is_clear(point, point[None])[0] for point in points], bool)

    def is_clear(self, start: Array, ends: Array) -> Array:
        """Whether it may go straight from `start` (2,) to each of `ends` (n, 2) [m]."""
        begin, end = self.edges
        extent = end - begin
        inside = self._is_inside(ends) & self._is_inside(start[None])
        way = ends[:, None] - start
        apart = np.minimum(
            _distance(start[None, None], begin, extent), _distance(ends[:, None], begin, extent)
        )
        for corner in (begin, end):
            apart = np.minimum(apart, _distance(corner, start, way))
        crosses = cross(way, extent)
        gap = begin - start
        with np.errstate(divide="ignore", invalid="ignore"):
            t, u = cross(gap, extent) / crosses, cross(gap, way) / crosses
        # parallel ones that touch are no distance apart
        is_across: Any = np.abs(crosses) > 1e-12 * np.hypot(*np.moveaxis(way, -1, 0))
        meets = is_across & (t >= 0) & (t <= 1) & (u >= 0) & (u <= 1)
        return np.asarray(inside & ~meets.any(1) & (apart.min(1) >= self.clearance - SLACK))

    def _is_inside(self, points: Array) -> Any:
        crossed = self._crossed(points[:, 1])
        beyond = (crossed > points[:, :1]) & np.isfinite(crossed)
        return beyond.sum(axis=1) % 2 == 1

    @cached_property
    def corners(self) -> Array:
        """Places (n, 2) [m] around all corners, between which a way around them may lead."""
        (begin, end), bend = self.edges, self.bends[:, 0]
        angle = np.arctan2(*(end - begin).T[::-1]) - bend / 2  # halfway between both edges
        out = -np.sign(bend) * (self.clearance + 2 * SLACK) / np.cos(bend / 2)
        single = begin + out[:, None] * np.c_[-np.sin(angle), np.cos(angle)]
        is_single = (np.abs(bend) <= SHARPEST) & np.asarray(self.holds(single))
        around = self.clearance * FURTHER * np.c_[np.cos(ROUND), np.sin(ROUND)]
        places = (begin[~is_single, None] + around).reshape(-1, 2)
        return np.concatenate([single[is_single], places[self.holds(places)]])


def _around(bend: float, side: int) -> float:
    """How far, in clearances, a way at the `side` of an edge leads around a corner."""
    is_outside = bend * side < 0 and abs(bend) <= SHARPEST
    return math.tan(abs(bend) / 2) if is_outside else 0.0


def read_area(file: str, clearance: float) -> Area:
    """Area of a text file: corners x, y [m] a line, an empty line before each further ring.

    A header holds for all rings below it. Raises `ValueError` naming the file, also where a ring
    crosses itself or another one.
    """
    try:
        texts = blocks(read_text(file))
        if not texts:
            raise ValueError("no corners in it: want x and y [m] of a corner a line")
        rings = []
        for number, (first, text) in enumerate(texts, start=1):
            try:
                ring, _ = read_waypoint_text(text, first)
            except ValueError as error:
                raise ValueError(f"ring {number}: {error}") from None
            ring = ring[np.hypot(*(ring - np.roll(ring, 1, axis=0)).T) > 0]
            if len(ring) < 3:
                raise ValueError(f"ring {number}: {len(ring)} corner(s), want >= 3")
            rings.append(ring)
        if (corners := sum(map(len, rings))) > MOST_CORNERS:
            raise ValueError(f"{corners} corners, want <= {MOST_CORNERS}: leave some out")
        _refuse_crossings(rings)
    except ValueError as error:
        raise ValueError(f"area={file!r}: {error}") from None
    return Area(tuple(rings), clearance)


def _refuse_crossings(rings: Sequence[Array]) -> None:
    begin, end = Area(tuple(rings), 0.0).edges
    number = np.repeat(np.arange(1, len(rings) + 1), [len(ring) for ring in rings])
    way = end - begin
    for edge in range(len(begin) - 1):
        later = slice(edge + 1, None)
        crosses = cross(way[edge], way[later])
        gap = begin[later] - begin[edge]
        with np.errstate(divide="ignore", invalid="ignore"):
            t, u = cross(gap, way[later]) / crosses, cross(gap, way[edge]) / crosses
        inner = 1e-9, 1 - 1e-9  # edges may touch
        meet = (t > inner[0]) & (t < inner[1]) & (u > inner[0]) & (u < inner[1])
        if meet.any():
            other = int(np.argmax(meet))
            x, y = begin[edge] + t[other] * way[edge]
            one, two = number[edge], number[edge + 1 + other]
            what = "itself" if one == two else f"ring {two}"
            raise ValueError(f"ring {one} crosses {what} at ({x:.4g}, {y:.4g}) m")


def turned(points: Array, angle: float) -> Array:
    """Points (..., 2), turned anticlockwise by an angle [rad]."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return points @ np.array([[cosine, sine], [-sine, cosine]])


def _distance(points: Array, begin: Array, way: Array) -> Array:
    """Distances (...) [m] of points from straight lines of which begin and extent are given."""
    square = np.maximum((way**2).sum(axis=-1), 1e-300)
    share = np.clip(((points - begin) * way).sum(axis=-1) / square, 0.0, 1.0)
    return np.hypot(*np.moveaxis(points - begin - share[..., None] * way, -1, 0))
