"""Many closed loops from one period to the next: odometry, its answer, and the climbers' way."""

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any, NamedTuple

from climber_uk.closed_loop.outcome import Tally
from climber_uk.closed_loop.unicycle import Downhill, UnicycleModel, advanced_often
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.estimator import Estimator
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import clipped
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, ReferencePoint, Torques, Wrench
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.simulation.sensors import Sensors

Advance = Callable[[UnicycleModel, Motion, Wrench], Motion]  # over a period

# numba compiles the plant, JAX all: extras `fast` and `accelerator`
BACKENDS = "numpy", "numba", "jax"


@dataclass(frozen=True)
class BatchRun:
    """Trajectory, duration and timing, which all loops share."""

    trajectory: Trajectory
    duration: float  # [s]
    period: float = 0.005  # [s] of the controller
    steps: int = 2  # of the plant in a period
    delay: int = 0  # periods of a torque on its way to the wheels
    backend: str = "numpy"  # one of `BACKENDS`, which must be installed

    def __post_init__(self) -> None:
        if self.backend not in BACKENDS:
            raise ValueError(f"backend={self.backend!r} must be one of {', '.join(BACKENDS)}")
        if find_spec(self.backend) is None:
            raise ValueError(
                f"backend={self.backend!r} is not installed (pip install {self.backend})"
            )

    def plant(self) -> Advance:
        """Function that advances climbers by a period."""
        step, advance = self.period / self.steps, advanced_often
        if self.backend == "numba":
            from climber_uk.closed_loop.compiled import advanced as advance
        return lambda body, motion, wrench: advance(body, motion, wrench, step, self.steps)


class Given(NamedTuple):
    """What a period begins with that the loops did not bring about."""

    stamp: int  # [ns]
    time: Any  # the same since the start [s]
    noise: Any  # of odometry, of unit variance (5, N); None without
    climber: Climber  # the true ones
    law: ControlLaw
    target: ReferencePoint  # where they should be now


@dataclass
class LoopsState:
    """N loops between two periods."""

    estimator: Estimator
    tally: Tally
    sensors: Sensors
    motion: Motion  # true
    first: Torques | None = None  # that act before any command; None: as the first command
    delay: int = 0  # periods
    on_their_way: deque[Torques] = field(default_factory=deque)  # one for each period of the delay

    def go_through(
        self,
        given: Given,
        target_at: Callable[[int], ReferencePoint | None],
        advance: Advance,
    ) -> None:
        """Go through a period; `target_at` has the reference at a stamp [ns]."""
        stamp, time, noise, climber, law, target = given
        estimator, motion, tally = self.estimator, self.motion, self.tally
        if law.climber is not estimator.climber:
            estimator.go_over_to(law.climber)
        estimator.see(stamp, motion if noise is None else self.sensors.corrupted(motion, noise))
        ahead = estimator.ahead(0.0)
        next_target = target_at(law.target_time(ahead))
        assert next_target is not None  # the preview goes beyond the duration
        command = law.command(ahead, next_target)
        wanted = {"yaw_rate": command.yaw_rate, "forward": command.forward}
        estimator.sent(
            ahead.begins, command.wheels, command.fits, speed=next_target.speed, **wanted
        )
        if not self.on_their_way:
            self.on_their_way.extend([self.first or command.wheels] * self.delay)
        self.on_their_way.append(command.wheels)
        right, left = climber.bounds(motion)
        arriving = self.on_their_way.popleft()
        wheels = Torques(clipped(arriving.right, *right), clipped(arriving.left, *left))
        tally.add(time, motion, target, command, wheels, climber)
        wrench, body = Wrench(*climber.wrench(*wheels)), UnicycleModel.of(climber)
        if tally.wall is None:
            self.motion = advance(body, motion, wrench)
        else:
            downhill = Downhill.of(tally.wall, climber, motion, estimator.period)
            end = advance(downhill.body(body, climber), downhill.seen(motion), wrench)
            self.motion = downhill.back(end, motion)


def go_on(state: LoopsState, periods: Iterable[Given], course: BatchRun, preview: Preview) -> None:
    """Go through some periods."""
    advance = course.plant()
    for given in periods:
        state.go_through(given, preview.target, advance)
