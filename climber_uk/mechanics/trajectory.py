"""What the climber shall do: a shape p(s) travelled by a time law s(t), from position to jerk.

ṗ = p' ṡ,   p̈ = p'' ṡ² + p' s̈,   p⃛ = p''' ṡ³ + 3 p'' ṡ s̈ + p' s⃛, and the heading along p'.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.climber import along
from climber_uk.mechanics.motion import Target
from climber_uk.mechanics.shapes import Shape
from climber_uk.mechanics.time_laws import ConstantRate, Derivatives, TimeLaw, compose


@dataclass(frozen=True)
class Reference:
    """Where the climber should be and how it should move at one time (or many), wall's frame."""

    pose: Array  # (..., 3) x [m], y [m], θ [rad]
    velocity: Array  # (..., 3) ẋ [m/s], ẏ [m/s], θ̇ [rad/s]
    acceleration: Array  # (..., 3) ẍ [m/s²], ÿ [m/s²], θ̈ [rad/s²]
    jerk: Array  # (..., 2) of x and y [m/s³]

    @classmethod
    def of(cls, target: Target) -> "Reference":
        """Reference of a target."""
        return cls(pack(*target[:3]), pack(*target[3:6]), pack(*target[6:9]), pack(*target[9:]))

    @cached_property
    def target(self) -> Target:
        """The same in components."""
        vectors = self.pose, self.velocity, self.acceleration, self.jerk
        return Target(*(part for vector in vectors for part in unpack(vector)))

    @cached_property
    def heading(self) -> Array:
        """θ_d (...) [rad]."""
        return unpack(self.pose)[2]

    @cached_property
    def yaw_rate(self) -> Array:
        """ω_d (...) [rad/s]."""
        return unpack(self.velocity)[2]

    # The speed along the heading, negative in reverse gear, and its rates:

    @cached_property
    def speed(self) -> Array:
        """v_d (...) [m/s]."""
        return along(self.heading, self.velocity)

    @cached_property
    def speed_rate(self) -> Array:
        """v̇_d (...) [m/s²]."""
        return along(self.heading, self.acceleration)

    @cached_property
    def speed_second_rate(self) -> Array:
        """v̈_d = p⃛·t + ω² v_d (...) [m/s³]."""
        return along(self.heading, self.jerk) + self.yaw_rate**2 * self.speed


@dataclass(frozen=True)
class Trajectory:
    """A shape travelled by a time law; in reverse gear the climber's tail goes first.

    Raises `ValueError` if the law would leave a path that ends.
    """

    shape: Shape
    law: TimeLaw
    reverse_gear: bool = False
    origin: tuple[float, float] = (0.0, 0.0)  # [m] of the shape, in the wall's frame

    def __post_init__(self) -> None:
        if not self.shape.closed and isinstance(self.law, ConstantRate):
            raise ValueError("time_law='constant_rate' runs off an open shape: use 'rest_to_rest'")

    @property
    def duration(self) -> float:
        """Time after which the climber rests for good [s]; infinite if it never does."""
        return self.law.duration(self.shape)

    def at(self, time: Array | float) -> Reference:
        """Reference at `time` (...) [s] since the start."""
        return self._travelled(self.law.progress(np.asarray(time, dtype=float), self.shape))

    def path(self, points: int) -> Array:
        """Poses (points, 3) evenly spaced in the path parameter, along the shape once."""
        s = np.linspace(0, self.shape.length, points)
        return self._travelled((s, np.ones_like(s), 0 * s, 0 * s)).pose

    def _travelled(self, progress: Derivatives) -> Reference:
        s, *rates = progress
        s_1, s_2, s_3 = (rate[..., None] for rate in rates)
        _, p_1, p_2, p_3 = path = self.shape.derivatives(s)
        position, velocity, acceleration, jerk = compose(path, (s_1, s_2, s_3))

        heading = np.arctan2(p_1[..., 1], p_1[..., 0])[..., None] + np.pi * self.reverse_gear
        square = np.sum(p_1**2, axis=-1, keepdims=True)
        turning = _cross(p_1, p_2) / square  # dθ/ds
        turning_rate = (
            _cross(p_1, p_3) / square
            - 2 * turning * np.sum(p_1 * p_2, axis=-1, keepdims=True) / square
        )
        yaw_rate = turning * s_1
        yaw_acceleration = turning_rate * s_1**2 + turning * s_2
        return Reference(
            pose=np.concatenate([position + self.origin, heading], axis=-1),
            velocity=np.concatenate([velocity, yaw_rate], axis=-1),
            acceleration=np.concatenate([acceleration, yaw_acceleration], axis=-1),
            jerk=jerk,
        )


def _cross(u: Array, v: Array) -> Array:
    return u[..., :1] * v[..., 1:] - u[..., 1:] * v[..., :1]
