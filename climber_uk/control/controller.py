"""The whole controller without ROS: odometry and reference in, torques out, whatever happens.

An odometry goes one way, from top to bottom: what it tells of the climber (`Estimator.see`),
whether torques and reference explain that (`Guard.watch`), whether to follow (`Mode`), where the
climber will be when its torques act (`Estimator.ahead`), where it should be then
(`ActiveReference.target`), and which torques take it there (`ControlLaw.command`).

Times are integers in nanoseconds: stamps on the odometry's clock, `now` on the node's, which is 0
while there is none.
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

from climber_uk.control.active_reference import ActiveReference
from climber_uk.control.approach import Approach
from climber_uk.control.constraint_set import ConstraintSet, blended
from climber_uk.control.control_law import CUT, Command, ControlLaw, check_finite
from climber_uk.control.encoder_check import EncoderCheck
from climber_uk.control.estimator import Estimator
from climber_uk.control.guard import Guard, GuardOptions
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import DisturbanceEstimate, Observer
from climber_uk.control.observed import Observed
from climber_uk.control.repeat_check import RepeatCheck
from climber_uk.control.safe_output import SafeOutput
from climber_uk.control.safety import Calm, Mode, Safety, Trouble
from climber_uk.control.speed_command import STANDING, MotorBoard
from climber_uk.control.stops import Stops
from climber_uk.control.time_scaling import Pacing
from climber_uk.control.timing import LONGEST_STEP, Ages, Timing
from climber_uk.control.twist import FAST_SIDEWAYS, OPPOSED_IF_TOO_FAST, TwistCheck
from climber_uk.mechanics import SECOND, Array, pack
from climber_uk.mechanics.adhesion import Adhesion, Suction
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import NO_WRENCH, Motion, Speeds, Torques

CLOCK_PATIENCE = 20  # looks at a clock that is not there
CLOCK_STEP = round(0.2 * SECOND)  # [ns] back, from which time has started anew
LONGEST_SILENCE = SECOND  # [ns] by which odometry that was silent so long may be late at most
PATIENCE = 3.0  # periods of silence, or `LONGEST_STEP`, after which no torque is held on
SELDOM = 0.8  # of the timeout from one odometry to the next: the least delay would exceed it
RETUNING_TIME = 0.5  # [s] in which changed gains come to act
FOLLOWING, APPROACHING, WAITING = Mode.FOLLOWING, Mode.APPROACHING, Mode.WAITING


class Answer(NamedTuple):
    """Torques for the odometry of `stamp`, and speeds for motors that take these."""

    stamp: int  # [ns]
    wheels: Torques
    command: Command | None  # what they came from; None: safe output
    speeds: Speeds = STANDING

    @property
    def torques(self) -> Array:
        """Torques (2,) right, left [N m]."""
        return pack(*self.wheels)


class Settings(NamedTuple):
    """What may change while a controller runs."""

    law: ControlLaw
    observer: Observer = Observer()
    timing: Timing = Timing()
    pacing: Pacing = Pacing()
    board: MotorBoard = MotorBoard()


class Controller:
    """Follows while all is well, else gives the safe output; `mode` and `detail` say why.

    The mode is found anew for every answer, from the fields below, the first that holds
    (`_find_mode`). Good odometry without a reference is WAITING, without any output, for up to
    `reference_timeout` since `_waiting_since`, and NO_REFERENCE, with the safe output, after that.
    """

    def __init__(
        self,
        settings: Settings,
        safety: Safety | None = None,
        approach: Approach | None = None,
        guard: GuardOptions | None = None,
        adhesion: Adhesion | None = None,
        gentle: Guidance | None = None,
        stops: Stops | None = None,
    ) -> None:
        """`adhesion` is for the guard; `gentle` are the constraints of what begins at rest."""
        self.safety = safety or Safety()
        self._law, observer, timing, pacing, board = settings
        law = self._law
        self.estimator = Estimator(law.climber, observer, timing, self.safety, law.wall)
        self.active = ActiveReference(pacing, approach or Approach(), gentle or Guidance())
        self.guard = Guard(guard or GuardOptions(), adhesion or Suction())
        self.board = board
        self.stops = stops or Stops()
        self.mode, self.detail = Mode.WAITING, ""
        self.answer: Answer | None = None  # the last one
        self.ages = Ages()
        self._retuned: tuple[int, ConstraintSet] | None = None  # [ns] and what was before
        self._enabled = True
        self._clockless_looks = 0  # in a row, of `look`: see `CLOCK_PATIENCE`
        # [ns] stamp of the last good odometry, no later than the clock; or when a bad one came
        self._heard: int | None = None
        self._trouble: Trouble | None = None  # with that odometry
        self._stamp = 0  # [ns] of the last good one
        self._now = 0  # [ns] of the last look at the clock
        self._resumes = 0  # [ns] stamp from which on odometry that was silent is believed
        self._unsettled = 0  # odometry messages until a jump is forgiven
        self._twist, self.encoders, self._repeats = TwistCheck(), EncoderCheck(), RepeatCheck()
        self._without_twist = ""  # field of the twist that is zero while the pose goes
        self._waiting_since: int | None = None  # [ns] stamp of the first one not answered
        self._calm, self._safe_output = Calm(), SafeOutput(self.safety)

    @property
    def law(self) -> ControlLaw:
        """The control law, by the settings of now."""
        return self._law

    @law.setter
    def law(self, law: ControlLaw) -> None:
        self._law = law
        self.estimator.go_over_to(law.climber)

    @property
    def board(self) -> MotorBoard:
        """What the motors take; what is sent is what acts only where that are torques."""
        return self._board

    @board.setter
    def board(self, board: MotorBoard) -> None:
        self._board = board
        takes_torques = board.motors == "torque"
        self.estimator.checks_delay = self.guard.budget.is_gentle = takes_torques

    @property
    def motion(self) -> Motion | None:
        """Motion at the last good odometry, as it is believed to be."""
        return self.estimator.motion

    @property
    def stamp(self) -> int:
        """Of the last good odometry [ns]; 0 if there was none."""
        return self._stamp

    @property
    def clock_offset(self) -> float:
        """By how much the node's clock is ahead of the odometry's [s]; 0 if that may be latency."""
        is_offset = self.ages.offset(self.estimator.timing.max_latency) != 0
        return self.ages.least if is_offset else 0.0

    def enable(self, enabled: bool) -> None:
        """Follow the reference, or give the safe output; what was wrong before is forgiven."""
        self._enabled = enabled
        if enabled:
            self.guard.fault = None
            self.guard.forgive()
            self._watch_anew()
            self.stops.enable()
            self._forget_when()

    def retune(self, settings: Settings) -> None:
        """Go over to other settings: the constraints' gains gradually, so that no torque jumps."""
        if settings.law.constraints != self.law.constraints:
            self._retuned = self.estimator.stamp, self.constraints
        self.law, self.estimator.observer, self.estimator.timing, pacing, self.board = settings
        self.active.pacing = pacing

    # What comes in

    def on_odometry(
        self, now: int, stamp: int, motion: Motion, aside: float = 0.0
    ) -> Answer | None:
        """Answer an odometry; None while a reference is waited for, or if a newer one was here.

        `aside` is the speed [m/s] to the left that it tells: `observer.side_slip_source`.
        """
        self._look_at_clock(now)
        # a simulation publishes its first odometry right before its first /clock: how long there
        # was no clock until then does not count
        if self._stamp == 0:
            self._clockless_looks = 0
        if stamp == self._stamp and self.mode in (FOLLOWING, APPROACHING):
            return self.answer  # it was not received: the same once more
        timeout, off = self.safety.odometry_timeout, (now - stamp) / SECOND
        if now > 0 and abs(now - stamp) > round(timeout * SECOND):
            return self.on_bad_odometry(now, f"stamp is {off:.2f} s from the clock, too far")
        if 0 < self._stamp - stamp <= round(timeout * SECOND):
            return None
        was_older, repeated = self._repeats.older, self._repeats.repeated
        self._repeats.add(stamp, motion, self._law.climber.half_track)
        if older := self._repeats.older:
            return self.on_bad_odometry(now, f"it is back where it was {older:.2f} s ago")
        self._heard = min(stamp, now or stamp)  # a clock that is ahead makes no news
        if now > 0:
            self.ages.add(now, off)
        if stamp != self._stamp:
            silent = abs(stamp - self._stamp)
            if self._stamp and (was_older or silent > round(timeout * SECOND)):
                self.estimator.reset()
                self._watch_anew()
                self._resumes = stamp + min(silent, LONGEST_SILENCE)
                if repeated:  # and the rest of it comes as late; a leap may be a correction
                    self.estimator.acts_later(repeated)
            self._trouble = self._see(stamp, motion, aside)
            self._stamp = stamp
        return self._answer(now)

    def on_bad_odometry(self, now: int, why: str) -> Answer | None:
        """Give the safe output for an odometry that cannot be used."""
        self._look_at_clock(now)
        self._heard, self._trouble = now, (Mode.BAD_ODOMETRY, why)
        return self._answer(now)

    def on_reference(self, now: int, preview: Preview) -> Answer | None:
        """Take a reference; answer the odometry that waits for one."""
        self.active.take(preview)
        waits = self._waiting_since is not None or self.mode is Mode.NO_REFERENCE
        return self._answer(now) if waits else None

    def look(self, now: int) -> Answer | None:
        """Give the safe output if odometry has stopped, or its reference does not come."""
        self._look_at_clock(now)
        self._clockless_looks = self._clockless_looks + 1 if now == 0 else 0
        if self._heard is None and now > 0:
            self._heard = now
        mode, _ = self._find_mode(now)
        return None if mode in (FOLLOWING, WAITING) else self._answer(now)

    def _look_at_clock(self, now: int) -> None:
        """Notice a clock that went back: by a little, or because time starts anew."""
        back, self._now = self._now - now, now
        if back <= 0:
            return
        if self._heard is not None:
            self._heard = min(self._heard, now)
        # stamps of before the step are no newer ones
        self._stamp, self._resumes, self._waiting_since = 0, 0, None
        self._repeats.restart()
        self._forget_when()
        self.estimator.restart()
        if back > CLOCK_STEP:
            self.active.preview = None
            if not self.guard.is_for_good:  # what only ~/enable ends is ended by no clock
                self.guard.forgive()

    def _forget_when(self) -> None:
        """Forget since when it brakes and is calm: times of before mean nothing."""
        self._safe_output.forget()
        self._calm = Calm()

    # 1. What an odometry tells, and whether that is possible

    def _see(self, stamp: int, motion: Motion, aside: float) -> Trouble | None:
        """Take in an odometry; return what is wrong with it."""
        is_first = self.estimator.motion is None
        observed = self.estimator.see(stamp, motion, aside)
        self._safe_output.watch(self._law.climber, observed, motion)
        self.stops.move(self.estimator.motion if observed or is_first else None)
        if observed is None and not is_first:
            self._watch_anew()
            self._unsettled = self.safety.settling_messages
        if not is_first:
            self._unsettled -= self._unsettled > 0
        if observed is not None:
            wheels = self._check_encoders(observed)
            self._watch(stamp, observed, self._check_twist(observed) or wheels)
        if self._unsettled:
            return Mode.JUMPED, ""
        if self._without_twist:
            return Mode.NO_TWIST, f"{self._without_twist}; set velocity_source to pose"
        return None

    def _watch_anew(self) -> None:
        """Watch from now on: the climber is elsewhere."""
        self.guard.restart()
        self._twist.restart()
        self.encoders.restart()
        self._without_twist = ""

    def on_encoders(self, right: float, left: float) -> None:
        """Take the wheels' angles [rad]: a witness of odometry, for the guard."""
        self.encoders.turn(self._law.climber, right, left)

    def _check_encoders(self, observed: Observed) -> Trouble | None:
        """Trouble if the wheels turn otherwise than odometry says."""
        most = self.guard.options.encoder_distance
        if most == 0:
            return None
        self.encoders.go(self._law.climber, observed.after, observed.time)
        detail = self.encoders.trouble(most)
        return (Mode.WHEELS_DIFFER, detail) if detail else None

    def _check_twist(self, observed: Observed) -> Trouble | None:
        """Trouble if the heading is not that of the way, or the twist not the pose's rate.

        Notices a twist that is zero while the pose goes.
        """
        before, after, largest = observed.before, observed.after, self.safety.max_twist_error
        self._twist.add(before, after, observed.time, self._law.climber.half_track)
        if sideways := self._twist.sideways(largest):
            return Mode.HEADING_WRONG, sideways
        if self.estimator.observer.velocity_source == "pose":
            return None
        self._without_twist = self._twist.missing(largest)
        detail, is_sign = self._twist.trouble(largest)
        if not detail:
            return None
        return Mode.SIGN_WRONG if is_sign else Mode.TWIST_WRONG, detail

    def _watch(self, stamp: int, observed: Observed, trouble: Trouble | None) -> None:
        """Let the guard look at a climber that follows; let one that had a fault rest."""
        guard = self.guard
        if guard.fault is not None:
            guard.rest(self._law.climber, observed.after, observed.time)
            if guard.fault is None:
                self._twist.restart()
                self.encoders.restart()
        elif self.mode in (FOLLOWING, APPROACHING) and observed.time > 0:
            fault = trouble or self._find_fault(observed)
            if fault is not None:
                guard.count(stamp, fault)

    def _find_fault(self, observed: Observed) -> Trouble | None:
        """What the guard finds of a climber that follows, by the reference at its last odometry."""
        target = self.active.at(self._stamp)
        if target is None:
            return None
        expected = self.active.expected(self._stamp, target, self._law.constraints)
        margin = self.guard.options.speed_margin
        if margin > 0 and abs(self._twist.aside) > expected.allowed.speed + margin:
            least = FAST_SIDEWAYS * self.safety.max_twist_error
            if sideways := self._twist.sideways_of_late(least):
                return Mode.HEADING_WRONG, sideways
        fault = self.guard.watch(self._law.climber, observed, expected)
        if fault and fault[0] is Mode.LATE and self.estimator.acts_later(self.guard.late):
            fault = None
        if fault is None and (strayed := self.active.strayed(observed.before, target)):
            fault = self.guard.budget.unanswered or strayed
        if fault is not None and fault[0] is Mode.TOO_FAST:
            least = OPPOSED_IF_TOO_FAST * self.safety.max_twist_error
            sign = self._twist.opposed(least, is_sure=True)
            return (Mode.SIGN_WRONG, sign) if sign else fault
        return fault

    # 2. Whether to follow

    def _answer(self, now: int) -> Answer | None:
        """Torques for the last odometry, in the mode of now."""
        age = min(max(0, now - self._stamp) / SECOND, LONGEST_STEP)
        current = self._find_mode(now)
        mode, detail = self._calm.mode(self.mode, max(now, self._stamp), current)
        command = None
        if mode in (FOLLOWING, Mode.NO_REFERENCE):
            found, why, command = self._follow(age)
            if found is not WAITING or mode is FOLLOWING:
                mode, detail = found, why
        if mode in (WAITING, Mode.NO_REFERENCE):
            self._waiting_since = self._waiting_since or self._stamp
        else:
            self._waiting_since = None
        if mode is not self.mode:
            if mode.is_fault:
                self.estimator.forget()
            if command is not None:
                self._safe_output.end()
        self.mode, self.detail = mode, detail
        if mode is WAITING:
            return None
        if command is None:
            self.active.pause(self._stamp)
            law, estimator = self._law, self.estimator
            torques = self._safe_output.send(mode, self._stamp, age, estimator, law)
            speeds = STANDING
        else:
            torques = command.wheels
            speeds = self.board.speeds(self._law.climber, command, self.estimator.disturbance)
        self.answer = Answer(self._stamp, torques, command, speeds)
        return self.answer

    def _find_mode(self, now: int) -> Trouble:
        """Mode as things are, and a detail of it."""
        if not self._enabled:
            return Mode.DISABLED, ""
        if self._clockless_looks > CLOCK_PATIENCE:
            return Mode.NO_CLOCK, ""
        if self._heard is None:
            return Mode.WAITING, ""
        silent, patience = (now - self._heard) / SECOND, PATIENCE * self.estimator.period
        is_silent = silent - max(self.ages.least, 0.0) > max(LONGEST_STEP, patience)
        if silent > self.safety.odometry_timeout or is_silent:
            return Mode.NO_ODOMETRY, ""
        if self._stamp < self._resumes:  # what comes may be as old as it was silent
            return Mode.NO_ODOMETRY, "until now"
        # first what doubts the odometry, as that is what a stop brakes by
        wrong = self._trouble or self.guard.trouble
        return wrong or self.stops.trouble(now) or self._unfit() or self._missing(now)

    def _unfit(self) -> Trouble | None:
        """What forbids to follow, though nothing is wrong."""
        safety, pressure = self.safety, self._law.climber.suction_pressure
        period = self.estimator.period
        if pressure < safety.least_pressure:
            return Mode.LOW_PRESSURE, f"{pressure:.0f} Pa of {safety.least_pressure:.0f}"
        if period > SELDOM * safety.odometry_timeout:
            return Mode.SELDOM, f"every {period:.2f} s for a timeout of {safety.odometry_timeout} s"
        return None

    def _missing(self, now: int) -> Trouble:
        """Mode while nothing else forbids to follow: is there a reference?"""
        if self.active.begins_after(self._stamp):
            return Mode.NOT_BEGUN, ""
        since = now if self._waiting_since is None else self._waiting_since
        if now - since > self.safety.reference_timeout * SECOND:
            return Mode.NO_REFERENCE, ""
        return FOLLOWING, ""

    # 3. Where to, and with which torques

    def _follow(self, age: float) -> tuple[Mode, str, Command | None]:
        """Mode, detail, and torques for the last odometry, of `age` [s]."""
        estimator, active = self.estimator, self.active
        if active.preview is None:
            return WAITING, "", None
        try:
            ahead = estimator.ahead(self.ages.latency(age, estimator.timing.max_latency))
            target_time = self._law.target_time(ahead)
            target = active.target(ahead.motion, ahead.begins, target_time)
            point = target.point
            if point is None:
                return target.mode, target.detail, None
            at = partial(active.around, target, target_time)
            course = estimator.slip.course(self._law.climber, point, at, self._law.wall)
            ahead, law = ahead._replace(course=course), self._law_for(target.is_gentle)
            command = law.command(ahead, point)
            lost = command.lost.force
            if abs(lost) > CUT and active.pacing.catch_up > 0:
                target = active.slowed(
                    target, lost / law.climber.driven_mass, target_time, ahead.period
                )
                command = law.command(ahead, target.point or point)
            budget, pending = self.guard.budget, estimator.pending(ahead.begins)
            command = budget.within(command, law, ahead, pending)
            if active.way is None:
                budget.lasts = NO_WRENCH
            else:
                most = active.options.approach_speed, active.options.approach_yaw_rate
                command = budget.gently(command, law, ahead, *most)
            check_finite(command.wheels)
        except (ValueError, ArithmeticError) as error:
            return Mode.NO_SOLUTION, str(error), None
        if budget.paused is not None:
            active.wait(target)
        else:
            active.go_on(target)
        if not self.board.teaches(law.climber, point):
            estimator.learnt = DisturbanceEstimate()
        wanted = {"yaw_rate": command.yaw_rate, "forward": command.forward}
        estimator.sent(ahead.begins, command.wheels, command.fits, speed=point.speed, **wanted)
        return target.mode, target.detail, command

    def _law_for(self, is_gentle: bool) -> ControlLaw:
        """The control law, with the constraints that are followed now."""
        if is_gentle:
            return replace(self._law, constraints=self.active.gentle, other=None)
        if self._retuned is not None:
            return replace(self._law, constraints=self.constraints)
        return self._law

    @property
    def constraints(self) -> ConstraintSet:
        """The law's constraints as they are now, on their way from the gains that were before."""
        if self._retuned is None:
            return self._law.constraints
        since, before = self._retuned
        done = (self.estimator.stamp - since) / SECOND / RETUNING_TIME
        if not 0 <= done < 1 or type(before) is not type(self._law.constraints):
            self._retuned = None
            return self._law.constraints
        return blended(before, self._law.constraints, done)
