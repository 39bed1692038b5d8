"""`python bench/batch.py`: climber-steps a second of many climbers at once.

Open loop: plain climbers under constant torques. Closed loop: each with its controller at 200 Hz,
observer on, its mass and friction its own, on the paper's ellipse. All in turns in one
process, by the processor's time, without start-up. One step is one step of the plant.
"""

import argparse
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from limit import Limit, climber_numbers, controller_numbers
from side_by_side import in_turns, rate, table, timed

from climber_uk.closed_loop.batch import LOOPS_AT_ONCE, BatchRun, Loops
from climber_uk.closed_loop.simulate import sampled
from climber_uk.closed_loop.unicycle import UnicycleModel, advanced_often
from climber_uk.control.control_law import ControlLaw, ControlOptions
from climber_uk.control.guidance import Guidance
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.many import keep_what_is_freed
from climber_uk.mechanics.quantities import Motion, Wrench
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory

PAPER = Climber()
ELLIPSE = Trajectory(Ellipse(), ConstantRate())
OPEN, CLOSED, IN_C = 10_000, 8192, 512  # climbers; C needs no large blocks
STEP, STEPS, TICKS = 0.0025, 20, 40  # [s]; steps, and ticks, in a measurement
RATES = {"2.5 ms": 2, "1 ms": 5}  # steps of the plant in a tick of 5 ms


def spread(number: int) -> Motion:
    """Starts around that of the paper's ellipse."""
    random = np.random.default_rng(1)
    x, y, heading, v, omega = 0.05 * random.normal(size=(5, number))
    return Motion(x, 6 + y, heading, np.cos(heading), np.sin(heading), 10 + v, omega - 0.6)


class Way(NamedTuple):
    """A way to compute steps."""

    run: Callable[[], float]  # its own time [s]
    steps: int  # climber-steps that it takes


def compared(title: str, ways: dict[str, Way], rounds: int) -> None:
    """Run all in turns, and print their rates."""
    times = in_turns({name: way.run for name, way in ways.items()}, rounds)
    table(title, {name: times[name] / way.steps for name, way in ways.items()}, "M/s", rate)


def open_loop(limit: Limit | None, with_numba: bool) -> dict[str, Way]:
    """Ways to advance climbers under constant torques."""
    body, motion = UnicycleModel.of(PAPER), spread(OPEN)
    wrench = Wrench(np.full(OPEN, PAPER.seal_friction), np.full(OPEN, 0.01))
    steps = OPEN * STEPS
    run = {"numpy": timed(lambda: advanced_often(body, motion, wrench, STEP, STEPS))}
    if with_numba:
        from climber_uk.closed_loop import compiled

        run["numba"] = timed(lambda: compiled.advanced(body, motion, wrench, STEP, STEPS))
    if limit is not None:
        numbers, wrenches, motions = climber_numbers(PAPER, 1), np.array(wrench), np.array(motion)
        given = limit.pointer("Climber", numbers), limit.pointer("double", wrenches)

        def in_c() -> Array:
            rows = motions.copy()
            limit.functions.open_loops(OPEN, STEPS, STEP, *given, limit.pointer("double", rows))
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


def closed_loop(limit: Limit | None, with_numba: bool, steps: int) -> dict[str, Way]:
    """Ways to run closed loops; start-up is not counted."""
    loops, preview = many_loops(CLOSED), sampled(ELLIPSE, 1.0)
    keep_what_is_freed()

    def ours(backend: str) -> Callable[[], float]:
        def by_tick() -> float:
            """Ticks without the first, which is one of start-up."""
            course = BatchRun(ELLIPSE, TICKS * 0.005, steps=steps, backend=backend)
            ends: list[float] = []
            loops.run_block(course, preview, lambda: ends.append(time.process_time()))
            return (ends[-1] - ends[0]) / (len(ends) - 1) * TICKS

        return by_tick

    run = {"numpy": ours("numpy")}
    if with_numba:
        run["numpy, numba's plant"] = ours("numba")
    if limit is not None:
        run["C"] = closed_in_c(limit, many_loops(IN_C), steps)
    return {
        name: Way(function, (IN_C if name == "C" else CLOSED) * TICKS * steps)
        for name, function in run.items()
    }


def closed_in_c(limit: Limit, loops: Loops, steps: int) -> Callable[[], float]:
    """The same in C."""
    controllers = controller_numbers(loops.law, loops.observer, IN_C)
    climbers, start = climber_numbers(loops.climber, IN_C), np.array(loops.start).T.copy()
    preview = sampled(ELLIPSE, 1.0)
    times = (SECOND + round((tick + 0.5) * 0.005 * SECOND) for tick in range(TICKS))
    aims = np.array([preview.target(time) for time in times])
    memories = np.zeros((IN_C, 12))
    memories[:, :7] = start
    given = (
        limit.pointer("ControlLaw", controllers),
        limit.pointer("Climber", climbers),
        limit.pointer("ReferencePoint", aims),
    )

    def in_c() -> Array:
        motions, memory = start.copy(), memories.copy()
        mutable = limit.pointer("Motion", motions), limit.pointer("Memory", memory)
        limit.functions.closed_loops(IN_C, TICKS, steps, 0.005, *given, *mutable)
        return motions

    end = ELLIPSE.at(TICKS * 0.005).target
    far = np.hypot(*(in_c()[:, :2] - (end.x, end.y)).T)
    ours = loops.run(BatchRun(ELLIPSE, TICKS * 0.005, steps=steps)).last
    if np.abs(far - ours).max() > 1e-9:
        raise RuntimeError(f"the C is {np.abs(far - ours).max()} m elsewhere")
    return timed(in_c)


def half(number: int) -> None:
    """Some loops, in a process of their own."""
    many_loops(number).run(BatchRun(ELLIPSE, 0.5))


def two_processes() -> float:
    """How many times as fast two processes are as one, for the same loops in the same blocks."""
    with ProcessPoolExecutor(2) as pool:
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
    parser.add_argument("--no-numba", action="store_true", help="without numba")
    options = parser.parse_args()
    limit = None if options.no_c else Limit()
    ways = open_loop(limit, not options.no_numba)
    compared(f"open loop, {OPEN} climbers, {1e3 * STEP:g} ms", ways, options.rounds)
    for name, steps in RATES.items():
        ways = closed_loop(limit, not options.no_numba, steps)
        compared(f"closed loop, {CLOSED} climbers, {name} / 5 ms", ways, options.rounds)
    print(f"\ntwo processes, closed loop, by the wall clock: {two_processes():.2f} times one")


if __name__ == "__main__":
    main()
