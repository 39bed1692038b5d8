"""Thousands of closed loops at once: the node's estimator and law with unicycle climbers.

Whatever is a number in a `Climber`, in gains, in sensors or in a start may be an array (N,) of one
for each loop. Loops run in blocks that fit the cache, and their outcome is summed up on the way:
memory grows with the block, not with N or the duration. Not in here, but in `simulate`: a
reference that waits, jumps and safe outputs, lost and late messages, motors with a lag, wheel
odometry, pumps, and every contact but that of a `UnicycleModel` climber: its wheels hold, and no
side slip is learnt.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple

import numpy as np

from climber_uk.closed_loop import pressure_gauge
from climber_uk.closed_loop.outcome import Outcome, Tally
from climber_uk.closed_loop.period import BatchRun, Given, LoopsState, go_on
from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.estimator import Estimator
from climber_uk.control.model import Observer
from climber_uk.control.timing import Timing
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact, Wheeled
from climber_uk.mechanics.friction import Coulomb
from climber_uk.mechanics.many import chosen, indexed, keep_what_is_freed
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, ReferencePoint, Torques
from climber_uk.mechanics.wall import Wall
from climber_uk.simulation.sensors import Sensors

LOOPS_AT_ONCE = 16384  # fastest, by measurement
PERIODS_AT_ONCE = 64  # for which noise and targets are made together


class Change(NamedTuple):
    """The true climbers become `climber` at `time` [s]: less suction, other friction."""

    time: Any
    climber: Climber


@dataclass(frozen=True)
class Loops:
    """N climbers, their controllers and sensors; `ValueError` for what the module excludes."""

    start: Motion  # arrays (N,)
    climber: Climber  # the true ones; those that the controllers believe in are in `law`
    law: ControlLaw
    observer: Observer = field(default_factory=Observer)
    sensors: Sensors = field(default_factory=Sensors)
    seeds: Array | None = None  # (N,) integers: noise as the plant's sensors make it of a seed
    changes: tuple[Change, ...] = ()
    timing: Timing = field(default_factory=Timing)
    contact: Contact = field(default_factory=Contact)  # for the margins
    wall: Wall | None = None  # the true one, as a `ControlLaw` has it
    gauge: float = 0.0  # [s] period in which controllers are sent the pressure; 0: never

    def __post_init__(self) -> None:
        if self.seeds is None and not self.sensors.is_ideal:
            raise ValueError("seeds=None must be one for each loop, for sensors that err")
        sensors, contact = self.sensors, self.contact
        for name, value, wanted in (
            ("odometry_source", sensors.odometry_source, "truth"),
            ("odometry_delay", sensors.odometry_delay, 0.0),
            ("friction", type(contact.friction), Coulomb),
            ("locomotion", type(contact.locomotion), Wheeled),
            ("seal_radius", contact.grip.seal_radius, 0.0),
        ):
            if value != wanted:
                raise ValueError(f"{name}={value!r} must be {wanted!r} in many loops at once")

    def run(self, course: BatchRun, block: int = LOOPS_AT_ONCE) -> Outcome:
        """Outcome of each loop, arrays (N,); `block` loops run at once."""
        number = len(self.start.x)
        keep_what_is_freed()
        preview = sampled(course.trajectory, course.duration)
        outcomes = [
            indexed(self, slice(first, first + block)).run_block(course, preview)
            for first in range(0, number, block)
        ]
        return Outcome(*(np.concatenate(arrays) for arrays in zip(*outcomes, strict=True)))

    def run_block(self, course: BatchRun, preview: Preview) -> Outcome:
        """The same, all loops at once."""
        state, periods = self.begun(course), self.periods(course)
        if course.backend == "jax":
            from climber_uk.closed_loop import traced  # JAX takes long to import

            traced.go_on(state, periods, course, preview, self._changing)
        else:
            go_on(state, periods, course, preview)
        return state.tally.outcome()

    def begun(self, course: BatchRun) -> LoopsState:
        """Loops before their first period."""
        number = len(self.start.x)
        in_motion = np.any(self.start.speed) or np.any(self.start.yaw_rate)
        return LoopsState(
            Estimator(self.law.climber, self.observer, self.timing, wall=self.law.wall),
            Tally.begun(number, self.contact, self.wall),
            self.sensors,
            self.start,
            None if in_motion else Torques(*np.zeros((2, number))),
            course.delay,
        )

    def periods(self, course: BatchRun) -> Iterator[Given]:
        """What each period begins with, that at the end of the duration included."""
        ticks = round(course.duration / course.period)
        controllers = pressure_gauge.controllers(
            self.law, self._climbers(course, ticks), course.period, self.gauge
        )
        climbers, targets = self._climbers(course, ticks), _targets(course, ticks)
        by_tick = zip(self._noise(ticks), climbers, controllers, targets, strict=True)
        for tick, given in enumerate(by_tick):
            time = tick * course.period
            yield Given(SECOND + round(time * SECOND), time, *given)

    def _noise(self, ticks: int) -> Iterator[Array | None]:
        """For every odometry five numbers of unit variance (5, N), or None if sensors are ideal."""
        if self.sensors.is_ideal:
            yield from [None] * (ticks + 1)
            return
        seeds = np.asarray(self.seeds).tolist()
        randoms = [np.random.default_rng(seed) for seed in seeds]
        for first in range(0, ticks + 1, PERIODS_AT_ONCE):
            many = min(PERIODS_AT_ONCE, ticks + 1 - first)
            drawn = np.array([random.normal(size=(many, 5)) for random in randoms])
            yield from np.ascontiguousarray(drawn.transpose(1, 2, 0))

    @property
    def _changing(self) -> set[str]:
        """Names of what changes of the climbers."""
        return {
            field.name
            for field in fields(Climber)
            for change in self.changes
            if not np.array_equal(
                getattr(self.climber, field.name), getattr(change.climber, field.name)
            )
        }

    def _climbers(self, course: BatchRun, ticks: int) -> Iterator[Climber]:
        """The true climbers at every period."""
        climber = self.climber
        for tick in range(ticks + 1):
            time, last = tick * course.period, (tick - 1) * course.period
            for change in self.changes:
                now = (last + 1e-9 < change.time) & (change.time <= time + 1e-9)
                if np.any(now):
                    climber = chosen(now, change.climber, climber)
            yield climber


def _targets(course: BatchRun, ticks: int) -> Iterator[ReferencePoint]:
    for first in range(0, ticks + 1, PERIODS_AT_ONCE):
        times = np.arange(first, min(first + PERIODS_AT_ONCE, ticks + 1)) * course.period
        target = course.trajectory.at(times).target
        rows = zip(*(each.tolist() for each in target), strict=True)
        yield from (ReferencePoint(*numbers) for numbers in rows)
