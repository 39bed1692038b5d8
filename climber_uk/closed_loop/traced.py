"""Many closed loops by JAX, on whatever it runs: the extra `accelerator`.

No equation stands here: JAX traces `LoopsState.go_through` once, for all loops in a period, and
compiles what it has seen. The first periods, in which estimators have little to remember, are
numpy's, and so is all that comes from outside: noise, references, changes of the climbers.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import numpy as np
from jax import numpy as jnp

from climber_uk.closed_loop.outcome import Outcome, Tally
from climber_uk.closed_loop.period import Given, LoopsState
from climber_uk.closed_loop.unicycle import stepped
from climber_uk.control.estimator import Estimator
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.many import mapped
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import ReferencePoint

if TYPE_CHECKING:
    from climber_uk.closed_loop.batch import BatchRun, Loops

jax.config.update("jax_enable_x64", True)
BY_NUMPY = 3  # periods, and the delay of torques, until an estimator's memory is complete
AT_ONCE = 64  # periods


class Slot:
    """Where an array was: all are the same to JAX, which compares what it has compiled."""

    def __array_namespace__(self) -> None:  # noqa: D105
        return None


SLOT = Slot()


@jax.tree_util.register_pytree_node_class
class Arrays:
    """Tuples or dataclasses of which JAX sees the arrays only; all else is compiled in."""

    def __init__(self, of: Any) -> None:
        self.of = of

    def tree_flatten(self) -> tuple[list[Any], Any]:
        """The arrays, and what is left."""
        arrays: list[Any] = []
        return arrays, mapped(lambda array: arrays.append(array) or SLOT, self.of)

    @classmethod
    def tree_unflatten(cls, rest: Any, arrays: Any) -> "Arrays":
        """The reverse of it."""
        left = iter(arrays)
        return cls(mapped(lambda _: next(left), rest))


class Rows(NamedTuple):
    """What periods begin with, a row of each array (AT_ONCE, …) for each."""

    time: Any
    target: ReferencePoint
    aim: ReferencePoint  # of the commands
    noise: Any


def outcome(
    loops: "Loops", course: "BatchRun", preview: Preview, on_periods: Callable[[], object]
) -> Outcome:
    """See `Loops.run_block`."""
    from climber_uk.closed_loop.batch import plant

    state, periods = loops.begun(course), loops.periods(course)
    stamp = aim = 0

    def target_at(time: int) -> ReferencePoint | None:
        nonlocal aim
        aim = time - stamp
        return preview.target(time)

    advance = plant(course)
    for given in islice(periods, BY_NUMPY + course.delay):
        stamp = given.stamp
        state.go_through(given, loops.sensors, target_at, advance)
    memory, times = state.estimator.memory
    numbers = memory, state.motion, tuple(state.on_their_way), state.tally.sums
    numbers = _spread(numbers, len(loops.start.x))
    step = course.period / course.steps
    while rows := list(islice(periods, AT_ONCE)):
        given, few = _rows(rows, preview, aim)
        constant = Arrays((*_shared(loops, rows), loops.observer, loops.timing, loops.sensors, loops.contact))
        numbers = _go_through(
            constant, numbers, given, few, times=times, period=round(course.period * SECOND), step=step, steps=course.steps
        )
        jax.block_until_ready(numbers)
        on_periods()
    return Tally(numbers[3], loops.contact).outcome()


def _shared(loops, periods):
    return periods[0].climber, periods[0].law


def _rows(periods: list[Given], preview: Preview, aim: int) -> tuple[Rows, int]:
    few = len(periods)
    periods = periods + [periods[-1]] * (AT_ONCE - few)
    time = np.array([each.time for each in periods])
    target = ReferencePoint(*np.array([each.target for each in periods]).T)
    aims = ReferencePoint(*np.array([preview.target(each.stamp + aim) for each in periods]).T)
    noise = None if periods[0].noise is None else np.array([each.noise for each in periods])
    return Rows(time, target, aims, noise), few


def _spread(numbers: Any, many: int) -> Any:
    return jax.tree.map(lambda each: jnp.broadcast_to(each, (many,)), numbers)


@partial(jax.jit, static_argnames=("times", "period", "step", "steps"), donate_argnums=1)
def _go_through(
    constant: Arrays, numbers: Any, rows: Rows, few: int, *, times: Any, period: int, step: float, steps: int
) -> Any:
    climber, law, observer, timing, sensors, contact = constant.of

    def advance(body, motion, wrench):
        rates = body.under(wrench)
        return jax.lax.fori_loop(0, steps, lambda _, now: stepped(rates, now, step), motion)

    def one(i: Any, numbers: Any) -> Any:
        memory, motion, on_their_way, sums = numbers
        row = jax.tree.map(lambda each: each[i], rows)
        estimator = Estimator(law.climber, observer, timing)
        estimator.remember(memory, times, SECOND)
        state = LoopsState(estimator, Tally(sums, contact), motion, None, len(on_their_way), deque(on_their_way))
        given = Given(SECOND + period, row.time, row.noise, climber, law, row.target)
        state.go_through(given, sensors, lambda _: row.aim, advance)
        memory, now = estimator.memory
        assert now == times, (now, times)
        numbers = memory, state.motion, tuple(state.on_their_way), state.tally.sums
        return _spread(numbers, len(motion.x))

    return jax.lax.fori_loop(0, few, one, numbers)
