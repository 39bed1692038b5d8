"""How the state goes on, and what sensors show of it, with Jacobians (docs/localization.md).

    x = (x, y, θ, b, σ, κ, β_x, β_y, λ, a, ζ, ξ)   pose; gyro's bias; encoders' scale error; creep;
                                                   accelerometer's biases, forwards, to the left;
                                                   scrub; pivot; slip by drag; slip by weight

    α = (ω_gyro - b) Δt, or ω_wheels (1 - σ) Δt   ψ = θ + α/2   p = sin(inclination)
    over a way S, of length |S|
    s = S (1 - σ) - (ζ D + ξ p T sinψ)    u = p (a α sinψ - λ |α| cosψ)   to the left
    x⁺ = x + s cosψ - u sinψ   y⁺ = y + s sinψ + u cosψ - κ p |S|   θ⁺ = θ + α

A wheel under load gives way in proportion to its force. Of the weight's part of that, along
-sinθ and across -cosθ in the body's frame, is left -κ p |S| along y. Wheels that scrub are dragged
round as the climber turns, and give way to a side by the angle turned, whichever way (λ); and as
the weight loads the lower ones, it turns about a point that is a sinθ behind its centre.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import GRAVITY

X, Y, HEADING, BIAS, SCALE, CREEP, FORWARD_BIAS, LEFT_BIAS = range(8)
SCRUB, PIVOT, DRAG_SLIP, WEIGHT_SLIP = range(8, 12)
SIZE = 12
ASIDE, SLIPS = [SCRUB, PIVOT], [DRAG_SLIP, WEIGHT_SLIP]
FORCE_BIASES = [FORWARD_BIAS, LEFT_BIAS]
# [s] twice for how long slip is by a chance off its share, times the square of how much of T
SCATTERS = 0.02


class Travel(NamedTuple):
    """What wheels and gyro tell of the time between two samples of the encoders."""

    duration: float  # Δt [s]
    distance: float  # S [m], forwards
    path: float  # |S| [m], that of turning on the spot included
    yaw_rate: float  # [rad/s], of the gyro, else of the wheels
    is_gyro: bool  # whether it is the gyro's: biased
    scrubbed: float = 0.0  # |α| [rad], whichever way, of wheels that scrub
    slipped: float = 0.0  # T [m], by which their sides slip against each other
    dragged: float = 0.0  # D [m]: T, with the sign of the way


class Late(NamedTuple):
    """How much a measurement is behind the state."""

    turned: float  # [rad] since then, as the gyro tells with its bias
    by_bias: float  # [s] for which that is in it


def advanced(state: Array, travel: Travel, pull: float) -> Array:
    """State (12,) after a `travel`; `pull` is p, the share of gravity along the wall."""
    x, y, heading, _, scale, creep, _, _, scrub, pivot, *slips = state.tolist()
    angle = turn(state, travel)
    cosine, sine = math.cos(heading + angle / 2), math.sin(heading + angle / 2)
    way = travel.distance * (1 - scale) - slip_along(
        slips, travel.slipped, travel.dragged, pull * sine
    )
    aside = pull * slip_aside((scrub, pivot), heading + angle / 2, angle, travel.scrubbed)
    after = state.copy()
    after[X] = x + way * cosine - aside * sine
    after[Y] = y + way * sine + aside * cosine - creep * pull * travel.path
    after[HEADING] = heading + angle
    return after


def slip_aside(ways: Sequence[float], heading: float, angle: float, turned: float) -> float:
    """u / p [m] by (λ, a), at a `heading` ψ, of a turn by an `angle` α, whichever way `turned`."""
    scrub, pivot = ways
    return pivot * math.sin(heading) * angle - scrub * math.cos(heading) * turned


def slip_along(slips: Sequence[float], slipped: float, dragged: float, uphill: float) -> float:
    """How much less than rolled it goes [m] by (ζ, ξ), where T is `slipped` and `uphill` p sinψ."""
    return slips[0] * dragged + slips[1] * uphill * slipped


def forwards(state: Array, travel: Travel, uphill: float) -> float:
    """s [m], where `uphill` is p sinψ."""
    slip = slip_along(state[SLIPS].tolist(), travel.slipped, travel.dragged, uphill)
    return travel.distance * (1 - float(state[SCALE])) - slip


def turn(state: Array, travel: Travel) -> float:
    """α [rad]: the gyro's, or the wheels', which slip as they do on the way."""
    if travel.is_gyro:
        return (travel.yaw_rate - float(state[BIAS])) * travel.duration
    return travel.yaw_rate * (1 - float(state[SCALE])) * travel.duration


def advanced_jacobian(state: Array, travel: Travel, pull: float) -> Array:
    """Derivative (12, 12) of `advanced` by the state."""
    _, _, heading, _, scale, _, _, _, scrub, pivot, *slips = state.tolist()
    angle = turn(state, travel)
    middle = heading + angle / 2
    cosine, sine = math.cos(middle), math.sin(middle)
    way = travel.distance * (1 - scale) - slip_along(
        slips, travel.slipped, travel.dragged, pull * sine
    )
    downhill = pull * travel.slipped  # ξ's, of a climber that looks up
    by_heading = -slips[1] * downhill * cosine
    sag, swing = pull * travel.scrubbed, pull * angle
    jacobian = np.eye(SIZE)
    jacobian[X, SCRUB], jacobian[Y, SCRUB] = sag * cosine * sine, -sag * cosine * cosine
    jacobian[X, PIVOT], jacobian[Y, PIVOT] = -swing * sine * sine, swing * sine * cosine
    double, doubled = math.cos(2 * middle), math.sin(2 * middle)
    along, across = by_heading * cosine - way * sine, by_heading * sine + way * cosine
    jacobian[X, HEADING] = along + scrub * sag * double - pivot * swing * doubled
    jacobian[Y, HEADING] = across + scrub * sag * doubled + pivot * swing * double
    by_angle = jacobian[: HEADING + 1, HEADING] / 2
    by_angle[X] -= pull * pivot * sine * sine
    by_angle[Y] += pull * pivot * sine * cosine
    by_angle[HEADING] = 1.0
    angle_by_scale = 0.0 if travel.is_gyro else -travel.yaw_rate * travel.duration
    jacobian[: HEADING + 1, BIAS] = by_angle * (-travel.duration if travel.is_gyro else 0.0)
    jacobian[: HEADING + 1, SCALE] = by_angle * angle_by_scale
    jacobian[X, SCALE] -= travel.distance * cosine
    jacobian[Y, SCALE] -= travel.distance * sine
    jacobian[Y, CREEP] = -pull * travel.path
    jacobian[X, DRAG_SLIP] = -travel.dragged * cosine
    jacobian[Y, DRAG_SLIP] = -travel.dragged * sine
    jacobian[X, WEIGHT_SLIP] = -downhill * sine * cosine
    jacobian[Y, WEIGHT_SLIP] = -downhill * sine * sine
    return jacobian


def process_noise(travel: Travel, options: LocalizationOptions) -> Array:
    """Variances (12,) that a `travel` adds."""
    way = options.way_noise**2 * travel.path
    way += SCATTERS * travel.slipped**2 / travel.duration
    if travel.is_gyro:
        angle = options.gyro_noise**2 * travel.duration
    else:
        angle = options.turn_noise**2 * (
            abs(travel.yaw_rate) * travel.duration + travel.path / options.turning_lever
        )
    bias = options.gyro_bias_walk**2 * travel.duration
    scale = 2 * options.scale_deviation**2 * travel.duration / options.scale_time
    force = options.acceleration_bias_walk**2 * travel.duration
    slip = options.slip_walk**2 * travel.scrubbed
    return np.array([way, way, angle, bias, scale, 0.0, force, force, 0.0, 0.0, slip, slip])


def gravity(state: Array, late: Late, along_wall: float) -> Array:
    """Specific force (2,) of the weight forwards, to the left [m/s²]; `along_wall` is g_t."""
    heading = earlier_heading(state, late)
    exact = np.array([along_wall * math.sin(heading), along_wall * math.cos(heading)])
    return exact + state[FORCE_BIASES]


def gravity_jacobian(state: Array, late: Late, along_wall: float) -> Array:
    """Derivative (2, 12) of `gravity` by the state."""
    heading = earlier_heading(state, late)
    jacobian = np.zeros((2, SIZE))
    jacobian[:, HEADING] = along_wall * math.cos(heading), -along_wall * math.sin(heading)
    jacobian[:, BIAS] = late.by_bias * jacobian[:, HEADING]
    jacobian[0, FORWARD_BIAS] = jacobian[1, LEFT_BIAS] = 1.0
    return jacobian


def fixed(state: Array, lever: tuple[float, float]) -> Array:
    """Pose (3,) of a place of the climber, `lever` [m] forwards and to the left of its centre."""
    forwards, left = lever
    x, y, heading = state[: HEADING + 1].tolist()
    cosine, sine = math.cos(heading), math.sin(heading)
    return np.array(
        [x + cosine * forwards - sine * left, y + sine * forwards + cosine * left, heading]
    )


def fixed_jacobian(state: Array, lever: tuple[float, float]) -> Array:
    """Derivative (3, 12) of `fixed` by the state."""
    jacobian, away = np.eye(HEADING + 1, SIZE), fixed(state, lever) - state[: HEADING + 1]
    jacobian[X, HEADING], jacobian[Y, HEADING] = -away[Y], away[X]
    return jacobian


def heading_by_force_biases(heading: float, along_wall: float) -> Array:
    """Derivative (2,) of the heading that gravity tells by the accelerometer's biases, negative."""
    return np.array([-math.cos(heading), math.sin(heading)]) / along_wall


def earlier_heading(state: Array, late: Late) -> float:
    """θ [rad] of a while ago."""
    return float(state[HEADING]) - late.turned + late.by_bias * float(state[BIAS])


def share_along_wall(options: LocalizationOptions) -> float:
    """p = sin(inclination)."""
    return options.gravity_along_wall / GRAVITY
