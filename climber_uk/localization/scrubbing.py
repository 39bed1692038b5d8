"""How far a climber whose wheels scrub has gone: in turns they slip along, too.

    v̂̇ = f_x - β_x - g_t sinθ + u ω + γ / (T (1 + γ²/G²))    γ = V - v̂

The speed v̂ is the accelerometer's at once, and soon that V of the wheels, less what they are
expected to slip (`models`). Where they break away they tell hardly anything of the climber: what is
much faster than it counts the less; but no longer than `LONGEST`, or an accelerometer that is off
would carry the speed away. By how much v̂ depends on the slip that is expected follows alike.
"""

import math
from typing import NamedTuple

import numpy as np

from climber_uk.localization.encoders import Rolled
from climber_uk.localization.imu import Mean
from climber_uk.localization.options import LocalizationOptions

SOON = 0.05  # [s] T
SLIPS = 0.02  # [m/s] G
BREAKS_AWAY = 0.08  # [m/s] of γ, from which on gravity is not told from what wheels accelerate,
MEMORY = 0.2  # and for as long [s] after that: the force goes through a low-pass
LONGEST = 1.0  # [s] for which wheels may slip
TURNING = 0.05  # [s] of the low-pass of a turn: of noise, its size would be a turn, too
ENDS = 0.015  # [s] of the low-pass in which the sides stop to slip, as the turn ends
DRAGGED = 0.1  # [m/s] about which it changes its sign what drags


class Push(NamedTuple):
    """What an IMU tells of the centre, less weight and biases."""

    acceleration: float  # v̇ [m/s²] forwards
    yaw_rate: float  # [rad/s]
    aside: float  # [m] how far to the left it is


class Turned(NamedTuple):
    """What wheels that scrub do in a turn; see `models.Travel`."""

    angle: float  # |α| [rad], whichever way
    slipped: float  # T [m] by which the sides slip against each other
    dragged: float  # D [m]: that, with the sign of the way


class Gone(NamedTuple):
    """How far the climber has gone, and what of the wheels' slip that depends on."""

    distance: float  # [m] forwards
    slipped: float  # T [m]
    dragged: float  # D [m]


class Scrubbing:
    """Goes on from one sample of the encoders to the next."""

    def __init__(self) -> None:
        """At rest."""
        self._speed = 0.0  # [m/s] of the IMU, forwards
        self._by_slips = np.zeros(2)  # [m/s] of that, T and D by their time
        self._slipped = self._broken = 0.0  # [s]
        self._turning, self._sides, self._rolling = Mean(TURNING), Mean(TURNING), Mean(TURNING)
        self._slips = Mean(ENDS)  # [m/s] the sides, against each other

    @property
    def breaks_away(self) -> bool:
        """Whether wheels do, or did a moment ago."""
        return self._broken > 0

    def turned(self, rolled: Rolled, yaw_rate: float, options: LocalizationOptions) -> Turned:
        """What was `rolled` in a turn at a yaw rate [rad/s] without bias."""
        duration = rolled.duration
        self._turning.add(yaw_rate, duration)
        self._sides.add(rolled.yaw_rate * options.turning_lever, duration)
        self._rolling.add(rolled.speed, duration)
        sides, speed = self._sides.value, self._rolling.value
        slipping = sides - options.half_track * self._turning.value
        now = rolled.yaw_rate * options.turning_lever - options.half_track * yaw_rate
        self._slips.add(now, duration)
        # wheels that roll again tell the climber's speed at once
        still = max(self._slips.value * math.copysign(1.0, slipping), 0.0)
        slipped = math.copysign(min(abs(slipping), still) * duration, slipping * sides)
        dragged = slipped * speed / math.hypot(speed, DRAGGED)
        return Turned(abs(self._turning.value) * duration, slipped, dragged)

    def go_on(self, rolled: Rolled, push: Push | None, turned: Turned, slip: float) -> Gone:
        """Go on after what was `rolled`, and has slipped along by `slip` [m] as is expected.

        Without a `push` the way is the wheels'.
        """
        duration, swing = rolled.duration, push.yaw_rate * push.aside if push else 0.0
        speed, share = rolled.speed - slip / duration, 1.0
        if push is None or rolled.rests:
            self._slipped = self._broken = 0.0
        else:
            expected = self._speed + swing + push.acceleration * duration
            share = self._trust(speed - expected, duration) * (1 - math.exp(-duration / SOON))
            speed = expected + share * (speed - expected)
        self._speed = speed - swing
        by_slips = np.array([turned.slipped, turned.dragged]) / duration
        self._by_slips = self._by_slips + share * (by_slips - self._by_slips)
        return Gone(speed * duration, *(self._by_slips * duration).tolist())

    def _trust(self, behind: float, duration: float) -> float:
        """How much wheels count that are faster by so much [m/s] than is expected."""
        slipped = self._slipped + (duration if abs(behind) > SLIPS else -duration)
        self._slipped = min(max(slipped, 0.0), 1.2 * LONGEST)
        broken = abs(behind) > BREAKS_AWAY
        self._broken = MEMORY if broken else max(self._broken - duration, 0.0)
        return 1.0 if slipped > LONGEST else 1 / (1 + (behind / SLIPS) ** 2)
