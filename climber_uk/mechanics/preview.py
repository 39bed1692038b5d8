"""A reference known at points in time, and between them by quintic Hermite interpolation.

Pose, velocity and acceleration are met at every point; between points the pose is off by less
than h⁶ |p⁽⁶⁾| / 46080. A piece depends on its two ends only, so that overlapping previews of one
trajectory agree to the last bit.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from climber_uk.mechanics import Array
from climber_uk.mechanics.trajectory import Reference


@dataclass(frozen=True)
class Preview:
    """Points of a reference; raises `ValueError` unless there are two, in the order of time.

    Headings may be given modulo 2π.
    """

    times: NDArray[np.int64]  # (n,) [ns]
    pose: Array  # (n, 3) x [m], y [m], θ [rad]
    velocity: Array  # (n, 3)
    acceleration: Array  # (n, 3)

    def __post_init__(self) -> None:
        if len(self.times) < 2 or (np.diff(self.times) <= 0).any():
            raise ValueError(f"{len(self.times)} points must be >= 2 and in the order of time")
        for name in ("pose", "velocity", "acceleration"):
            if not np.isfinite(getattr(self, name)).all():
                raise ValueError(f"{name} of a point is not finite")

    def at(self, time: int) -> Reference | None:
        """Reference at `time` [ns]; None outside of the points."""
        if not self.times[0] <= time <= self.times[-1]:
            return None
        i = min(int(np.searchsorted(self.times, time, side="right")), len(self.times) - 1) - 1
        h = float(self.times[i + 1] - self.times[i]) * 1e-9
        u = float(time - self.times[i]) * 1e-9 / h

        p, p_end = self.pose[i], self.pose[i + 1]
        v, a = self.velocity[i] * h, self.acceleration[i] * h**2
        way = p_end - p
        way[2] = np.mod(way[2] + np.pi, 2 * np.pi) - np.pi
        p_left = way - v - a / 2
        v_left = self.velocity[i + 1] * h - v - a
        a_left = self.acceleration[i + 1] * h**2 - a
        c_3 = 10 * p_left - 4 * v_left + a_left / 2
        c_4 = -15 * p_left + 7 * v_left - a_left
        c_5 = 6 * p_left - 3 * v_left + a_left / 2
        jerk = (6 * c_3 + u * (24 * c_4 + u * 60 * c_5)) / h**3
        return Reference(
            pose=p + u * (v + u * (a / 2 + u * (c_3 + u * (c_4 + u * c_5)))),
            velocity=(v + u * (a + u * (3 * c_3 + u * (4 * c_4 + u * 5 * c_5)))) / h,
            acceleration=(a + u * (6 * c_3 + u * (12 * c_4 + u * 20 * c_5))) / h**2,
            jerk=jerk[:2],
        )


def joined(previews: Iterable[Preview]) -> Preview:
    """All points of some previews; where two have a point at the same time, the later one's."""
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
