"""`python bench/starts.py`: random starts, and how many of them find the reference.

In closed loop, with the controllers' observer and limits, all at once. Offsets are even over a disc
about the reference, headings and speeds over an interval.
"""

import argparse
from dataclasses import dataclass, replace

import numpy as np
from robustness import (
    BUILT,
    GUIDANCE,
    OBSERVER,
    PAPER,
    RAMPED,
    SLOW_GUIDANCE,
    SLOW_OBSERVER,
)

from climber_uk.closed_loop.batch import Loops
from climber_uk.closed_loop.period import BatchRun
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import Observer
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion
from climber_uk.mechanics.shapes import Ellipse, Lemniscate
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory


@dataclass(frozen=True)
class Case:
    """Whose starts they are, and where."""

    climber: Climber
    gains: Guidance
    trajectory: Trajectory
    radius: float  # [m] of the disc
    turned: float  # [rad] from the reference's heading, at most
    speeds: tuple[float, float]  # as shares of the reference's
    duration: float  # [s]
    observer: Observer = OBSERVER

    def starts(self, number: int) -> Motion:
        """Motions (N,)."""
        target, random = self.trajectory.at(0.0).target, np.random.default_rng(7)
        distance = self.radius * np.sqrt(random.uniform(0, 1, number))
        angle = random.uniform(-np.pi, np.pi, number)
        heading = target.heading + random.uniform(-self.turned, self.turned, number)
        speed = target.speed * random.uniform(*self.speeds, number)
        place = target.x + distance * np.cos(angle), target.y + distance * np.sin(angle)
        return Motion(*place, heading, np.cos(heading), np.sin(heading), speed, 0.0 * speed)


# twice the look-ahead: where docs/theory.md, §5.4, says that the distance shrinks; and further off
CASES = {
    "paper.yaml, 10 m/s, 1.7 m": Case(
        PAPER, GUIDANCE, Trajectory(Ellipse(), ConstantRate()), 1.67, 1.0, (0.5, 1.2), 10.0
    ),
    "paper's ellipse from rest, 4 N m, 0.7 m": Case(
        replace(PAPER, max_wheel_torque=4.0), GUIDANCE, RAMPED, 0.7, 1.0, (0.0, 0.0), 10.0
    ),
    "the same, 3 m": Case(
        replace(PAPER, max_wheel_torque=4.0), GUIDANCE, RAMPED, 3.0, 3.1, (0.0, 0.0), 15.0
    ),
    "climber.yaml, 0.18 m/s, 0.18 m": Case(
        *(BUILT, SLOW_GUIDANCE, Trajectory(Lemniscate(1.5, 0.75), ConstantRate(rate=0.12))),
        *(0.18, 1.0, (0.0, 1.2), 15.0, SLOW_OBSERVER),
    ),
}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--number", type=int, default=10_000, help="of starts in each case")
    parser.add_argument("--only", default="", help="cases whose name contains this")
    options = parser.parse_args()
    print(f"{'':<42}{'not back':>10}{'90 % within':>14}{'all within':>14}{'at the end':>14}")
    for name, case in CASES.items():
        if options.only not in name:
            continue
        loops = Loops(
            case.starts(options.number),
            case.climber,
            ControlLaw(case.climber, case.gains),
            case.observer,
        )
        outcome = loops.run(BatchRun(case.trajectory, case.duration))
        lost = int(np.sum(outcome.last > 1e-3))
        times = np.quantile(outcome.settled, (0.9, 1.0))
        print(
            f"{name:<42}{lost:>10}"
            + "".join(f"{f'{time:.2f} s':>14}" for time in times)
            + f"{f'{1e3 * outcome.last.max():.3g} mm':>14}",
            flush=True,
        )


if __name__ == "__main__":
    main()
