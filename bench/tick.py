"""`python bench/tick.py`: what a controller's tick costs, beside other ways to compute the same.

A tick is from an odometry to its torques: prediction, constraints, UK, observer and saturation,
without messages, and without what a `Controller` checks besides. All ways are measured in turns in
one process; the least time of many counts.
"""

import argparse
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from limit import Limit, law_numbers
from scipy.linalg import sqrtm

from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.approach import ANYWHERE
from climber_uk.control.constraint_set import rows
from climber_uk.control.constraints import CONSTRAINTS
from climber_uk.control.control_law import (
    Command,
    ControlInput,
    ControlLaw,
    ControlOptions,
    check_finite,
)
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.model import Observer
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import (
    Motion,
    ReferencePoint,
    State,
    Torques,
    Wrench,
    along,
)
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory

OURS = "closed form, floats"
PAPER = Trajectory(Ellipse(), ConstantRate())
PERIOD, TICKS = 0.005, 20  # [s], and in a measurement
# Runs before one that counts. Not only caches are full of what ran before: CPython binds what it
# runs to the types that it meets (PEP 659), and a controller has one law, not those of all ways.
WARM = 10


def as_the_paper(M: Array, Q: Array, A: Array, b: Array) -> Array:
    """Qc = M^(1/2) B⁺ (b - A a), B = A M^(-1/2) (8), as it is written."""
    root = sqrtm(M)
    B = A @ np.linalg.inv(root)
    return root @ np.linalg.pinv(B) @ (b - A @ np.linalg.solve(M, Q))


@dataclass(frozen=True)
class WithMatrices(ControlLaw):
    """The same law, but with M, Q, A and b, and another function that solves them."""

    solve: Callable[[Array, Array, Array, Array], Array] = as_the_paper

    def closed_form(
        self, prepared: Any, motion: Motion, friction: Any = 0.0, *_: Any
    ) -> tuple[Any, Any, Any]:
        """See `ControlLaw.generic`."""
        climber, state, heading = self.climber, State.moving(motion), motion.heading
        demand = self.constraints.desired_acceleration(prepared, motion)
        direction = np.tanh(demand.speed / self.options.friction_speed)
        Q = climber.applied_force(heading, direction)
        Qc = self.solve(climber.mass_matrix, Q, *rows(state, demand))
        wanted = demand.forward, demand.yaw_rate
        return float(along(heading, Qc)), float(Qc[2]), *wanted


def motions_on_the_way(number: int) -> list[Motion]:
    """Motions of a climber that is where it should be."""
    reference = PAPER.at(np.arange(number) * PERIOD)
    states = zip(reference.pose, reference.velocity, strict=True)
    return [State(pose, velocity).motion for pose, velocity in states]


class Known:
    """A preview whose targets were computed before, as those of the C are."""

    def __init__(self, preview: Preview, times: Iterable[int]) -> None:
        self.targets = {time: preview.target(time) for time in times}
        self.times = preview.times

    def target(self, time: int) -> ReferencePoint | None:
        """See `Preview`."""
        return self.targets[time]


def tick(controller: Controller, stamp: int, motion: Motion) -> Command:
    """What a `Controller` that follows does, all is well: see its docstring."""
    estimator, active = controller.estimator, controller.active
    estimator.see(stamp, motion)
    ahead = estimator.ahead(0.0)
    target_time = controller.law.target_time(ahead)
    target = active.target(ahead.motion, ahead.begins, target_time)
    assert target.point is not None
    at = partial(active.around, target, target_time)
    course = estimator.slip.course(controller.law.climber, target.point, at, controller.law.wall)
    command = controller.law.command(ahead._replace(course=course), target.point)
    check_finite(command.wheels)
    active.go_on(target)
    wanted = target.point.speed, command.yaw_rate, command.forward
    estimator.sent(ahead.begins, command.wheels, command.fits, *wanted)
    return command


def on_the_paper(law: ControlLaw, preview: Any) -> Controller:
    """A controller that knows its reference."""
    controller = Controller(Settings(law), approach=ANYWHERE)
    controller.active.preview = preview
    controller.estimator.safety = None  # it believes in every jump
    return controller


def ticks(law: ControlLaw, known: bool = False) -> Callable[[], None]:
    """Ticks along the paper's ellipse, with targets that are known or not.

    A tick aims at the middle of the period that follows it.
    """
    preview: Any = sampled(PAPER, 60.0)
    if known:
        aims = (SECOND + round((number + 0.5) * PERIOD * SECOND) for number in range(10_000))
        preview = Known(preview, [SECOND, *aims])
    stamps = (SECOND + round(number * PERIOD * SECOND) for number in range(10_000))
    all_of_them = list(zip(stamps, motions_on_the_way(10_000), strict=True))
    controller, number = on_the_paper(law, preview), 0

    def some() -> None:
        nonlocal controller, number
        if number + TICKS > len(all_of_them):
            controller, number = on_the_paper(law, preview), 0
        for stamp, motion in all_of_them[number : number + TICKS]:
            tick(controller, stamp, motion)
        number += TICKS

    return some


def ticks_in_c(limit: Limit, law: ControlLaw) -> tuple[Callable[[], None], Array]:
    """Ticks of the same law in C, of targets that are known; and their torques (n, 2)."""
    numbers, preview = np.array(motions_on_the_way(TICKS)), sampled(PAPER, 1.0)
    times = (SECOND + round((number + 0.5) * PERIOD * SECOND) for number in range(TICKS))
    aims = np.array([preview.target(time) for time in times])
    memory, torques = np.zeros(17), np.zeros((TICKS, 2))
    arrays = (("Law", law_numbers(law, Observer())), ("Memory", memory), ("Motion", numbers))
    numbers_of_law, past, motions = (limit.pointer(kind, array) for kind, array in arrays)
    targets, told = limit.pointer("Target", aims), limit.pointer("double", torques)

    def some() -> None:
        memory[15] = 0.0  # it has seen nothing before
        in_c = limit.functions.tick  # which lives as long as the library does
        for i in range(TICKS):
            in_c(numbers_of_law, past, motions + i, targets + i, PERIOD, told + 2 * i)

    return some, torques


def with_known_targets(law: ControlLaw, in_c: Callable[[], None]) -> dict[str, Callable[[], None]]:
    """The same work as the C does, which is given the targets."""
    return {f"{OURS}, targets known": ticks(law, known=True), "C through cffi, targets known": in_c}


def bare(law: ControlLaw) -> Callable[[], None]:
    """The law alone: a torque from state and reference."""
    reference = PAPER.at(1.0)
    target, motion = reference.target, State(reference.pose, reference.velocity).motion
    situation = ControlInput(motion, Torques(0.0, 0.0), Wrench(0.0, 0.0), PERIOD)

    def some() -> None:
        for _ in range(TICKS):
            law.command(situation, target)

    return some


def least(ways: dict[str, Callable[[], None]], rounds: int) -> dict[str, float]:
    """Least time of a tick [µs], of measurements in turns."""
    best = dict.fromkeys(ways, np.inf)
    for _ in range(rounds):
        for name, run in ways.items():
            for _ in range(WARM):
                run()
            start = time.perf_counter()
            run()
            best[name] = min(best[name], (time.perf_counter() - start) / TICKS * 1e6)
    return best


def ways(constraints: str, options: ControlOptions) -> dict[str, ControlLaw]:
    """Controllers that give the same torques."""
    gains = CONSTRAINTS[constraints]()
    return {
        OURS: ControlLaw(Climber(), gains, options),
        "generic UK, numpy": ControlLaw(Climber(), gains, replace(options, solver="generic")),
        "the paper's formula": WithMatrices(Climber(), gains, options),
    }


def check(law: ControlLaw, run: Callable[[], None], torques: Array) -> None:
    """Raise `RuntimeError` unless the C gives what the controller answers."""
    run()
    controller = on_the_paper(law, sampled(PAPER, 1.0))
    for number, motion in enumerate(motions_on_the_way(TICKS)):
        command = tick(controller, SECOND + round(number * PERIOD * SECOND), motion)
        if np.abs(command.torques - torques[number]).max() > 1e-9:
            raise RuntimeError(f"tick {number}: {command} is not {torques[number]}")


def table(title: str, times: dict[str, float]) -> None:
    """Print times, and how many times as long each is as the first."""
    first = next(iter(times.values()))
    print(f"{title:<40}{'µs':>10}{'ratio':>10}")
    for name, least_time in times.items():
        print(f"{name:<40}{least_time:>10.2f}{least_time / first:>10.3g}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=200, help="measurements of each")
    parser.add_argument("--no-c", action="store_true", help="without gcc and cffi")
    options = parser.parse_args()
    limit = None if options.no_c else Limit()
    for constraints in CONSTRAINTS:
        laws = ways(constraints, ControlOptions())
        whole = {name: ticks(law) for name, law in laws.items()}
        if limit is not None and constraints == "guidance":
            ours = laws[OURS]
            run, torques = ticks_in_c(limit, ours)
            check(ours, run, torques)
            whole |= with_known_targets(ours, run)
        table(f"tick, {constraints}", least(whole, options.rounds))
        alone = {
            name: bare(law)
            for name, law in ways(constraints, ControlOptions(predict=False)).items()
        }
        table(f"law alone, {constraints}", least(alone, options.rounds))


if __name__ == "__main__":
    main()
