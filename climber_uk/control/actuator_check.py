"""Whether each wheel answers its torque: detection of a dead motor, and of which one it is.

The force that acted on each wheel is that of (11) and (15), from two odometry messages in a row; it
is compared with the one that the torque should have caused. Where odometry is made of encoders, one
that is stuck shows as a wheel that stands while the other one goes.
"""

import math

from climber_uk.control.observed import Observed
from climber_uk.mechanics.climber import Climber

SLIDES = 0.01  # [m/s] from which it is known against what the seal rubs
UNANSWERED = 5.0  # times as much the torque explains less than no torque at all
LACKS = 0.3, 1.3  # of a wheel's torque that is missing all at once, if nothing of the other one's
LACKS_ELSE = 0.25  # of the same, is missing or too much there,
LACKS_MOMENT = 0.5  # and of what is missing: what scrubs gives one what it takes from the other
LACKS_FROM = 0.3  # of the largest torque, that a wheel has to be asked for
LACKS_IN_A_ROW = 3  # odometry messages
STANDS_OUT = 100.0  # sum of their squares, by the mean square of what was missing before
WENT, GOES, STANDS = 0.05, 0.01, 1e-3  # [m/s] of a rim: before, of the other one, of this one
ASKED = 0.02  # [m/s] of a rim that is not to stand: of one that turns back all tell a little else
ASKED_SHARE = 0.5  # of the speed at which the other one goes, which is enough where that is less
# odometry messages for which a rim stands that went before; that is asked to go, and never did
STANDS_AT_ONCE, STANDS_ON = 3, 10
NEITHER = "neither"  # name of both wheels, where
SILENT = 0.05  # [s] they have not answered for more than that
EXCITED = 0.12  # of the largest torque: its standard deviation that shows if a wheel answers


class Variance:
    """Mean and variance of what was added, each older value counting less."""

    def __init__(self) -> None:
        self.number, self.mean, self.variance = 0, 0.0, 0.0

    def add(self, value: float, weight: float) -> None:
        """Add a value that has `weight` (0 to 1), and all before it the rest."""
        self.number += 1
        if self.number == 1:
            self.mean = value
            return
        off = value - self.mean
        self.mean += weight * off
        self.variance = (1 - weight) * (self.variance + weight * off * off)


class Wheel:
    """A wheel that answers its torque: the force that acted follows the one that was asked for.

    Of a dead one the force stays what it was, and what is unexplained, the difference, varies.
    What resists the climber as a whole makes that vary on both sides.
    """

    def __init__(self) -> None:
        self.asked, self.acted, self.unexplained = Variance(), Variance(), Variance()
        self.force = self.missing = 0.0  # [N] that was asked for last, and what of it did not act
        self.lacking = 0  # odometry messages in a row, for which it was
        self._lacked = self._usual = 0.0  # [N²] sum of squares in these; mean square before them
        self._weight = 0.0

    def add(self, asked: float, acted: float, known: float, weight: float) -> None:
        """Add the force [N] that a torque should cause, the one that acted, and a known one."""
        self.asked.add(asked, weight)
        self.acted.add(acted, weight)
        self.unexplained.add(acted - asked, weight)
        self.force, self.missing = asked, asked + known - acted
        self._weight = max(weight, 1 / self.asked.number)

    def lacks(self, other: "Wheel", largest: float) -> bool:
        """Whether its force is missing all at once, of `largest` [N], and only its force.

        What is missing has to stand out of what was before, of wheels that scrub and noise.
        """
        force = abs(self.force)
        missing = math.copysign(1.0, self.force) * self.missing
        least, most = LACKS
        is_missing = force > LACKS_FROM * largest and least * force < missing < most * force
        alone = abs(other.missing) < min(LACKS_ELSE * force, LACKS_MOMENT * missing)
        square = missing * missing
        if is_missing and alone:
            self.lacking, self._lacked = self.lacking + 1, self._lacked + square
        else:
            self.lacking, self._lacked = 0, 0.0
            self._usual += self._weight * (square - self._usual)
        return self.lacking >= LACKS_IN_A_ROW and self._lacked > STANDS_OUT * self._usual

    def answers(self, other: "Wheel", largest: float, proof: float) -> bool:
        """Whether it does, or too little was asked of it to know; of `largest` [N] at most."""
        excited = self.asked.variance > (proof * EXCITED * largest) ** 2
        explained = max(self.acted.variance, other.unexplained.variance)
        return not (excited and self.unexplained.variance > proof * UNANSWERED * explained)

    @property
    def acts(self) -> bool:
        """Whether what is asked explains what acts, more than it leaves unexplained."""
        return self.unexplained.variance < self.acted.variance


class RimStop:
    """A rim that stands while the other one goes on, as no motor makes it.

    Its encoder is stuck, of which odometry is made, or the wheel is.
    """

    def __init__(self) -> None:
        self._seen = 0.0, 0.0  # [m/s] in the last two messages
        self._stands, self._at_once = 0, False  # messages; whether it went before them
        self._unheeded = 0  # messages in a row of those, in which it is asked to go
        self._other_stands = 0  # messages in a row
        self.is_stuck = False

    def add(self, rim: float, other: float, asked: float) -> None:
        """Add speeds [m/s] of this rim, of the other, and what is asked of this one at least."""
        self._other_stands = self._other_stands + 1 if abs(other) <= GOES else 0
        if abs(rim) >= STANDS or self._other_stands >= (STANDS_AT_ONCE if self._at_once else 1):
            self._stands, self._unheeded, self._at_once = 0, 0, False
        elif not self._other_stands:  # else a seal may have stuck again
            if self._stands == 0:
                self._at_once = max(map(abs, self._seen)) > WENT
            self._stands += 1
            is_asked = asked > min(ASKED, ASKED_SHARE * abs(other))
            self._unheeded = self._unheeded + 1 if is_asked else 0
        self._seen = self._seen[1], rim
        long_since = self._unheeded >= STANDS_ON
        self.is_stuck = long_since or (self._at_once and self._stands >= STANDS_AT_ONCE)


class ActuatorCheck:
    """Whether both wheels of a climber that slides answer their torques."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Compare from now on."""
        self._rims = RimStop(), RimStop()
        self._begin()

    def _begin(self) -> None:
        """Compare torques from now on."""
        self._wheels, self._moved = (Wheel(), Wheel()), 0.0  # [s]
        self._drive, self._silent = Wheel(), 0.0  # both together; [s] for which nothing answers
        self._had_time = False  # to answer

    def add(
        self,
        climber: Climber,
        observed: Observed,
        response_time: float,
        asked: tuple[float, float],
    ) -> None:
        """Take what an odometry tells of the time since the last: see `Wheel` and `RimStop`.

        They have a `response_time` [s] to answer; 0: nothing is compared. `asked` [m/s] is what
        is asked of the right and the left rim, at least.
        """
        if response_time == 0:
            self.restart()
            return
        before, after, time = observed.before, observed.after, observed.time
        d, (right, left) = climber.half_track, self._rims
        speeds = after.speed + d * after.yaw_rate, after.speed - d * after.yaw_rate
        right.add(*speeds, asked[0])
        left.add(*speeds[::-1], asked[1])
        if min(abs(before.speed), abs(after.speed)) < SLIDES:
            if self._moved:
                self._begin()
            return
        self._moved += time
        self._had_time = self._moved > response_time
        mass, inertia, friction, weight = climber.inertial
        drive = mass * (after.speed - before.speed) / time + weight * after.sine
        drive += math.copysign(friction, after.speed)
        yaw_force = inertia * (after.yaw_rate - before.yaw_rate) / time / climber.half_track
        new = 1 - math.exp(-time / response_time)
        push, turn = observed.disturbance
        push += observed.pull
        turn /= climber.half_track
        acted = (drive + yaw_force) / 2, (drive - yaw_force) / 2
        known = (push + turn) / 2, (push - turn) / 2
        rows = zip(self._wheels, observed.torques, acted, known, strict=True)
        for wheel, torque, force, push in rows:
            wheel.add(torque / climber.wheel_radius, force, push, new)
        force, _ = climber.wrench(*observed.torques)
        self._drive.add(force, drive, 0.0, new)
        largest = climber.max_wheel_torque / climber.wheel_radius
        silent = not self._drive.answers(Wheel(), 2 * largest, 1.0)
        acts = any(wheel.acts for wheel in self._wheels)
        self._silent = self._silent + time if silent and not acts else 0.0

    @property
    def stuck(self) -> str:
        """Name of the wheel that stands while the other goes, else ''."""
        right, left = self._rims
        return "right" if right.is_stuck else "left" if left.is_stuck else ""

    def dead(self, climber: Climber, proof: float) -> str:
        """Name of the wheel that does not answer, else ''; `proof` is the share that is enough.

        It is `NEITHER` where both are silent: their torques act late, or odometry does.
        """
        if not self._moved:
            return ""
        largest, (right, left) = climber.max_wheel_torque / climber.wheel_radius, self._wheels
        wheels = ("right", right, left), ("left", left, right)
        lacking = (name for name, wheel, other in wheels if wheel.lacks(other, largest))
        if name := next(lacking, ""):
            return name
        if not self._had_time:
            return ""
        silent = (name for name, it, other in wheels if not it.answers(other, largest, proof))
        if name := next(silent, ""):
            return name
        return NEITHER if self._silent > SILENT else ""
