"""How much force is given on trust: what goes beyond known friction while no motion is told.

A seal that sticks looks like odometry that is late, or stuck: torque is given, and no motion is
told. The climber may move in truth, at a speed that is the excess force's integral over the mass.
So that speed is bounded. Where it is used up, the climber is let come to rest, as its seal makes
it; then it is pushed again, a little more. A seal that sticks breaks loose by that, and what was
told too late shows while nothing drives. A reference that begins slowly asks for hardly more than
the known friction, so that pushes after the first have a least force of their own.
"""

import math

from climber_uk.control.control_law import CUT, Command, ControlInput, ControlLaw
from climber_uk.control.model import SLOW
from climber_uk.control.observed import Acting, Observed
from climber_uk.control.safety import Mode, Trouble
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import clipped, wrapped
from climber_uk.mechanics.quantities import NO_WRENCH, Torques, Wrench

FIRST, FIRST_SHARE = 0.04, 0.2  # [m/s] of the first push, and beside it of what is allowed
GROWS = 1.4  # from one push to the next
MOST, PUSHES = 0.1, 6  # [m/s] beyond what is allowed, and pushes, after which it is stalled
# [m/s] of a reference that goes on while the climber stops, and pushes, after which it is stalled
STOPPED, STOPPED_PUSHES = 0.05, 1
TRIED = 2  # pushes, from which on a climber off its path is stalled
SPENT = 0.95  # of it, from which it is used up
MORE = 0.2  # of the friction, by which each push after the first is stronger than the last
FIRST_PAUSE, PAUSE = 0.16, 0.05  # [s] from one to the next, for which nothing drives
ECHO = 1.1  # [s] after the very first one, in which an answer comes that is late
# of the friction, that is pushed against meanwhile, once it rests; and for a time [s] before the
# next push, as motors are lazy
HELD, LOADED, LOADS = 0.6, 0.95, 0.03
MOVES_NOTHING = 0.85  # of it, up to which a push surely has ended
LATE = 0.02  # [s] after a push has ended, from which on a motion that begins comes too late
MEMORY = 0.1  # [s] in which friction is learnt
CREEPS = 1e-3  # [m/s] of a motion that pose and twist tell alike, from which on it is one
KNOWN = 0.2  # [s] of sliding, after which it is known
MOST_FRICTION = 2.0  # times that of the model
# On the way to the reference speed and yaw rate may change by so much [1/s] of the fastest; beyond
# that the push [m/s³] and the moment [rad/s³] grow: fast enough for what scrubs
GENTLE = 4.0
GROWS_BY, TURN_GROWS_BY = 10.0, 90.0
BREAKS_LOOSE = 1.2  # times what a turn meets, until it begins


class ForceBudget:
    """What a climber may do by its torques, while odometry tells that it rests."""

    def __init__(self) -> None:
        self.is_gentle = True  # with the first push of a climber that has not slid for a while
        self.restart()

    def restart(self) -> None:
        """Know nothing of a climber."""
        self.pause()
        self.late = 0.0  # [s] by which a motion came later than its push
        self.is_new = True  # until its first push was answered, or an answer waited for
        self.is_doubted = False  # odometry that changes, until the climber has slid for a while
        self._slid, self._friction = 0.0, 0.0  # [s] for which it slides, [N] of friction then
        # [N m] that is turned against, of late, and what a turn is known to meet
        self._resisted = self._scrubs = 0.0
        self.lasts = NO_WRENCH  # of what pushes and turns it on its way to the reference

    def pause(self) -> None:
        """Watch nothing for now: it need not move."""
        self._rests = False  # as it is told
        self.speed = self.turn = 0.0  # [m/s] that it may have, and a rim by turning
        self._turns = self._creeps = False  # as it is told, by pose and twist
        self._astray = 0.0  # [rad] that its heading may be off
        self.pushes = 0  # without an answer
        self.paused: float | None = None  # [s] for which nothing drives
        self._loads = False  # before the next push
        self._still = 0.0  # [s] for which it rests after a push, as far as its torques tell
        self._pushed = 0.0  # [s] since it should move by the last push
        self._wanted, self._allowed = 0.0, math.inf  # [m/s]
        self._lives = False  # odometry, that has changed at all since the first push
        self._most_pushes = PUSHES

    @property
    def first(self) -> float:
        """Speed [m/s] that is given at first."""
        return FIRST + FIRST_SHARE * self._allowed

    @property
    def listens(self) -> bool:
        """Whether it waits for an answer to the first push there was, however late."""
        is_new = self.is_new and self.is_gentle
        return self.paused is not None and self.pushes == 1 and is_new

    @property
    def most(self) -> float:
        """Speed [m/s] that may be given now."""
        is_first = self.is_gentle and self.pushes == 0 and self._slid <= KNOWN
        first = FIRST if is_first else self.first
        return min(first * GROWS**self.pushes, self._allowed + MOST)

    def learn(self, climber: Climber, observed: Observed) -> None:
        """Learn what resists turning: what scrubs, all of it while it turns, either way alike.

        `see` does so, too.
        """
        before, after, time = observed.before, observed.after, observed.time
        is_told = after[:3] != before[:3]
        self._turns = is_told and abs(climber.half_track * after.yaw_rate) >= SLOW
        if not is_told or max(abs(after.speed), abs(climber.half_track * after.yaw_rate)) < SLOW:
            return
        _, moment = climber.wrench(*observed.torques)
        moment -= climber.driven_inertia * (after.yaw_rate - before.yaw_rate) / time
        resists = math.copysign(1.0, after.yaw_rate) * moment if self._turns else abs(moment)
        self._resisted += (1 - math.exp(-time / MEMORY)) * (resists - self._resisted)
        self._scrubs = max(self._resisted, 0.0 if self._turns else self._scrubs)

    def see(
        self, climber: Climber, observed: Observed, wanted: float, allowed: float
    ) -> Trouble | None:
        """Take what an odometry tells; [m/s] that the reference asks for, and may ask for."""
        self.learn(climber, observed)
        self._wanted, self._allowed = wanted, allowed
        speed, gone = abs(observed.after.speed), _gone(observed)
        way = speed * observed.time
        self._creeps = speed >= CREEPS and abs(gone - way) < way / 2
        if _is_fast(observed) or climber.falls:
            return self._slide(climber, observed)
        return self._rest(climber, observed)

    def _slide(self, climber: Climber, observed: Observed) -> Trouble | None:
        before, after, time = observed.before, observed.after, observed.time
        push = _push(climber, observed.torques, _weight(climber, observed))
        holds = self._holds(climber)
        # a pose that a fix corrects moves as well, but no twist tells it
        is_told = abs(after.speed) >= SLOW
        is_late = is_told and self._rests and self.pushes > 0 and _ends(climber, push, holds)
        if self._rests:
            self.is_new = False  # it has answered
            self._rests, self.paused, self._slid, self.pushes = False, None, 0.0, self.pushes // 2
        self._slid += time
        if self._slid > KNOWN:
            self.is_new = self.is_doubted = False
        resists = push - climber.driven_mass * (after.speed - before.speed) / time
        new = max(1 - math.exp(-time / MEMORY), time / self._slid)
        self._friction += new * (math.copysign(1.0, after.speed) * resists - self._friction)
        if is_late and self._still > LATE + observed.reaction:
            self.late = max(self._pushed, self._still)
            return Mode.LATE, f"it moves {self._still:.2f} s after a push has ended"
        return None

    def _rest(self, climber: Climber, observed: Observed) -> Trouble | None:
        before, after, time = observed.before, observed.after, observed.time
        if not self._rests:
            self._friction *= self._slid > KNOWN
            self._rests, self.speed, self.turn, self._astray = True, before.speed, 0.0, 0.0
            self._lives, self._still, self._pushed = False, 0.0, 0.0
            stops = self._wanted > STOPPED and self._slid > KNOWN
            self._most_pushes = STOPPED_PUSHES if stops else PUSHES
        elif self.pushes and after[:3] != before[:3]:
            self._lives = True
        push = _push(climber, observed.torques, _weight(climber, observed))
        holds = self._holds(climber)
        self.speed = _rolled(self.speed, push, holds, time / climber.driven_mass)
        ends = self.speed == 0 and _ends(climber, push, holds)
        self._still = self._still + time if ends else 0.0
        if self._pushed or abs(self.speed) > SLOW:
            self._pushed += time
        if self._is_told:
            self.speed, self.turn = before.speed, climber.half_track * after.yaw_rate
            self._pushed = 0.0
            return None
        _, moment = climber.wrench(*observed.torques)
        holds = BREAKS_LOOSE * self._scrubs
        told = climber.half_track * after.yaw_rate
        rolled = _rolled(self.turn, moment, holds, time * _rims(climber))
        self.turn = told if self._turns else rolled
        if not self._turns:  # a slow turn that its heading shows leads it nowhere else
            turned = abs(self.turn) / climber.half_track * time
            shown = abs(wrapped(after.heading - before.heading))
            self._astray = max(self._astray + turned - shown, 0.0)
        if self.paused is not None:
            self.paused += time
            pause = FIRST_PAUSE if self.pushes == 1 else PAUSE
            pause = (ECHO if self.listens else pause) + observed.reaction
            self._loads = self.paused > pause
            if self.paused > pause + LOADS and self.speed == 0:
                self.is_new, self.paused = False, None
        elif abs(self.speed) > SPENT * self.most:
            self.paused, self._loads, self.pushes = 0.0, False, self.pushes + 1
        return self.unanswered if self.pushes > self._most_pushes else None

    @property
    def _is_told(self) -> bool:
        """Whether odometry tells what moves, so that nothing is given on trust."""
        lives = self._lives and not self.is_doubted
        return self.paused is None and (lives or self._creeps)

    @property
    def _is_to_drive(self) -> bool:
        """Whether it is watched: its reference does not rest, nor turn on the spot."""
        return self._allowed < math.inf

    @property
    def unanswered(self) -> Trouble | None:
        """Trouble if odometry stands exactly, whatever was pushed."""
        if self.pushes < TRIED or self._lives:
            return None
        return Mode.STALLED, f"{self.pushes} pushes moved nothing"

    def _holds(self, climber: Climber) -> float:
        """Friction [N] that is known to hold it, but for what its weight may pull beside."""
        model = climber.seal_friction
        friction = min(max(model, self._friction), MOST_FRICTION * model)
        return max(friction - climber.weight_along_wall * min(self._astray, 1.0), 0.0)

    def within(
        self, command: Command, law: ControlLaw, ahead: ControlInput, pending: Acting
    ) -> Command:
        """A command, or what of it is in the budget; `pending` torques act before it.

        What may change of it within a period is found anew: a moment that is not given would leave
        nothing of that for the drive.
        """
        if law.falls or not self._rests or self._is_told:
            return command
        climber, weight, period = law.climber, law.weight(command.motion), ahead.period
        force, moment = (
            asked - lost for asked, lost in zip(command.demanded, command.lost, strict=True)
        )
        push = force - weight
        stronger = self._stronger(climber, push)
        if self.paused is not None:
            share = LOADED if self._loads else HELD
            held = share * min(climber.seal_friction, self._holds(climber))
            most = 0.0 if self.speed else held
            lowest, highest = -most, most
        else:
            speed, holds = self.speed, self._holds(climber)
            for torques, time in pending:
                push_then = _push(climber, torques, weight)
                speed = _rolled(speed, push_then, holds, time / climber.driven_mass)
            to_force = climber.driven_mass / period
            lowest = -holds - to_force * max(self.most + speed, 0.0)
            highest = holds + to_force * max(self.most - speed, 0.0)
        push_given = min(max(stronger, lowest), highest)
        turned = moment - self._turning(climber, moment, period)
        if push_given == push and abs(turned) <= CUT:
            return command
        cut = push - push_given
        lost = Wrench(command.lost.force + cut, command.lost.moment + turned)
        wheels = law.torques(weight + push_given, moment - turned, ahead)
        return command._replace(wheels=wheels, lost=lost)

    def gently(
        self, command: Command, law: ControlLaw, ahead: ControlInput, speed: float, yaw_rate: float
    ) -> Command:
        """A command on the way to the reference, at a `speed` [m/s] and a `yaw_rate` [rad/s].

        How late torques act may not be known yet: a push or a moment that swings is bounded, and
        what lasts of it is given all the same.
        """
        climber, weight, time = law.climber, law.weight(command.motion), ahead.period
        force, moment = (
            asked - lost for asked, lost in zip(command.demanded, command.lost, strict=True)
        )
        mass, inertia, push = climber.driven_mass, climber.driven_inertia, force - weight
        given, pushed = push, self.lasts.force
        if not law.falls and not self._is_to_drive:  # else `within` bounds its push
            holds = self._holds(climber)
            known = clipped(push, -holds, holds)
            most, change = mass * GENTLE * speed, mass * GROWS_BY * time
            beyond, pushed = _gentle(push - known, pushed, most, change)
            given = known + beyond
        most = inertia * GENTLE * yaw_rate + BREAKS_LOOSE * self._scrubs
        turn, turned = _gentle(moment, self.lasts.moment, most, inertia * TURN_GROWS_BY * time)
        if self.paused is None:
            self.lasts = Wrench(pushed, turned)
        if (given, turn) == (push, moment):
            return command
        lost = Wrench(command.lost.force + push - given, command.lost.moment + moment - turn)
        return command._replace(wheels=law.torques(weight + given, turn, ahead), lost=lost)

    def _stronger(self, climber: Climber, push: float) -> float:
        """A push [N] with at least the force of its number; see `MORE`.

        Soon after a fault it is not: what was wrong may be so still.
        """
        is_push = self.paused is None and self.pushes > 0 and abs(push) > self._holds(climber)
        if self.is_doubted or not is_push:
            return push
        least = (1 + MORE * self.pushes) * climber.seal_friction
        return math.copysign(max(least, abs(push)), push)

    def _turning(self, climber: Climber, moment: float, period: float) -> float:
        """A moment [N m], or what of it is given while no turn is told.

        In a pause that is none, but for what has lasted on the way to the reference.
        """
        if self.paused is not None:
            return self.lasts.moment if self._turns else 0.0
        if self._turns:  # as it is told
            return moment
        holds, to_moment = BREAKS_LOOSE * self._scrubs, 1 / (_rims(climber) * period)
        lowest = -holds - to_moment * max(FIRST + self.turn, 0.0)
        return min(max(moment, lowest), holds + to_moment * max(FIRST - self.turn, 0.0))


def _gentle(asked: float, lasts: float, most: float, change: float) -> tuple[float, float]:
    """What is given of what is asked for, `most` beside what lasts; and what lasts from now on."""
    given = clipped(asked, lasts - most, lasts + most)
    return given, lasts + clipped(asked - lasts, -change, change)


def _gone(observed: Observed) -> float:
    """Way [m] between two odometry messages, by their poses."""
    before, after = observed.before, observed.after
    return math.hypot(after.x - before.x, after.y - before.y)


def _is_fast(observed: Observed) -> bool:
    """Whether it slides, by its twist or its poses."""
    return max(abs(observed.after.speed), _gone(observed) / observed.time) >= SLOW


def _ends(climber: Climber, push: float, holds: float) -> bool:
    """Whether a push surely moves nothing, of which friction `holds` so much [N]."""
    return abs(push) <= MOVES_NOTHING * min(climber.seal_friction, holds)


def _rolled(speed: float, push: float, friction: float, by_time: float) -> float:
    """The speed [m/s] that it may have after a `push`, of which `friction` takes its part."""
    if speed == 0 and abs(push) <= friction:
        return 0.0
    push -= math.copysign(friction, speed or push)
    end = speed + by_time * push
    return 0.0 if speed * end < 0 else end


def _rims(climber: Climber) -> float:
    """Acceleration [m/s²] of a rim by a moment of 1 N m."""
    return climber.half_track / climber.driven_inertia


def _push(climber: Climber, torques: Torques, weight: float) -> float:
    """Drive force [N] beside the one that carries the weight."""
    force, _ = climber.wrench(*torques)
    return force - weight


def _weight(climber: Climber, observed: Observed) -> float:
    """Drive [N] that carries the weight, while torques act: a turn of 5 mrad is worth 0.2 N."""
    sine = (observed.before.sine + observed.after.sine) / 2
    return climber.weight_along_wall * sine - observed.pull
