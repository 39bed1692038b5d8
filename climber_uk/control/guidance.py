"""The guidance law: v̇ and θ̈ that lead speed and heading back to the reference.

    wanted = v_d - L tanh(k_x e_x / L)                        the speed that leads back
    v̇ = v̇_d - 2 ζ ω (v - wanted),  k_x = ω / 2ζ               ë_x + 2 ζ ω ė_x + ω² e_x = 0, nearby
    ψ = θ - θ_d + atan(g e_y)                                 0 for the heading that leads back
    g = k_y v_d / √(v_s² + v_d² + (k_y v_d² / ω_n)²)
    s = ψ̇ + R tanh(k_ψ ψ / R),  k_ψ = ω_n / 2ζ                the rate of turning off the one wanted
    ψ̈ = -2 ζ ω_n s,  ω_n = 2/3 ω                              gives θ̈

Derived line by line in docs/theory.md, §5; the gains are fields of `Guidance`. A number that ends a
name is a derivative by time: `v_1` is v̇, `e_x1` is ė_x (§1.3). Errors and their rates are in the
reference's frame: along its heading, and to its left. Floats, or arrays (N,) of many climbers.
"""

import math
from typing import Any, NamedTuple

from climber_uk.mechanics.elementary import (
    arctan,
    cos,
    select,
    sin,
    sqrt,
    tanh,
    wrapped,
)
from climber_uk.mechanics.quantities import DesiredAcceleration, Motion, ReferencePoint
from climber_uk.parameters.declaration import parameter, parameters

HEADING_SHARE = 2 / 3  # of the frequency: what the heading leads back is one integral away


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
    slow_down: Any  # L of a climber ahead: most by which it slows down [m/s]
    catch_up: Any  # L of one behind: most by which it is faster [m/s]
    turn_rate: Any  # R [rad/s]
    gain: tuple[Any, Any, Any]  # g [1/m], ġ and g̈


@parameters(slots=True)
class Guidance:
    """Speed and heading that lead back to the reference; never singular, and so good at rest.

    Near the reference the error along the track and ψ = θ - θ_d + atan(g e_y) are oscillators with
    the damping ζ: the former with ω = `frequency`, ψ with 2/3 of it, as it is ψ that leads the
    error across the track back, at g v. g fades below v_s, where steering cannot help, and changes
    sign in reverse gear; g v stays below ω_n, as ψ cannot follow what is faster. With the no-slip
    row, A is orthonormal.

    L bounds how much the speed differs from the reference's. Behind it, L = √(v_s²/4 + (c v_d)²),
    where c v_d is at most v_c. Ahead of it, L = √(v_d² + v_s²/4): a climber slows down and waits
    for its reference, for driving backwards it would steer away. R bounds how fast it turns back:
    R = √(v_d² + v_s²) / ρ, at most `turn_rate`.
    """

    frequency: float = parameter(
        18.0,
        "rad/s",
        "ω, how fast errors along the path and across it vanish; those of the heading at 2/3 of it",
        above=0,
        plausible=(0.1, 150.0),  # at 300 torques go to and fro, at 200 Hz
        runtime=True,
    )
    damping: float = parameter(
        0.7,
        "",
        "ζ, damping of errors; 1: no overshoot, lower: faster",
        above=0.5,
        at_most=2,
        runtime=True,
    )
    cross_track_gain: float = parameter(
        8.0,
        "1/m",
        "k_y, angle of the way back to the path by the distance from it; less where that is "
        "too fast for ω",
        at_least=0,
        runtime=True,
    )
    fade_speed: float = parameter(
        1.0, "m/s", "v_s, speed below which k_y fades", above=0, runtime=True
    )
    catch_up_share: float = parameter(
        0.25, "", "c, share of the reference's speed that is added behind it", above=0, runtime=True
    )
    catch_up_speed: float = parameter(
        2.0,
        "m/s",
        "v_c, most that `guidance.catch_up_share` adds to the reference's speed",
        above=0,
        runtime=True,
    )
    turn_radius: float = parameter(
        0.3, "m", "ρ, radius of the turn back to the heading wanted", above=0, runtime=True
    )
    turn_rate: float = parameter(
        4.0, "rad/s", "fastest turn back to the heading wanted", above=0, runtime=True
    )

    @property
    def heading_frequency(self) -> float:
        """ω_n [rad/s]."""
        return HEADING_SHARE * self.frequency

    def steering(self, speed: float) -> float:
        """g [1/m] at a speed [m/s] of the reference."""
        steep = self.cross_track_gain * speed
        return steep / math.hypot(speed, self.fade_speed, steep * speed / self.heading_frequency)

    def fastest(self, speed: float, yaw_rate: float) -> tuple[float, float]:
        """See `ConstraintSet`; steering along atan(g e_y) turns by g v at most."""
        v_s = self.fade_speed
        hurry = math.hypot(v_s / 2, min(self.catch_up_share * speed, self.catch_up_speed))
        root, steering = math.hypot(speed, v_s), self.steering(speed) * (speed + hurry)
        return_rate = min(root / self.turn_radius, self.turn_rate)
        return speed + hurry, yaw_rate + return_rate + steering

    def prepare(self, target: ReferencePoint) -> PreparedTarget:
        """Prepare a reference, given in the wall's frame to the jerk: L, R, and g with its rates.

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
        # g = k_y ς(v_d), ς = v/√q, q = v_s² + v² + c v⁴, c = (k_y/ω_n)², N = v_s² - c v⁴:
        # ς' = N/q^(3/2), ς'' = -v (4 c v² + 3 N (1 + 2 c v²)/q)/q^(3/2),
        # ς̇ = ς' v̇,  ς̈ = ς' v̈ + ς'' v̇²
        too_fast = (k_y / self.heading_frequency) ** 2 * v2
        q, N = root2 + too_fast * v2, v_s2 - too_fast * v2
        root_q = sqrt(q)
        steep = 1.0 / (q * root_q)
        fade, slope = v / root_q, N * steep
        bend = -v * (4.0 * too_fast + 3.0 * N * (1.0 + 2.0 * too_fast) / q) * steep
        fade_1 = slope * v_1
        fade_2 = slope * v_2 + bend * v_1 * v_1
        # ahead L = √(v_d² + v_s²/4), behind L = √(v_s²/4 + min(c |v_d|, v_c)²)
        slow_down = sqrt(v2 + 0.25 * v_s2)
        is_below_ceiling = c * abs(v) < self.catch_up_speed
        catch_up = sqrt(0.25 * v_s2 + select(is_below_ceiling, c * c * v2, self.catch_up_speed**2))
        # R = min(√(v_d² + v_s²)/ρ, R_max)
        tightest = sqrt(root2) / self.turn_radius
        return_rate = select(tightest < self.turn_rate, tightest, self.turn_rate)
        gain = k_y * fade, k_y * fade_1, k_y * fade_2
        limits = slow_down, catch_up, return_rate
        return PreparedTarget(x, y, heading, cosine, sine, v, v_1, omega, omega_1, *limits, gain)

    def desired_acceleration(self, prepared: PreparedTarget, motion: Motion) -> DesiredAcceleration:
        """v̇ [m/s²] and θ̈ [rad/s²] of a climber in `motion`, and the speed wanted [m/s]."""
        # unpacked by position: this runs twice for each odometry, and attributes would take longer
        x, y, heading, cosine, sine, v, omega = motion
        (x_d, y_d, heading_d, cosine_d, sine_d, v_d, v_d1, omega_d, omega_d1, slow_down, catch_up,
         R, (g, g_1, g_2)) = prepared  # fmt: skip
        # errors, actual minus wanted (§5.1); Δ = heading_error:
        #   ė_x = v cosΔ - v_d + ω_d e_y,  ė_y = v sinΔ - ω_d e_x,  Δ̇ = yaw_rate_error = ω - ω_d
        offset_x, offset_y, heading_error = x - x_d, y - y_d, wrapped(heading - heading_d)
        e_x, e_y = offset_x * cosine_d + offset_y * sine_d, offset_y * cosine_d - offset_x * sine_d
        v_along = v * (cosine * cosine_d + sine * sine_d)  # v cosΔ: here along the reference
        sine_e = sine * cosine_d - cosine * sine_d
        v_across = v * sine_e
        yaw_rate_error = omega - omega_d
        e_x1, e_y1 = v_along - v_d + omega_d * e_y, v_across - omega_d * e_x

        # speed (§5.2): v̇ = v̇_d - 2 ζ ω (v - wanted)
        omega_x, damping = self.frequency, 2.0 * self.damping
        limit = select(e_x * v_d > 0.0, slow_down, catch_up)
        wanted = v_d - limit * tanh(omega_x / damping * e_x / limit)
        v_1 = v_d1 - damping * omega_x * (v - wanted)

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

        # s: 0 when it turns back as fast as it should; ψ̈ = -2 ζ ω_n s, solved for θ̈
        omega_n = self.heading_frequency
        s = psi_1 + R * tanh(omega_n / damping * psi / R)
        theta_2 = omega_d1 - psi_2 - damping * omega_n * s
        return DesiredAcceleration(v_1, theta_2, wanted, omega - s)
