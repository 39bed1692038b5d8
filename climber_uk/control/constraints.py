"""The reference as a constraint on the climber: the accelerations with which it is met.

A constraint set says what forward acceleration v̇ and yaw acceleration θ̈ it demands. As rows of
A q̈ = b these are [cosθ sinθ 0] q̈ = v̇ and [0 0 1] q̈ = θ̈; the wheels' no-slip row is the third.
A new set is one class with `demand` and `speed`, and one entry in `CONSTRAINTS`.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.climber import State, across, along, no_slip
from climber_uk.mechanics.elementary import arctan, cos, select, sign, sin, sqrt, tanh, wrapped
from climber_uk.mechanics.parameter import check, parameter
from climber_uk.mechanics.trajectory import Reference

REST_SPEED = 1e-3  # [m/s] below which a heading cannot be told from the way a climber moves


class ConstraintSet(Protocol):
    """What makes the climber follow a reference, with gains as fields."""

    def demand(self, state: State, reference: Reference) -> tuple[Array, Array]:
        """v̇ [m/s²] and θ̈ [rad/s²], each (...)."""

    def speed(self, state: State, reference: Reference) -> Array:
        """Forward speed asked for (...) [m/s]; its sign is the way friction will be met."""


def rows(state: State, demand: tuple[Array, Array]) -> tuple[Array, Array]:
    """A (..., 3, 3) and b (..., 3) of a demand and of no-slip (18); A is orthonormal."""
    slip_row, slip_b = no_slip(state)
    sine, minus_cosine, zero = unpack(slip_row)
    A = np.stack([pack(-minus_cosine, sine, zero), pack(zero, zero, zero + 1), slip_row], axis=-2)
    return A, pack(*demand, slip_b)


def tracking_error(pose: Array, reference: Reference) -> tuple[Array, Array, Array]:
    """Actual minus desired pose along-track [m], cross-track [m] and in heading [rad], each (...).

    Along and across are those of the reference's heading; the heading error is in [-π, π).
    """
    heading, offset = reference.heading, pose - reference.pose
    return along(heading, offset), across(heading, offset), wrapped(unpack(offset)[2])


@dataclass(frozen=True)
class Guidance:
    """Speed and heading that lead back to the reference; never singular, and so good at rest.

    v = v_d - L tanh(k_x e_x / L), first order with rate λ;  ψ = θ - θ_d + atan(g e_y) to 0 by
    ψ̇ = -R tanh(ω_n ψ / R), that with rate ω_n: critically damped, and never faster than R;
    g = k_y v_d / √(v_d² + v_s²) fades where steering cannot help and changes sign in reverse gear.
    With the no-slip row, A is orthonormal.

    L = v_s/2 + v_c |v_d| / √(v_d² + v_s²) bounds what is added to the speed of who is behind, and
    L = √(v_d² + v_s²/4) what is taken from who is ahead: he waits, for driving backwards he would
    steer away.
    """

    along_track_gain: float = parameter(5.0, "1/s", "k_x", above=0, runtime=True)
    cross_track_gain: float = parameter(1.0, "1/m", "k_y", at_least=0, runtime=True)
    speed_rate: float = parameter(10.0, "1/s", "λ of the speed", above=0, runtime=True)
    heading_frequency: float = parameter(12.0, "rad/s", "ω_n of the heading", above=0, runtime=True)
    fade_speed: float = parameter(1.0, "m/s", "v_s, below which k_y fades", above=0, runtime=True)
    catch_up_speed: float = parameter(
        2.0, "m/s", "v_c, most that is added to the reference's speed", above=0, runtime=True
    )
    turn_rate: float = parameter(
        4.0, "rad/s", "R, fastest turn back to the heading wanted", above=0, runtime=True
    )

    def __post_init__(self) -> None:
        check(self)

    def speed(self, state: State, reference: Reference) -> Array:
        """See `ConstraintSet`."""
        e_x, _, _ = tracking_error(state.pose, reference)
        return self._speed(reference, e_x, 0 * e_x)[0]

    def demand(self, state: State, reference: Reference) -> tuple[Array, Array]:
        """See `ConstraintSet`."""
        v, omega, v_d = state.forward_speed, state.yaw_rate, reference.speed
        omega_d, omega_d1 = reference.yaw_rate, unpack(reference.acceleration)[2]

        e_x, e_y, turned = tracking_error(state.pose, reference)
        cosine, sine = cos(turned), sin(turned)
        e_x1 = v * cosine - v_d + omega_d * e_y
        e_y1 = v * sine - omega_d * e_x

        wanted, wanted_1 = self._speed(reference, e_x, e_x1)
        v_1 = wanted_1 - self.speed_rate * (v - wanted)

        e_y2 = v_1 * sine + v * cosine * (omega - omega_d) - omega_d1 * e_x - omega_d * e_x1
        g, g_1, g_2 = self._steering_gain(reference)
        w = g * e_y
        w_1 = g_1 * e_y + g * e_y1
        w_2 = g_2 * e_y + 2 * g_1 * e_y1 + g * e_y2
        slope = 1 / (1 + w**2)
        led = turned + arctan(w)  # ψ, heading minus the one that leads back
        led_1 = omega - omega_d + slope * w_1
        led_2 = slope * w_2 - 2 * w * (slope * w_1) ** 2

        omega_n, most = self.heading_frequency, self.turn_rate
        part = tanh(omega_n * led / most)
        turning_back = led_1 + most * part  # 0 when it turns back as fast as it should
        return v_1, omega_d1 - led_2 - omega_n * ((1 - part**2) * led_1 + turning_back)

    def _speed(self, reference: Reference, e_x: Array, e_x1: Array) -> tuple[Array, Array]:
        """Speed that leads back along the track, and its rate."""
        v_d, v_d1 = reference.speed, reference.speed_rate
        waiting = sqrt(v_d**2 + self.fade_speed**2 / 4)
        root = sqrt(v_d**2 + self.fade_speed**2)
        hurrying = self.fade_speed / 2 + self.catch_up_speed * abs(v_d) / root
        hurrying_1 = self.catch_up_speed * sign(v_d) * self.fade_speed**2 / root**3 * v_d1
        is_ahead = e_x * v_d > 0
        most = select(is_ahead, waiting, hurrying)
        most_1 = select(is_ahead, v_d * v_d1 / waiting, hurrying_1)
        u = self.along_track_gain * e_x / most
        part = tanh(u)
        inside = 1 - part**2
        back_1 = self.along_track_gain * inside * e_x1 + (part - u * inside) * most_1
        return v_d - most * part, v_d1 - back_1

    def _steering_gain(self, reference: Reference) -> tuple[Array, Array, Array]:
        """g = k_y v_d / √(v_d² + v_s²) and its first two derivatives by time."""
        v, v_1, v_2 = reference.speed, reference.speed_rate, reference.speed_second_rate
        square = self.fade_speed**2
        root = sqrt(v**2 + square)
        slope = square / root**3
        curvature = -3 * v * slope / root**2
        k_y = self.cross_track_gain
        return k_y * v / root, k_y * slope * v_1, k_y * (curvature * v_1**2 + slope * v_2)


@dataclass(frozen=True)
class Exact:
    """The path itself: p̈ = u = p̈_d + K_d (ṗ_d - ṗ) + K_p (p_d - p), and what it hides.

    With no-slip, p̈ = u leaves θ̈ open but binds the velocity: φ = v ω - n·u = 0. Differentiated,
    with a decay, it is the third row: v θ̈ = -v̇ ω + d/dt(n·u) - λ φ. Singular at rest, where θ̈
    is left at 0, and violent near it: for references that never slow down.
    """

    natural_frequency: float = parameter(
        5.0, "rad/s", "ω_n: K_p = ω_n², K_d = 2 ω_n", above=0, runtime=True
    )
    hidden_rate: float = parameter(10.0, "1/s", "λ, decay of φ", above=0, runtime=True)

    def __post_init__(self) -> None:
        check(self)

    def speed(self, state: State, reference: Reference) -> Array:
        """See `ConstraintSet`."""
        return reference.speed

    def demand(self, state: State, reference: Reference) -> tuple[Array, Array]:
        """See `ConstraintSet`."""
        heading, v, omega = state.heading, state.forward_speed, state.yaw_rate
        K_d, K_p = 2 * self.natural_frequency, self.natural_frequency**2
        e = (reference.pose - state.pose)[..., :2]
        e_1 = (reference.velocity - state.velocity)[..., :2]
        p_d2 = reference.acceleration[..., :2]
        u = p_d2 + K_d * e_1 + K_p * e

        # what p̈ will be: u along the heading, and the centripetal v ω across it
        v_1, centripetal = along(heading, u), v * omega
        cosine, sine = cos(heading), sin(heading)
        p_2 = pack(v_1 * cosine - centripetal * sine, v_1 * sine + centripetal * cosine)
        u_1 = reference.jerk + K_d * (p_d2 - p_2) + K_p * e_1

        phi = centripetal - across(heading, u)
        turning = -2 * v_1 * omega + across(heading, u_1) - self.hidden_rate * phi
        at_rest = abs(v) < REST_SPEED
        return v_1, select(at_rest, 0.0, turning / select(at_rest, 1.0, v))


CONSTRAINTS: dict[str, type[Guidance] | type[Exact]] = {"guidance": Guidance, "exact": Exact}
