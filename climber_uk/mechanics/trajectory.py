"""A trajectory: a shape p(s) travelled by a time law s(t), from position to jerk.

ṗ = p' ṡ,   p̈ = p'' ṡ² + p' s̈,   p⃛ = p''' ṡ³ + 3 p'' ṡ s̈ + p' s⃛, and the heading along p'.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from climber_uk.mechanics import Array, cross
from climber_uk.mechanics.elementary import Derivatives, compose
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.shapes import Shape
from climber_uk.mechanics.time_laws import TimeLaw
from climber_uk.mechanics.waypoint_file import FARTHEST

LONGEST = 1e9  # [s], about 30 years; stamps in nanoseconds end after 290
SMALLEST = 1e-4  # [m] of a path
LOOKS = 9  # places that are looked at


@dataclass(frozen=True)
class Trajectory:
    """A shape travelled by a time law; in reverse gear the climber's tail goes first.

    Raises `ValueError` if the law would leave a path that ends, or not stop where it turns back,
    and where lengths or times are beyond those that have millimetres, or nanoseconds, left.
    """

    shape: Shape
    law: TimeLaw
    reverse_gear: bool = False
    origin: tuple[float, float] = (0.0, 0.0)  # [m] of the shape, in the wall's frame

    def __post_init__(self) -> None:
        try:
            with np.errstate(all="ignore"):
                self._refuse_absurd()
        except ArithmeticError as error:
            raise ValueError(f"numbers of the path are too large or too small: {error}") from None
        if self.law.stops:
            return
        if not self.shape.closed:
            raise ValueError(f"time_law {self.law} runs off an open shape: use 'rest_to_rest'")
        if len(rests := self.course.rests[0]):
            x, y = self.course.derivatives(rests[0])[0] + self.origin
            raise ValueError(
                f"time_law {self.law} does not stop where the path turns back or rests, "
                f"at ({x:.4g}, {y:.4g}) m: use 'rest_to_rest'"
            )

    def _refuse_absurd(self) -> None:
        """Raise `ValueError` for a path too far off, too small or too long in time.

        So does a law whose table is of another path; `ArithmeticError` where numbers overflow.
        """
        course = self.course
        places = course.derivatives(np.linspace(0.0, course.length, LOOKS))[0]
        extent = float(np.ptp(places, axis=0).max())
        x, y = (places + self.origin).T
        beyond = ~((np.abs(x) <= FARTHEST) & (np.abs(y) <= FARTHEST))
        if not np.isfinite(places).all():
            raise ArithmeticError("where it leads cannot be told")
        if beyond.any():
            i = int(np.argmax(beyond))
            raise ValueError(
                f"the path leads to ({x[i]:.4g}, {y[i]:.4g}) m, beyond {FARTHEST:g} m of the origin"
            )
        if extent < SMALLEST:
            raise ValueError(f"the path is {extent:.4g} m wide and high, want >= {SMALLEST:g} m")
        duration, once = self.duration, self.law.horizon(course)
        if not once <= LONGEST or not (duration <= LONGEST or duration == math.inf):
            longest = once if not once <= LONGEST else duration
            raise ValueError(f"the path takes {longest:.4g} s, more than {LONGEST:g} s")

    @cached_property
    def course(self) -> Shape:
        """The shape as it is travelled at the law's rate."""
        return self.shape.at_rate(self.law.rate)

    @property
    def duration(self) -> float:
        """Time after which the climber rests for good [s]; infinite if it never does."""
        return self.law.duration(self.course)

    def at(self, time: Array | float) -> Reference:
        """Reference at `time` (...) [s] since the start."""
        return self.at_progress(self.law.progress(np.asarray(time, dtype=float), self.course))

    def at_own_time(self, own_time: Derivatives) -> Reference:
        """Reference (...) at the law's time (...) [s], which goes on with these derivatives."""
        u, *rates = own_time
        progress = self.law.progress(np.asarray(u, dtype=float), self.course)
        return self.at_progress(compose(progress, tuple(rates)))  # type: ignore[arg-type]

    def path(self, points: int) -> Array:
        """Poses (points, 3) [m, rad], even in the path parameter, once along the shape."""
        s = np.linspace(0, self.course.length, points)
        return self.at_progress((s, np.ones_like(s), 0 * s, 0 * s)).pose

    def at_progress(self, progress: Derivatives) -> Reference:
        """Reference (...) of s and its derivatives by time (...), by the chain rule."""
        s, *rates = progress
        s_1, s_2, s_3 = (rate[..., None] for rate in rates)
        _, p_1, p_2, p_3 = path = self.course.derivatives(s)
        position, velocity, acceleration, jerk = compose(path, (s_1, s_2, s_3))

        forwards = p_1 * np.asarray(self.course.gear(s))[..., None]
        heading = np.arctan2(forwards[..., 1:], forwards[..., :1]) + np.pi * self.reverse_gear
        square = np.sum(p_1**2, axis=-1, keepdims=True)
        curvature = cross(p_1, p_2)[..., None] / square  # dθ/ds
        curvature_1 = (  # by s
            cross(p_1, p_3)[..., None] / square
            - 2 * curvature * np.sum(p_1 * p_2, axis=-1, keepdims=True) / square
        )
        yaw_rate = curvature * s_1
        yaw_acceleration = curvature_1 * s_1**2 + curvature * s_2
        return Reference(
            pose=np.concatenate([position + self.origin, heading], axis=-1),
            velocity=np.concatenate([velocity, yaw_rate], axis=-1),
            acceleration=np.concatenate([acceleration, yaw_acceleration], axis=-1),
            jerk=jerk,
        )
