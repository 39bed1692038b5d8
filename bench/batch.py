"""`python bench/batch.py`: climber-steps a second of many climbers at once.

Open loop: plain climbers under constant torques. Closed loop: each with its controller at 200 Hz,
observer on, its mass and friction its own, on the paper's ellipse. All in turns in one
process, by the processor's time (of all threads), without start-up. One step is one step of the
plant. C is `climber.c`, side by side as arrays, and vectorised, on one core.
"""

import argparse
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from importlib.util import find_spec
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np
from limit import Limit, climber_numbers, law_numbers
from side_by_side import in_turns, rate, table, timed

from climber_uk.closed_loop.batch import LOOPS_AT_ONCE, Loops
from climber_uk.closed_loop.outcome import Outcome
from climber_uk.closed_loop.period import BACKENDS, BatchRun
from climber_uk.closed_loop.simulate import sampled
from climber_uk.closed_loop.unicycle import UnicycleModel, advanced_often
from climber_uk.control.control_law import ControlLaw, ControlOptions
from climber_uk.control.guidance import Guidance
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.adhesion import MAX_MARGIN
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.many import keep_what_is_freed
from climber_uk.mechanics.quantities import Motion, Wrench
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory

PAPER = Climber()
ELLIPSE = Trajectory(Ellipse(), ConstantRate())
OPEN, CLOSED = 10_000, 8192  # climbers
STEP, STEPS, TICKS = 0.0025, 20, 64  # [s]; steps, and ticks, in a measurement
NAMES = {"numpy": "numpy", "numba": "numpy, numba's plant", "jax": "JAX"}  # of backends
RATES = {"2.5 ms": 2, "1 ms": 5}  # steps of the plant in a tick of 5 ms


def spread(number: int) -> Motion:
    """Starts around that of the paper's ellipse."""
    random = np.random.default_rng(1)
    x, y, heading, v, omega = 0.05 * random.normal(size=(5, number))
    return Motion(x, 6 + y, heading, np.cos(heading), np.sin(heading), 10 + v, omega - 0.6)


def installed() -> list[str]:
    """Backends that are, numpy first."""
    return [name for name in BACKENDS if find_spec(name) is not None]


class Way(NamedTuple):
    """A way to compute steps."""

    run: Callable[[], float]  # its own time [s]
    steps: int  # climber-steps that it takes


def compared(title: str, ways: dict[str, Way], rounds: int) -> None:
    """Run all in turns, and print their rates."""
    times = in_turns({name: way.run for name, way in ways.items()}, rounds)
    table(title, {name: times[name] / way.steps for name, way in ways.items()}, "M/s", rate)


def open_loop(limit: Limit | None, backends: Sequence[str]) -> dict[str, Way]:
    """Ways to advance climbers under constant torques."""
    body, motion = UnicycleModel.of(PAPER), spread(OPEN)
    wrench = Wrench(np.full(OPEN, PAPER.seal_friction), np.full(OPEN, 0.01))
    steps = OPEN * STEPS
    run = {"numpy": timed(lambda: advanced_often(body, motion, wrench, STEP, STEPS))}
    if "numba" in backends:
        from climber_uk.closed_loop import compiled

        run["numba"] = timed(lambda: compiled.advanced(body, motion, wrench, STEP, STEPS))
    if limit is not None:
        given = climber_numbers(PAPER, OPEN), np.array(wrench)

        def in_c() -> Array:
            rows = np.array(motion)
            pointers = [limit.pointer("double", numbers) for numbers in (*given, rows)]
            limit.functions.open_loops(OPEN, STEPS, STEP, *pointers)
            return rows

        if np.abs(in_c() - advanced_often(body, motion, wrench, STEP, STEPS)).max() > 1e-9:
            raise RuntimeError("the C does something else")
        run["C"] = timed(in_c)
    return {name: Way(function, steps) for name, function in run.items()}


def many_loops(number: int) -> Loops:
    """Loops of climbers that are not quite as their controllers believe."""
    random = np.random.default_rng(2)
    true = replace(
        PAPER,
        mass=5 * random.uniform(0.9, 1.1, number),
        seal_friction_coefficient=0.8 * random.uniform(0.9, 1.1, number),
    )
    return Loops(spread(number), true, ControlLaw(PAPER, Guidance(), ControlOptions()))


def closed_loop(limit: Limit | None, backends: Sequence[str], steps: int) -> dict[str, Way]:
    """Ways to run closed loops, which all have to give the same to 1e-9; without start-up."""
    loops, preview = many_loops(CLOSED), sampled(ELLIPSE, 2.0)
    keep_what_is_freed()
    few, more = (BatchRun(ELLIPSE, number * 0.005, steps=steps) for number in (TICKS, 2 * TICKS))

    def ours(backend: str) -> Callable[[], float]:
        """What `more` takes longer than `few`."""
        once, twice = (
            timed(lambda course=course: loops.run_block(replace(course, backend=backend), preview))
            for course in (few, more)
        )
        return lambda: twice() - once()

    expected = loops.run_block(few, preview)
    for backend in backends:
        check(backend, loops.run_block(replace(few, backend=backend), preview), expected)
    run = {NAMES[backend]: ours(backend) for backend in backends}
    if limit is not None:
        in_c = closed_in_c(limit, loops, steps)
        check("C", outcome_in_c(in_c(TICKS + 1), expected), expected)
        run["C"] = timed(lambda: in_c(TICKS))
    return {name: Way(function, CLOSED * TICKS * steps) for name, function in run.items()}


def check(name: str, outcome: Outcome, expected: Outcome) -> None:
    """Raise `RuntimeError` unless two outcomes are the same."""
    for what, got, wanted in zip(expected._fields, outcome, expected, strict=True):
        if not np.allclose(got, wanted, rtol=1e-9, atol=1e-9):
            raise RuntimeError(f"{name}: {what} is {got}, not {wanted}")


def closed_in_c(limit: Limit, loops: Loops, steps: int) -> Callable[[int], Array]:
    """The same in C: sums (7, N) of a number of periods, as climber.c has them."""
    preview, times = sampled(ELLIPSE, 2.0), np.arange(TICKS + 1) * 0.005
    targets = np.array([ELLIPSE.at(time).target for time in times])
    stamps = [SECOND + round((time + 0.0025) * SECOND) for time in times]
    aims = np.array([preview.target(stamp) for stamp in stamps])
    climber, contact = loops.climber, loops.contact
    load = float(np.mean(contact.wheel_load(climber, climber.gravity_into_wall)))
    law, climbers = law_numbers(loops.law, loops.observer), climber_numbers(climber, CLOSED)
    given = (
        limit.pointer("Law", law),
        limit.pointer("double", climbers),
        *(limit.pointer("Target", points) for points in (targets, aims)),
        *(load, contact.grip.wheel_friction_coefficient, contact.grip.centre_height),
    )

    def in_c(periods: int) -> Array:
        rows = np.array(loops.start), np.zeros((17, CLOSED)), np.zeros((7, CLOSED))
        rows[-1][-1] = MAX_MARGIN
        mutable = [limit.pointer("double", numbers) for numbers in rows]
        limit.functions.closed_loops(CLOSED, periods, steps, 0.005, *given, *mutable)
        return rows[-1]

    return in_c


def outcome_in_c(sums: Array, expected: Outcome) -> Outcome:
    """Outcome of C's sums of `TICKS` and one periods, without falls and tipping."""
    squares, saturated, worst, last, settled, peak, slip = sums
    return expected._replace(
        rms=np.sqrt(squares / (TICKS + 1)),
        saturated=saturated / (TICKS + 1),
        worst=np.sqrt(worst),
        last=np.sqrt(last),
        settled=settled,
        peak_torque=peak,
        slip_margin=slip,
    )


def half(number: int) -> None:
    """Some loops, in a process of their own."""
    many_loops(number).run(BatchRun(ELLIPSE, 0.5))


def two_processes() -> float:
    """How many times as fast two processes are as one, for the same loops in the same blocks."""
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:  # JAX has threads
        list(pool.map(half, [LOOPS_AT_ONCE // 8] * 2))  # they have started
        ratios = []
        for _ in range(3):
            one = timed(lambda: pool.submit(half, 2 * LOOPS_AT_ONCE).result(), time.perf_counter)()
            two = timed(lambda: list(pool.map(half, [LOOPS_AT_ONCE] * 2)), time.perf_counter)()
            ratios.append(one / two)
    return float(np.median(ratios))


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=20, help="measurements of each")
    parser.add_argument("--no-c", action="store_true", help="without gcc and cffi")
    parser.add_argument(
        "--backends", nargs="+", choices=BACKENDS, default=installed(), help="(default: installed)"
    )
    options = parser.parse_args()
    limit = None if options.no_c else Limit()
    ways = open_loop(limit, options.backends)
    compared(f"open loop, {OPEN} climbers, {1e3 * STEP:g} ms", ways, options.rounds)
    for name, steps in RATES.items():
        ways = closed_loop(limit, options.backends, steps)
        compared(f"closed loop, {CLOSED} climbers, {name} / 5 ms", ways, options.rounds)
    print(f"\ntwo processes, closed loop, by the wall clock: {two_processes():.2f} times one")


if __name__ == "__main__":
    main()
