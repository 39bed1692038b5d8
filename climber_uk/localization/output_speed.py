"""Speed and yaw rate for the output: what wheels' angles tell, without the steps of their counts.

    e = p - p̂    p̂̇ = v̂ + 3 W e    v̂̇ = â + 3 W² e    â̇ = W³ e

A count is an error of the angle, not of its rate: a filter that takes ways p makes far less noise
of it than a low-pass of their differences would, and is not late: v̂ is wrong by the change of the
acceleration only. The yaw rate is the wheels' too, as a gyro is rough; but below 1 / `GYRO_TIME` it
is the gyro's, which no wheel that scrubs misleads.
"""

import math

from climber_uk.localization.imu import Mean

GYRO_TIME = 0.2  # [s]
SCRUBBING_TIME = 0.01  # [s] of wheels that scrub: their turns tell hardly more than gyros do


class Rate:
    """Rate of what has gone a way since the last time."""

    def __init__(self, frequency: float) -> None:
        """Poles at a `frequency` W [rad/s]."""
        self.value, self._frequency = 0.0, frequency
        self._ahead = self._change = 0.0  # p - p̂, â

    def go_on(self, way: float, duration: float) -> float:
        """Rate after a way that took `duration` [s]: three poles at exp(-W `duration`)."""
        kept = math.exp(-self._frequency * duration)
        new = 1 - kept
        expected = self.value * duration + self._change * duration**2 / 2
        error = self._ahead + way - expected
        self._ahead = kept**3 * error
        self.value += self._change * duration + 1.5 * new * new * (1 + kept) * error / duration
        self._change += new**3 * error / duration**2
        return self.value


class OutputSpeed:
    """Goes on from one sample of the encoders to the next."""

    def __init__(self, frequency: float, scrubs: bool = False) -> None:
        """With a filter's W [rad/s], of wheels that roll or scrub."""
        self._speed, self._yaw_rate = Rate(frequency), Rate(frequency)
        # [rad/s] by which the wheels' yaw rate is below the gyro's
        self._lag = Mean(SCRUBBING_TIME if scrubs else GYRO_TIME)

    def go_on(
        self, distance: float, wheels: float, gyro: float, duration: float
    ) -> tuple[float, float]:
        """Speed [m/s] and yaw rate [rad/s] after a `distance` [m], and yaw rates of both."""
        self._lag.add(gyro - wheels, duration)
        angle = (wheels + self._lag.value) * duration
        return self._speed.go_on(distance, duration), self._yaw_rate.go_on(angle, duration)
