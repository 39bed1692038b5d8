"""The output: the estimate, but for what corrections have moved it, which it follows at its pace.

    o⁺ = o - clip(o Δt / T, ± v Δt)    o: output less estimate

A controller that is fed a jump answers it with torque, and one whose odometry goes otherwise than
its twist says has to stop. So the output is corrected on the way only, by a share of it.
"""

import math

import numpy as np

from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import Array

SHARE = 0.3  # of what is driven and turned: corrections add no more to it than a slip may
BEND = 0.05  # [rad/m] that they add, too: a heading has to be corrected on a straight as well


class Smoothing:
    """Keeps how far the output is behind the estimate."""

    def __init__(self, options: LocalizationOptions) -> None:
        self.options = options
        self.offset: Array = np.zeros(3)  # of the output from the estimate [m], [rad]

    def corrected(self, before: Array, after: Array) -> None:
        """Let the output be where it was, though the estimate's pose (3,) has moved."""
        self.offset = self.offset + before - after

    def go_on(self, duration: float, distance: float, turned: float) -> None:
        """Follow for `duration` [s], in which the climber drives [m] and turns [rad]."""
        options, (x, y, angle) = self.options, self.offset.tolist()
        share = min(duration / options.pull_time, 1.0)
        way, bend = SHARE * abs(distance), SHARE * abs(turned) + BEND * abs(distance)
        along = bounded(share, math.hypot(x, y), min(way, options.pull_speed * duration))
        about = bounded(share, abs(angle), min(bend, options.pull_yaw_rate * duration))
        self.offset = self.offset * (1 - np.array([along, along, about]))


def bounded(share: float, size: float, most: float) -> float:
    """`share`, or less where that of `size` is above `most`."""
    return share if share * size <= most else most / size


def between(estimate: Array, output: Array) -> tuple[float, float, float]:
    """Place (x, y) [m] and angle [rad] of the output's frame in that of the estimate.

    Both are poses (3,) of the climber, at the same time, each in its own.
    """
    angle = float(estimate[2] - output[2])
    cosine, sine, (x, y) = math.cos(angle), math.sin(angle), output[:2].tolist()
    turned = cosine * x - sine * y, sine * x + cosine * y
    return float(estimate[0]) - turned[0], float(estimate[1]) - turned[1], angle
