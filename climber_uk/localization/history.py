"""The estimates of the last second, so that a late fix corrects the one of its own stamp.

What came after that is done again from there, and with it all fixes since: the estimate is the one
that it would be had the fix come in time.
"""

import bisect
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from climber_uk.localization.imu import DELAY, Weight
from climber_uk.localization.kalman import (
    Estimate,
    predicted,
    with_gravity,
    with_yaw_rate_at_rest,
)
from climber_uk.localization.models import HEADING, Late, Travel, turn
from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import SECOND, Array

Correction = Callable[[Estimate], Estimate]


@dataclass(frozen=True)
class Sample:
    """All that the encoders and the IMU tell between two samples of the encoders."""

    travel: Travel
    weight: Weight | None = None
    rests: bool = False

    def after(self, estimate: Estimate, options: LocalizationOptions) -> Estimate:
        """Estimate after this one."""
        travel, weight = self.travel, self.weight
        estimate = predicted(estimate, travel, options)
        if weight is not None:
            force = np.array([weight.forwards, weight.left])
            variance = options.acceleration_noise**2 / weight.time
            delay = DELAY if travel.is_gyro else 0.0
            late, since = Late(weight.turned, delay), options.gyro_noise**2 * delay
            pull = options.gravity_along_wall
            estimate = with_gravity(estimate, force, late, variance, pull, since)
        if self.rests and travel.is_gyro:
            variance = options.gyro_noise**2 / travel.duration
            estimate = with_yaw_rate_at_rest(estimate, travel.yaw_rate, variance)
        return estimate


@dataclass
class Entry:
    """A sample, the estimate after it, and the fixes that have corrected that."""

    stamp: int  # [ns]
    sample: Sample
    estimate: Estimate
    corrections: list[Correction] = field(default_factory=list)
    anew: bool = False  # whether something was believed against the estimate of before

    def pose(self, stamp: int) -> Array:
        """Pose (3,) a little later, at `stamp` [ns]."""
        travel, later = self.sample.travel, (stamp - self.stamp) / SECOND
        mean = self.estimate.mean
        x, y, heading = mean[: HEADING + 1].tolist()
        speed = travel.distance / travel.duration
        return np.array(
            [
                x + speed * later * math.cos(heading),
                y + speed * later * math.sin(heading),
                heading + turn(mean, travel) * later / travel.duration,
            ]
        )


class History:
    """Entries of the last `longest_delay`, in the order of their stamps."""

    def __init__(self, options: LocalizationOptions, start: Estimate) -> None:
        self.options = options
        self._start = start
        self.entries: list[Entry] = []

    @property
    def latest(self) -> Estimate:
        """The estimate of now."""
        return self.entries[-1].estimate if self.entries else self._start

    def add(self, stamp: int, sample: Sample) -> Entry:
        """Go on to `stamp` [ns]."""
        self.entries.append(Entry(stamp, sample, sample.after(self.latest, self.options)))
        oldest = stamp - round(self.options.longest_delay * SECOND)
        while len(self.entries) > 2 and self.entries[1].stamp <= oldest:
            del self.entries[0]
        return self.entries[-1]

    def at(self, stamp: int) -> int | None:
        """Number of the last entry not after `stamp` [ns]; None: it is before all."""
        found = bisect.bisect_right(self.entries, stamp, key=lambda entry: entry.stamp)
        return found - 1 if found else None

    def correct(self, number: int, correction: Correction, anew: bool = False) -> None:
        """Correct the estimate of an entry, or begin it `anew`; do again all that came after it."""
        entry = self.entries[number]
        entry.anew = entry.anew or anew
        entry.corrections.append(correction)
        entry.estimate = estimate = correction(entry.estimate)
        for later in self.entries[number + 1 :]:
            estimate = later.sample.after(estimate, self.options)
            for again in later.corrections:
                estimate = again(estimate)
            later.estimate = estimate
