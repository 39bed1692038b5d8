"""A trajectory's extremes: length, duration, fastest speeds, smallest radius."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from climber_uk.mechanics import Array, cross
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.shapes import Shape
from climber_uk.mechanics.trajectory import Trajectory

SAMPLES = 4001  # in time
LONG_PATH = 500.0  # [m] from which on a path is probably given in mm


@dataclass(frozen=True)
class Summary:
    """Extremes of a trajectory; `str` of it is one line for a log."""

    length: float  # [m] of the path, once along it
    duration: float  # [s]; infinite if it goes on without end
    fastest_speed: float  # [m/s]
    fastest_yaw_rate: float  # [rad/s]
    smallest_radius: float  # [m]; infinite if all is straight
    tightest_place: tuple[float, float]  # [m] x and y where it is
    fastest_wheel_speed: float | None  # [m/s] of a wheel's rim; None if the track is not known
    closed: bool
    remarks: tuple[str, ...] = ()  # what looks like a mistake, each worth a warning

    def __str__(self) -> str:
        """Return one line for a log."""
        said = f"{self.length:.4g} m, {'closed' if self.closed else 'open'}, "
        said += "without end" if math.isinf(self.duration) else f"{self.duration:.4g} s"
        said += f", at most {self.fastest_speed:.3g} m/s and {self.fastest_yaw_rate:.3g} rad/s"
        if self.fastest_wheel_speed is not None:
            said += f", wheels at most {self.fastest_wheel_speed:.3g} m/s"
        if math.isinf(self.smallest_radius):
            return f"{said}, straight"
        x, y = (round(place, 3) + 0.0 for place in self.tightest_place)
        return f"{said}, smallest radius {self.smallest_radius:.3g} m at ({x:g}, {y:g}) m"


def summary(trajectory: Trajectory, half_track: float | None = None) -> Summary:
    """Extremes of `trajectory`; with `half_track` [m] the fastest wheel speed as well."""

    def curvature(s: Array) -> Array:
        _, p_1, p_2, _ = path.derivatives(s)
        return np.abs(cross(p_1, p_2)) / _size(p_1) ** 3

    def speed(reference: Reference) -> Array:
        return np.abs(reference.speed)

    def yaw_rate(reference: Reference) -> Array:
        return np.abs(reference.yaw_rate)

    def wheel_speed(reference: Reference) -> Array:
        return speed(reference) + (half_track or 0.0) * yaw_rate(reference)

    def fastest(rate: Callable[[Reference], Array]) -> float:
        return _highest(lambda time: rate(trajectory.at(time)), times, rate(reference))[1]

    path, times = trajectory.course, _times(trajectory)
    reference = trajectory.at(times)
    length = _length(path)
    tightest, bend = _highest(curvature, path.stations, curvature(path.stations))
    x, y = path.derivatives(np.array(tightest))[0] + trajectory.origin
    return Summary(
        length=length,
        duration=trajectory.duration,
        fastest_speed=fastest(speed),
        fastest_yaw_rate=fastest(yaw_rate),
        smallest_radius=1 / bend if bend * length > 1e-9 else math.inf,
        tightest_place=(float(x), float(y)),
        fastest_wheel_speed=None if half_track is None else fastest(wheel_speed),
        closed=path.closed,
        remarks=_remarks(trajectory, length),
    )


def _remarks(trajectory: Trajectory, length: float) -> tuple[str, ...]:
    remarks = []
    if length > LONG_PATH:
        remarks.append(f"the path is {length:.4g} m long: are its sizes in mm rather than in m?")
    laps = getattr(trajectory.law, "laps", 1)
    if laps > 1 and not trajectory.course.closed:
        remarks.append(f"laps={laps} has no effect: the path is open")
    if unused := getattr(trajectory.shape, "unused", ()):
        remarks.append(
            f"of the waypoints' columns, not used: {', '.join(unused[:5])}"
            + " …" * (len(unused) > 5)
        )
    return tuple(remarks)


def _times(trajectory: Trajectory) -> Array:
    """Times (n,) [s] up to the law's horizon, even in time and in the path parameter together."""
    path, law = trajectory.course, trajectory.law
    times = np.linspace(0.0, law.horizon(path), 4 * SAMPLES)
    progress = np.maximum.accumulate(law.progress(times, path)[0])
    stations = path.stations
    if path.closed:
        stations = np.concatenate([stations, stations + path.length])
    even = np.interp(stations[stations < progress[-1]], progress, times)
    return np.union1d(times, even)


def _length(path: Shape) -> float:
    """Length of a path [m], by Simpson's rule between its stations."""
    s = path.stations
    middle, step = (s[:-1] + s[1:]) / 2, np.diff(s)
    ends, halfway = (_size(path.derivatives(at)[1]) for at in (s, middle))
    return float(((ends[:-1] + 4 * halfway + ends[1:]) * step).sum() / 6)


def _highest(f: Callable[[Array], Array], x: Array, values: Array) -> tuple[float, float]:
    """Place and value of the maximum of `f`, whose peaks are wider than the steps of `x`.

    `values` are those at `x`. Of maxima that are equal but for rounding the first.
    """
    for refined in range(4):
        values = f(x) if refined else values
        best = int(np.argmax(values >= values.max() * (1 - 1e-9)))
        place, value = float(x[best]), float(values[best])
        x = np.linspace(x[max(best - 1, 0)], x[min(best + 1, len(x) - 1)], 101)
    return place, value


def _size(vectors: Array) -> Array:
    """Length (...) of vectors (..., 2)."""
    return np.hypot(vectors[..., 0], vectors[..., 1])
