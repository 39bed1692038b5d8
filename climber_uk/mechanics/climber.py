"""The wheeled suction climber as M q̈ = Q + E(θ) τ under the no-slip row (11), (15), (17).

q = (x, y, θ): the centre of mass in a frame fixed to the wall, x horizontal, y up, θ anticlockwise
from x. Arrays (..., 3) for q and its derivatives, (..., 2) for wheel torques (right, left).
"""

import math
from functools import cached_property
from typing import Any

import numpy as np

from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.elementary import clipped, cos, everywhere, select, sin
from climber_uk.mechanics.quantities import Bounds, Motion, State, Torques
from climber_uk.parameters.declaration import parameter, parameters

GRAVITY = 9.81  # [m/s²]
DEGREE = math.pi / 180  # [rad]


@parameters
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

    def lateral_reaction(self, motion: Motion) -> Any:
        """What the wheels take to the left [N]: m v ω + w cosθ."""
        mass, _, _, weight = self.inertial
        return mass * motion.speed * motion.yaw_rate + weight * motion.cosine

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

    def wrench(self, right: Any, left: Any) -> tuple[Any, Any]:
        """Force along the climber (τR + τL)/r [N] and moment about it d (τR - τL)/r [N m]."""
        radius = self.wheel_radius
        return (right + left) / radius, self.half_track * (right - left) / radius

    def torques(self, drive: Any, turn: Any) -> Torques:
        """τR, τL = r (F ± N/d) / 2 of the drive force F and the moment N."""
        half = self.wheel_radius / 2
        half_drive, half_turn = half * drive, half * turn / self.half_track
        return Torques(half_drive + half_turn, half_drive - half_turn)

    def rim_rates(self, motion: Motion) -> tuple[Any, Any]:
        """Turning rates (v ± d ω) / r of the wheels, right and left [rad/s]."""
        v, turning = motion.speed, self.half_track * motion.yaw_rate
        return (v + turning) / self.wheel_radius, (v - turning) / self.wheel_radius

    def bounds(self, motion: Motion) -> tuple[Bounds, Bounds]:
        """Lowest and highest torque of the right wheel, and of the left one.

        That of a DC motor falls in a straight line with the rate at which it drives its wheel, and
        not with the rate at which it brakes it.
        """
        limit, no_load = self.max_wheel_torque, self.no_load_wheel_rate
        if everywhere(no_load == 0):
            return (-limit, limit), (-limit, limit)
        no_load = select(no_load == 0, float("inf"), no_load)
        right, left = self.rim_rates(motion)
        return _bounds(limit, right / no_load), _bounds(limit, left / no_load)

    def saturate(
        self, drive: Any, turn: Any, right: Bounds, left: Bounds
    ) -> tuple[Any, Any, Any, Any]:
        """What wheels within their bounds can do of drive and turn, the turn served first.

        Returns drive and turn, the very same ones if they fit, and the torques of the right wheel
        and of the left one that do it.
        """
        (right_low, right_high), (left_low, left_high) = right, left
        to_mean, to_twist = self.leverage
        mean, twist = to_mean * drive, to_twist * turn  # τR,L = mean ± twist
        one, other = mean + twist, mean - twist
        fits = (right_low <= one) & (one <= right_high) & (left_low <= other) & (other <= left_high)
        if fits is True or everywhere(fits):
            return drive, turn, one, other
        twist = clipped(twist, (right_low - left_high) / 2, (right_high - left_low) / 2)
        lowest, highest = right_low - twist, right_high - twist
        lowest = lowest + clipped(left_low + twist - lowest, 0.0, float("inf"))
        highest = highest - clipped(highest - (left_high + twist), 0.0, float("inf"))
        mean = clipped(mean, lowest, highest)
        # once more, as sums are rounded: no torque is beyond its bound by as little as that
        return (
            select(fits, drive, mean / to_mean),
            select(fits, turn, twist / to_twist),
            select(fits, one, clipped(mean + twist, right_low, right_high)),
            select(fits, other, clipped(mean - twist, left_low, left_high)),
        )

    def drive_and_turn(self, torques: Array) -> tuple[Array, Array]:
        """Force along the climber (τR + τL)/r [N] and moment about it d (τR - τL)/r [N m]."""
        return self.wrench(*unpack(torques))

    def wheel_torques(self, drive: Array, turn: Array) -> Array:
        """τR, τL = r (F ± N/d) / 2 of the drive force F and the moment N, (..., 2) [N m]."""
        return pack(*self.torques(drive, turn))

    def wheel_rates(self, state: State) -> Array:
        """Turning rates (v ± d ω) / r of the wheels (right, left), (..., 2) [rad/s]."""
        return pack(*self.rim_rates(state.motion))

    def torque_bounds(self, state: State) -> tuple[Bounds, Bounds]:
        """Lowest and highest torque [N m] of the right wheel, and of the left one, each (...)."""
        return self.bounds(state.motion)

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


def no_slip(state: State) -> tuple[Array, Array]:
    """Row A = [sinθ -cosθ 0] (..., 3) and b = -ω (ẋ cosθ + ẏ sinθ) (...) of (18)."""
    heading = state.heading
    row = pack(sin(heading), -cos(heading), 0 * heading)
    return row, -state.yaw_rate * state.forward_speed


def _bounds(limit: Any, part: Any) -> Bounds:
    return -limit * clipped(1 + part, 0.0, 1.0), limit * clipped(1 - part, 0.0, 1.0)
