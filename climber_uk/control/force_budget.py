"""How much force is given on trust: what goes beyond known resistance while no motion is told.

A seal that sticks looks like odometry that is late, or stuck: torque is given, and no motion is
told. The climber may move in truth, at a speed that is the excess force's integral over the mass.
So that speed is bounded. Where it is used up, the climber is let come to rest (its seal holds it),
is waited for, and then pushed again, a little more. A seal that sticks breaks loose by that; what
was told too late shows while nothing drives.
"""

import math

from climber_uk.control.control_law import CUT, Command
from climber_uk.control.estimator import Acting, Observed
from climber_uk.control.model import SLOW
from climber_uk.control.safety import Mode, Trouble
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion, Torques, Wrench

TRUSTED, TRUSTED_SHARE = 0.05, 0.2  # [m/s] of the first push, and beside it of what is allowed
GROWS = 1.4  # from one push to the next
MOST = 1.2, 2.5  # times what is allowed, of odometry that stands exactly, and of one that lives
SPENT = 0.8  # of it, from which it is used up
PUSHES = 8, 20  # of the same, without an answer, after which it is stalled
FIRST_PAUSE, PAUSE = 0.12, 0.05  # [s] from one to the next, for which nothing drives
KNOWN = 0.2  # [s] of sliding, after which its friction is
MOST_FRICTION = 2.0  # times that of the model
HELD = 0.8  # of the friction, that is pushed meanwhile, once it rests
LATE = 0.035  # [s] into it, from which on a motion that begins comes too late
MEMORY = 0.1  # [s] in which it is learnt what resists a climber that slides


class ForceBudget:
    """What a climber may do by the torques that it was given, beyond the motion that is told."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Nothing was given."""
        self.speed = 0.0  # [m/s] beyond what is told
        self.turn = 0.0  # [m/s] of a rim, the same
        self._resistance = 0.0  # [N] of what slides
        self._slides = 0.0  # [s] for which it does
        self._pushes = 0
        self._paused: float | None = None  # [s] for which nothing drives
        self._allowed = math.inf  # [m/s]
        self._changed = self._lives = False  # odometry, at all, since the last push; in that
        self._friction = 0.0  # [N] of the seal, as it was when it slid last

    @property
    def most(self) -> float:
        """Speed [m/s] that may be given."""
        return min(self.first * GROWS**self._pushes, MOST[self._lives] * self._allowed)

    @property
    def first(self) -> float:
        """The same, at first [m/s]."""
        return TRUSTED + TRUSTED_SHARE * self._allowed

    def see(self, climber: Climber, observed: Observed, allowed: float) -> Trouble | None:
        """Take what an odometry tells; `allowed` [m/s] is the reference's fastest, and catch-up."""
        self._allowed = allowed
        force, _ = climber.wrench(*observed.torques)
        push = force - climber.weight_along_wall * observed.after.sine
        if abs(observed.after.speed) < SLOW:
            return self._rest(climber, observed, push)
        return self._slide(climber, observed, push)

    def _rest(self, climber: Climber, observed: Observed, push: float) -> Trouble | None:
        if self._slides:
            self.speed, self._slides, self.turn = observed.before.speed, 0.0, 0.0
            self._changed = self._lives = False
        elif observed.after[:3] != observed.before[:3]:
            self._changed = True
        if climber.seal_friction < climber.weight_along_wall:  # it does not rest by itself
            self.speed = 0.0
            return None
        self.speed = _rolled(climber, self._holds(climber), self.speed, push, observed.time)
        if self._pushes:
            _, moment = climber.wrench(*observed.torques)
            rate = moment / climber.driven_inertia
            self.turn += climber.half_track * (rate * observed.time)
        if self._paused is not None:
            self._paused += observed.time
            pause = FIRST_PAUSE if self._pushes == 1 else PAUSE
            if self._paused > pause + observed.reaction and self.speed == 0:
                self._paused = None
        elif abs(self.speed) > SPENT * self.most:
            self._paused, self._pushes = 0.0, self._pushes + 1
            self._lives, self._changed = self._changed, False
        if self._pushes > PUSHES[self._lives]:
            return Mode.STALLED, f"{self._pushes} pushes moved nothing"
        return None

    def _slide(self, climber: Climber, observed: Observed, push: float) -> Trouble | None:
        time, late = observed.time, self._paused
        if not self._slides:
            self.speed, self._paused, self._pushes = 0.0, None, self._pushes // 2
        self._slides += time
        change = observed.after.speed - observed.before.speed
        resists = push - climber.driven_mass * change / time
        off = resists - self._resistance
        new = max(1 - math.exp(-time / MEMORY), time / self._slides)
        self._resistance += new * off
        self.speed = math.exp(-time / MEMORY) * self.speed + off / climber.driven_mass * time * (1-new)
        if self._slides > KNOWN:
            self._friction = abs(self._resistance)
        if late is not None and late > LATE + observed.reaction:
            return Mode.LATE, f"it moves {late:.2f} s after the last push"
        return None

    def within(
        self, command: Command, climber: Climber, period: float, pending: Acting
    ) -> Command:
        """A command, or what of it is in the budget; `pending` torques act before it."""
        force, moment = climber.wrench(*command.wheels)
        weight, mass = climber.weight_along_wall * command.motion.sine, climber.driven_mass
        push, speed, known = force - weight, self.speed, self._resistance
        if self._slides:
            for torques, time in pending:
                before, _ = climber.wrench(*torques)
                speed += time * (before - weight - known) / mass
            most = known + mass * (self.most - speed) / period
            least = known - mass * (self.most + speed) / period
            goes = command.motion.speed > 0  # it may always be braked
            lowest, highest = (-math.inf, most) if goes else (least, math.inf)
        elif climber.seal_friction < climber.weight_along_wall:
            return command
        elif self._paused is not None:
            highest = 0.0 if self.speed else HELD * climber.seal_friction
            lowest = -highest
        else:
            for torques, time in pending:
                before, _ = climber.wrench(*torques)
                speed = _rolled(climber, self._holds(climber), speed, before - weight, time)
            known = self._holds(climber)
            lowest = -known - mass * max(self.most + speed, 0.0) / period
            highest = known + mass * max(self.most - speed, 0.0) / period
        cut, turned = push - min(max(push, lowest), highest), 0.0
        if self._pushes and not self._slides:
            turned = moment - self._turning(climber, moment, period)
        if abs(cut) + abs(turned) <= CUT:
            return command
        most = climber.max_wheel_torque
        off = climber.torques(cut, turned)
        right, left = (
            min(max(it - less, -most), most) for it, less in zip(command.wheels, off, strict=True)
        )
        lost = Wrench(command.lost.force + cut, command.lost.moment + turned)
        return command._replace(wheels=Torques(right, left), lost=lost)

    def _holds(self, climber: Climber) -> float:
        """Friction [N] that is known to hold it."""
        friction = climber.seal_friction
        return min(max(friction, self._friction), MOST_FRICTION * friction)

    def _turning(self, climber: Climber, moment: float, period: float) -> float:
        """A moment [N m], or what of it is given while no motion is told: none in a pause."""
        if self._paused is not None:
            return 0.0
        stopping = climber.driven_inertia / climber.half_track / period
        lowest = -max(self.first + self.turn, 0.0) * stopping
        return min(max(moment, lowest), max(self.first - self.turn, 0.0) * stopping)


def _rolled(climber: Climber, friction: float, speed: float, push: float, time: float) -> float:
    """Speed [m/s] after a force [N] without weight has acted for a time [s]."""
    if speed == 0 and abs(push) <= friction:
        return 0.0
    end = speed + time * (push - math.copysign(friction, speed or push)) / climber.driven_mass
    return 0.0 if speed * end < 0 else end
