"""The wheeled suction climber as M q̈ = Q + E(θ) τ under the no-slip row (11), (15), (17).

q = (x, y, θ): the centre of mass in a frame fixed to the wall, x horizontal, y up, θ anticlockwise
from x. Arrays (..., 3) for q and its derivatives, (..., 2) for wheel torques (right, left). What
takes a `Motion` or single torques works on components: floats, or arrays (N,) of many climbers.
"""

import math
from functools import cached_property
from typing import Any

import numpy as np

from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.elementary import clipped, cos, everywhere, select, sin
from climber_uk.mechanics.quantities import Bounds, Motion, Speeds, State, Torques
from climber_uk.parameters.declaration import parameter, parameters

GRAVITY = 9.81  # [m/s²]
DEGREE = math.pi / 180  # [rad]
MEASURED_PRESSURE = 5.0  # at most, by `suction_pressure`: an absolute pressure is beyond


def most_pressure(suction_pressure: float) -> float:
    """Largest measured pressure difference [Pa] that is believed beside `suction_pressure` [Pa]."""
    return MEASURED_PRESSURE * suction_pressure or math.inf


@parameters
class Climber:
    """Parameters of a two-wheel suction climber; the defaults are the paper's.

    Where a value is wrong: too low a mass, inertia or friction, or too small a wheel, gives too
    little torque, until the observer has learnt the rest; too high a pressure promises margins
    that are not there; above the motors' true limit, torques are cut instead of saturated.
    Raises `ValueError` naming field, value and bound.
    """

    mass: float = parameter(
        5.0, "kg", "mass m; too low: torques are too small", above=0, plausible=(0.1, 300)
    )
    yaw_inertia: float = parameter(
        0.33, "kg m²", "inertia J about the centre of mass", above=0, plausible=(1e-4, 100)
    )
    rotor_inertia: float = parameter(
        0.0,
        "kg m²",
        "inertia of a side's rotors at its wheels (gear ratio squared), not in mass and "
        "yaw_inertia",
        at_least=0,
        plausible=(1e-8, 10),
    )
    wheel_radius: float = parameter(
        0.027, "m", "wheel radius r; too large: so are the torques", above=0, plausible=(0.005, 0.5)
    )
    half_track: float = parameter(
        0.3, "m", "distance d of a wheel from the centre", above=0, plausible=(0.02, 2)
    )
    seal_friction_coefficient: float = parameter(
        0.8,
        "",
        "friction coefficient μ of the seal on the wall; too high: it starts with a jerk",
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
        0.06, "m²", "area S the pressure difference acts on", at_least=0, plausible=(1e-4, 1)
    )
    inclination: float = parameter(
        90.0,
        "deg",
        "inclination of the wall: 0 floor, 90 vertical, 180 ceiling",
        at_least=0,
        at_most=180,
        plausible=(3.2, 180),
    )
    max_wheel_torque: float = parameter(
        20.0, "N m", "limit of each wheel's torque, either way", above=0, plausible=(0.02, 300)
    )
    no_load_wheel_rate: float = parameter(
        0.0,
        "rad/s",
        "wheel rate at which a motor has no torque left; 0: torque does not fall with the rate",
        at_least=0,
        plausible=(1, 1000),
    )

    @cached_property
    def mass_matrix(self) -> Array:
        """M = diag(m, m, J), (3, 3), of a climber without rotors, as the paper's."""
        return np.diag([self.mass, self.mass, self.yaw_inertia])

    def mass_matrix_at(self, heading: Array) -> Array:
        """M (..., 3, 3) with the rotors, which turn as it goes along its heading, not across."""
        M = np.zeros((*np.shape(heading), 3, 3)) + np.diag([self.mass, self.mass, 0.0])
        rims, (c, s) = self.driven_mass - self.mass, (cos(heading), sin(heading))
        M[..., 0, 0] += rims * c * c
        M[..., 1, 1] += rims * s * s
        M[..., 0, 1] = M[..., 1, 0] = rims * c * s
        M[..., 2, 2] = self.driven_inertia
        return M

    @cached_property
    def driven_mass(self) -> float:
        """m + 2 I/r², with the rotors that turn as it drives [kg]."""
        return self.mass + 2 * self.rotor_inertia / self.wheel_radius**2

    @cached_property
    def driven_inertia(self) -> float:
        """J + 2 I d²/r², with the rotors that turn as it yaws [kg m²]."""
        return (
            self.yaw_inertia + 2 * self.rotor_inertia * (self.half_track / self.wheel_radius) ** 2
        )

    @cached_property
    def seal_friction(self) -> float:
        """Sliding friction of the seal f = (1 - k) μ P S [N]."""
        suction_force = self.suction_pressure * self.suction_area
        return (1 - self.wheel_load_share) * self.seal_friction_coefficient * suction_force

    @cached_property
    def weight_along_wall(self) -> float:
        """m g_t, the part of the weight that pulls along -y [N]."""
        return self.mass * GRAVITY * sin(self.inclination * DEGREE)

    @property
    def falls(self) -> bool:
        """Whether its weight is more than its seal holds: it does not come to rest by itself."""
        return self.seal_friction < self.weight_along_wall

    @cached_property
    def gravity_into_wall(self) -> float:
        """g_n of a flat wall, below 0 where it pulls the climber off [m/s²]."""
        return GRAVITY * cos(self.inclination * DEGREE)

    @cached_property
    def inertial(self) -> tuple[float, float, float, float]:
        """m + 2 I/r² [kg], J + 2 I d²/r² [kg m²], f [N] and m g_t [N]: of (11) and (15)."""
        return self.driven_mass, self.driven_inertia, self.seal_friction, self.weight_along_wall

    def lateral_reaction(self, motion: Motion) -> Any:
        """What the wheels take to the left [N]: m v ω + w cosθ."""
        turned = self.mass * motion.speed * motion.yaw_rate
        return turned + self.weight_along_wall * motion.cosine

    @cached_property
    def leverage(self) -> tuple[float, float]:
        """r/2 [m] and r/2d: mean torque per drive force, half the difference per yaw moment."""
        return self.wheel_radius / 2, self.wheel_radius / 2 / self.half_track

    def applied_force(self, heading: Array, direction: Array | float) -> Array:
        """Q without the motors: seal friction against the motion, and gravity, (..., 3) [N, N m].

        `direction` (...) is 1 forwards, -1 backwards, 0 where no friction acts.
        """
        friction, weight = -self.seal_friction * direction, self.weight_along_wall
        return pack(friction * cos(heading), friction * sin(heading) - weight, 0 * heading)

    def wrench(self, right: Any, left: Any) -> tuple[Any, Any]:
        """Drive force (τR + τL)/r [N] and yaw moment d (τR - τL)/r [N m] of two torques [N m]."""
        radius = self.wheel_radius
        return (right + left) / radius, self.half_track * (right - left) / radius

    def torques(self, force: Any, moment: Any) -> Torques:
        """τR, τL = r (F ± N/d) / 2 [N m] of drive force F [N] and yaw moment N [N m]."""
        half = self.wheel_radius / 2
        from_force, from_moment = half * force, half * moment / self.half_track
        return Torques(from_force + from_moment, from_force - from_moment)

    def rim_rates(self, motion: Motion | Speeds) -> tuple[Any, Any]:
        """Turning rates (v ± d ω) / r of the wheels, right and left [rad/s]."""
        v, differential = motion.speed, self.half_track * motion.yaw_rate
        return (v + differential) / self.wheel_radius, (v - differential) / self.wheel_radius

    def bounds(self, motion: Motion) -> tuple[Bounds, Bounds]:
        """Lowest and highest torque [N m] of the right wheel, and of the left one.

        That of a DC motor falls in a straight line with the rate at which it drives its wheel, and
        not with the rate at which it brakes it.
        """
        limit, no_load = self.max_wheel_torque, self.no_load_wheel_rate
        if everywhere(no_load == 0):
            return (-limit, limit), (-limit, limit)
        no_load = select(no_load == 0, float("inf"), no_load)
        right, left = self.rim_rates(motion)
        return _dc_motor_bounds(limit, right / no_load), _dc_motor_bounds(limit, left / no_load)

    def saturate(
        self, force: Any, moment: Any, right: Bounds, left: Bounds
    ) -> tuple[Any, Any, Any, Any, bool]:
        """Saturate the wheel torques at their bounds [N m]; the moment is served first.

        Returns force [N] and moment [N m] that are left, the torques of the right and of the left
        wheel [N m] that give them, and whether no bound acts (on any of many climbers).
        """
        (right_low, right_high), (left_low, left_high) = right, left
        to_mean, to_twist = self.leverage
        mean, twist = to_mean * force, to_twist * moment  # τR,L = mean ± twist
        tau_r, tau_l = mean + twist, mean - twist
        fits = (right_low <= tau_r) & (tau_r <= right_high)
        fits = fits & (left_low <= tau_l) & (tau_l <= left_high)
        if fits is True or everywhere(fits):
            return force, moment, tau_r, tau_l, True
        twist = clipped(twist, (right_low - left_high) / 2, (right_high - left_low) / 2)
        lowest, highest = right_low - twist, right_high - twist
        lowest = lowest + clipped(left_low + twist - lowest, 0.0, float("inf"))
        highest = highest - clipped(highest - (left_high + twist), 0.0, float("inf"))
        mean = clipped(mean, lowest, highest)
        # once more, as sums are rounded: no torque is beyond its bound by as little as that
        return (
            select(fits, force, mean / to_mean),
            select(fits, moment, twist / to_twist),
            select(fits, tau_r, clipped(mean + twist, right_low, right_high)),
            select(fits, tau_l, clipped(mean - twist, left_low, left_high)),
            False,
        )

    def force_and_moment(self, torques: Array) -> tuple[Array, Array]:
        """Drive force (...) [N] and yaw moment (...) [N m] of torques (..., 2): see `wrench`."""
        return self.wrench(*unpack(torques))

    def wheel_torques(self, force: Array, moment: Array) -> Array:
        """Torques (right, left) (..., 2) [N m] of force and moment (...): see `torques`."""
        return pack(*self.torques(force, moment))

    def wheel_rates(self, state: State) -> Array:
        """Turning rates (v ± d ω) / r of the wheels (right, left), (..., 2) [rad/s]."""
        return pack(*self.rim_rates(state.motion))

    def rolling_acceleration(self, state: State, torques: Array, direction: Array | float) -> Array:
        """q̈ of the climber that rolls without side slip under `torques`, (..., 3).

        (10) with the no-slip row A in closed form: A has unit length and M weighs x and y alike,
        so that the wheels' reaction takes just the lateral part away. Left are (11) and (15).
        """
        heading, v, omega = state.heading, state.forward_speed, state.yaw_rate
        force, moment = self.force_and_moment(torques)
        cosine, sine = cos(heading), sin(heading)
        force = force - self.seal_friction * direction - self.weight_along_wall * sine
        v_1 = force / self.driven_mass
        return pack(
            v_1 * cosine - v * omega * sine,
            v_1 * sine + v * omega * cosine,
            moment / self.driven_inertia,
        )


def no_slip(state: State) -> tuple[Array, Array]:
    """Row A = [sinθ -cosθ 0] (..., 3) and b = -ω (ẋ cosθ + ẏ sinθ) (...) of (18)."""
    heading = state.heading
    row = pack(sin(heading), -cos(heading), 0 * heading)
    return row, -state.yaw_rate * state.forward_speed


def _dc_motor_bounds(limit: Any, rate: Any) -> Bounds:
    """Torques [N m] between which a motor can act; `rate` is its own by the no-load rate."""
    return -limit * clipped(1 + rate, 0.0, 1.0), limit * clipped(1 - rate, 0.0, 1.0)
