"""How the state goes on, and what sensors show of it, with Jacobians (docs/localization.md).

    x = (x, y, θ, b, σ, κ, β_x, β_y)   pose; gyro's bias; encoders' scale error; creep;
                                       accelerometer's biases, forwards and to the left

    s = S (1 - σ)   α = (ω_gyro - b) Δt   over a way of signed length S and length |S|
    x⁺ = x + s cos(θ + α/2)   y⁺ = y + s sin(θ + α/2) - κ p |S|   θ⁺ = θ + α

A wheel under load gives way in proportion to its force. Of the weight's part of that, along
-sinθ and across -cosθ in the body's frame, is left -κ p |S| along y; p = sin(inclination).
"""

import math
from typing import NamedTuple

import numpy as np

from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import GRAVITY

X, Y, HEADING, BIAS, SCALE, CREEP, FORWARD_BIAS, LEFT_BIAS = range(8)
SIZE = 8
FORCE_BIASES = [FORWARD_BIAS, LEFT_BIAS]


class Travel(NamedTuple):
    """What wheels and gyro tell of the time between two samples of the encoders."""

    duration: float  # Δt [s]
    distance: float  # S [m], forwards
    path: float  # |S| [m], that of turning on the spot included
    yaw_rate: float  # [rad/s], of the gyro, else of the wheels
    is_gyro: bool  # whether it is the gyro's: biased


class Late(NamedTuple):
    """How much a measurement is behind the state."""

    turned: float  # [rad] since then, as the gyro tells with its bias
    by_bias: float  # [s] for which that is in it


def advanced(state: Array, travel: Travel, pull: float) -> Array:
    """State (8,) after a `travel`; `pull` is p, the share of gravity along the wall."""
    x, y, heading, bias, scale, creep, *force_biases = state.tolist()
    angle, way = turn(bias, travel), travel.distance * (1 - scale)
    middle = heading + angle / 2
    return np.array(
        [
            x + way * math.cos(middle),
            y + way * math.sin(middle) - creep * pull * travel.path,
            heading + angle,
            bias,
            scale,
            creep,
            *force_biases,
        ]
    )


def turn(bias: float, travel: Travel) -> float:
    """α [rad]."""
    return (travel.yaw_rate - (bias if travel.is_gyro else 0.0)) * travel.duration


def advanced_jacobian(state: Array, travel: Travel, pull: float) -> Array:
    """Derivative (8, 8) of `advanced` by the state."""
    _, _, heading, bias, scale, *_ = state.tolist()
    way, middle = travel.distance * (1 - scale), heading + turn(bias, travel) / 2
    cosine, sine = math.cos(middle), math.sin(middle)
    angle_by_bias = -travel.duration if travel.is_gyro else 0.0
    jacobian = np.eye(SIZE)
    jacobian[X, HEADING], jacobian[Y, HEADING] = -way * sine, way * cosine
    jacobian[X, BIAS] = -way * sine * angle_by_bias / 2
    jacobian[Y, BIAS] = way * cosine * angle_by_bias / 2
    jacobian[HEADING, BIAS] = angle_by_bias
    jacobian[X, SCALE], jacobian[Y, SCALE] = -travel.distance * cosine, -travel.distance * sine
    jacobian[Y, CREEP] = -pull * travel.path
    return jacobian


def process_noise(travel: Travel, options: LocalizationOptions) -> Array:
    """Variances (8,) that a `travel` adds."""
    way = options.way_noise**2 * travel.path
    if travel.is_gyro:
        angle = options.gyro_noise**2 * travel.duration
    else:
        angle = options.turn_noise**2 * (
            abs(travel.yaw_rate) * travel.duration + travel.path / options.turning_lever
        )
    bias = options.gyro_bias_walk**2 * travel.duration
    scale = 2 * options.scale_deviation**2 * travel.duration / options.scale_time
    force = options.acceleration_bias_walk**2 * travel.duration
    return np.array([way, way, angle, bias, scale, 0.0, force, force])


def gravity(state: Array, late: Late, along_wall: float) -> Array:
    """Specific force (2,) of the weight forwards, to the left [m/s²]; `along_wall` is g_t."""
    heading = earlier_heading(state, late)
    exact = np.array([along_wall * math.sin(heading), along_wall * math.cos(heading)])
    biased: Array = exact + state[FORCE_BIASES]
    return biased


def gravity_jacobian(state: Array, late: Late, along_wall: float) -> Array:
    """Derivative (2, 8) of `gravity` by the state."""
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
    """Derivative (3, 8) of `fixed` by the state."""
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
