"""The guidance law: v̇ and θ̈ that lead speed and heading back to the reference.

    wanted = v_d - L tanh(k_x e_x / L)                        the speed that leads back
    d/dt (v - wanted) = -λ (v - wanted)                       gives v̇
    ψ = θ - θ_d + atan(g e_y),  g = k_y v_d / √(v_d² + v_s²)  0 for the heading that leads back
    s = ψ̇ + R tanh(ω_n ψ / R),  ṡ = -ω_n s                    gives θ̈

Derived line by line in docs/theory.md, §5; the gains are fields of `Guidance`. A number that ends a
name is a derivative by time: `v_1` is v̇, `e_x1` is ė_x (§1.3). Errors and their rates are in the
reference's frame: along its heading, and to its left. Floats, or arrays (N,) of many climbers.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

from climber_uk.mechanics.elementary import arctan, cos, either, select, sin, sqrt, tanh, wrapped
from climber_uk.mechanics.motion import Demand, Motion, Target, named

if TYPE_CHECKING:
    from climber_uk.control.constraints import Guidance


class Track(NamedTuple):
    """A reference at one time, and all of the law that does not depend on the climber (§5)."""

    x: Any  # [m] in the wall's frame
    y: Any  # [m]
    heading: Any  # θ_d [rad]
    cosine: Any  # of θ_d
    sine: Any
    speed: Any  # v_d along θ_d, below 0 in reverse gear [m/s]
    speed_rate: Any  # v̇_d [m/s²]
    yaw_rate: Any  # ω_d [rad/s]
    yaw_acceleration: Any  # ω̇_d [rad/s²]
    waiting: tuple[Any, Any]  # L, and L̇, of a climber ahead: most by which it slows down [m/s]
    hurrying: tuple[Any, Any]  # L, and L̇, of one behind: most by which it is faster [m/s]
    turn_rate: tuple[Any, Any]  # R [rad/s], and Ṙ
    gain: tuple[Any, Any, Any]  # g [1/m], ġ and g̈


def on_track(gains: "Guidance", target: Target) -> Track:
    """Prepare a reference, given in the wall's frame to the jerk: L, R and g with their rates.

    None of them depends on where the climber is: a controller that computes its answer twice, or
    for many climbers on one reference, prepares it once.
    """
    # here v_x, a_x, j_x are along the wall's x, and v, omega are the reference's v_d and ω_d
    x, y, heading, v_x, v_y, omega, a_x, a_y, omega_1, j_x, j_y = target
    cosine, sine = cos(heading), sin(heading)
    # v_d = t·ṗ_d, and as t turns with ω_d:  v̇_d = t·p̈_d,  v̈_d = t·p⃛_d + ω_d² v_d
    v, v_1 = v_x * cosine + v_y * sine, a_x * cosine + a_y * sine
    v_2 = j_x * cosine + j_y * sine + omega * omega * v

    v_s, k_y, c = gains.fade_speed, gains.cross_track_gain, gains.catch_up_share
    v_s2, v2 = v_s * v_s, v * v
    root2 = v2 + v_s2
    root = sqrt(root2)
    # g = k_y ς(v_d), ς = v/√(v² + v_s²), ς' = v_s²/(v² + v_s²)^(3/2), ς'' = -3 v ς'/(v² + v_s²):
    # ς̇ = ς' v̇,  ς̈ = ς' v̈ + ς'' v̇²
    share, slope = v / root, v_s2 / (root * root2)
    share_1 = slope * v_1
    share_2 = slope * v_2 - 3.0 * share_1 * v * v_1 / root2
    # ahead L = √(v_d² + v_s²/4), L̇ = v_d v̇_d / L; behind L = √(v_s²/4 + min(c |v_d|, v_c)²),
    # L̇ = c² v_d v̇_d / L, or 0 at the ceiling v_c
    wait = sqrt(v2 + 0.25 * v_s2)
    waiting = wait, v * v_1 / wait
    is_shared = c * abs(v) < gains.catch_up_speed  # the ceiling of what is added is not reached
    hurry = sqrt(0.25 * v_s2 + select(is_shared, c * c * v2, gains.catch_up_speed**2))
    hurrying = hurry, select(is_shared, c * c * v * v_1 / hurry, 0.0)
    # R = min(√(v_d² + v_s²)/ρ, R_max)
    turn = root / gains.turn_radius
    is_slower = turn < gains.turn_rate
    turn_rate = (
        select(is_slower, turn, gains.turn_rate),
        select(is_slower, v * v_1 / (root * gains.turn_radius), 0.0),
    )
    gain = k_y * share, k_y * share_1, k_y * share_2
    numbers = (
        x,
        y,
        heading,
        cosine,
        sine,
        v,
        v_1,
        omega,
        omega_1,
        waiting,
        hurrying,
        turn_rate,
        gain,
    )
    return named(Track, numbers)


def guided(gains: "Guidance", track: Track, motion: Motion) -> Demand:
    """v̇ [m/s²] and θ̈ [rad/s²] of the law for a climber in `motion`, and the speed wanted [m/s]."""
    # unpacked by position: this runs twice for each odometry, and attributes would take longer
    x, y, heading, cosine, sine, v, omega = motion
    x_d, y_d, heading_d, cosine_d, sine_d, v_d, v_d1, omega_d, omega_d1, *others = track
    waiting, hurrying, (fastest, fastest_1), gain = others
    # errors, actual minus wanted (§5.1); Δ = turned:
    #   ė_x = v cosΔ - v_d + ω_d e_y,  ė_y = v sinΔ - ω_d e_x,  Δ̇ = turning = ω - ω_d
    offset_x, offset_y, turned = x - x_d, y - y_d, wrapped(heading - heading_d)
    e_x, e_y = offset_x * cosine_d + offset_y * sine_d, offset_y * cosine_d - offset_x * sine_d
    v_x = v * (cosine * cosine_d + sine * sine_d)  # v cosΔ: here along the reference
    sine_e = sine * cosine_d - cosine * sine_d
    v_y = v * sine_e
    turning = omega - omega_d
    e_x1, e_y1 = v_x - v_d + omega_d * e_y, v_y - omega_d * e_x

    # speed (§5.2), with u = k_x e_x / L and part = tanh u, so that u̇ = k_x ė_x / L - u L̇ / L:
    #   d/dt (L tanh u) = k_x (1 - tanh² u) ė_x + (tanh u - u (1 - tanh² u)) L̇
    #   v̇ = v̇_d - d/dt (L tanh u) - λ (v - wanted)
    is_ahead = e_x * v_d > 0.0
    most, most_1 = either(is_ahead, waiting, hurrying)
    k_x = gains.along_track_gain
    u = k_x * e_x / most
    part = tanh(u)
    inside = 1.0 - part * part
    wanted = v_d - most * part
    back_1 = k_x * inside * e_x1 + (part - u * inside) * most_1
    v_1 = v_d1 - back_1 - gains.speed_rate * (v - wanted)

    # heading (§5.3), with w = g e_y:
    #   ë_y = v̇ sinΔ + v cosΔ Δ̇ - ω̇_d e_x - ω_d ė_x
    #   d/dt atan w = ẇ / (1 + w²),  d²/dt² atan w = ẅ / (1 + w²) - 2 w (d/dt atan w)²
    e_y2 = v_1 * sine_e + v_x * turning - omega_d1 * e_x - omega_d * e_x1
    g, g_1, g_2 = gain
    w, w_1 = g * e_y, g_1 * e_y + g * e_y1
    w_2 = g_2 * e_y + 2.0 * g_1 * e_y1 + g * e_y2
    slope = 1.0 / (1.0 + w * w)
    steered_1 = slope * w_1
    led = turned + arctan(w)  # ψ, heading minus the one that leads back
    led_1 = turning + steered_1  # ψ̇
    # what of ψ̈ = θ̈ - ω̇_d + … is not θ̈ - ω̇_d
    led_2 = slope * w_2 - 2.0 * w * steered_1 * steered_1

    # ṡ = -ω_n s, with u = ω_n ψ / R and part = tanh u:
    #   ψ̈ + ω_n (1 - tanh² u) ψ̇ + (tanh u - u (1 - tanh² u)) Ṙ = -ω_n s,  solved for θ̈
    omega_n = gains.heading_frequency
    u = omega_n * led / fastest
    part = tanh(u)
    inside = 1.0 - part * part
    turning_back = led_1 + fastest * part  # s: 0 when it turns back as fast as it should
    theta_2 = omega_d1 - led_2 - omega_n * (inside * led_1 + turning_back)
    theta_2 = theta_2 - fastest_1 * (part - u * inside)
    return v_1, theta_2, wanted
