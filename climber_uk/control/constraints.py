"""The reference as a constraint on the climber: the accelerations with which it is met.

A constraint set says what forward acceleration v̇ and yaw acceleration θ̈ it demands. As rows of
A q̈ = b these are [cosθ sinθ 0] q̈ = v̇ and [0 0 1] q̈ = θ̈; the wheels' no-slip row is the third.
A new set is one class with `track` and `demand`, and one entry in `CONSTRAINTS`.
"""

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from climber_uk.control.guidance import guided, on_track
from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.climber import State, across, along, no_slip
from climber_uk.mechanics.elementary import cos, select, sin, wrapped
from climber_uk.mechanics.motion import Demand, Motion, Target
from climber_uk.mechanics.parameter import check, parameter
from climber_uk.mechanics.reference import Reference

REACH = 0.2  # [m] from the path, within which the exact set is expected to stay
REST_SPEED = 1e-3  # [m/s] below which a heading cannot be told from the way a climber moves


class ConstraintSet(Protocol):
    """What makes the climber follow a reference, with gains as fields."""

    def track(self, target: Target) -> Any:
        """All that can be said of a target before it is known where the climber is."""

    def demand(self, track: Any, motion: Motion) -> Demand:
        """What is asked of a climber that moves like that."""

    def fastest(self, speed: float, yaw_rate: float) -> tuple[float, float]:
        """Speed [m/s] and yaw rate [rad/s] at most asked for, on a reference with those at most."""


def demanded(constraints: ConstraintSet, state: State, reference: Reference) -> Demand:
    """What `constraints` ask of a state, each (...)."""
    return constraints.demand(constraints.track(reference.target), state.motion)


def rows(state: State, demand: Demand) -> tuple[Array, Array]:
    """A (..., 3, 3) and b (..., 3) of a demand and of no-slip (18); A is orthonormal."""
    slip_row, slip_b = no_slip(state)
    sine, minus_cosine, zero = unpack(slip_row)
    A = np.stack([pack(-minus_cosine, sine, zero), pack(zero, zero, zero + 1), slip_row], axis=-2)
    return A, pack(*demand[:2], slip_b)


def tracking_error(pose: Array, reference: Reference) -> tuple[Array, Array, Array]:
    """Actual minus desired pose along-track [m], cross-track [m] and in heading [rad], each (...).

    Along and across are those of the reference's heading; the heading error is in [-π, π).
    """
    heading, offset = reference.heading, pose - reference.pose
    return along(heading, offset), across(heading, offset), wrapped(unpack(offset)[2])


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

    track = on_track  # see `ConstraintSet`
    demand = guided


@dataclass(frozen=True, slots=True)
class Exact:
    """The path itself: p̈ = u = p̈_d + K_d (ṗ_d - ṗ) + K_p (p_d - p), and what it hides.

    With no-slip, p̈ = u leaves θ̈ open but binds the velocity: φ = v ω - n·u = 0. Differentiated,
    with a decay, it is the third row: v θ̈ = -v̇ ω + d/dt(n·u) - λ φ. Singular at rest, where θ̈
    is left at 0, and violent near it: for references that never slow down.
    """

    natural_frequency: float = parameter(
        6.0, "rad/s", "ω_n: K_p = ω_n², K_d = 2 ω_n", above=0, runtime=True
    )
    hidden_rate: float = parameter(10.0, "1/s", "λ, decay of φ", above=0, runtime=True)

    def __post_init__(self) -> None:
        check(self)

    def fastest(self, speed: float, yaw_rate: float) -> tuple[float, float]:
        """See `ConstraintSet`; offsets of up to `REACH` are expected to be corrected."""
        correction = self.natural_frequency * REACH
        return 2 * speed + correction, 2 * yaw_rate + self.natural_frequency

    def track(self, target: Target) -> Target:
        """See `ConstraintSet`."""
        return target

    def demand(self, target: Target, motion: Motion) -> Demand:
        """See `ConstraintSet`."""
        x, y, _, cosine, sine, v, omega = motion
        x_d, y_d, heading_d, v_x, v_y, _, a_x, a_y, _, j_x, j_y = target
        K_d, K_p = 2 * self.natural_frequency, self.natural_frequency * self.natural_frequency
        e_x1, e_y1 = v_x - v * cosine, v_y - v * sine
        u_x = a_x + K_d * e_x1 + K_p * (x_d - x)
        u_y = a_y + K_d * e_y1 + K_p * (y_d - y)

        # what p̈ will be: u along the heading, and the centripetal v ω across it
        v_1, centripetal = u_x * cosine + u_y * sine, v * omega
        u_x1 = j_x + K_d * (a_x - v_1 * cosine + centripetal * sine) + K_p * e_x1
        u_y1 = j_y + K_d * (a_y - v_1 * sine - centripetal * cosine) + K_p * e_y1

        phi = centripetal - (u_y * cosine - u_x * sine)
        turning = u_y1 * cosine - u_x1 * sine - 2 * v_1 * omega - self.hidden_rate * phi
        at_rest = abs(v) < REST_SPEED
        theta_2 = select(at_rest, 0.0, turning / select(at_rest, 1.0, v))
        # friction is that of the speed at which the error along the track goes as exp(-ω_n t)
        wanted_x = v_x + self.natural_frequency * (x_d - x)
        wanted_y = v_y + self.natural_frequency * (y_d - y)
        return v_1, theta_2, wanted_x * cos(heading_d) + wanted_y * sin(heading_d)


CONSTRAINTS: dict[str, type[Guidance] | type[Exact]] = {"guidance": Guidance, "exact": Exact}
