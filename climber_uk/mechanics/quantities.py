"""The quantities of a climber's motion: in components for every tick, and as vectors (..., 3).

Arithmetic on a float, or on N numbers that lie side by side, takes a fraction of what it takes on
vectors. So the equations of every tick stand on the components here, floats of one climber or
arrays (N,) of many; `State` has the same as vectors. Time derivatives end in _1 and _2 (§1.3).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.elementary import cos, sin

Bounds = tuple[Any, Any]  # lowest and highest torque of a wheel [N m]


class DesiredAcceleration(NamedTuple):
    """Accelerations that a constraint set asks for, and the speed it wants."""

    forward: Any  # v̇ [m/s²]
    yaw: Any  # θ̈ [rad/s²]
    speed: Any  # wanted [m/s]: friction is fed forward with its sign
    yaw_rate: Any = 0.0  # wanted [rad/s]: what resists turning is, too


class Motion(NamedTuple):
    """Pose in the wall's frame, forward speed and yaw rate of a climber without side slip (17).

    `cosine` and `sine` are those of `heading`: make one by `at`, and never replace `heading` alone.
    """

    x: Any  # [m]
    y: Any  # [m]
    heading: Any  # θ [rad]
    cosine: Any  # of θ
    sine: Any
    speed: Any  # v, forward [m/s]
    yaw_rate: Any  # ω [rad/s]

    @classmethod
    def at(cls, x: Any, y: Any, heading: Any, speed: Any, yaw_rate: Any) -> "Motion":
        """Motion at a pose in the wall's frame [m, rad], with speed [m/s] and yaw rate [rad/s]."""
        return cls(x, y, heading, cos(heading), sin(heading), speed, yaw_rate)


class ReferencePoint(NamedTuple):
    """The `Reference` at one time, in components, in the wall's frame."""

    x: Any  # [m]
    y: Any  # [m]
    heading: Any  # θ_d [rad]
    v_x: Any  # [m/s]
    v_y: Any  # [m/s]
    yaw_rate: Any  # ω_d [rad/s]
    a_x: Any  # [m/s²]
    a_y: Any  # [m/s²]
    yaw_acceleration: Any  # [rad/s²]
    j_x: Any  # jerk [m/s³]
    j_y: Any  # [m/s³]

    @property
    def speed(self) -> Any:
        """Along its heading [m/s]."""
        return self.v_x * cos(self.heading) + self.v_y * sin(self.heading)


class Speeds(NamedTuple):
    """Speed and yaw rate of a climber, as of a `Motion`."""

    speed: Any  # forward [m/s]
    yaw_rate: Any  # [rad/s]


class Wrench(NamedTuple):
    """Force and moment on a climber, in its body's frame."""

    force: Any  # along the climber [N]
    moment: Any  # about its vertical [N m]


class Torques(NamedTuple):
    """Torques of the two wheels [N m], positive forwards; in numbers the right one is first."""

    right: Any
    left: Any


NO_TORQUES = Torques(0.0, 0.0)
NO_WRENCH = Wrench(0.0, 0.0)


@dataclass(frozen=True)
class State:
    """Pose and velocity of a climber, or of many (...), both in the wall's frame."""

    pose: Array  # (..., 3) x [m], y [m], θ [rad]
    velocity: Array  # (..., 3) ẋ [m/s], ẏ [m/s], θ̇ [rad/s]

    @classmethod
    def rolling(cls, pose: Array, speed: Array | float, yaw_rate: Array | float) -> "State":
        """State at `pose` (..., 3) that moves along its heading (17)."""
        heading = unpack(pose)[2]
        return cls(pose, pack(speed * cos(heading), speed * sin(heading), yaw_rate))

    @classmethod
    def moving(cls, motion: Motion, side_slip: Any = 0.0) -> "State":
        """State of a climber in `motion`, with a `side_slip` [m/s] to the left."""
        v, cosine, sine = motion.speed, motion.cosine, motion.sine
        v_x, v_y = v * cosine - side_slip * sine, v * sine + side_slip * cosine
        return cls(pack(motion.x, motion.y, motion.heading), pack(v_x, v_y, motion.yaw_rate))

    @cached_property
    def motion(self) -> Motion:
        """The same in components, without its side slip."""
        x, y, heading = unpack(self.pose)
        v_x, v_y, yaw_rate = unpack(self.velocity)
        cosine, sine = cos(heading), sin(heading)
        return Motion(x, y, heading, cosine, sine, v_x * cosine + v_y * sine, yaw_rate)

    @cached_property
    def heading(self) -> Array:
        """θ (...) [rad]."""
        return unpack(self.pose)[2]

    @cached_property
    def forward_speed(self) -> Array:
        """v = ẋ cosθ + ẏ sinθ (12), (...) [m/s]."""
        return along(self.heading, self.velocity)

    @cached_property
    def side_slip(self) -> Array:
        """Velocity to the left, 0 where (17) holds, (...) [m/s]."""
        return across(self.heading, self.velocity)

    @cached_property
    def yaw_rate(self) -> Array:
        """ω = θ̇ (...) [rad/s]."""
        return unpack(self.velocity)[2]


def along(heading: Array, vector: Array) -> Array:
    """Forward component, (...), of a vector (..., 2 or 3) given in the wall's frame."""
    x, y, *_ = unpack(vector)
    return x * cos(heading) + y * sin(heading)


def across(heading: Array, vector: Array) -> Array:
    """Component to the left, (...), of a vector (..., 2 or 3) given in the wall's frame."""
    x, y, *_ = unpack(vector)
    return y * cos(heading) - x * sin(heading)
