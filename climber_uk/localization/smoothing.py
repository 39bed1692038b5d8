"""The output: the estimate, but for what corrections have moved it, which it follows at its pace.

    o⁺ = o - clip(o Δt / T, ± v Δt)    o: output less estimate

A controller that is fed a jump answers it with torque.
"""

import math

import numpy as np

from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import Array


class Smoothing:
    """Keeps how far the output is behind the estimate."""

    def __init__(self, options: LocalizationOptions) -> None:
        self.options = options
        self.offset: Array = np.zeros(3)  # of the output from the estimate [m], [rad]

    def corrected(self, before: Array, after: Array) -> None:
        """Let the output be where it was, though the estimate's pose (3,) has moved."""
        self.offset = self.offset + before - after

    def go_on(self, duration: float) -> None:
        """Follow for `duration` [s]."""
        options, offset = self.options, self.offset
        way = math.hypot(offset[0], offset[1])
        share = duration / options.pull_time
        fastest = np.array([options.pull_speed * duration, options.pull_yaw_rate * duration])
        along = min(share, fastest[0] / way if way > 0 else 1.0, 1.0)
        angle = abs(float(offset[2]))
        about = min(share, fastest[1] / angle if angle > 0 else 1.0, 1.0)
        self.offset = offset * (1 - np.array([along, along, about]))
