"""How far a climber whose wheels scrub has gone: in turns they slip along, too, for moments.

    v̂̇ = f_x - β_x - g_t sinθ + γ / (T (1 + γ²/G²))    γ = V - v̂

The speed v̂ is the accelerometer's at once, and soon that V of the wheels. Where they break away
they tell hardly anything of the climber: what is much faster than it counts the less; but no
longer than `LONGEST`, or an accelerometer that is off would carry the speed away.
"""

import math
from typing import NamedTuple

from climber_uk.localization.encoders import Rolled
from climber_uk.localization.imu import Mean

SOON = 0.05  # [s] T
SLIPS = 0.02  # [m/s] G
BREAKS_AWAY = 0.08  # [m/s] of γ, from which on gravity is not told from what wheels accelerate,
MEMORY = 0.2  # and for as long [s] after that: the force goes through a low-pass
LONGEST = 1.0  # [s] for which wheels may slip
TURNING = 0.05  # [s] of the low-pass of a turn: of noise, its size would be a turn, too


class Push(NamedTuple):
    """What an IMU tells of the centre, less weight and biases."""

    acceleration: float  # [m/s²] forwards
    yaw_rate: float  # [rad/s]
    aside: float  # [m] how far to the left it is


class Scrubbing:
    """Goes on from one sample of the encoders to the next."""

    def __init__(self) -> None:
        """At rest."""
        self._speed = 0.0  # [m/s] of the IMU, forwards
        self._slipped = self._broken = 0.0  # [s]
        self._turning = Mean(TURNING)

    @property
    def breaks_away(self) -> bool:
        """Whether wheels do, or did a moment ago."""
        return self._broken > 0

    def turned(self, yaw_rate: float, duration: float) -> float:
        """|α| [rad] of a turn at a yaw rate [rad/s] without bias."""
        self._turning.add(yaw_rate, duration)
        return abs(self._turning.value) * duration

    def distance(self, rolled: Rolled, push: Push | None) -> float:
        """Way forwards [m] after what was `rolled`; without a `push` it is the wheels'."""
        swing = push.yaw_rate * push.aside if push else 0.0
        if push is None or rolled.rests:
            self._speed, self._slipped, self._broken = rolled.speed - swing, 0.0, 0.0
            return rolled.distance
        speed = self._speed + swing + push.acceleration * rolled.duration
        behind, duration = rolled.speed - speed, rolled.duration
        slips = abs(behind) > SLIPS
        slipped = self._slipped + (duration if slips else -duration)
        self._slipped = min(max(slipped, 0.0), 1.2 * LONGEST)
        trust = 1.0 if slipped > LONGEST else 1 / (1 + (behind / SLIPS) ** 2)
        broken = abs(behind) > BREAKS_AWAY
        self._broken = MEMORY if broken else max(self._broken - duration, 0.0)
        speed += behind * trust * (1 - math.exp(-duration / SOON))
        self._speed = speed - swing
        return speed * duration
