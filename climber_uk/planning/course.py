"""A trajectory under way: its points ahead of the climber, and what is asked of it meanwhile.

Its times t never change their meaning, and a controller may wait on them. What is asked of it (to
pause, to go on, slower, back) changes how fast the trajectory's own time u(t) goes on
(`PathClock`), from `reaction` ahead of the climber on: nearer points are never taken back.
"""

import math
from collections import deque
from collections.abc import Callable
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.planning.path_clock import PathClock

PEAK_RATE = 15 / 8  # of a smooth start's ramp, of its mean
NEAREST_STEP = 0.05  # [s] in which the nearest place is looked for
AS_NEAR, AROUND = 0.05, 2.0  # [m] and [s], of places that are about as near
HELD = 0.02  # [m, rad] from where a course rests
MOST_POINTS = 1500  # of a preview: what a controller takes
SAMPLES = 4001  # of a trajectory, to find its highest speed and acceleration
Row = TypeVar("Row")


@parameters
class CourseOptions:
    """How a trajectory is published, and how it stops."""

    preview: float = parameter(1.0, "s", "how far ahead the reference is published", above=0)
    point_period: float = parameter(0.05, "s", "time between two points of a preview", above=0)
    publish_period: float = parameter(0.1, "s", "time between two previews", at_least=0.001)
    reaction: float = parameter(
        0.3,
        "s",
        "time ahead of the climber from where on what is published may change: it pauses no sooner",
        at_least=0.1,
    )
    stop_time: float = parameter(
        1.0,
        "s",
        "least time from the full rate to rest, or back; more where the path accelerates less",
        above=0,
    )

    def __post_init__(self) -> None:
        if self.preview < 2 * self.publish_period:
            raise ValueError(
                f"preview={self.preview} must be >= 2 publish_period={self.publish_period} [s]"
            )
        ahead = self.preview + self.reaction + self.stop_time
        if ahead > MOST_POINTS * self.point_period:
            raise ValueError(
                f"point_period={self.point_period} must be >= {ahead / MOST_POINTS:.3g} [s], a "
                f"{MOST_POINTS}th of preview + reaction + stop_time"
            )


class Course(Generic[Row]):
    """A trajectory that started at `start` [ns], at rest if it `is_paused`.

    It begins at its own time `begin` [s], from rest there if that is later than 0, and goes back
    from there if `direction` is -1. `make` makes of a reference, and its time [s] since the start,
    what is published of it.
    """

    def __init__(
        self,
        trajectory: Trajectory,
        start: int,
        options: CourseOptions,
        make: Callable[[Reference, float], Row],
        is_paused: bool = False,
        speed: float = 1.0,
        begin: float = 0.0,
        direction: int = 1,
    ) -> None:
        self.trajectory, self.start, self.options = trajectory, start, options
        self.is_paused, self.speed = is_paused, speed  # as a share of the planned one
        self.begin = begin
        self.direction = direction  # -1: back along the path
        self.clock: PathClock | None = None  # None: as planned
        self._make = make
        self._points: deque[tuple[float, Row]] = deque()  # with their times [s]
        self._next = 0  # number of the next point: each is computed once, but where it changes
        if begin > 0:
            rest = PathClock(self.ramp_time, begin=begin, rate=0.0)
            self.clock = rest.changed(0.0, self.asked, 0.0)
        elif self.asked != 1.0:
            self.clock = PathClock(self.ramp_time, rate=self.asked)

    @cached_property
    def ramp_time(self) -> float:
        """Time [s] of a change of the rate by 1, no harder than the law's own ramps."""
        law, least = self.trajectory.law, self.options.stop_time
        if law.stops:
            times = np.linspace(0.0, law.horizon(self.trajectory.course), SAMPLES)
            reference = self.trajectory.at(times)
            hardest = np.abs(reference.forward_acceleration).max()
            least = max(least, PEAK_RATE * np.abs(reference.speed).max() / max(hardest, 1e-9))
        # it ends at a point: a piece between points would overshoot, and drive back a little
        return math.ceil(least / self.options.point_period - 1e-9) * self.options.point_period

    @property
    def asked(self) -> float:
        """Rate of the trajectory's own time that is asked for."""
        return 0.0 if self.is_paused else self.direction * self.speed

    @cached_property
    def duration(self) -> float:
        """Own time [s] at its end; infinite if it goes on without end."""
        return self.trajectory.duration

    def time(self, position: int) -> float:
        """Time [s] since the start at `position` [ns]."""
        return (position - self.start) / SECOND

    def own_time(self, position: int) -> tuple[float, float]:
        """The trajectory's own time [s] at `position` [ns], and its rate."""
        t = self.time(position)
        if self.clock is None:
            return min(max(t, 0.0), self.duration), 1.0
        u, rate, *_ = self.clock.at(t)
        return self._within(float(u)), float(rate)

    def _within(self, u: float) -> float:
        """Own time [s] within the trajectory's, at whose ends a law that stops has come to rest."""
        return min(max(u, 0.0), self.duration) if self.trajectory.law.stops else u

    def is_done(self, position: int) -> bool:
        """Whether it has come to its end, or back to its beginning, for good."""
        if not self.trajectory.law.stops:
            return False
        u, _ = self.own_time(position)
        return u >= self.duration if self.direction > 0 else u <= 0.0

    def rests(self, position: int) -> bool:
        """Whether it rests at `position` [ns] and for as long as nothing else is asked for."""
        if self.is_done(position):
            return True
        clock = self.clock
        return clock is not None and not self.asked and self.time(position) >= clock.settles()

    def rested(self, position: int, pose: Array) -> Array:
        """Pose (3,) at which it rests at `position` [ns], if a climber is at about that `pose`.

        It is held a little off by friction: what begins there begins without a jump.
        """
        planned = self.trajectory.at(self.own_time(position)[0]).pose
        off = planned - pose
        off[2] = wrapped(off[2])
        is_there = self.rests(position) and np.abs(off).max() <= HELD
        return np.asarray(planned if is_there else pose)

    def nearest(self, place: Array, left: float) -> float:
        """Own time [s] at which it is nearest to a place (2,) [m].

        Of places that are about as near, the one counts that is nearest in time to `left` [s].
        """
        trajectory = self.trajectory
        last = min(self.duration, 2 * trajectory.law.horizon(trajectory.course))
        times = np.linspace(0.0, last, math.ceil(last / NEAREST_STEP) + 1)
        apart = np.hypot(*(trajectory.at(times).pose[:, :2] - place).T)
        near = times[apart <= apart.min() + AS_NEAR]
        about = float(near[np.abs(near - left).argmin()])
        around = np.abs(times - about) <= AROUND
        return float(times[around][apart[around].argmin()])

    # What is asked of it

    def pause(self, position: int) -> None:
        """Come to rest on the path."""
        self.is_paused = True
        self._change(position)

    def go_on(self, position: int, direction: int = 1) -> None:
        """Go on along the path, or back (`direction` -1)."""
        self.is_paused, self.direction = False, direction
        self._change(position)

    def set_speed(self, speed: float, position: int) -> None:
        """Go on at a share of the planned speed."""
        self.speed = speed
        self._change(position)

    def _change(self, position: int) -> None:
        """Go over to the rate asked for, from `reaction` after `position` [ns] on."""
        period, done = self.options.point_period, max(self.time(position), 0.0)
        number = math.ceil((done + self.options.reaction) / period)
        clock = self.clock or PathClock(self.ramp_time)
        begin = number * period
        u = float(clock.at(begin)[0])
        if self._within(u) != u:  # it rests at an end, whatever its clock does
            clock = PathClock(self.ramp_time, done, self._within(u), 0.0)
        self.clock = clock.turned(begin, self.asked, done)
        while self._points and self._points[-1][0] > begin:
            self._points.pop()
        self._next = min(self._next, number + 1)

    # What is published of it

    def preview(self, position: int, _now: int = 0) -> list[Row]:
        """Points around `position` [ns], from a little before it to the end of the preview."""
        options, time = self.options, self.time(position)
        oldest = time - options.publish_period - 2 * options.point_period
        self._next = max(self._next, int(oldest / options.point_period))
        while (at := self._next * options.point_period) < time + options.preview:
            self._points.append((at, self._make(self._at(at), at)))
            self._next += 1
        while self._points[0][0] < oldest:
            self._points.popleft()
        return [row for _, row in self._points]

    def _at(self, time: float) -> Reference:
        """Reference `time` [s] after the start."""
        if self.clock is None:
            return self.trajectory.at(time)
        return self.trajectory.at_own_time(self.clock.at(time))
