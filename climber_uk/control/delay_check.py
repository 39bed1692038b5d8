"""Whether torques act when they are said to: detection of a delay that nobody told.

Where odometry is older than its stamps say, or torques arrive late, what moves the climber now is
what was to act some time ago. Drive and yaw moment that acted, of (11) and (15), are compared with
what was to act at that time, and before: the delay that leaves the least variance unexplained.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence

from climber_uk.control.actuator_check import Variance
from climber_uk.control.estimator import Observed
from climber_uk.mechanics.climber import Climber

BORNE = 0.0, 0.02, 0.04  # [s] that the loop bears, beside what it has learnt
LATE = 0.06, 0.08, 0.1, 0.14, 0.2  # [s] that it does not
MOVES = 0.03  # [m/s] from which on noise does not make it that
MEMORY = 0.15  # [s] in which a difference is forgotten
EXCITED = 0.03  # of the largest force: standard deviation of what no delay leaves unexplained
UNEXPLAINED = 4.0  # times as much is unexplained with any delay that is borne as with a longer one
IN_A_ROW = 3  # odometry messages
KEPT = 100  # of them, that are too old, before they are forgotten


class Axis:
    """A force that acts, beside one that was to act, at the time of each delay, while it moves."""

    def __init__(self) -> None:
        self._rests = 0.0  # [s]
        self._restart()

    def _restart(self) -> None:
        self._acted, self._unexplained = Variance(), [Variance() for _ in BORNE + LATE]
        self._late = 0  # messages in a row

    def rest(self, time: float) -> None:
        """For some time [s] more it stands: what rubs holds it, by as much as is asked."""
        self._rests += time
        if self._rests > MEMORY:
            self._restart()

    def add(self, acted: float, asked: Sequence[float], weight: float) -> None:
        """Add the force [N] that acted, and those that were to act, each with its delay."""
        self._rests = 0.0
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
    """Compares what acts with what was to act: of the drive, and of the yaw, while they move."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Compare from now on."""
        self._time = 0.0  # [s] of the last stamp, since the first
        self._until, self._asked = list[float](), list[tuple[float, float]]()
        self._drive, self._yaw = Axis(), Axis()

    def add(self, climber: Climber, observed: Observed) -> bool:
        """Take what an odometry tells of the time since the last: does that show a delay?"""
        before, after, time = observed.before, observed.after, observed.time
        d, new = climber.half_track, 1 - math.exp(-time / MEMORY)
        force, moment = climber.wrench(*observed.torques)
        self._time += time
        self._until.append(self._time)
        self._asked.append((force, moment / d))
        drives, yaws = zip(*self._at_delays(self._time - time / 2), strict=True)
        mass, inertia, friction, weight = climber.inertial
        if d * min(abs(before.yaw_rate), abs(after.yaw_rate)) < MOVES:
            self._yaw.rest(time)
        else:
            turn = inertia * (after.yaw_rate - before.yaw_rate) / time / d
            self._yaw.add(turn, yaws, new)
        if min(abs(before.speed), abs(after.speed)) < MOVES:
            self._drive.rest(time)
        else:
            drive = mass * (after.speed - before.speed) / time + weight * after.sine
            drive += math.copysign(friction, after.speed) - observed.pull
            self._drive.add(drive, drives, new)
        largest = 2 * climber.max_wheel_torque / climber.wheel_radius
        return self._drive.is_late(largest) or self._yaw.is_late(largest)

    def _at_delays(self, time: float) -> list[tuple[float, float]]:
        """Drive, and yaw at the rims [N], that were to act each delay before a `time` [s]."""
        last = len(self._until) - 1
        places = [bisect_right(self._until, time - delay, hi=last) for delay in BORNE + LATE]
        found = [
            self._asked[place] if time >= delay else (0.0, 0.0)
            for place, delay in zip(places, BORNE + LATE, strict=True)
        ]
        if (forgotten := places[-1]) > KEPT:
            del self._until[:forgotten], self._asked[:forgotten]
        return found
