"""The equations of `Guidance`, which says what they mean, on components.

v = v_d - L tanh(k_x e_x / L),   ψ = θ - θ_d + atan(g e_y),   g = k_y v_d / √(v_d² + v_s²)
"""

from typing import TYPE_CHECKING, Any, NamedTuple

from climber_uk.mechanics.elementary import arctan, cos, either, select, sin, sqrt, tanh, wrapped
from climber_uk.mechanics.motion import Demand, Motion, Target, named

if TYPE_CHECKING:
    from climber_uk.control.constraints import Guidance


class Track(NamedTuple):
    """A target as `Guidance` sees it: along its heading, and what it allows and wants there."""

    x: Any
    y: Any
    heading: Any
    cosine: Any
    sine: Any
    speed: Any  # v_d [m/s]
    speed_rate: Any
    yaw_rate: Any  # ω_d [rad/s]
    yaw_acceleration: Any
    waiting: tuple[Any, Any]  # L of who is ahead [m/s], and its rate
    hurrying: tuple[Any, Any]  # L of who is behind
    turn_rate: tuple[Any, Any]  # R [rad/s], and its rate
    gain: tuple[Any, Any, Any]  # g [1/m] and its first two derivatives by time


def on_track(gains: "Guidance", target: Target) -> Track:
    """Target along its heading, with the speeds and the steering that the gains allow there."""
    x, y, heading, v_x, v_y, omega, a_x, a_y, omega_1, j_x, j_y = target
    cosine, sine = cos(heading), sin(heading)
    v, v_1 = v_x * cosine + v_y * sine, a_x * cosine + a_y * sine
    v_2 = j_x * cosine + j_y * sine + omega * omega * v

    v_s, k_y, c = gains.fade_speed, gains.cross_track_gain, gains.catch_up_share
    v_s2, v2 = v_s * v_s, v * v
    root2 = v2 + v_s2
    root = sqrt(root2)
    share, slope = v / root, v_s2 / (root * root2)  # v/root, and its slope by v
    share_1 = slope * v_1
    share_2 = slope * v_2 - 3.0 * share_1 * v * v_1 / root2
    wait = sqrt(v2 + 0.25 * v_s2)
    waiting = wait, v * v_1 / wait
    is_shared = c * abs(v) < gains.catch_up_speed  # the ceiling of what is added is not reached
    hurry = sqrt(0.25 * v_s2 + select(is_shared, c * c * v2, gains.catch_up_speed**2))
    hurrying = hurry, select(is_shared, c * c * v * v_1 / hurry, 0.0)
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
    """Speed and heading that lead back, and the accelerations with which they are reached."""
    x, y, heading, cosine, sine, v, omega = motion
    x_d, y_d, heading_d, cosine_d, sine_d, v_d, v_d1, omega_d, omega_d1, *others = track
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
    k_x = gains.along_track_gain
    u = k_x * e_x / most
    part = tanh(u)
    inside = 1.0 - part * part
    wanted = v_d - most * part
    back_1 = k_x * inside * e_x1 + (part - u * inside) * most_1
    v_1 = v_d1 - back_1 - gains.speed_rate * (v - wanted)

    e_y2 = v_1 * sine_e + v_x * turning - omega_d1 * e_x - omega_d * e_x1
    g, g_1, g_2 = gain
    w, w_1 = g * e_y, g_1 * e_y + g * e_y1
    w_2 = g_2 * e_y + 2.0 * g_1 * e_y1 + g * e_y2
    slope = 1.0 / (1.0 + w * w)
    steered_1 = slope * w_1
    led = turned + arctan(w)  # ψ, heading minus the one that leads back
    led_1 = turning + steered_1
    led_2 = slope * w_2 - 2.0 * w * steered_1 * steered_1

    omega_n = gains.heading_frequency
    u = omega_n * led / fastest
    part = tanh(u)
    inside = 1.0 - part * part
    turning_back = led_1 + fastest * part  # 0 when it turns back as fast as it should
    theta_2 = omega_d1 - led_2 - omega_n * (inside * led_1 + turning_back)
    theta_2 = theta_2 - fastest_1 * (part - u * inside)
    # ahead of a reference that comes it waits, and overcomes no friction to go back
    return v_1, theta_2, select(wanted * v_d < 0.0, 0.0, wanted)
