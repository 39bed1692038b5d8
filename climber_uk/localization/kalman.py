"""An extended Kalman filter's estimate: predicted, and corrected in Joseph's form.

    K = P Hᵀ (H P Hᵀ + R)⁻¹    x⁺ = x + K z    P⁺ = (I - K H) P (I - K H)ᵀ + K R Kᵀ

which keeps P symmetric and positive whatever is rounded.
"""

import math
from dataclasses import dataclass

import numpy as np

from climber_uk.localization import models
from climber_uk.localization.models import (
    BIAS,
    CREEP,
    HEADING,
    PIVOT,
    SCALE,
    SCRUB,
    SIZE,
    Late,
    Travel,
)
from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import Array

IDENTITY = np.eye(SIZE)
# of an innovation's χ² of two parts, above which specific force counts for less: knocks
LARGEST_KNOCK = 9.2
SINCE_SHARE = 0.9  # of a heading's variance, that may have come in the last moment
LEAST = 1e-18  # variance added to each, so that what is known exactly can be divided by


@dataclass(frozen=True)
class Estimate:
    """What is believed of the state, and how far that may be off."""

    mean: Array  # (12,) as in `models`
    covariance: Array  # (12, 12)

    def deviation(self, part: int) -> float:
        """Standard deviation of a part of the state."""
        return math.sqrt(max(float(self.covariance[part, part]), 0.0))

    @classmethod
    def start(cls, options: LocalizationOptions) -> "Estimate":
        """What is known before any measurement."""
        o = options
        position = o.initial_position_deviation
        deviations = np.zeros(SIZE)
        deviations[:HEADING] = position
        deviations[HEADING], deviations[BIAS] = o.initial_heading_deviation, o.gyro_bias_deviation
        deviations[SCALE], deviations[CREEP] = o.scale_deviation, o.creep_deviation
        deviations[models.FORCE_BIASES] = o.acceleration_bias_deviation
        deviations[SCRUB] = o.scrub_deviation
        # the same forces make both: they are off by the same share
        told = o.initial_scrub > 0 and o.initial_pivot > 0
        share = o.initial_pivot / o.initial_scrub if told else 1.0
        deviations[PIVOT] = share * o.scrub_deviation
        deviations[models.SLIPS] = o.slip_deviation if o.scrubs else 0.0
        pose = o.initial_x, o.initial_y, o.initial_heading
        scrub = o.initial_scrub, o.initial_pivot, o.initial_drag_slip, o.initial_weight_slip
        mean = np.array([*pose, 0.0, 0.0, o.initial_creep, 0.0, 0.0, *scrub])
        return cls(mean, np.diag(deviations**2))

    def with_heading(self, heading: float, deviation: float, along_wall: float) -> "Estimate":
        """The same at a heading [rad] that gravity tells, and nothing before has told.

        Its `deviation` is without that of the accelerometer's biases; `along_wall` is g_t.
        """
        by_biases = models.heading_by_force_biases(heading, along_wall)
        jacobian = np.eye(SIZE)
        jacobian[HEADING, HEADING] = 0.0
        jacobian[HEADING, models.FORCE_BIASES] = by_biases
        mean, covariance = self.mean.copy(), jacobian @ self.covariance @ jacobian.T
        mean[HEADING] = heading
        covariance[HEADING, HEADING] += deviation**2
        return Estimate(mean, covariance)


def predicted(estimate: Estimate, travel: Travel, options: LocalizationOptions) -> Estimate:
    """Estimate after a `travel`; the encoders' scale goes back to 1 in its time."""
    after, _ = predicted_with_jacobian(estimate, travel, options)
    return after


def predicted_with_jacobian(
    estimate: Estimate, travel: Travel, options: LocalizationOptions
) -> tuple[Estimate, Array]:
    """The same, and the derivative (12, 12) of its mean by the one before."""
    pull = models.share_along_wall(options)
    mean = models.advanced(estimate.mean, travel, pull)
    jacobian = models.advanced_jacobian(estimate.mean, travel, pull)
    kept = math.exp(-travel.duration / options.scale_time)
    mean[SCALE] *= kept
    jacobian[SCALE, SCALE] = kept
    covariance = jacobian @ estimate.covariance @ jacobian.T
    covariance.flat[:: SIZE + 1] += models.process_noise(travel, options)
    return Estimate(mean, covariance), jacobian


def corrected(
    estimate: Estimate, innovation: Array, jacobian: Array, noise: Array, limit: float = math.inf
) -> Estimate:
    """Estimate after a measurement that is `innovation` (n,) off, by `jacobian` (n, 12).

    One whose χ² is above `limit` counts for less, by as much as it is above.
    """
    covariance = estimate.covariance
    crossed = jacobian @ covariance
    expected = crossed @ jacobian.T + noise
    inverse = np.linalg.inv(expected)
    excess = float(innovation @ inverse @ innovation) / limit
    if excess > 1:
        noise = noise * excess
        inverse = np.linalg.inv(crossed @ jacobian.T + noise)
    gain = crossed.T @ inverse
    kept = IDENTITY - gain @ jacobian
    after = kept @ covariance @ kept.T + gain @ noise @ gain.T
    return Estimate(estimate.mean + gain @ innovation, (after + after.T) / 2)


def distance(estimate: Estimate, innovation: Array, jacobian: Array, noise: Array) -> float:
    """Innovation's χ²: zᵀ (H P Hᵀ + R)⁻¹ z."""
    expected = jacobian @ estimate.covariance @ jacobian.T + noise
    return float(innovation @ np.linalg.solve(expected, innovation))


def with_gravity(
    estimate: Estimate,
    force: Array,
    late: Late,
    variance: float,
    along_wall: float,
    since: float = 0.0,
) -> Estimate:
    """Estimate after a specific force (2,) of the weight [m/s²]; see `models.gravity`.

    It shows the heading of a while ago. What the gyro's noise has added `since` [rad²] is in the
    estimate, and not in what is corrected. On a floor and on a ceiling it tells nothing, and
    changes nothing.
    """
    innovation = force - models.gravity(estimate.mean, late, along_wall)
    jacobian = models.gravity_jacobian(estimate.mean, late, along_wall)
    since = min(since, SINCE_SHARE * alone(estimate, HEADING)) if since else 0.0
    covariance = estimate.covariance.copy()
    covariance[HEADING, HEADING] -= since
    then = Estimate(estimate.mean, covariance)
    after = corrected(then, innovation, jacobian, variance * np.eye(2), LARGEST_KNOCK)
    after.covariance[HEADING, HEADING] += since
    return after


def alone(estimate: Estimate, part: int) -> float:
    """Variance of a part of the state, were all others known."""
    information = np.linalg.solve(estimate.covariance + LEAST * IDENTITY, IDENTITY[part])
    return max(1 / float(information[part]) - LEAST, 0.0)


def with_yaw_rate_at_rest(estimate: Estimate, yaw_rate: float, variance: float) -> Estimate:
    """Estimate after the gyro's yaw rate [rad/s] of a climber that rests: its bias."""
    jacobian, noise = IDENTITY[BIAS : BIAS + 1], np.array([[variance]])
    innovation = np.array([yaw_rate - estimate.mean[BIAS]])
    if distance(estimate, innovation, jacobian, noise) > LARGEST_KNOCK:
        return estimate  # pushed, or sliding: no rest
    return corrected(estimate, innovation, jacobian, noise)
