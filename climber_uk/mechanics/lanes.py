"""Lanes that cover an area of the wall, one after the other, around what is to be kept out of.

They lie side by side, evenly, and one along each edge covers what their ends leave. From the end of
each it goes on to the nearest end of all that are left, straight or around corners.
"""

import itertools
import math
from dataclasses import replace
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
MOST_LOOKS = 50_000_000  # at edges, from places to places; half a minute on a slow computer
LEVEL = np.zeros(2)
NEAREST_TURNS = 0.25  # of the lanes' spacing: nearer to each other, two turns are eased
BENDS = 0.2  # [rad] from which on a corner is a turn
EASE = 3.0  # times as long as two turns are apart is what is left out of a lane to ease them: 18°


@parameters
class Lanes(ThroughPoints):
    """Lanes over an area of a text file, of which further rings are holes.

    Tags tell where each begins and ends: `lane 1 begins`.
    Raises `ValueError` naming the file.
    """

    area: str = parameter(
        "",
        "",
        "text file of the area: corners x and y [m], an empty line before each hole",
        is_path=True,
    )
    width: float = parameter(0.2, "m", "width of a lane: what is done at once, across", above=0)
    overlap: float = parameter(0.0, "m", "overlap of two lanes side by side, at least", at_least=0)
    clearance: float = parameter(
        0.2, "m", "distance of the climber's centre from the area's edge and its holes", above=0
    )
    direction: float = parameter(0.0, "rad", "direction of the lanes, anticlockwise from x")
    edges: bool = parameter(
        True, "", "drive a lane along each edge, too, for what lanes' ends leave"
    )
    descent: float = parameter(
        1.0,
        "",
        "factor by which the way between two lanes counts where it goes down, against y: more "
        "for climbers whose turns scrub, which sag where they turn from down to level",
        at_least=1,
        at_most=100,
    )
    dwell: float = parameter(
        0.0, "s", "time to rest where each lane but the first begins", at_least=0
    )
    start_x: float = parameter(
        0.0,
        "m",
        "begin at the end of a lane that is nearest to (start_x, start_y); both 0: nearest to "
        "where the climber is as it starts first",
    )
    start_y: float = parameter(
        0.0, "m", "begin at the end of a lane that is nearest to (start_x, start_y)"
    )

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

    def near(self, place: Array) -> "Lanes":
        """The same from the end of a lane that is nearest to the climber's `place` (2,) [m].

        Itself, if it is so already, or is told where to begin.
        """
        places, begins = self._way
        ends = places[np.concatenate([begins, np.array(begins) + 1])]
        if self.start_x or self.start_y or np.hypot(*(ends - place).T).argmin() == 0:
            return self
        return replace(self, start_x=float(place[0]), start_y=float(place[1]))

    @cached_property
    def _way(self) -> tuple[Array, list[int]]:
        clearance = self.clearance + CUT * self.tolerance
        area = read_area(self.area, clearance).turned(-self.direction)
        start = turned(np.array([self.start_x, self.start_y]), -self.direction)
        try:
            lanes = lanes_of(area, self.width - self.overlap, self.edges)
            up = (self.descent - 1) * turned(np.array([0.0, 1.0]), -self.direction)
            places, begins = joined(area, lanes, start, up)
            places = eased(area, places, NEAREST_TURNS * (self.width - self.overlap))
            return turned(places, self.direction), begins
        except ValueError as error:
            raise ValueError(f"{self.source}: {error}") from None


def lanes_of(area: Area, spacing: float, edges: bool) -> Array:
    """Lanes (n, 2, 2) [m], both ends of each, along x, no more than `spacing` [m] apart.

    One lies along each level edge, so that none lies just beside one that leads around a hole;
    with `edges`, along each edge.
    """
    y = np.concatenate(area.rings)[:, 1]
    least = area.clearance + SLACK
    low, high = float(y.min()) + least, float(y.max()) - least
    if not 0 <= (high - low) / spacing <= MOST_LANES:
        raise ValueError(
            f"{high - low:.4g} m between the clearances, want 0 to {MOST_LANES} lanes of "
            f"{spacing:.4g} m"
        )
    along = area.along_edges()
    is_level = np.ptp(along[:, :, 1], axis=1) < SHORTEST
    shortest = spacing if edges else SHORTEST  # what is shorter lies between two along edges
    across = [
        [[left, y], [right, y]]
        for y in _heights(np.array([low, high, *along[is_level, 0, 1]]), spacing)
        for left, right in area.spans(y).tolist()
        if right - left >= shortest
    ]
    lanes = np.array(across).reshape(-1, 2, 2)
    found = np.concatenate([along[~is_level], lanes]) if edges else lanes
    if not len(found):
        raise ValueError(f"nowhere is room for a clearance of {area.clearance:.4g} m")
    return found


def _heights(fixed: Array, spacing: float) -> list[float]:
    """Heights [m] at all that are `fixed`, and evenly between them."""
    fixed = np.unique(fixed)
    fixed = fixed[np.diff(fixed, prepend=-np.inf) > SHORTEST]
    found = [float(fixed[0])]
    for low, high in itertools.pairwise(fixed.tolist()):
        number = max(1, math.ceil((high - low) / spacing - 1e-9))
        found += [low + (high - low) * part / number for part in range(1, number + 1)]
    return found


def joined(area: Area, lanes: Array, start: Array, up: Array = LEVEL) -> tuple[Array, list[int]]:
    """Places (n, 2) [m] of a way along all lanes, which begins at the end nearest to `start`.

    And the numbers of the places at which lanes begin, from 0. What it goes down between them,
    against a vector `up` (2,), counts by that much more.
    """
    from scipy.sparse.csgraph import dijkstra  # slow to import: where it is needed only

    ends = lanes.reshape(-1, 2)
    places = np.concatenate([ends, area.corners])
    if len(places) ** 2 * len(area.edges[0]) > MOST_LOOKS:
        raise ValueError(
            f"{len(lanes)} lanes and {len(area.edges[0])} corners are too many to find a way: "
            "leave corners out, or drive the area in parts"
        )
    apart = _apart(area, places, up)
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


def eased(area: Area, places: Array, nearest: float) -> Array:
    """A way through `places` (n, 2) [m], with no two turns nearer to each other than `nearest` [m].

    Of two that are, one is begun sooner, by an oblique end of its lane, or ended later, where that
    is clear and makes no others. Places that are one stay one.
    """
    is_new = np.append(True, np.hypot(*np.diff(places, axis=0).T) > SHORTEST)
    way = places[is_new]
    for at in range(1, len(way) - 2):
        around = slice(max(at - 3, 0), at + 5)
        a, b, c, d = way[at - 1 : at + 3]
        near = _near_turns(way[around], nearest)
        if math.dist(b, c) >= nearest or not near:
            continue
        length = EASE * math.dist(b, c)
        for sooner, later in (
            (_towards(b, a, length), c),
            (b, _towards(c, d, length)),
            (c, c),
            (b, b),
        ):
            tried = way.copy()
            tried[at : at + 2] = sooner, later
            legs = zip(tried[at - 1 : at + 2], tried[at : at + 3], strict=True)
            clear = all(area.is_clear(start, end[None])[0] for start, end in legs)
            if clear and _near_turns(tried[around], nearest) < near:
                way = tried
                break
    return way[np.cumsum(is_new) - 1]


def _towards(start: Array, goal: Array, length: float) -> Array:
    """The place so far [m] from `start`, at most halfway to `goal`."""
    return start + min(length / max(math.dist(start, goal), SHORTEST), 0.5) * (goal - start)


def _near_turns(way: Array, nearest: float) -> int:
    """How many turns are nearer to the one before."""
    legs = np.diff(way, axis=0)
    legs = legs[np.hypot(*legs.T) > SHORTEST]
    angle = np.arctan2(*legs.T[::-1])
    turn = np.abs((np.diff(angle) + np.pi) % (2 * np.pi) - np.pi)
    along = np.cumsum(np.hypot(*legs.T))[:-1]
    return int(np.sum(np.diff(along[turn > BENDS]) < nearest))


def _apart(area: Area, places: Array, up: Array) -> Array:
    """Distances (n, n) [m] of places between which the way is straight; 0: not straight."""
    apart = np.zeros((len(places), len(places)))
    for i, place in enumerate(places):
        sees = area.is_clear(place, places)
        way = places[sees] - place
        apart[i, sees] = np.hypot(*way.T) + np.maximum(-way @ up, 0.0)
    return apart


def _between(before: Any, start: int, goal: int) -> list[int]:
    """Places on the way from `start` to `goal`, by the place `before` each."""
    way, at = [], int(before[goal])
    while at != start:
        way.append(at)
        at = int(before[at])
    return way[::-1]
