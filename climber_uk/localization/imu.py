"""Yaw rate between two samples of the encoders, and the specific force that the weight makes.

    f_x - v̇ + u ω + ω² r_x + ω̇ r_y = g_t sinθ    f_y - v ω - u̇ + ω² r_y - ω̇ r_x = g_t cosθ

of an IMU that is at r in the climber's frame, which slips to the left at u. All go through the same
low-pass, twice, so that they are equally late. A bar for each time: v̇ is (v̄ - v̿) / τ, ω̇ and u̇
alike, and θ̿ = θ - τ (ω̄ + ω̿). What is slower than 1/τ the low-pass leaves as it is: each sample
counts as much as it does without. Once would leave too much of the encoders' counts in v̇.
"""

from typing import NamedTuple

from climber_uk.localization.encoders import Rolled

TIME = 0.04  # [s] τ
DELAY = 2 * TIME  # [s] of all that went through
FILLED = 4 * TIME  # [s] over which that is a mean, once it is no more one of all samples
SPACING = 0.02  # [s] from one weight to the next: in between they tell hardly anything new
MOST = 1000  # samples that wait for encoders, which may have stopped
STALE = 0.25  # [s] without a sample, after which there is no IMU


class Weight(NamedTuple):
    """Specific force of a climber's weight, through the low-pass."""

    forwards: float  # [m/s²]
    left: float
    turned: float  # [rad] by which the heading was less
    time: float  # [s] for which this stands
    known: float  # [s] over which it is a mean: since the first sample, at most `FILLED`

    @property
    def has_only_begun(self) -> bool:
        """Whether it is a mean of no more than the first few samples."""
        return self.known < FILLED - 1e-9


class Mean:
    """Low-pass of first order, with the plain mean where it has only begun."""

    def __init__(self, time: float = TIME) -> None:
        self.value, self._time, self._most = 0.0, 0.0, time

    def add(self, value: float, duration: float) -> None:
        """Take a value that holds for `duration` [s]."""
        self._time = min(self._time + duration, self._most + duration)
        self.value += (value - self.value) * duration / self._time


class LowPass:
    """Two in a row."""

    def __init__(self) -> None:
        self.first, self.second = Mean(), Mean()

    def add(self, value: float, duration: float) -> None:
        """Take a value that holds for `duration` [s]."""
        self.first.add(value, duration)
        self.second.add(self.first.value, duration)


class Imu:
    """Takes samples; `yaw_rate` and `weight` are since the last sample of the encoders."""

    def __init__(self, x: float = 0.0, y: float = 0.0) -> None:
        """An IMU at (x, y) [m] in the climber's frame."""
        self._place = x, y
        self.stamp: int | None = None  # [ns] of the last sample
        self.period = 0.005  # [s] between two samples
        self._samples: list[tuple[float, float]] = []  # since the last encoders
        self._is_used = False
        self._known = self._unused = 0.0  # [s]
        self._forwards, self._left = LowPass(), LowPass()
        self._speed, self._centripetal, self._yaw_rate = LowPass(), LowPass(), LowPass()
        self._square = LowPass()  # of the yaw rate
        self._aside, self._swung = LowPass(), LowPass()

    def add(self, stamp: int, yaw_rate: float, forwards: float, left: float) -> None:
        """Take yaw rate [rad/s] and specific force [m/s²] of a `stamp` [ns], all in the body's."""
        if self.stamp is not None:
            passed = (stamp - self.stamp) * 1e-9
            if -STALE < passed <= 0:
                return
            if passed > 0:  # else one of the two has a wrong stamp, or time has started anew
                self.period = min(passed, STALE)
        self.stamp = stamp
        if self._is_used:
            self._samples.clear()
        self._is_used = False
        del self._samples[: -MOST + 1]
        self._samples.append((yaw_rate, forwards))
        self._known, self._unused = self._known + self.period, self._unused + self.period
        self._forwards.add(forwards, self.period)
        self._left.add(left, self.period)

    def is_there(self, stamp: int) -> bool:
        """Whether there is a sample not older than `STALE`, at `stamp` [ns]."""
        return self.stamp is not None and abs(stamp - self.stamp) < STALE * 1e9

    def is_due(self, stamp: int) -> bool:
        """Whether a sample of `stamp` [ns], or of a little before, is still to be expected."""
        if self.stamp is None or not self.is_there(stamp):
            return False
        return (stamp - self.stamp) * 1e-9 >= 0.9 * self.period

    def means(self) -> tuple[float, float]:
        """Mean yaw rate [rad/s] and specific force forwards of the centre, less what ω̇ makes.

        They are of all samples since the last call; without any, the last one.
        """
        number = len(self._samples)
        yaw_rate, forwards = (sum(parts) / number for parts in zip(*self._samples, strict=True))
        del self._samples[:-1]
        self._is_used = True
        return yaw_rate, forwards + yaw_rate * yaw_rate * self._place[0]

    def weight(self, rolled: Rolled, yaw_rate: float, aside: float = 0.0) -> Weight | None:
        """Force of the weight after what was `rolled` at a `yaw_rate` [rad/s]; None: not yet.

        The climber slips to the left at a speed `aside` [m/s].
        """
        speed = rolled.speed
        self._speed.add(speed, rolled.duration)
        self._centripetal.add(speed * yaw_rate, rolled.duration)
        self._yaw_rate.add(yaw_rate, rolled.duration)
        self._square.add(yaw_rate * yaw_rate, rolled.duration)
        self._aside.add(aside, rolled.duration)
        self._swung.add(aside * yaw_rate, rolled.duration)
        if self._unused == 0 or self._unused + 1e-9 < min(SPACING, self._known):
            return None
        time, self._unused = self._unused, 0.0
        acceleration = (self._speed.first.value - self._speed.second.value) / TIME
        acceleration -= self._swung.second.value
        faster_aside = (self._aside.first.value - self._aside.second.value) / TIME
        faster = (self._yaw_rate.first.value - self._yaw_rate.second.value) / TIME
        turning = self._yaw_rate.first.value + self._yaw_rate.second.value
        (x, y), square = self._place, self._square.second.value
        return Weight(
            self._forwards.second.value - acceleration + square * x + faster * y,
            self._left.second.value
            - (self._centripetal.second.value + faster_aside)
            + (square * y - faster * x),
            TIME * turning,
            time,
            min(self._known, FILLED),
        )
