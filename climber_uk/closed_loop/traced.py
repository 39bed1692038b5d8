"""Many closed loops by JAX, on whatever it finds: the extra `accelerator`.

No equation stands here: JAX traces `LoopsState.go_through`, compiles what it has seen, and goes on
with that. The first periods, in which an estimator has little to remember, are numpy's, and so is
what comes from outside: noise, references, changes of the climbers.
"""

import math
import os
from collections import deque
from collections.abc import Iterator, Set
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any, NamedTuple

import jax
import numpy as np

from climber_uk.closed_loop import period
from climber_uk.closed_loop.outcome import Sums, Tally
from climber_uk.closed_loop.period import BatchRun, Given, LoopsState
from climber_uk.closed_loop.unicycle import UnicycleModel, stepped
from climber_uk.control.estimator import Estimator, Memory
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.many import mapped
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, ReferencePoint, Torques, Wrench

jax.config.update("jax_enable_x64", True)
# else XLA computes on a CPU twice what two results need; there is no other way to tell it
FLAG = "--xla_backend_extra_options=xla_cpu_use_multi_output_fusion=true"
os.environ["XLA_FLAGS"] = f"{FLAG} {os.environ.get('XLA_FLAGS', '')}"

BY_NUMPY = 3  # periods, beside the delay: then an estimator's memory is complete
AT_ONCE = 64  # periods
PRESSURE = "suction_pressure"  # what controllers are told of a change


class Slot:
    """Where an array was."""

    def __array_namespace__(self) -> None:
        """None: arrays have one."""


SLOT = Slot()


@jax.tree_util.register_pytree_node_class
class Arrays:
    """Tuples or dataclasses of which JAX sees the arrays only; all else is compiled in."""

    def __init__(self, of: Any) -> None:
        self.of = of

    def tree_flatten(self) -> tuple[list[Any], Any]:
        """Arrays, and what they were taken out of."""
        arrays: list[Any] = []

        def taken(array: Any) -> Slot:
            arrays.append(array)
            return SLOT

        rest = mapped(taken, self.of)
        return arrays, rest

    @classmethod
    def tree_unflatten(cls, rest: Any, arrays: list[Any]) -> "Arrays":
        """Put them back."""
        left = iter(arrays)
        return cls(mapped(lambda _: next(left), rest))


class Numbers(NamedTuple):
    """State of the loops, arrays (N,)."""

    memory: Memory  # of the estimator
    motion: Motion
    on_their_way: tuple[Torques, ...]
    sums: Sums

    @classmethod
    def of(cls, state: LoopsState) -> "Numbers":
        """Numbers of a state, in arrays all."""
        memory, _ = state.estimator.memory
        on_their_way, number = tuple(state.on_their_way), state.motion.x.shape
        numbers = cls(memory, state.motion, on_their_way, state.tally.sums)
        return jax.tree.map(lambda each: jax.numpy.broadcast_to(each, number), numbers)


class Rows(NamedTuple):
    """What periods begin with: rows of arrays (AT_ONCE, …)."""

    time: Any
    target: ReferencePoint
    aim: ReferencePoint  # of the commands
    noise: Any


class Clock(NamedTuple):
    """Times that are the same in every period."""

    period: int  # [ns]
    known: tuple[Any, ...]  # to the estimator, of what it remembers
    step: float  # of the plant [s]
    steps: int  # of the plant in a period


def go_on(
    state: LoopsState,
    periods: Iterator[Given],
    course: BatchRun,
    preview: Preview,
    changing: Set[str],
) -> None:
    """Go through all periods of a course; `changing` are names of what changes of the climbers.

    Raises `ValueError` for a period that is no integer in nanoseconds.
    """
    nanoseconds = round(course.period * SECOND)
    if abs(nanoseconds - course.period * SECOND) > 1e-3:
        raise ValueError(f"period={course.period} must be whole nanoseconds, for JAX")
    estimator, tally, number = state.estimator, state.tally, len(state.motion.x)
    late = math.ceil(estimator.timing.transport_delay / course.period)
    period.go_on(state, islice(periods, BY_NUMPY + max(late, course.delay)), course, preview)
    _, known = estimator.memory
    clock = Clock(nanoseconds, known, course.period / course.steps, course.steps)
    numbers = Numbers.of(state)
    while several := list(islice(periods, AT_ONCE)):
        count, law = len(several), several[0].law
        several += several[-1:] * (AT_ONCE - count)
        climber = _stacked([given.climber for given in several], changing, number)
        believed = _stacked([given.law.climber for given in several], changing & {PRESSURE}, number)
        law = replace(law, climber=believed)
        same = estimator.observer, estimator.timing, state.sensors, tally.contact, tally.wall
        aim = law.target_time(estimator.ahead(0.0)) - estimator.stamp
        rows = _rows(several, preview, aim)
        numbers = _go_through(Arrays((climber, law, *same)), numbers, rows, count, clock)
    tally.sums = numbers.sums


def _stacked(climbers: list[Climber], changing: Set[str], number: int) -> Climber:
    """Climber of several periods: arrays (AT_ONCE, N) of what changes."""
    rows: dict[str, Any] = {}
    for name in changing:
        values = [getattr(climber, name) for climber in climbers]
        rows[name] = np.array([np.broadcast_to(value, number) for value in values])
    return replace(climbers[0], **rows)


def _rows(several: list[Given], preview: Preview, aim: int) -> Rows:
    targets = np.array([given.target for given in several])
    aims = np.array([preview.target(given.stamp + aim) for given in several])
    return Rows(
        np.array([given.time for given in several]),
        ReferencePoint(*targets.T),
        ReferencePoint(*aims.T),
        None if several[0].noise is None else np.array([given.noise for given in several]),
    )


@partial(jax.jit, static_argnames="clock", donate_argnames="numbers")
def _go_through(
    constant: Arrays, numbers: Numbers, rows: Rows, count: int, clock: Clock
) -> Numbers:
    """Numbers after `count` periods."""

    def advance(body: UnicycleModel, motion: Motion, wrench: Wrench) -> Motion:
        rates = body.under(wrench)
        return jax.lax.fori_loop(
            0, clock.steps, lambda _, now: stepped(rates, now, clock.step), motion
        )

    def next_period(i: Any, numbers: Numbers) -> Numbers:
        def now(array: Any) -> Any:
            return array[i] if array.ndim == 2 else array

        climber, law, observer, timing, sensors, contact, wall = mapped(now, constant.of)
        time, target, aim, noise = jax.tree.map(lambda row: row[i], rows)
        # goes over to the model of `law`
        estimator = Estimator(climber, observer, timing, wall=law.wall)
        estimator.remember(numbers.memory, clock.known, SECOND)
        tally, on_their_way = Tally(numbers.sums, contact, wall), deque(numbers.on_their_way)
        state = LoopsState(estimator, tally, sensors, numbers.motion, on_their_way=on_their_way)
        given = Given(SECOND + clock.period, time, noise, climber, law, target)
        state.go_through(given, lambda _: aim, advance)
        return Numbers.of(state)

    return jax.lax.fori_loop(0, count, next_period, numbers)
