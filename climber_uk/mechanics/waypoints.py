"""A path through waypoints: the polyline of a file with its corners rounded, slow in its bends."""

import math
from dataclasses import dataclass, field, fields
from functools import cached_property
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from climber_uk.mechanics import Array, cross
from climber_uk.mechanics.elementary import Derivatives, compose
from climber_uk.mechanics.rounding import Rounded, rounded
from climber_uk.mechanics.slowing import Slowed, SpeedLimits, slowed
from climber_uk.mechanics.waypoint_file import Marks, read_waypoints
from climber_uk.parameters.declaration import parameter, parameters

STATIONS = 2001


@parameters
class Rounding:
    """How corners of a path through points are rounded, and how slow they are."""

    tolerance: float = parameter(
        0.02, "m", "most distance of the path from the straight lines between points", at_least=1e-5
    )
    max_yaw_rate: float = parameter(1.0, "rad/s", "most yaw rate; bends are slow for it", above=0)
    max_acceleration: float = parameter(0.5, "m/s²", "most acceleration, also in bends", above=0)
    reversal_angle: float = parameter(
        0.35,
        "rad",
        "a corner that goes back, within this angle of the way it came, is driven in reverse",
        at_least=0.01,
        at_most=1.0,
    )


class ThroughPoints(Rounding):
    """A path straight from each of its points to the next, its corners rounded: a `Shape`.

    The path parameter s is the distance [m] on straights. In bends it is stretched, so that at
    the law's rate the limits of yaw rate and acceleration hold. Where the points turn back, the
    climber stops and goes back in the other gear. The path is closed if its last point is
    nearer than a sixth of the tolerance to its first.
    """

    def given(self) -> Array:
        """Points (n, 2) [m]; raises `ValueError`."""
        raise NotImplementedError

    def marks(self) -> Marks:
        """What is said of the points beside their places."""
        return Marks.none(len(self.given()))

    @property
    def source(self) -> str:
        """What an error calls the points."""
        return "path"

    @cached_property
    def _rounded(self) -> Rounded:
        points = self.given()
        try:
            return rounded(points, self.tolerance, self.reversal_angle)
        except ValueError as error:
            raise ValueError(f"{self.source}: {error}") from None

    @cached_property
    def _by_rate(self) -> dict[float, "SlowedPath"]:
        return {}

    def at_rate(self, rate: float) -> "SlowedPath":
        """See `Shape`."""
        if rate not in self._by_rate:
            path = self._rounded
            try:
                marks = placed(path, self.marks())
                limits = SpeedLimits(rate, self.max_yaw_rate, self.max_acceleration, marks.legs)
                pace = slowed(path.curve, path.length, path.closed, self.tolerance, limits)
            except ValueError as error:
                raise ValueError(f"{self.source}: {error}") from None
            self._by_rate[rate] = SlowedPath(path, pace, marks)
        return self._by_rate[rate]

    # Without a rate there is no need to be slow:

    @property
    def closed(self) -> bool:
        """See `Shape`."""
        return self._rounded.closed

    @property
    def length(self) -> float:
        """See `Shape`."""
        return self.at_rate(0.0).length

    @property
    def reversals(self) -> Array:
        """See `Shape`."""
        return self.at_rate(0.0).reversals

    @property
    def rests(self) -> tuple[Array, Array]:
        """See `Shape`."""
        return self.at_rate(0.0).rests

    @property
    def tags(self) -> tuple[tuple[float, str], ...]:
        """See `Shape`."""
        return self.at_rate(0.0).tags

    @property
    def stations(self) -> Array:
        """See `Shape`."""
        return self.at_rate(0.0).stations

    def gear(self, s: Array) -> Any:
        """See `Shape`."""
        return self.at_rate(0.0).gear(s)

    def segment(self, s: Array) -> Any:
        """See `Shape`."""
        return self.at_rate(0.0).segment(s)

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        return self.at_rate(0.0).derivatives(s)


@parameters
class Waypoints(ThroughPoints):
    """A path straight from each point of a text file to the next, its corners rounded.

    Raises `ValueError` naming the file.
    """

    file: str = parameter("", "", "text file with x and y [m], one point a line", is_path=True)

    def __post_init__(self) -> None:
        _ = self.rests  # a bad file is found now, not when the climber starts

    @cached_property
    def _read(self) -> tuple[Array, Marks]:
        return read_waypoints(self.file)

    @property
    def unused(self) -> tuple[str, ...]:
        """Columns of the file by which nothing is done: a name may be misspelt."""
        return self._read[1].unused

    def given(self) -> Array:
        """See `ThroughPoints`."""
        return self._read[0]

    def marks(self) -> Marks:
        """See `ThroughPoints`."""
        return self._read[1]

    @property
    def source(self) -> str:
        """See `ThroughPoints`."""
        return f"file={self.file!r}"


@dataclass(frozen=True)
class Polyline(ThroughPoints):
    """The same through points that are given; raises `ValueError` as soon as it is used."""

    places: Array = field(default_factory=lambda: np.empty((0, 2)))  # (n, 2) [m]

    @classmethod
    def through(cls, places: Array, rounding: Rounding) -> "Polyline":
        """Path through `places` (n, 2) [m] with this rounding."""
        limits = {rule.name: getattr(rounding, rule.name) for rule in fields(Rounding)}
        return cls(**limits, places=places)

    def given(self) -> Array:
        """See `ThroughPoints`."""
        return self.places


class Placed(NamedTuple):
    """Marks of points, by places s on their rounded polyline."""

    legs: tuple[Array, Array] | None  # as `SpeedLimits` has them
    rests: tuple[Array, Array]  # s (k,), and for how long (k,) [s]
    tags: tuple[Array, list[str], Array]  # s (k,), texts, and whether (k,) at the end of a round


def placed(path: Rounded, marks: Marks) -> Placed:
    """Marks where their points are; of those that are left out, at the one before."""
    numbers, first = np.unique(path.numbers, return_index=True)
    count = len(marks.dwell)
    corner = first[np.searchsorted(numbers, np.arange(count) + 1, "right") - 1]
    where, dwell = path.legs[corner], marks.dwell
    is_end = (np.arange(count) == count - 1) & path.closed
    if path.closed:  # its last point is its first
        dwell = np.append(max(dwell[0], dwell[-1]), dwell[1:]) * ~is_end
    fastest = np.full(len(path.legs), np.inf)
    np.minimum.at(fastest, corner, marks.speed)
    legs = (path.legs, fastest[:-1]) if np.isfinite(fastest[:-1]).any() else None
    rests, tagged = dwell > 0, np.array([bool(tag) for tag in marks.tags])
    texts = [tag for tag in marks.tags if tag]
    return Placed(legs, (where[rests], dwell[rests]), (where[tagged], texts, is_end[tagged]))


@dataclass(frozen=True)
class SlowedPath:
    """A rounded polyline whose parameter is stretched in bends, for one rate."""

    path: Rounded
    slowed: Slowed
    placed: Placed

    @property
    def closed(self) -> bool:
        """See `Shape`."""
        return self.path.closed

    @property
    def length(self) -> float:
        """See `Shape`."""
        return self.slowed.length

    @cached_property
    def _start(self) -> float:
        """u of `slowed` where this path begins."""
        return float(self.slowed.parameter(self.path.start))

    def at_rate(self, _: float) -> "SlowedPath":
        """See `Shape`."""
        return self

    @cached_property
    def reversals(self) -> Array:
        """See `Shape`."""
        return self._from_start(self.slowed.parameter(self.path.reversals))

    def _from_start(self, parameter: Array) -> Array:
        return np.sort(self._shifted(parameter))

    def _shifted(self, parameter: Array) -> Array:
        s = parameter - self._start
        return np.where(s < -1e-9 * self.length, s + self.length, np.maximum(s, 0.0))

    @cached_property
    def rests(self) -> tuple[Array, Array]:
        """See `Shape`."""
        where, dwell = self.placed.rests
        places = np.concatenate([self._shifted(self.slowed.parameter(where)), self.reversals])
        dwell = np.concatenate([dwell, np.zeros(len(self.reversals))])
        order = np.lexsort([-dwell, places])  # a dwell before the reversal at its place
        places, dwell = places[order], dwell[order]
        is_new = np.diff(places, prepend=-np.inf) > 1e-9 * self.length
        return places[is_new], dwell[is_new]

    @cached_property
    def tags(self) -> tuple[tuple[float, str], ...]:
        """See `Shape`."""
        where, texts, is_end = self.placed.tags
        places = np.where(is_end, self.length, self._shifted(self.slowed.parameter(where)))
        return tuple(sorted(zip(places.tolist(), texts, strict=True), key=itemgetter(0)))

    @cached_property
    def stations(self) -> Array:
        """See `Shape`: denser where it is fastest, turns fastest, or is tightest."""
        cells = self.slowed.cells
        middle = (cells[:-1] + cells[1:]) / 2
        p_1, p_2 = self.path.curve(middle, 1), self.path.curve(middle, 2)
        speed, rho = np.hypot(*p_1.T), self.slowed.slowness(middle)
        bend = np.abs(cross(p_1, p_2)) / speed**2
        most = [np.argsort(what)[-STATIONS:] for what in (speed / rho, bend / rho, bend / speed)]
        s = self._from_start(self.slowed.parameter(middle[np.unique(np.concatenate(most))]))
        return np.union1d(s, np.linspace(0.0, self.length, STATIONS))

    def gear(self, s: Array) -> Any:
        """See `Shape`."""
        if not len(self.path.reversals):
            return 1.0
        places = self._progress(s)[0], np.array(self.path.start)
        now, first = (np.searchsorted(self.path.reversals, at, "right") for at in places)
        return 1.0 - 2.0 * ((now - first) % 2)

    def segment(self, s: Array) -> Any:
        """See `Shape`."""
        legs, place = self.path.legs, self._progress(s)[0]
        leg = np.searchsorted(legs, place + 1e-9 * legs[-1], "right") - 1
        return self.path.numbers[np.clip(leg, 0, len(legs) - 2)]

    def leg_speed(self, s: Array) -> Array:
        """Most speed (...) [m/s] that is said of the points before s (...); infinite if none is."""
        place, *_ = self._progress(s)
        return SpeedLimits(0.0, math.inf, math.inf, self.placed.legs).speed(place)

    def derivatives(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """See `Shape`."""
        place, *rates = self._progress(s)
        path = tuple(self.path.curve(place, order) for order in range(4))
        by_s_1, by_s_2, by_s_3 = (np.asarray(rate)[..., None] for rate in rates)
        return compose(path, (by_s_1, by_s_2, by_s_3))  # type: ignore[arg-type]

    def _progress(self, s: Array) -> Derivatives:
        """Parameter of the rounded polyline, with its derivatives by this path's s."""
        s = s + self._start
        s = np.mod(s, self.length) if self.closed else np.clip(s, 0.0, self.length)
        return self.slowed.progress(s)
