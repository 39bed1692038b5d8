"""Yaw rate between two samples of the encoders, and the specific force that the weight makes.

    f_x - v̇ = g_t sinθ    f_y - v ω = g_t cosθ

v̇ is (v - v̄) / τ, v̄ being v through a low-pass of time constant τ. Force, v ω and θ go through the
same one, so that all are equally late: θ̄ = θ - τ ω̄. Below 1/τ the low-pass leaves noise as it is,
so that each sample counts as much as it does without.
"""

from typing import NamedTuple

from climber_uk.localization.encoders import Rolled

TIME = 0.1  # [s] τ
STALE = 0.25  # [s] without a sample, after which there is no IMU


class Weight(NamedTuple):
    """Specific force of a climber's weight, through the low-pass."""

    forwards: float  # [m/s²]
    left: float
    turned: float  # [rad] by which the heading was less
    time: float  # [s] for which this stands
    known: float  # [s] since the first sample, at most 2 τ: over which it is a mean


class Mean:
    """Low-pass of first order, with the plain mean where it has only begun."""

    def __init__(self) -> None:
        self.value, self._time = 0.0, 0.0

    def add(self, value: float, duration: float) -> None:
        """Take a value that holds for `duration` [s]."""
        self._time = min(self._time + duration, TIME + duration)
        self.value += (value - self.value) * duration / self._time


class Imu:
    """Takes samples; `yaw_rate` and `weight` are since the last sample of the encoders."""

    def __init__(self) -> None:
        self.stamp: int | None = None  # [ns] of the last sample
        self.period = 0.005  # [s] between two samples
        self._rates: list[float] = []
        self._last_rate = 0.0
        self._known = self._unused = 0.0  # [s]
        self._forwards, self._left = Mean(), Mean()
        self._speed, self._centripetal, self._yaw_rate = Mean(), Mean(), Mean()

    def add(self, stamp: int, yaw_rate: float, forwards: float, left: float) -> None:
        """Take yaw rate [rad/s] and specific force [m/s²] of a `stamp` [ns], all in the body's."""
        if self.stamp is not None:
            if stamp <= self.stamp:
                return
            self.period = min((stamp - self.stamp) * 1e-9, STALE)
        self.stamp, self._last_rate = stamp, yaw_rate
        self._rates.append(yaw_rate)
        self._known, self._unused = self._known + self.period, self._unused + self.period
        self._forwards.add(forwards, self.period)
        self._left.add(left, self.period)

    def is_there(self, stamp: int) -> bool:
        """Whether there is a sample not older than `STALE`, at `stamp` [ns]."""
        return self.stamp is not None and abs(stamp - self.stamp) < STALE * 1e9

    def yaw_rate(self) -> float:
        """Mean [rad/s] of the samples since the last call, else the last one."""
        rates, self._rates = self._rates or [self._last_rate], []
        return sum(rates) / len(rates)

    def weight(self, rolled: Rolled, yaw_rate: float) -> Weight | None:
        """Force of the weight after what was `rolled` at a `yaw_rate` [rad/s]; None: no sample."""
        speed = rolled.speed
        self._speed.add(speed, rolled.duration)
        self._centripetal.add(speed * yaw_rate, rolled.duration)
        self._yaw_rate.add(yaw_rate, rolled.duration)
        if self._unused == 0:
            return None
        time, self._unused = self._unused, 0.0
        acceleration = (speed - self._speed.value) / TIME
        return Weight(
            self._forwards.value - acceleration,
            self._left.value - self._centripetal.value,
            TIME * self._yaw_rate.value,
            time,
            min(self._known, 2 * TIME),
        )
