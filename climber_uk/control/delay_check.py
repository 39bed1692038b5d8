"""Whether torques act when they are said to: detection of a delay that nobody told.

Where odometry is older than its stamps say, or torques arrive late, what moves the climber now is
what was to act some time ago. Drive and yaw moment that acted, of (11) and (15), are compared with
what was to act at that time, and before: the delay that leaves the least variance unexplained.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence

from climber_uk.control.actuator_check import Variance
from climber_uk.control.observed import Observed
from climber_uk.control.timing import LONGEST_DELAY
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion

DELAYS = tuple(0.02 * number for number in range(16))  # [s] that are compared
BORNE = 0.025  # [s] that the loop bears, beside what it knows
EXACT = 0.011  # [s] that is borne where a longer delay is known: one of `DELAYS` is that near
MOVES = 0.03  # [m/s] from which on noise does not make it that
MEMORY = 0.2  # [s] in which a difference is forgotten
EXCITED = 0.002  # of the largest force: standard deviation of what no delay leaves unexplained
MUCH = math.log(4.0)  # times as much is unexplained near the delay that is known as with another
SURE = 20.0  # of the evidence of drive and yaw together, for another delay
MOST = 20  # windows that count: older ones are forgotten
TICK = 1e-6  # [s] by which times that are added may be off
WINDOW = 0.015  # [s] at least, over which a force is told: noise of the twist is shared out
KEPT = 100  # odometry messages that are too old, before they are forgotten


class Axis:
    """A force that acts, beside one that was to act, at the time of each delay, while it moves."""

    def __init__(self) -> None:
        self._rests = 0.0  # [s]
        self._restart()

    def _restart(self) -> None:
        self._acted, self._unexplained = Variance(), [Variance() for _ in DELAYS]

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

    def evidence(self, near: Sequence[bool], largest: float) -> tuple[list[float], float]:
        """For each delay, how much better it explains what acts than those `near` do; enough of it.

        That is (n - 2) times the logarithm of what is unexplained, of n windows: chance correlates
        so well once in exp(x / 2). Forces are `largest` [N] at most.
        """
        count, least = min(self._acted.number, MOST) - 2, (EXCITED * largest) ** 2
        if count <= 0:
            return [0.0] * len(DELAYS), 0.0
        unexplained = [max(it.variance, least) for it in self._unexplained]
        known = min(it for it, is_near in zip(unexplained, near, strict=True) if is_near)
        # where nothing answers, what was to act before may be as steady
        known = min(known, max(self._acted.variance, least))
        return [count * math.log(known / it) for it in unexplained], count * MUCH


class DelayCheck:
    """Compares what acts with what was to act: of the drive, and of the yaw, while they move."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Compare from now on."""
        self._time = self._begin = 0.0  # [s] of the last stamp, and of the window's begin
        self._first: Motion | None = None  # of the window
        # until when, and with what impulse of drive, and of yaw at the rims [N s], it was to act
        self._until, self._impulse = [0.0], [(0.0, 0.0)]
        self._drive, self._yaw = Axis(), Axis()

    def add(self, climber: Climber, observed: Observed, known: float) -> float | None:
        """Take what an odometry tells, and the torques that arrived, not acted, since the last.

        Returns the delay [s] with which they act, if that is quite another than the one `known`.
        """
        d, (force, moment) = climber.half_track, climber.wrench(*observed.torques)
        drive, yaw = self._impulse[-1]
        self._time += observed.time
        self._until.append(self._time)
        self._impulse.append((drive + observed.time * force, yaw + observed.time * moment / d))
        before, after = self._first or observed.before, observed.after
        time = self._time - self._begin
        if time < WINDOW - TICK:
            self._first = before
            return None
        # what was asked for by the delays that may be learnt; before, nothing counts as asked for
        is_known = self._begin - LONGEST_DELAY >= self._until[0]
        drives, yaws = self._asked(time)
        self._first, self._begin, new = None, self._time, 1 - math.exp(-time / MEMORY)
        if not is_known:
            return None
        mass, inertia, friction, weight = climber.inertial
        if d * _slowest(before.yaw_rate, after.yaw_rate) < MOVES:
            self._yaw.rest(time)
        else:
            turn = inertia * (after.yaw_rate - before.yaw_rate) / time / d
            self._yaw.add(turn, yaws, new)
        if _slowest(before.speed, after.speed) < MOVES:
            self._drive.rest(time)
        else:
            acted = mass * (after.speed - before.speed) / time + weight * after.sine
            acted += math.copysign(friction, after.speed) - observed.pull
            self._drive.add(acted, drives, new)
        largest = 2 * climber.max_wheel_torque / climber.wheel_radius
        borne = BORNE if known <= BORNE else EXACT
        near = [abs(delay - known) <= borne for delay in DELAYS]
        if not any(near):
            return None
        drive_shows, much = self._drive.evidence(near, largest)
        yaw_shows, as_much = self._yaw.evidence(near, largest)
        shows = [drive + yaw for drive, yaw in zip(drive_shows, yaw_shows, strict=True)]
        most = max(shows)
        delay = DELAYS[shows.index(most)]
        # a longer one is not learnt: it stops the climber until somebody has looked
        enough = max(SURE, much, as_much) * (1 if delay <= LONGEST_DELAY else 2)
        return delay if most > enough else None

    def _asked(self, time: float) -> tuple[list[float], list[float]]:
        """Drives, and yaws at the rims [N], of the last `time` [s], had they come by each delay."""
        ends = [self._at(self._time - delay) for delay in DELAYS]
        begins = [self._at(self._time - time - delay) for delay in DELAYS]
        drives, yaws = (
            [(end[axis] - begin[axis]) / time for end, begin in zip(ends, begins, strict=True)]
            for axis in (0, 1)
        )
        if (forgotten := bisect_right(self._until, self._begin - DELAYS[-1]) - 1) > KEPT:
            del self._until[:forgotten], self._impulse[:forgotten]
        return drives, yaws

    def _at(self, time: float) -> tuple[float, float]:
        """Impulse of drive and of yaw until a `time` [s]."""
        if time <= self._until[0]:
            return self._impulse[0]
        place = bisect_right(self._until, time, hi=len(self._until) - 1)
        since, until = self._until[place - 1], self._until[place]
        share = (time - since) / (until - since)
        (drive, yaw), (drive_1, yaw_1) = self._impulse[place - 1], self._impulse[place]
        return drive + share * (drive_1 - drive), yaw + share * (yaw_1 - yaw)


def _slowest(before: float, after: float) -> float:
    """The lower speed of two, 0 if it turned round between them."""
    return min(abs(before), abs(after)) if before * after > 0 else 0.0
