"""What a path has to tell when the climber reaches a place: each tag once, in order."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.trajectory import Trajectory

NEAR = 1e-9  # of the length: what rounding leaves of a place at which it rests


class Event(NamedTuple):
    """A tag that is reached, and where."""

    tag: str
    stamp: int  # [ns] when it was
    place: tuple[float, float]  # [m]


class Events:
    """Tells the tags of a trajectory as far as it is driven; what has been reached stays so.

    So there is nothing to tell on the way back, nor when the same place is driven again. Each lap
    of a closed path has all of its tags.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        self.trajectory = trajectory
        self._path = trajectory.course
        duration = trajectory.duration
        self._end = self._at(duration)[0] if math.isfinite(duration) else math.inf
        self._tags = self._upcoming(self._path.tags)
        self._next = next(self._tags, None)

    def _at(self, own_time: float) -> tuple[float, float]:
        """Path parameter and its rate at the trajectory's own time [s]."""
        s, rate, *_ = self.trajectory.law.progress(np.array(own_time), self._path)
        return float(s), float(rate)

    def _upcoming(self, tags: tuple[tuple[float, str], ...]) -> Iterator[tuple[float, str]]:
        """Path parameter and text of each tag, of all laps."""
        lap = 0.0
        while tags and (not lap or lap < self._end * (1 - NEAR)):
            yield from ((lap + s, text) for s, text in tags)
            if not self._path.closed:
                return
            lap += self._path.length

    def reached(self, own_time: float, rate: float, stamp: int) -> list[Event]:
        """Tags that are reached by `own_time` [s], which goes on at a `rate`, at a `stamp` [ns]."""
        s, s_1 = self._at(own_time)
        found = []
        while self._next is not None and s >= self._next[0] - NEAR * self._path.length:
            at, text = self._next
            late = (s - at) / (s_1 * rate) if s_1 * rate > 0 else 0.0  # it was between two looks
            x, y = self._path.derivatives(np.array(at))[0] + self.trajectory.origin
            found.append(Event(text, stamp - round(late * SECOND), (float(x), float(y))))
            self._next = next(self._tags, None)
        return found

    def skip(self, own_time: float) -> None:
        """Leave out what it does not come by, as it goes on from there."""
        s, _ = self._at(own_time)
        while self._next is not None and self._next[0] < s - NEAR * self._path.length:
            self._next = next(self._tags, None)
