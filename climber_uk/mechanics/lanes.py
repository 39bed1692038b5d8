"""Lanes that cover an area of the wall, one after the other, around what is to be kept out of.

They lie side by side, evenly, and one along each edge covers what their ends leave. From the end of
each it goes on to the nearest end of all that are left, straight or around corners.
"""

import math
from functools import cached_property
from typing import Any

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.area import SLACK, Area, read_area, turned
from climber_uk.mechanics.waypoint_file import Marks
from climber_uk.mechanics.waypoints import ThroughPoints
from climber_uk.parameters.declaration import parameter, parameters

SHORTEST = 1e-3  # [m] of a lane
CUT = 0.25  # of the tolerance: most that a turn around an obstacle, of 1/8, is rounded
MOST_LANES = 500


@parameters
class Lanes(ThroughPoints):
    """Lanes over an area of a text file, of which further rings are holes.

    Tags tell where each begins and ends: `lane 1 begins`.
    Raises `ValueError` naming the file.
    """

    area: str = parameter(
        "", "", "text file: corners x and y [m], an empty line before each hole", is_path=True
    )
    width: float = parameter(0.2, "m", "of a lane: what is done at once, across", above=0)
    overlap: float = parameter(0.0, "m", "of two lanes side by side, at least", at_least=0)
    clearance: float = parameter(
        0.2, "m", "of the climber's centre from the area's edge and its holes", above=0
    )
    direction: float = parameter(0.0, "rad", "of the lanes, anticlockwise from x")
    edges: bool = parameter(True, "", "a lane along each edge, too, for what lanes' ends leave")
    dwell: float = parameter(0.0, "s", "rest where each lane but the first begins", at_least=0)
    start_x: float = parameter(0.0, "m", "begin at the end of a lane that is nearest to this x")
    start_y: float = parameter(0.0, "m", "begin at the end of a lane that is nearest to this y")

    def __post_init__(self) -> None:
        if self.overlap >= self.width:
            raise ValueError(f"overlap={self.overlap} must be < width={self.width} [m]")
        _ = self._rounded

    @property
    def source(self) -> str:
        """See `ThroughPoints`."""
        return f"area={self.area!r}"

    def given(self) -> Array:
        """See `ThroughPoints`: it keeps clear with its corners rounded as well."""
        return self._way[0]

    def marks(self) -> Marks:
        """See `ThroughPoints`."""
        places, begins = self._way
        dwell, tags = np.zeros(len(places)), [""] * len(places)
        for number, begin in enumerate(begins, start=1):
            dwell[begin] = self.dwell
            tags[begin], tags[begin + 1] = f"lane {number} begins", f"lane {number} ends"
        return Marks(np.full(len(places), np.inf), dwell, tuple(tags))

    @cached_property
    def _way(self) -> tuple[Array, list[int]]:
        clearance = self.clearance + CUT * self.tolerance
        area = read_area(self.area, clearance).turned(-self.direction)
        start = turned(np.array([self.start_x, self.start_y]), -self.direction)
        try:
            lanes = lanes_of(area, self.width - self.overlap, self.edges)
            places, begins = joined(area, lanes, start)
            return turned(places, self.direction), begins
        except ValueError as error:
            raise ValueError(f"{self.source}: {error}") from None


def lanes_of(area: Area, spacing: float, edges: bool) -> Array:
    """Lanes (n, 2, 2) [m], both ends of each, along x, no more than `spacing` [m] apart.

    With those along `edges`, none lies beside an edge.
    """
    y = np.concatenate(area.rings)[:, 1]
    least = area.clearance + SLACK
    low, high = float(y.min()) + least, float(y.max()) - least
    if not 0 <= (high - low) / spacing <= MOST_LANES:
        raise ValueError(
            f"{high - low:.4g} m between the clearances, want 0 to {MOST_LANES} lanes of "
            f"{spacing:.4g} m"
        )
    number = math.ceil((high - low) / spacing - 1e-9)
    heights = low + (high - low) * np.arange(edges, number + 1 - edges) / max(number, 1)
    lanes = [
        [[left, y], [right, y]]
        for y in heights.tolist()
        for left, right in area.spans(y).tolist()
        if right - left >= SHORTEST
    ]
    along = area.along_edges() if edges else np.empty((0, 2, 2))
    found = np.concatenate([along, np.array(lanes).reshape(-1, 2, 2)])
    if not len(found):
        raise ValueError(f"nowhere is room for a clearance of {area.clearance:.4g} m")
    return found


def joined(area: Area, lanes: Array, start: Array) -> tuple[Array, list[int]]:
    """Places (n, 2) [m] of a way along all lanes, which begins at the end nearest to `start`.

    And the numbers of the places at which lanes begin, from 0.
    """
    from scipy.sparse.csgraph import dijkstra  # slow to import: where it is needed only

    ends = lanes.reshape(-1, 2)
    places = np.concatenate([ends, area.corners])
    apart = _apart(area, places)
    left = np.ones(len(ends), bool)
    at = int(np.hypot(*(ends - start).T).argmin())
    way: list[int] = []
    begins = []
    while True:
        begins.append(len(way))
        way += [at, at ^ 1]
        left[[at, at ^ 1]] = False
        at ^= 1
        if not left.any():
            return places[way], begins
        lengths, before = dijkstra(apart, indices=at, return_predecessors=True)
        goal = int(np.where(left, lengths[: len(ends)], np.inf).argmin())
        if not math.isfinite(lengths[goal]) or not left[goal]:
            x, y = ends[left][0]
            raise ValueError(f"no way leads on to ({x:.4g}, {y:.4g}) m: drive the area in parts")
        way += _between(before, at, goal)
        at = goal


def _apart(area: Area, places: Array) -> Array:
    """Distances (n, n) [m] of places between which the way is straight; 0: not straight."""
    apart = np.zeros((len(places), len(places)))
    for i, place in enumerate(places):
        sees = area.is_clear(place, places)
        apart[i, sees] = np.hypot(*(places[sees] - place).T)
    return apart


def _between(before: Any, start: int, goal: int) -> list[int]:
    """Places on the way from `start` to `goal`, by the place `before` each."""
    way, at = [], int(before[goal])
    while at != start:
        way.append(at)
        at = int(before[at])
    return way[::-1]
