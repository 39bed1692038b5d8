"""The guidance law: v̇ and θ̈ that lead speed and heading back to the reference.

    wanted = v_d - L tanh(k_x e_x / L)                        the speed that leads back
    d/dt (v - wanted) = -λ (v - wanted)                       gives v̇
    ψ = θ - θ_d + atan(g e_y),  g = k_y v_d / √(v_d² + v_s²)  0 for the heading that leads back
    s = ψ̇ + R tanh(ω_n ψ / R),  ṡ = -ω_n s                    gives θ̈

Derived line by line in docs/theory.md, §5; the gains are fields of `Guidance`. A number that ends a
name is a derivative by time: `v_1` is v̇, `e_x1` is ė_x (§1.3). Errors and their rates are in the
reference's frame: along its heading, and to its left. Floats, or arrays (N,) of many climbers.
"""

import math
from typing import Any, NamedTuple

from climber_uk.mechanics.elementary import (
    arctan,
    clipped,
    cos,
    either,
    select,
    sin,
    sqrt,
    tanh,
    wrapped,
)
from climber_uk.mechanics.quantities import DesiredAcceleration, Motion, ReferencePoint
from climber_uk.parameters.declaration import parameter, parameters


class PreparedTarget(NamedTuple):
    """A reference at one time, and all of the law that does not depend on the climber (§5)."""

    x: Any  # [m] in the wall's frame
    y: Any  # [m]
    heading: Any  # θ_d [rad]
    cosine: Any  # of θ_d
    sine: Any
    speed: Any  # v_d along θ_d, below 0 in reverse gear [m/s]
    acceleration: Any  # v̇_d [m/s²]
    yaw_rate: Any  # ω_d [rad/s]
    yaw_acceleration: Any  # ω̇_d [rad/s²]
    slow_down: tuple[Any, Any]  # L, and L̇, of a climber ahead: most by which it slows down [m/s]
    catch_up: tuple[Any, Any]  # L, and L̇, of one behind: most by which it is faster [m/s]
    turn_rate: tuple[Any, Any]  # R [rad/s], and Ṙ
    gain: tuple[Any, Any, Any]  # g [1/m], ġ and g̈


COMES = 2e-3  # [m/s] of a reference, from which on it comes without a doubt


@parameters(slots=True)
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

    def fastest(self, speed: float, yaw_rate: float) -> tuple[float, float]:
        """See `ConstraintSet`; steering along atan(g e_y) turns by g v at most."""
        v_s = self.fade_speed
        hurry = math.hypot(v_s / 2, min(self.catch_up_share * speed, self.catch_up_speed))
        root = math.hypot(speed, v_s)
        steering = self.cross_track_gain * speed / root * (speed + hurry)
        return_rate = min(root / self.turn_radius, self.turn_rate)
        return speed + hurry, yaw_rate + return_rate + steering

    def prepare(self, target: ReferencePoint) -> PreparedTarget:
        """Prepare a reference, given in the wall's frame to the jerk: L, R and g with their rates.

        None of them depends on where the climber is: a controller that computes its answer twice,
        or for many climbers on one reference, prepares it once.
        """
        # here v_x, a_x, j_x are along the wall's x, and v, omega are the reference's v_d and ω_d
        x, y, heading, v_x, v_y, omega, a_x, a_y, omega_1, j_x, j_y = target
        cosine, sine = cos(heading), sin(heading)
        # v_d = t·ṗ_d, and as t turns with ω_d:  v̇_d = t·p̈_d,  v̈_d = t·p⃛_d + ω_d² v_d
        v, v_1 = v_x * cosine + v_y * sine, a_x * cosine + a_y * sine
        v_2 = j_x * cosine + j_y * sine + omega * omega * v

        v_s, k_y, c = self.fade_speed, self.cross_track_gain, self.catch_up_share
        v_s2, v2 = v_s * v_s, v * v
        root2 = v2 + v_s2
        root = sqrt(root2)
        # g = k_y ς(v_d), ς = v/√(v² + v_s²), ς' = v_s²/(v² + v_s²)^(3/2),
        # ς'' = -3 v ς'/(v² + v_s²):  ς̇ = ς' v̇,  ς̈ = ς' v̈ + ς'' v̇²
        fade, slope = v / root, v_s2 / (root * root2)
        fade_1 = slope * v_1
        fade_2 = slope * v_2 - 3.0 * fade_1 * v * v_1 / root2
        # ahead L = √(v_d² + v_s²/4), L̇ = v_d v̇_d / L; behind L = √(v_s²/4 + min(c |v_d|, v_c)²),
        # L̇ = c² v_d v̇_d / L, or 0 at the ceiling v_c
        slow = sqrt(v2 + 0.25 * v_s2)
        slow_down = slow, v * v_1 / slow
        is_below_ceiling = c * abs(v) < self.catch_up_speed
        fast = sqrt(0.25 * v_s2 + select(is_below_ceiling, c * c * v2, self.catch_up_speed**2))
        catch_up = fast, select(is_below_ceiling, c * c * v * v_1 / fast, 0.0)
        # R = min(√(v_d² + v_s²)/ρ, R_max)
        tightest = root / self.turn_radius
        is_slower = tightest < self.turn_rate
        slower = tightest, v * v_1 / (root * self.turn_radius)
        return_rate = either(is_slower, slower, (self.turn_rate, 0.0))
        gain = k_y * fade, k_y * fade_1, k_y * fade_2
        limits = slow_down, catch_up, return_rate
        return PreparedTarget(x, y, heading, cosine, sine, v, v_1, omega, omega_1, *limits, gain)

    def desired_acceleration(self, prepared: PreparedTarget, motion: Motion) -> DesiredAcceleration:
        """v̇ [m/s²] and θ̈ [rad/s²] of a climber in `motion`, and the speed wanted [m/s]."""
        # unpacked by position: this runs twice for each odometry, and attributes would take longer
        x, y, heading, cosine, sine, v, omega = motion
        (x_d, y_d, heading_d, cosine_d, sine_d, v_d, v_d1, omega_d, omega_d1, slow_down, catch_up,
         (R, R_1), (g, g_1, g_2)) = prepared  # fmt: skip
        # errors, actual minus wanted (§5.1); Δ = heading_error:
        #   ė_x = v cosΔ - v_d + ω_d e_y,  ė_y = v sinΔ - ω_d e_x,  Δ̇ = yaw_rate_error = ω - ω_d
        offset_x, offset_y, heading_error = x - x_d, y - y_d, wrapped(heading - heading_d)
        e_x, e_y = offset_x * cosine_d + offset_y * sine_d, offset_y * cosine_d - offset_x * sine_d
        v_along = v * (cosine * cosine_d + sine * sine_d)  # v cosΔ: here along the reference
        sine_e = sine * cosine_d - cosine * sine_d
        v_across = v * sine_e
        yaw_rate_error = omega - omega_d
        e_x1, e_y1 = v_along - v_d + omega_d * e_y, v_across - omega_d * e_x

        # speed (§5.2), with u = k_x e_x / L, so that u̇ = k_x ė_x / L - u L̇ / L:
        #   d/dt (L tanh u) = k_x (1 - tanh² u) ė_x + (tanh u - u (1 - tanh² u)) L̇
        #   v̇ = v̇_d - d/dt (L tanh u) - λ (v - wanted)
        is_ahead = e_x * v_d > 0.0
        limit, limit_1 = either(is_ahead, slow_down, catch_up)
        k_x = self.along_track_gain
        u = k_x * e_x / limit
        tanh_u = tanh(u)
        sech2_u = 1.0 - tanh_u * tanh_u
        wanted = v_d - limit * tanh_u
        back_1 = k_x * sech2_u * e_x1 + (tanh_u - u * sech2_u) * limit_1
        v_1 = v_d1 - back_1 - self.speed_rate * (v - wanted)

        # heading (§5.3), with w = g e_y:
        #   ë_y = v̇ sinΔ + v cosΔ Δ̇ - ω̇_d e_x - ω_d ė_x
        #   d/dt atan w = ẇ / (1 + w²),  d²/dt² atan w = ẅ / (1 + w²) - 2 w (d/dt atan w)²
        e_y2 = v_1 * sine_e + v_along * yaw_rate_error - omega_d1 * e_x - omega_d * e_x1
        w, w_1 = g * e_y, g_1 * e_y + g * e_y1
        w_2 = g_2 * e_y + 2.0 * g_1 * e_y1 + g * e_y2
        slope = 1.0 / (1.0 + w * w)
        steered_1 = slope * w_1
        psi = heading_error + arctan(w)  # ψ, heading minus the one that leads back
        psi_1 = yaw_rate_error + steered_1  # ψ̇
        # what of ψ̈ = θ̈ - ω̇_d + … is not θ̈ - ω̇_d
        psi_2 = slope * w_2 - 2.0 * w * steered_1 * steered_1

        # ṡ = -ω_n s, with u = ω_n ψ / R:
        #   ψ̈ + ω_n (1 - tanh² u) ψ̇ + (tanh u - u (1 - tanh² u)) Ṙ = -ω_n s,  solved for θ̈
        omega_n = self.heading_frequency
        u = omega_n * psi / R
        tanh_u = tanh(u)
        sech2_u = 1.0 - tanh_u * tanh_u
        s = psi_1 + R * tanh_u  # s: 0 when it turns back as fast as it should
        theta_2 = omega_d1 - psi_2 - omega_n * (sech2_u * psi_1 + s)
        theta_2 = theta_2 - R_1 * (tanh_u - u * sech2_u)
        # ahead of a reference that comes it waits, and overcomes no friction to go back; gradually,
        # for the sign of the speed of a reference at rest is but rounding
        fade = clipped(1.0 - abs(v_d) / COMES, 0.0, 1.0)
        wanted = select(wanted * v_d < 0.0, fade * clipped(wanted, -COMES, COMES), wanted)
        return DesiredAcceleration(v_1, theta_2, wanted, omega - s)
