"""Motions and torques in components, (11) and (15): floats of one climber, arrays (N,) of many.

Arithmetic on a float, or on N numbers that lie side by side, takes a fraction of what it takes on
vectors (..., 3). So the equations of every tick stand here and in `control` on components; `State`
and `Reference` carry the same as vectors.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

from climber_uk.mechanics.elementary import clipped, everywhere, select

named = tuple.__new__  # a named tuple without the detour that calling its class takes

if TYPE_CHECKING:
    from climber_uk.mechanics.climber import Climber

Bounds = tuple[Any, Any]  # lowest and highest torque of a wheel [N m]
# v̇ [m/s²] and θ̈ [rad/s²] asked of a climber, and the speed [m/s] whose sign friction will have
DesiredAcceleration = tuple[Any, Any, Any]


class Motion(NamedTuple):
    """Where a climber is, and how it rolls without side slip (17), in the wall's frame."""

    x: Any  # [m]
    y: Any  # [m]
    heading: Any  # θ [rad]
    cosine: Any  # of θ
    sine: Any
    speed: Any  # v, forward [m/s]
    yaw_rate: Any  # ω [rad/s]


class ReferencePoint(NamedTuple):
    """Where a climber should be and how it should move, in the wall's frame."""

    x: Any  # [m]
    y: Any  # [m]
    heading: Any  # θ_d [rad]
    v_x: Any  # [m/s]
    v_y: Any  # [m/s]
    yaw_rate: Any  # ω_d [rad/s]
    a_x: Any  # [m/s²]
    a_y: Any  # [m/s²]
    yaw_acceleration: Any  # [rad/s²]
    j_x: Any  # jerk [m/s³]
    j_y: Any  # [m/s³]


class Wrench(NamedTuple):
    """What pushes a climber forward, and what turns it."""

    drive: Any  # [N]
    turn: Any  # [N m]


class Torques(NamedTuple):
    """Of the wheels [N m]."""

    right: Any
    left: Any


def wrench_of_torques(climber: "Climber", right: Any, left: Any) -> tuple[Any, Any]:
    """Force along the climber (τR + τL)/r [N] and moment about it d (τR - τL)/r [N m]."""
    radius = climber.wheel_radius
    return (right + left) / radius, climber.half_track * (right - left) / radius


def torques(climber: "Climber", drive: Any, turn: Any) -> Torques:
    """τR, τL = r (F ± N/d) / 2 of the drive force F and the moment N."""
    half = climber.wheel_radius / 2
    half_drive, half_turn = half * drive, half * turn / climber.half_track
    return Torques(half_drive + half_turn, half_drive - half_turn)


def wheel_rates(climber: "Climber", motion: Motion) -> tuple[Any, Any]:
    """Turning rates (v ± d ω) / r of the wheels, right and left [rad/s]."""
    v, turning = motion.speed, climber.half_track * motion.yaw_rate
    return (v + turning) / climber.wheel_radius, (v - turning) / climber.wheel_radius


def torque_bounds(climber: "Climber", motion: Motion) -> tuple[Bounds, Bounds]:
    """Lowest and highest torque of the right wheel, and of the left one.

    That of a DC motor falls in a straight line with the rate at which it drives its wheel, and
    not with the rate at which it brakes it.
    """
    limit, no_load = climber.max_wheel_torque, climber.no_load_wheel_rate
    if everywhere(no_load == 0):
        return (-limit, limit), (-limit, limit)
    no_load = select(no_load == 0, float("inf"), no_load)
    right, left = wheel_rates(climber, motion)
    return _bounds(limit, right / no_load), _bounds(limit, left / no_load)


def _bounds(limit: Any, part: Any) -> Bounds:
    return -limit * clipped(1 + part, 0.0, 1.0), limit * clipped(1 - part, 0.0, 1.0)


def saturate(
    climber: "Climber", drive: Any, turn: Any, right: Bounds, left: Bounds
) -> tuple[Any, Any, Any, Any]:
    """What wheels within their bounds can do of drive and turn, the turn served first.

    Drive and turn, the very same ones if they fit, and the torques of the right wheel and of the
    left one that do it.
    """
    (right_low, right_high), (left_low, left_high) = right, left
    to_mean, to_twist = climber.leverage
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
