"""The constraint set `guidance`: a speed and a heading that lead back to the reference.

v = v_d - L tanh(k_x e_x / L),   ψ = θ - θ_d + atan(g e_y),   g = k_y v_d / √(v_d² + v_s²)
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from climber_uk.mechanics.elementary import arctan, cos, either, select, sin, sqrt, tanh, wrapped
from climber_uk.mechanics.quantities import DesiredAcceleration, Motion, ReferencePoint
from climber_uk.parameters.declaration import check, parameter


class PreparedTarget(NamedTuple):
    """A target as `Guidance` sees it: along its heading, and what it allows and wants there."""

    x: Any
    y: Any
    heading: Any
    cosine: Any
    sine: Any
    speed: Any  # v_d [m/s]
    acceleration: Any  # v̇_d [m/s²]
    yaw_rate: Any  # ω_d [rad/s]
    yaw_acceleration: Any
    slow_down_limit: tuple[Any, Any]  # L ahead of the reference [m/s], and its rate
    catch_up_limit: tuple[Any, Any]  # L behind it
    turn_rate: tuple[Any, Any]  # R [rad/s], and its rate
    gain: tuple[Any, Any, Any]  # g [1/m] and its first two derivatives by time


@dataclass(frozen=True, slots=True)
class Guidance:
    """Speed and heading that lead back to the reference; never singular, and so good at rest.

    v = v_d - L tanh(k_x e_x / L), first order with rate λ;  ψ = θ - θ_d + atan(g e_y) to 0 by
    ψ̇ = -R tanh(ω_n ψ / R), that with rate ω_n: critically damped, and never faster than R;
    g = k_y v_d / √(v_d² + v_s²) fades where steering cannot help and changes sign in reverse gear.
    With the no-slip row, A is orthonormal.

    L bounds how much the speed differs from the reference's. Behind it, L = √(v_s²/4 + (c v_d)²),
    where c v_d is at most v_c. Ahead of it, L = √(v_d² + v_s²/4): a climber slows down and waits
    for its reference, for driving backwards it would steer away. R = √(v_d² + v_s²) / ρ, at most
    `turn_rate`.
    """

    along_track_gain: float = parameter(5.0, "1/s", "k_x", above=0, runtime=True)
    cross_track_gain: float = parameter(1.0, "1/m", "k_y", at_least=0, runtime=True)
    speed_rate: float = parameter(10.0, "1/s", "λ of the speed", above=0, runtime=True)
    heading_frequency: float = parameter(12.0, "rad/s", "ω_n of the heading", above=0, runtime=True)
    fade_speed: float = parameter(1.0, "m/s", "v_s, below which k_y fades", above=0, runtime=True)
    catch_up_share: float = parameter(
        0.25, "", "c, share of its speed that is added behind the reference", above=0, runtime=True
    )
    catch_up_speed: float = parameter(
        2.0, "m/s", "v_c, most that this share adds to the reference's speed", above=0, runtime=True
    )
    turn_radius: float = parameter(
        0.3, "m", "ρ, of the turn back to the heading wanted", above=0, runtime=True
    )
    turn_rate: float = parameter(
        4.0, "rad/s", "fastest turn back to the heading wanted", above=0, runtime=True
    )

    def __post_init__(self) -> None:
        check(self)

    def fastest(self, speed: float, yaw_rate: float) -> tuple[float, float]:
        """See `ConstraintSet`; steering along atan(g e_y) turns by g v at most."""
        v_s = self.fade_speed
        hurry = math.hypot(v_s / 2, min(self.catch_up_share * speed, self.catch_up_speed))
        root = math.hypot(speed, v_s)
        steering = self.cross_track_gain * speed / root * (speed + hurry)
        turning = min(root / self.turn_radius, self.turn_rate)
        return speed + hurry, yaw_rate + turning + steering

    def prepare(self, target: ReferencePoint) -> PreparedTarget:
        """Target along its heading, with the speeds and the steering that the gains allow there."""
        x, y, heading, v_x, v_y, omega, a_x, a_y, omega_1, j_x, j_y = target
        cosine, sine = cos(heading), sin(heading)
        v, v_1 = v_x * cosine + v_y * sine, a_x * cosine + a_y * sine
        v_2 = j_x * cosine + j_y * sine + omega * omega * v

        v_s, k_y, c = self.fade_speed, self.cross_track_gain, self.catch_up_share
        v_s2, v2 = v_s * v_s, v * v
        root2 = v2 + v_s2
        root = sqrt(root2)
        share, slope = v / root, v_s2 / (root * root2)  # v/root, and its slope by v
        share_1 = slope * v_1
        share_2 = slope * v_2 - 3.0 * share_1 * v * v_1 / root2
        wait = sqrt(v2 + 0.25 * v_s2)
        waiting = wait, v * v_1 / wait
        is_shared = c * abs(v) < self.catch_up_speed  # the ceiling of what is added is not reached
        hurry = sqrt(0.25 * v_s2 + select(is_shared, c * c * v2, self.catch_up_speed**2))
        hurrying = hurry, select(is_shared, c * c * v * v_1 / hurry, 0.0)
        turn = root / self.turn_radius
        is_slower = turn < self.turn_rate
        turn_rate = (
            select(is_slower, turn, self.turn_rate),
            select(is_slower, v * v_1 / (root * self.turn_radius), 0.0),
        )
        gain = k_y * share, k_y * share_1, k_y * share_2
        return PreparedTarget(
            x=x,
            y=y,
            heading=heading,
            cosine=cosine,
            sine=sine,
            speed=v,
            acceleration=v_1,
            yaw_rate=omega,
            yaw_acceleration=omega_1,
            slow_down_limit=waiting,
            catch_up_limit=hurrying,
            turn_rate=turn_rate,
            gain=gain,
        )

    def desired_acceleration(self, prepared: PreparedTarget, motion: Motion) -> DesiredAcceleration:
        """Speed and heading that lead back, and the accelerations with which they are reached."""
        x, y, heading, cosine, sine, v, omega = motion
        x_d, y_d, heading_d, cosine_d, sine_d, v_d, v_d1, omega_d, omega_d1, *others = prepared
        waiting, hurrying, (fastest, fastest_1), gain = others
        offset_x, offset_y, turned = x - x_d, y - y_d, wrapped(heading - heading_d)
        e_x, e_y = offset_x * cosine_d + offset_y * sine_d, offset_y * cosine_d - offset_x * sine_d
        v_x = v * (cosine * cosine_d + sine * sine_d)
        sine_e = sine * cosine_d - cosine * sine_d
        v_y = v * sine_e
        turning = omega - omega_d
        e_x1, e_y1 = v_x - v_d + omega_d * e_y, v_y - omega_d * e_x

        is_ahead = e_x * v_d > 0.0
        most, most_1 = either(is_ahead, waiting, hurrying)
        k_x = self.along_track_gain
        u = k_x * e_x / most
        part = tanh(u)
        inside = 1.0 - part * part
        wanted = v_d - most * part
        back_1 = k_x * inside * e_x1 + (part - u * inside) * most_1
        v_1 = v_d1 - back_1 - self.speed_rate * (v - wanted)

        e_y2 = v_1 * sine_e + v_x * turning - omega_d1 * e_x - omega_d * e_x1
        g, g_1, g_2 = gain
        w, w_1 = g * e_y, g_1 * e_y + g * e_y1
        w_2 = g_2 * e_y + 2.0 * g_1 * e_y1 + g * e_y2
        slope = 1.0 / (1.0 + w * w)
        steered_1 = slope * w_1
        led = turned + arctan(w)  # ψ, heading minus the one that leads back
        led_1 = turning + steered_1
        led_2 = slope * w_2 - 2.0 * w * steered_1 * steered_1

        omega_n = self.heading_frequency
        u = omega_n * led / fastest
        part = tanh(u)
        inside = 1.0 - part * part
        turning_back = led_1 + fastest * part  # 0 when it turns back as fast as it should
        theta_2 = omega_d1 - led_2 - omega_n * (inside * led_1 + turning_back)
        theta_2 = theta_2 - fastest_1 * (part - u * inside)
        return DesiredAcceleration(v_1, theta_2, wanted)
