"""A reference known at points in time, and between them by quintic Hermite interpolation.

Pose, velocity and acceleration are met at every point; between points the pose is off by less
than h⁶ |p⁽⁶⁾| / 46080. A piece depends on its two ends only, so that overlapping previews of one
trajectory agree to the last bit.
"""

from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from climber_uk.mechanics import Array, Stamps
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import ReferencePoint, across, along
from climber_uk.mechanics.reference import Reference

MOST_SIDEWAYS = 0.1  # [rad] between heading and velocity, forwards or backwards
REST_SPEED = 0.005  # [m/s] sideways, below which any heading passes


@dataclass(frozen=True)
class Preview:
    """Points of a reference in the wall's frame, [m], [rad], [s]; headings may be modulo 2π.

    Raises `ValueError` unless there are two at least, in the order of time, and all are finite.
    """

    times: Stamps  # (n,) [ns]
    pose: Array  # (n, 3) x [m], y [m], θ [rad]
    velocity: Array  # (n, 3)
    acceleration: Array  # (n, 3)

    def __post_init__(self) -> None:
        if len(self.times) < 2 or (np.diff(self.times) <= 0).any():
            raise ValueError(f"{len(self.times)} points must be >= 2 and in the order of time")
        for name in ("pose", "velocity", "acceleration"):
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"{name} of a point is not finite")

    @property
    def _arrays(self) -> tuple[Any, ...]:
        return self.times, self.pose, self.velocity, self.acceleration

    def check_heading(self) -> None:
        """Raise `ValueError` unless every point moves along its heading, forwards or backwards.

        Wheels do not roll sideways (17). Angles of less than `MOST_SIDEWAYS` pass, which finite
        differences may give, and any heading passes at rest.
        """
        heading = self.pose[:, 2]
        forwards = np.abs(along(heading, self.velocity))
        sideways = np.abs(across(heading, self.velocity))
        angle = np.arctan2(sideways, forwards)
        is_wrong = (angle > MOST_SIDEWAYS) & (sideways > REST_SPEED)
        if is_wrong.any():
            i = int(np.argmax(is_wrong))
            raise ValueError(
                f"point {i + 1} moves sideways: its velocity of "
                f"{np.hypot(forwards[i], sideways[i]):.3g} m/s is {np.degrees(angle[i]):.3g}° off "
                f"its heading of {heading[i]:.3g} rad, at most {np.degrees(MOST_SIDEWAYS):.2g}° "
                "can be followed"
            )

    @cached_property
    def _pieces(self) -> tuple[list[int], list[list[list[float]]]]:
        """Times [ns], and coefficients (n-1, 3, 6) of 1, t … t⁵, t [s] since each."""
        h = np.diff(self.times)[:, None] * 1e-9
        step = np.diff(self.pose, axis=0)
        step[:, 2] = np.mod(step[:, 2] + np.pi, 2 * np.pi) - np.pi
        v, v_end = self.velocity[:-1] * h, self.velocity[1:] * h
        a, a_end = self.acceleration[:-1] * h**2, self.acceleration[1:] * h**2
        by_u = np.stack([self.pose[:-1], v, a / 2, *quintic(step, v, a, v_end, a_end)], axis=2)
        return self.times.tolist(), (by_u / h[..., None] ** np.arange(6)).tolist()

    def at(self, time: int) -> Reference | None:
        """Reference at `time` [ns]; None outside of the points."""
        target = self.target(time)
        return None if target is None else Reference.of(target)

    def target(self, time: int) -> ReferencePoint | None:
        """The same in components, for every tick of a controller."""
        times, coefficients = self._pieces
        if not times[0] <= time <= times[-1]:
            return None
        i = bisect_right(times, time, 1, len(times) - 1) - 1
        t = float(time - times[i]) * 1e-9
        of_x, of_y, of_heading = coefficients[i]
        x, v_x, a_x, j_x = _derivatives(of_x, t)
        y, v_y, a_y, j_y = _derivatives(of_y, t)
        heading, omega, omega_1, _ = _derivatives(of_heading, t)
        return ReferencePoint(x, y, heading, v_x, v_y, omega, a_x, a_y, omega_1, j_x, j_y)

    def fastest(self, begin: int, end: int) -> tuple[float, float]:
        """Fastest speed [m/s] and yaw rate [rad/s], >= 0, at the points from `begin` to `end` [ns].

        Where no point lies between these, that of the nearest one.
        """
        first = min(int(np.searchsorted(self.times, begin)), len(self.times) - 1)
        last = max(int(np.searchsorted(self.times, end, "right")), first + 1)
        v_x, v_y, yaw_rate = self.velocity[first:last].T
        return float(np.hypot(v_x, v_y).max()), float(np.abs(yaw_rate).max())

    def last(self, points: int) -> "Preview":
        """Preview of the last `points` points, or of all if there are fewer."""
        if len(self.times) <= points:
            return self
        return Preview(*(array[-points:] for array in self._arrays))

    def goes_on_with(self, newer: "Preview", tolerance: float) -> bool:
        """Whether `newer` begins within `tolerance` [m, rad] of where this one is by then."""
        here = self.at(int(newer.times[0]))
        if here is None:
            return False
        offset = newer.pose[0] - here.pose
        offset[2] = wrapped(offset[2])
        return bool(np.abs(offset).max() <= tolerance)

    def continued(self, newer: "Preview", since: int) -> "Preview":
        """Preview of this one's points from `since` [ns] on, then all of `newer`."""
        old = slice(*np.searchsorted(self.times, [since, newer.times[0]]))
        both = zip(self._arrays, newer._arrays, strict=True)
        return Preview(*(np.concatenate([before[old], after]) for before, after in both))


def _derivatives(coefficients: list[float], t: float) -> tuple[float, float, float, float]:
    """Polynomial c₀ + c₁ t + … + c₅ t⁵ and its first three derivatives, by Horner's scheme."""
    c_0, c_1, c_2, c_3, c_4, c_5 = coefficients
    last = t * c_5
    p_4 = c_4 + last
    p_3 = c_3 + t * p_4
    p_2 = c_2 + t * p_3
    p_1 = c_1 + t * p_2
    v_4 = p_4 + last
    v_3 = p_3 + t * v_4
    v_2 = p_2 + t * v_3
    a_4 = v_4 + last
    a_3 = v_3 + t * a_4
    return (
        c_0 + t * p_1,
        p_1 + t * v_2,
        2.0 * (v_2 + t * a_3),
        6.0 * (a_3 + t * (a_4 + last)),
    )


def joined(previews: Iterable[Preview]) -> Preview:
    """Preview of all points of several; at the same time the point of the later preview counts."""
    points = {
        int(time): (preview, i) for preview in previews for i, time in enumerate(preview.times)
    }
    chosen = [points[time] for time in sorted(points)]
    return Preview(
        times=np.array(sorted(points), np.int64),
        pose=np.array([preview.pose[i] for preview, i in chosen]),
        velocity=np.array([preview.velocity[i] for preview, i in chosen]),
        acceleration=np.array([preview.acceleration[i] for preview, i in chosen]),
    )


def quintic(step: Array, v: Array, a: Array, v_end: Array, a_end: Array) -> tuple[Array, ...]:
    """Coefficients of u³, u⁴, u⁵ of a Hermite piece, u from 0 to 1, that goes a `step`.

    Velocities and accelerations at both ends, (...), are by u.
    """
    p_left, v_left, a_left = step - v - a / 2, v_end - v - a, a_end - a  # without these three
    return (
        10 * p_left - 4 * v_left + a_left / 2,
        -15 * p_left + 7 * v_left - a_left,
        6 * p_left - 3 * v_left + a_left / 2,
    )
