"""One period of many closed loops at once: odometry, its answer, and the climbers' way."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from climber_uk.closed_loop.outcome import Tally
from climber_uk.closed_loop.unicycle import UnicycleModel
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.estimator import Estimator
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import clipped
from climber_uk.mechanics.quantities import Motion, ReferencePoint, Torques, Wrench
from climber_uk.simulation.sensors import Sensors

Advance = Callable[[UnicycleModel, Motion, Wrench], Motion]  # over a period


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
    motion: Motion  # true
    first: Torques | None = None  # that act before any command; None: as the first command
    delay: int = 0  # periods
    on_their_way: deque[Torques] = field(default_factory=deque)  # one for each period of the delay

    def go_through(
        self,
        given: Given,
        sensors: Sensors,
        target_at: Callable[[int], ReferencePoint | None],
        advance: Advance,
    ) -> None:
        """Go through a period; `target_at` has the reference at a stamp [ns]."""
        stamp, time, noise, climber, law, target = given
        estimator, motion = self.estimator, self.motion
        if law.climber is not estimator.climber:
            estimator.go_over_to(law.climber)
        estimator.see(stamp, motion if noise is None else sensors.corrupted(motion, noise))
        ahead = estimator.ahead(0.0)
        next_target = target_at(law.target_time(ahead))
        assert next_target is not None  # the preview goes beyond the duration
        command = law.command(ahead, next_target)
        estimator.sent(ahead.begins, command.wheels, command.fits, next_target.speed)
        if not self.on_their_way:
            self.on_their_way.extend([self.first or command.wheels] * self.delay)
        self.on_their_way.append(command.wheels)
        right, left = climber.bounds(motion)
        arriving = self.on_their_way.popleft()
        wheels = Torques(clipped(arriving.right, *right), clipped(arriving.left, *left))
        self.tally.add(time, motion, target, command, wheels, climber)
        wrench = Wrench(*climber.wrench(*wheels))
        self.motion = advance(UnicycleModel.of(climber), motion, wrench)
