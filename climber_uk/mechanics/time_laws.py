"""Time laws: how far along its shape the climber is at a time, s(t) with three derivatives.

A new law is one class with `duration` and `progress`, and one entry in `TIME_LAWS`.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.elementary import Derivatives, compose
from climber_uk.mechanics.parameter import check, parameter
from climber_uk.mechanics.shapes import Shape


class TimeLaw(Protocol):
    """Progress along a shape."""

    def duration(self, shape: Shape) -> float:
        """Time after which the climber rests for good [s]; infinite if it never does."""

    def horizon(self, shape: Shape) -> float:
        """Time by which all has been seen that the law does [s]: at most two rounds or one way."""

    def progress(self, time: Array, shape: Shape) -> Derivatives:
        """s, ṡ, s̈, s⃛ at `time` (...) [s], in the units of the shape's path parameter."""


def _rate() -> float:
    rate: float = parameter(
        1.0, "", "path parameter a second: rad/s for round shapes, m/s for others", above=0
    )
    return rate


@dataclass(frozen=True)
class ConstantRate:
    """s = rate · t: already moving at the start, and for ever."""

    rate: float = _rate()

    def __post_init__(self) -> None:
        check(self)

    def duration(self, shape: Shape) -> float:
        """See `TimeLaw`."""
        return math.inf

    def horizon(self, shape: Shape) -> float:
        """See `TimeLaw`."""
        return shape.length / self.rate

    def progress(self, time: Array, shape: Shape) -> Derivatives:
        """See `TimeLaw`."""
        zero = np.zeros_like(time)
        return self.rate * time, self.rate + zero, zero, zero


@dataclass(frozen=True)
class RestToRest:
    """From rest up to `rate`, along, and back to rest, smooth to the jerk; once or repeatedly.

    A run goes `laps` times around a closed shape or once along an open one. The next run goes on
    around the closed shape, or back along the open one with the heading kept: in reverse gear.
    """

    rate: float = _rate()
    ramp_time: float = parameter(3.0, "s", "time from rest to the full rate", above=0)
    laps: int = parameter(1, "", "rounds of a closed shape without a stop", at_least=1)
    runs: int = parameter(1, "", "runs from rest to rest; 0: without end", at_least=0)
    pause: float = parameter(1.0, "s", "rest between two runs", at_least=0)

    def __post_init__(self) -> None:
        check(self)

    def duration(self, shape: Shape) -> float:
        """See `TimeLaw`."""
        _, _, run_time = self._run(shape)
        return self.runs * (run_time + self.pause) - self.pause if self.runs else math.inf

    def horizon(self, shape: Shape) -> float:
        """See `TimeLaw`."""
        rate, _, run_time = self._run(shape)
        return min(run_time, 2 * shape.length / rate + self.ramp_time)

    def progress(self, time: Array, shape: Shape) -> Derivatives:
        """See `TimeLaw`."""
        rate, brake_start, run_time = self._run(shape)
        last_run = self.runs - 1 if self.runs else math.inf
        run = np.clip(np.floor(time / (run_time + self.pause)), 0, last_run)
        since = np.clip(time - run * (run_time + self.pause), 0, run_time)
        faster = smooth_start(since, self.ramp_time)
        slower = smooth_start(since - brake_start, self.ramp_time)
        s, s_1, s_2, s_3 = (rate * (up - down) for up, down in zip(faster, slower, strict=True))
        if shape.closed:
            return s + run * rate * brake_start, s_1, s_2, s_3
        back = np.mod(run, 2)
        sign = 1 - 2 * back
        return back * shape.length + sign * s, sign * s_1, sign * s_2, sign * s_3

    def _run(self, shape: Shape) -> tuple[float, float, float]:
        """Highest rate, start of the braking and end of a run [s]."""
        span = shape.length * (self.laps if shape.closed else 1)
        rate = min(self.rate, span / self.ramp_time)
        return rate, span / rate, span / rate + self.ramp_time


@dataclass(frozen=True)
class Stopping:
    """Another law until `start`, from where its clock runs slower until all is at rest."""

    law: TimeLaw
    start: float  # [s]
    ramp_time: float  # [s]

    def duration(self, shape: Shape) -> float:
        """See `TimeLaw`."""
        return self.start + self.ramp_time

    def horizon(self, shape: Shape) -> float:
        """See `TimeLaw`."""
        return self.duration(shape)

    def progress(self, time: Array, shape: Shape) -> Derivatives:
        """See `TimeLaw`."""
        since = np.minimum(time - self.start, self.ramp_time)
        lost, slower, t_2, t_3 = smooth_start(since, self.ramp_time)
        law = self.law.progress(self.start + since - lost, shape)
        return compose(law, (1 - slower, -t_2, -t_3))


TIME_LAWS = {"constant_rate": ConstantRate, "rest_to_rest": RestToRest}


def smooth_start(time: Array, ramp_time: float) -> Derivatives:
    """Distance, rate and its derivatives of a motion from rest at 0 to rate 1 at `ramp_time`.

    The rate is 10 u³ - 15 u⁴ + 6 u⁵, u = t / ramp_time: smooth to the jerk at both ends.
    """
    u = np.clip(time / ramp_time, 0, 1)
    return (
        ramp_time * u**4 * (2.5 - 3 * u + u**2) + np.maximum(time - ramp_time, 0),
        u**3 * (10 - 15 * u + 6 * u**2),
        30 * u**2 * (1 - u) ** 2 / ramp_time,
        60 * u * (1 - u) * (1 - 2 * u) / ramp_time**2,
    )
