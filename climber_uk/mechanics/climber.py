"""The wheeled suction climber as M q̈ = Q + E(θ) τ under the no-slip row (11), (15), (17).

q = (x, y, θ): the centre of mass in a frame fixed to the wall, x horizontal, y up, θ anticlockwise
from x. Arrays (..., 3) for q and its derivatives, (..., 2) for wheel torques (right, left).
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from climber_uk.mechanics import Array, motion, pack, unpack
from climber_uk.mechanics.elementary import cos, sin
from climber_uk.mechanics.motion import Bounds, Motion
from climber_uk.parameters.declaration import check, parameter

GRAVITY = 9.81  # [m/s²]
DEGREE = math.pi / 180  # [rad]


@dataclass(frozen=True)
class State:
    """Where the climber is and how it moves, both in the wall's frame."""

    pose: Array  # (..., 3) x [m], y [m], θ [rad]
    velocity: Array  # (..., 3) ẋ [m/s], ẏ [m/s], θ̇ [rad/s]

    @classmethod
    def rolling(cls, pose: Array, speed: Array | float, yaw_rate: Array | float) -> "State":
        """State at `pose` (..., 3) that moves along its heading (17)."""
        heading = unpack(pose)[2]
        return cls(pose, pack(speed * cos(heading), speed * sin(heading), yaw_rate))

    @classmethod
    def moving(cls, motion: Motion) -> "State":
        """State of a climber in `motion`."""
        return cls(
            pack(motion.x, motion.y, motion.heading),
            pack(motion.speed * motion.cosine, motion.speed * motion.sine, motion.yaw_rate),
        )

    @cached_property
    def motion(self) -> Motion:
        """The same in components, without the side slip."""
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


@dataclass(frozen=True)
class Climber:
    """Parameters of a two-wheel suction climber; the defaults are the paper's.

    Raises `ValueError` naming field, value and bound.
    """

    mass: float = parameter(5.0, "kg", "mass m", above=0, plausible=(0.1, 300))
    yaw_inertia: float = parameter(
        0.33, "kg m²", "inertia J about the centre of mass", above=0, plausible=(1e-4, 100)
    )
    wheel_radius: float = parameter(0.027, "m", "wheel radius r", above=0, plausible=(0.005, 0.5))
    half_track: float = parameter(
        0.3, "m", "distance d of a wheel from the centre", above=0, plausible=(0.02, 2)
    )
    seal_friction_coefficient: float = parameter(
        0.8,
        "",
        "friction coefficient μ of the seal ring on the wall",
        at_least=0,
        plausible=(0.01, 3),
    )
    wheel_load_share: float = parameter(
        0.53, "", "share k of the suction force that the wheels carry", at_least=0, at_most=1
    )
    suction_pressure: float = parameter(
        2500.0, "Pa", "pressure difference P", at_least=0, runtime=True, plausible=(1000, 1e5)
    )
    suction_area: float = parameter(
        0.06, "m²", "effective suction area S", at_least=0, plausible=(1e-4, 1)
    )
    inclination: float = parameter(
        90.0,
        "deg",
        "of the wall: 0 floor, 90 vertical, 180 ceiling",
        at_least=0,
        at_most=180,
        plausible=(3.2, 180),
    )
    max_wheel_torque: float = parameter(
        20.0, "N m", "limit of each wheel's torque", above=0, plausible=(0.02, 300)
    )
    no_load_wheel_rate: float = parameter(
        0.0,
        "rad/s",
        "wheel rate at which a motor has no torque left; 0: none falls",
        at_least=0,
        plausible=(1, 1000),
    )

    def __post_init__(self) -> None:
        check(self)

    @cached_property
    def mass_matrix(self) -> Array:
        """M = diag(m, m, J), (3, 3)."""
        return np.diag([self.mass, self.mass, self.yaw_inertia])

    @cached_property
    def seal_friction(self) -> float:
        """Sliding friction of the seal f = (1 - k) μ P S [N]."""
        suction_force = self.suction_pressure * self.suction_area
        return (1 - self.wheel_load_share) * self.seal_friction_coefficient * suction_force

    @cached_property
    def weight_along_wall(self) -> float:
        """m g_t, the part of the weight that pulls along -y [N]."""
        weight: float = self.mass * GRAVITY * sin(self.inclination * DEGREE)
        return weight

    @cached_property
    def gravity_into_wall(self) -> float:
        """g_n of a flat wall, below 0 where it pulls the climber off [m/s²]."""
        gravity: float = GRAVITY * cos(self.inclination * DEGREE)
        return gravity

    @cached_property
    def inertial(self) -> tuple[float, float, float, float]:
        """m [kg], J [kg m²], f [N] and m g_t [N]: all that a motion asks for, in one."""
        return self.mass, self.yaw_inertia, self.seal_friction, self.weight_along_wall

    @cached_property
    def leverage(self) -> tuple[float, float]:
        """Mean of the wheels' torques by drive r/2 [m], and half their difference by turn r/2d."""
        return self.wheel_radius / 2, self.wheel_radius / 2 / self.half_track

    def applied_force(self, heading: Array, direction: Array | float) -> Array:
        """Q without the motors: seal friction against the motion, and gravity, (..., 3) [N, N m].

        `direction` (...) is 1 forwards, -1 backwards, 0 where no friction acts.
        """
        friction, weight = -self.seal_friction * direction, self.weight_along_wall
        return pack(friction * cos(heading), friction * sin(heading) - weight, 0 * heading)

    def wheel_force(self, heading: Array, torques: Array) -> Array:
        """E(θ) τ: what the wheel torques (right, left) do to the climber, (..., 3) [N, N m]."""
        drive, turn = self.drive_and_turn(torques)
        return pack(drive * cos(heading), drive * sin(heading), turn)

    def drive_and_turn(self, torques: Array) -> tuple[Array, Array]:
        """Force along the climber (τR + τL)/r [N] and moment about it d (τR - τL)/r [N m]."""
        return motion.wrench_of_torques(self, *unpack(torques))

    def wheel_torques(self, drive: Array, turn: Array) -> Array:
        """τR, τL = r (F ± N/d) / 2 of the drive force F and the moment N, (..., 2) [N m]."""
        return pack(*motion.torques(self, drive, turn))

    def wheel_rates(self, state: State) -> Array:
        """Turning rates (v ± d ω) / r of the wheels (right, left), (..., 2) [rad/s]."""
        return pack(*motion.wheel_rates(self, state.motion))

    def torque_bounds(self, state: State) -> tuple[Bounds, Bounds]:
        """Lowest and highest torque [N m] of the right wheel, and of the left one, each (...)."""
        return motion.torque_bounds(self, state.motion)

    def rolling_acceleration(self, state: State, torques: Array, direction: Array | float) -> Array:
        """q̈ of the climber that rolls without side slip under `torques`, (..., 3).

        (10) with the no-slip row A in closed form: A has unit length and M weighs x and y alike,
        so that the wheels' reaction takes just the lateral part away. Left are (11) and (15).
        """
        heading, v, omega = state.heading, state.forward_speed, state.yaw_rate
        drive, turn = self.drive_and_turn(torques)
        cosine, sine = cos(heading), sin(heading)
        force = drive - self.seal_friction * direction - self.weight_along_wall * sine
        v_1 = force / self.mass
        return pack(
            v_1 * cosine - v * omega * sine,
            v_1 * sine + v * omega * cosine,
            turn / self.yaw_inertia,
        )


def along(heading: Array, vector: Array) -> Array:
    """Forward component, (...), of a vector (..., 2 or 3) given in the wall's frame."""
    x, y, *_ = unpack(vector)
    return x * cos(heading) + y * sin(heading)


def across(heading: Array, vector: Array) -> Array:
    """Component to the left, (...), of a vector (..., 2 or 3) given in the wall's frame."""
    x, y, *_ = unpack(vector)
    return y * cos(heading) - x * sin(heading)


def no_slip(state: State) -> tuple[Array, Array]:
    """Row A = [sinθ -cosθ 0] (..., 3) and b = -ω (ẋ cosθ + ẏ sinθ) (...) of (18)."""
    heading = state.heading
    row = pack(sin(heading), -cos(heading), 0 * heading)
    return row, -state.yaw_rate * state.forward_speed
