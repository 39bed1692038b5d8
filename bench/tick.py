"""`python bench/tick.py`: what a controller's tick costs, beside other ways to compute the same.

A tick is `Tracker.see` and `Tracker.answer`: prediction, constraints, UK, observer, saturation,
without messages. All ways are measured in turns in one process; the least time of many counts.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import sqrtm

from climber_uk.analysis.closed_loop import sampled
from climber_uk.control.constraints import CONSTRAINTS, Demand, rows
from climber_uk.control.controller import Controller, Law, Situation
from climber_uk.control.model import Observer
from climber_uk.control.pacing import Pacing
from climber_uk.control.tracker import Timing, Tracker
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber, State, across, along
from climber_uk.mechanics.motion import Motion, Torques, Wrench
from climber_uk.mechanics.preview import SECOND
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.udwadia_kalaba import constraint_force

PAPER = Trajectory(Ellipse(), ConstantRate())
PERIOD, TICKS = 0.005, 100  # [s], and in a measurement


def as_the_paper(M: Array, Q: Array, A: Array, b: Array) -> Array:
    """Qc = M^(1/2) B⁺ (b - A a), B = A M^(-1/2) (8), as it is written."""
    root = sqrtm(M)
    B = A @ np.linalg.inv(root)
    return root @ np.linalg.pinv(B) @ (b - A @ np.linalg.solve(M, Q))


@dataclass(frozen=True)
class WithMatrices(Controller):
    """The same law, but with M, Q, A and b, and a function that solves them."""

    solve: Callable[[Array, Array, Array, Array], Array] = constraint_force

    def force(self, demand: Demand, motion: Motion) -> tuple[Any, Any, Any]:
        """See `Controller`."""
        climber, state, heading = self.climber, State.moving(motion), motion.heading
        direction = np.tanh(demand.speed / self.law.friction_speed)
        Q = climber.applied_force(heading, direction)
        Qc = self.solve(climber.mass_matrix, Q, *rows(state, demand))
        return float(along(heading, Qc)), float(Qc[2]), float(across(heading, Qc))


def ticks(tracker: Tracker) -> Callable[[], None]:
    """Ticks of a tracker on its way along the paper's ellipse."""
    preview = sampled(PAPER, 60.0)
    reference = PAPER.at(np.arange(10_000) * PERIOD)
    motions = [
        State(pose, velocity).motion
        for pose, velocity in zip(reference.pose, reference.velocity, strict=True)
    ]
    number = 0

    def some() -> None:
        nonlocal number
        if number + TICKS > len(motions):
            tracker.reset()
            number = 0
        for motion in motions[number : number + TICKS]:
            tracker.see(SECOND + round(number * PERIOD * SECOND), motion)
            tracker.answer(preview, 0.0)
            number += 1

    return some


def bare(controller: Controller) -> Callable[[], None]:
    """The law alone: a torque from state and reference."""
    reference = PAPER.at(1.0)
    target, motion = reference.target, State(reference.pose, reference.velocity).motion
    situation = Situation(motion, Torques(0.0, 0.0), Wrench(0.0, 0.0), PERIOD)

    def some() -> None:
        for _ in range(TICKS):
            controller.command(situation, target)

    return some


def least(ways: dict[str, Callable[[], None]], rounds: int) -> dict[str, float]:
    """Least time of a tick [µs], of measurements in turns."""
    best = dict.fromkeys(ways, np.inf)
    for _ in range(rounds):
        for name, run in ways.items():
            start = time.perf_counter()
            run()
            best[name] = min(best[name], (time.perf_counter() - start) / TICKS * 1e6)
    return best


def ways(constraints: str, law: Law) -> dict[str, Controller]:
    """Controllers that give the same torques."""
    gains = CONSTRAINTS[constraints]()
    return {
        "closed form, floats": Controller(Climber(), gains, law),
        "generic UK, numpy": WithMatrices(Climber(), gains, law),
        "the paper's formula": WithMatrices(Climber(), gains, law, as_the_paper),
    }


def table(title: str, times: dict[str, float]) -> None:
    """Print times, and how many times as long each is as the first."""
    first = next(iter(times.values()))
    print(f"{title:<40}{'µs':>10}{'ratio':>10}")
    for name, least_time in times.items():
        print(f"{name:<40}{least_time:>10.2f}{least_time / first:>10.1f}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=100, help="measurements of each")
    options = parser.parse_args()
    for constraints in CONSTRAINTS:
        whole = {
            name: ticks(Tracker(controller, Observer(), Timing(), Pacing()))
            for name, controller in ways(constraints, Law()).items()
        }
        table(f"tick, {constraints}", least(whole, options.rounds))
        alone = {
            name: bare(controller)
            for name, controller in ways(constraints, Law(predict=False)).items()
        }
        table(f"law alone, {constraints}", least(alone, options.rounds))


if __name__ == "__main__":
    main()
