"""Yaw rate between two samples of the encoders, and the specific force that the weight makes.

    f_x - v̇ = g_t sinθ    f_y - v ω = g_t cosθ

v̇ is (v - v̄) / τ, v̄ being v through a low-pass of time constant τ. Force, v ω and θ go through the
same one, so that all are equally late: θ̄ = θ - τ ω̄. Below 1/τ the low-pass leaves noise as it is,
so that each sample counts as much as it does without.
"""

from typing import NamedTuple

from climber_uk.localization.encoders import Rolled

TIME = 0.1  # [s] τ
SPACING = 0.02  # [s] from one weight to the next: in between they tell hardly anything new
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
        self._samples: list[
            tuple[float, float]
        ] = []  # yaw rate, force forwards: since the last encoders
        self._is_used = False
        self._known = self._unused = 0.0  # [s]
        self._forwards, self._left = Mean(), Mean()
        self._speed, self._centripetal, self._yaw_rate = Mean(), Mean(), Mean()

    def add(self, stamp: int, yaw_rate: float, forwards: float, left: float) -> None:
        """Take yaw rate [rad/s] and specific force [m/s²] of a `stamp` [ns], all in the body's."""
        if self.stamp is not None:
            if stamp <= self.stamp:
                return
            self.period = min((stamp - self.stamp) * 1e-9, STALE)
        self.stamp = stamp
        if self._is_used:
            self._samples.clear()
        self._is_used = False
        self._samples.append((yaw_rate, forwards))
        self._known, self._unused = self._known + self.period, self._unused + self.period
        self._forwards.add(forwards, self.period)
        self._left.add(left, self.period)

    def is_there(self, stamp: int) -> bool:
        """Whether there is a sample not older than `STALE`, at `stamp` [ns]."""
        return self.stamp is not None and abs(stamp - self.stamp) < STALE * 1e9

    def means(self) -> tuple[float, float]:
        """Yaw rate [rad/s] and specific force forwards [m/s²]: means since the last call.

        Without a sample since then, they are the last ones.
        """
        rates, forces = zip(*self._samples, strict=True)
        del self._samples[:-1]
        self._is_used = True
        return sum(rates) / len(rates), sum(forces) / len(forces)

    def weight(self, rolled: Rolled, yaw_rate: float) -> Weight | None:
        """Force of the weight after what was `rolled` at a `yaw_rate` [rad/s]; None: not yet."""
        speed = rolled.speed
        self._speed.add(speed, rolled.duration)
        self._centripetal.add(speed * yaw_rate, rolled.duration)
        self._yaw_rate.add(yaw_rate, rolled.duration)
        if self._unused == 0 or self._unused + 1e-9 < min(SPACING, self._known):
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
