"""How far a course is, and what the climber does on it."""

import math
from dataclasses import dataclass

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.planning.course import Course, Row

WAITING, APPROACHING, FOLLOWING = "waiting", "approaching", "following"
PAUSED, DONE, BY_HAND = "paused", "done", "by hand"
SAMPLES = 4001


@dataclass(frozen=True)
class Progress:
    """How far the climber is; `state` is one of the above."""

    state: str
    done: float = 0.0  # [m] that it has driven, as planned; less, on the way back
    left: float = math.nan  # [m] to the end; infinite if there is none
    time_left: float = math.nan  # [s] at the speed asked for
    lap: int = 0  # of a closed path; run of one that is driven forth and back; from 1
    segment: int = 0  # number of the last point of a polyline that it has passed, from 1
    mode: str = ""  # what the controller does; empty if none tells


class Odometer:
    """Distance that is driven along a trajectory, by its own time."""

    def __init__(self, trajectory: Trajectory) -> None:
        self.trajectory = trajectory
        law, path = trajectory.law, trajectory.course
        stations = path.stations
        middle = (stations[:-1] + stations[1:]) / 2
        speeds = [np.hypot(*np.moveaxis(path.derivatives(s)[1], -1, 0)) for s in (stations, middle)]
        simpson = (speeds[0][:-1] + speeds[0][1:] + 4 * speeds[1]) / 6 * np.diff(stations)
        self._stations, self._along = stations, np.insert(np.cumsum(simpson), 0, 0.0)
        # after which a law without an end repeats itself: it may rest before
        duration = trajectory.duration
        repeats = law.horizon(path) + getattr(law, "pause", 0.0)
        self._times = np.linspace(0.0, duration if math.isfinite(duration) else repeats, SAMPLES)
        self._places = self._place(self._times)
        self._driven = np.insert(np.cumsum(np.abs(np.diff(self._places))), 0, 0.0)

    def _place(self, own_time: Array) -> Array:
        """Distance (...) [m] along the path, on over all laps of a closed one."""
        path = self.trajectory.course
        s, *_ = self.trajectory.law.progress(own_time, path)
        laps = np.floor(s / path.length) if path.closed else 0 * s
        within = np.interp(s - laps * path.length, self._stations, self._along)
        return np.asarray(laps * self._along[-1] + within)

    @property
    def whole(self) -> float:
        """Distance [m] of all of it; infinite if it has no end."""
        return float(self._driven[-1]) if math.isfinite(self.trajectory.duration) else math.inf

    def at(self, own_time: float) -> float:
        """Distance [m] that is driven at the trajectory's own time [s]."""
        span = self._times[-1]
        rounds = 0.0 if math.isfinite(self.trajectory.duration) else own_time // span
        since = own_time - rounds * span
        i = min(max(int(np.searchsorted(self._times, since, "right")) - 1, 0), SAMPLES - 1)
        more = np.abs(self._place(np.array([since]))[0] - self._places[i])
        return float(rounds * self._driven[-1] + self._driven[i] + more)


def progress(course: Course[Row], odometer: Odometer, position: int, mode: str) -> Progress:
    """Progress at `position` [ns]; `mode` is what the controller does, empty if none tells."""
    trajectory = course.trajectory
    u, _ = course.own_time(position)
    path = trajectory.course
    s = float(trajectory.law.progress(np.array(u), path)[0])
    duration, speed = course.duration, course.speed
    if path.closed:
        lap = s / path.length
    else:
        lap = u / (trajectory.law.horizon(path) + getattr(trajectory.law, "pause", 0.0))
    laps = getattr(trajectory.law, "runs" if not path.closed else "laps", 0) or math.inf
    done = odometer.at(u)
    return Progress(
        state=_state(course, position, mode),
        done=done,
        left=max(odometer.whole - done, 0.0),
        time_left=(duration - u if course.direction > 0 else u) / speed,
        lap=int(min(math.floor(lap + 1e-9) + 1, laps)),
        segment=int(path.segment(np.array(s))),
        mode=mode,
    )


def _state(course: Course[Row], position: int, mode: str) -> str:
    if mode == APPROACHING:
        return APPROACHING
    if course.is_done(position):
        return DONE
    if course.is_paused and course.rests(position):
        return PAUSED
    return FOLLOWING if mode in (FOLLOWING, "") else WAITING
