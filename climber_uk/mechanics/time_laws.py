"""Time laws: how far along its shape the climber is at a time, s(t) with three derivatives.

A new law is one class, a `TimeLaw` with `rate` as a field or 0, and one entry in `TIME_LAWS`, or
an entry point `climber_uk.time_laws` of another package.
"""

import math
from dataclasses import replace
from typing import ClassVar, Protocol

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.elementary import Derivatives
from climber_uk.mechanics.fastest_law import Fastest
from climber_uk.mechanics.shapes import Shape
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.registry import Variants


class TimeLaw(Protocol):
    """Progress s(t) along a shape."""

    @property
    def rate(self) -> float:
        """Highest ṡ, in the path parameter's unit a second."""

    def duration(self, shape: Shape) -> float:
        """Time after which the climber rests for good [s]; infinite if it never does."""

    def horizon(self, shape: Shape) -> float:
        """Time [s] after which a law only repeats itself: at most two rounds, or once along."""

    def progress(self, time: Array, shape: Shape) -> Derivatives:
        """s, ṡ, s̈, s⃛ at `time` (...) [s], in the units of the shape's path parameter."""

    stops: ClassVar[bool] = True
    """Whether it rests where an open shape ends, and where a shape turns back."""


def _rate() -> float:
    return parameter(
        1.0, "", "path parameter a second: rad/s for round shapes, m/s for others", above=0
    )


@parameters
class ConstantRate(TimeLaw):
    """s = rate · t: already moving at the start, and without an end."""

    rate: float = _rate()
    stops: ClassVar[bool] = False

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


@parameters
class RestToRest(TimeLaw):
    """From rest up to `rate`, along, and back to rest, smooth to the jerk; once or repeatedly.

    A run goes `laps` times around a closed shape or once along an open one, from rest to rest
    between the places where the shape turns back. The next run goes on around the closed shape,
    or back along the open one with the heading kept: in reverse gear.
    """

    rate: float = _rate()
    ramp_time: float = parameter(
        3.0, "s", "rest to full rate; shorter takes more torque", at_least=1e-3
    )
    laps: int = parameter(1, "", "rounds of a closed shape without a stop", at_least=1)
    runs: int = parameter(1, "", "runs from rest to rest; 0: without end", at_least=0)
    pause: float = parameter(1.0, "s", "rest between two runs", at_least=0)

    def duration(self, shape: Shape) -> float:
        """See `TimeLaw`."""
        run_time = float(self._legs(shape)[2][-1])
        return self.runs * run_time + (self.runs - 1) * self.pause if self.runs else math.inf

    def horizon(self, shape: Shape) -> float:
        """See `TimeLaw`."""
        few = replace(self, laps=min(self.laps, 2))
        return float(few._legs(shape)[2][-1])

    def progress(self, time: Array, shape: Shape) -> Derivatives:
        """See `TimeLaw`."""
        places, times, _ = legs = self._legs(shape)
        run_time = times[-1]
        last_run = self.runs - 1 if self.runs else math.inf
        run = np.clip(np.floor(time / (run_time + self.pause)), 0, last_run)
        since = np.clip(time - run * (run_time + self.pause), 0, run_time)
        if shape.closed:
            s, *rates = self._along(since, *legs)
            return s + run * places[-1], *rates
        back = np.mod(run, 2)  # odd runs go back along the path
        sign = 1 - 2 * back
        s, s_1, s_2, s_3 = self._along(back * run_time + sign * since, *legs)
        return s, sign * s_1, s_2, sign * s_3

    def _legs(self, shape: Shape) -> tuple[Array, Array, Array]:
        """Path parameters (n,) where a run rests, both ends included, until when, and since.

        Times (n,) are in [s].
        """
        laps = self.laps if shape.closed else 1
        span = shape.length * laps
        places, dwell = np.array([0.0, span]), np.zeros(2)
        on_the_way, dwells = shape.rests
        if len(on_the_way):
            rests = (on_the_way + shape.length * np.arange(laps)[:, None]).ravel()
            is_within = (rests > 1e-9 * shape.length) & (rests < span - 1e-9 * shape.length)
            places = np.insert(places, 1, rests[is_within])
            dwell = np.insert(dwell, 1, np.tile(dwells, laps)[is_within])
        distances = np.diff(places)
        times = distances / np.minimum(self.rate, distances / self.ramp_time) + self.ramp_time
        until = np.concatenate([[0.0], np.cumsum(times + dwell[1:])])
        return places, until, until - dwell

    def _along(self, since: Array, places: Array, times: Array, _: Array) -> Derivatives:
        """s and its derivatives at `since` (...) of a run, from rest to rest on each leg."""
        leg = np.clip(np.searchsorted(times, since, "right") - 1, 0, len(times) - 2)
        distance, since = places[leg + 1] - places[leg], since - times[leg]
        rate = np.minimum(self.rate, distance / self.ramp_time)
        faster = smooth_start(since, self.ramp_time)
        slower = smooth_start(since - distance / rate, self.ramp_time)
        s, s_1, s_2, s_3 = (rate * (up - down) for up, down in zip(faster, slower, strict=True))
        return places[leg] + s, s_1, s_2, s_3


TIME_LAWS = Variants[type[TimeLaw]](
    {"constant_rate": ConstantRate, "rest_to_rest": RestToRest, "fastest": Fastest}, "time_laws"
)


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
