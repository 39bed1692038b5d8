"""Whether torques act when they are said to: detection of a delay that nobody told.

Where odometry is older than its stamps say, or torques arrive late, what moves the climber now is
what was to act some time ago. Drive and yaw moment that acted, of (11) and (15), are compared with
what was to act at that time, and before: the delay that leaves the least variance unexplained.
"""

import math
from collections import deque
from collections.abc import Sequence

from climber_uk.control.actuator_check import SLIDES, Variance
from climber_uk.control.estimator import Observed
from climber_uk.mechanics.climber import Climber

BORNE = 0.0, 0.02, 0.04  # [s] that the loop bears, beside what it has learnt
LATE = 0.06, 0.08, 0.1, 0.14, 0.2  # [s] that it does not
MEMORY = 0.15  # [s] in which a difference is forgotten
EXCITED = 0.03  # of the largest force: standard deviation of what no delay leaves unexplained
UNEXPLAINED = 4.0  # times as much is unexplained with any delay that is borne as with a longer one
IN_A_ROW = 3  # odometry messages


class Axis:
    """A force that acts, beside one that was to act, at the time of each delay."""

    def __init__(self) -> None:
        self._acted, self._unexplained = Variance(), [Variance() for _ in BORNE + LATE]
        self._late = 0  # messages in a row

    def add(self, acted: float, asked: Sequence[float], weight: float) -> None:
        """Add the force [N] that acted, and those that were to act, each with its delay."""
        self._acted.add(acted, weight)
        for variance, force in zip(self._unexplained, asked, strict=True):
            variance.add(acted - force, weight)

    def is_late(self, largest: float) -> bool:
        """Whether it acts later than is borne, by forces of `largest` [N] at most."""
        variances = [it.variance for it in self._unexplained]
        least = min(variances[len(BORNE) :])
        is_excited = variances[0] > (EXCITED * largest) ** 2
        # where nothing answers, what was to act before may be as steady
        without = min(self._acted.variance, *variances[: len(BORNE)])
        is_later = is_excited and without > UNEXPLAINED * least
        self._late = self._late + 1 if is_later else 0
        return self._late >= IN_A_ROW


class DelayCheck:
    """Compares what acts with what was to act: of the drive while it slides, and of the yaw."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Compare from now on."""
        # the last first: for how long [s] it was to act, drive, and yaw at the rims [N]
        self._asked: deque[tuple[float, float, float]] = deque()
        self._drive, self._yaw, self._rests = Axis(), Axis(), 0.0

    def add(self, climber: Climber, observed: Observed) -> bool:
        """Take what an odometry tells of the time since the last: does that show a delay?"""
        before, after, time = observed.before, observed.after, observed.time
        d, new = climber.half_track, 1 - math.exp(-time / MEMORY)
        force, moment = climber.wrench(*observed.torques)
        self._asked.appendleft((time, force, moment / d))
        drives, yaws = zip(*self._at_delays(time / 2), strict=True)
        mass, inertia, friction, weight = climber.inertial
        self._yaw.add(inertia * (after.yaw_rate - before.yaw_rate) / time / d, yaws, new)
        if min(abs(before.speed), abs(after.speed)) < SLIDES:
            self._rests += time  # a seal holds it, by as much as is asked
            if self._rests > MEMORY:
                self._drive = Axis()
        else:
            self._rests = 0.0
            drive = mass * (after.speed - before.speed) / time + weight * after.sine
            drive += math.copysign(friction, after.speed) - observed.pull
            self._drive.add(drive, drives, new)
        largest = 2 * climber.max_wheel_torque / climber.wheel_radius
        return self._drive.is_late(largest) or self._yaw.is_late(largest)

    def _at_delays(self, middle: float) -> list[tuple[float, float]]:
        """Drive and yaw [N] that were to act, of each delay, `middle` [s] before the last stamp."""
        found = list[tuple[float, float]]()
        until, delays = 0.0, [middle + it for it in BORNE + LATE]
        for number, (time, drive, yaw) in enumerate(self._asked):
            until += time
            while len(found) < len(delays) and delays[len(found)] <= until:
                found.append((drive, yaw))
            if len(found) == len(delays):
                for _ in range(len(self._asked) - number - 1):
                    self._asked.pop()
                break
        return found + [(0.0, 0.0)] * (len(delays) - len(found))
