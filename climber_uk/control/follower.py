"""The whole controller without ROS: odometry and reference in, torques out, whatever happens.

Times are integers in nanoseconds: stamps on the odometry's clock, `now` on the node's, which is 0
while there is none.
"""

import math
from collections import deque
from typing import NamedTuple

from climber_uk.control.ages import Ages
from climber_uk.control.approach import Approach
from climber_uk.control.controller import Command
from climber_uk.control.course import Course
from climber_uk.control.guard import Guard, GuardOptions, Observed
from climber_uk.control.safety import Mode, Safety
from climber_uk.control.tracker import LONGEST_STEP, Tracker
from climber_uk.control.twist_check import SUSPECTED, TwistCheck
from climber_uk.mechanics import SECOND, Array, pack
from climber_uk.mechanics.climber import State
from climber_uk.mechanics.motion import Motion, Torques
from climber_uk.mechanics.preview import Preview

CLOCK_PATIENCE = 20  # looks at a clock that is not there
CLOCK_STEP = round(0.2 * SECOND)  # [ns] back, from which time has started anew
SELDOM = 0.8  # of the timeout from one odometry to the next: the least delay would exceed it
REST = 0.02  # [m/s] of a wheel's rim, below which a climber rests
STALL_REST = 10  # times the rest after which a stalled climber tries again
BRAKING = 0.01  # [s] after which the safe output has to have braked what moves
PUSHED = 0.05  # [m/s] by which it may be faster than before; if it is, something pushes it:
COASTING = 0.3  # [s] for which it is left alone then, as that may be the safe output itself
FLAPPING = 3  # faults within `FLAPPING_TIME`, after which the next one has to be over for a while
FLAPPING_TIME = 2 * SECOND  # [ns]
CALM = SECOND // 2  # [ns] for which it has to be over

Trouble = tuple[Mode, str]


class Answer(NamedTuple):
    """Torques for the odometry of `stamp`."""

    stamp: int  # [ns]
    torques: Array  # (2,) right, left [N m]
    command: Command | None  # what they came from; None: safe output


class Follower:
    """Follows while all is well, else gives the safe output; `mode` and `detail` say why."""

    def __init__(
        self,
        tracker: Tracker,
        safety: Safety,
        approach: Approach | None = None,
        guard: GuardOptions | None = None,
    ) -> None:
        self.tracker, self.safety = tracker, safety
        self.course = Course(tracker, approach or Approach())
        self.guard = Guard(guard or GuardOptions())
        self.mode, self.detail = Mode.WAITING, ""
        self.answer: Answer | None = None  # the last one
        self._enabled = True
        self._clockless_looks = 0
        self._heard: int | None = None  # [ns] time of the last odometry, good or bad
        self._trouble: Trouble | None = None  # with that odometry
        self._fault: Trouble | None = None  # found by the guard, until the climber has rested
        self._rested = 0.0  # [s] since it is at rest
        self._stamp = 0  # [ns] of the last good one
        self._now = 0  # [ns] of the last look at the clock
        self.ages = Ages()
        self._unsettled = 0  # odometry messages until a jump is forgiven
        self._twist = TwistCheck()
        self._moved_without_twist = 0.0  # [m]
        self._waiting_since: int | None = None  # [ns] stamp of the first one not answered
        self._last_fault: tuple[int, Trouble] | None = None  # [ns] when it was there last
        self._fault_times: deque[int] = deque(maxlen=FLAPPING)  # [ns] when each began
        self._braked: tuple[int, float] | None = None  # [ns] begin of the safe output, rim speed
        self._coasts_until = 0  # [ns]

    @property
    def state(self) -> State | None:
        """State at the last good odometry, as it is believed to be."""
        motion = self.tracker.motion
        return None if motion is None else State.moving(motion)

    @property
    def stamp(self) -> int:
        """Of the last good odometry [ns]; 0 if there was none."""
        return self._stamp

    @property
    def clock_offset(self) -> float:
        """By how much the node's clock is ahead of the odometry's [s]; 0 if that may be latency."""
        return self.ages.offset(self.tracker.timing.max_latency)

    @property
    def preview(self) -> Preview | None:
        """What is followed, or will be: the reference, or the way to it."""
        return self.course.followed

    def enable(self, enabled: bool) -> None:
        """Follow the reference, or give the safe output; what was wrong before is forgiven."""
        self._enabled = enabled
        self._moved_without_twist = 0.0
        if enabled:
            self._fault = None
            self._forget_when()

    def on_odometry(self, now: int, stamp: int, state: State) -> Answer | None:
        """Answer an odometry; None while a reference is waited for, or if a newer one was here."""
        self._look_at_clock(now)
        if self._stamp == 0:  # the first one: in simulated time the clock comes right after it
            self._clockless_looks = 0
        if stamp == self._stamp and self.mode in (Mode.FOLLOWING, Mode.APPROACHING):
            return self.answer  # it was not received: the same once more
        timeout = round(self.safety.odometry_timeout * SECOND)
        if now > 0 and abs(now - stamp) > timeout:
            off = (now - stamp) / SECOND
            return self.on_bad_odometry(now, f"stamp is {off:.2f} s from the clock, too far")
        if 0 < self._stamp - stamp <= timeout:
            return None
        self._heard = stamp
        if now > 0:
            self.ages.add(now, (now - stamp) / SECOND)
        if stamp != self._stamp:
            if self._stamp and abs(stamp - self._stamp) > timeout:
                self._start_anew()
            self._trouble = self._take(stamp, state.motion)
            self._stamp = stamp
        return self._answer(now)

    def on_bad_odometry(self, now: int, why: str) -> Answer | None:
        """Give the safe output for an odometry that cannot be used."""
        self._look_at_clock(now)
        self._heard, self._trouble = now, (Mode.BAD_ODOMETRY, why)
        return self._answer(now)

    def on_reference(self, now: int, preview: Preview) -> Answer | None:
        """Keep a reference; answer the odometry that waits for one."""
        self.course.take(preview)
        waits = self._waiting_since is not None or self.mode is Mode.NO_REFERENCE
        return self._answer(now) if waits else None

    def look(self, now: int) -> Answer | None:
        """Give the safe output if odometry has stopped, or its reference does not come."""
        self._look_at_clock(now)
        self._clockless_looks = self._clockless_looks + 1 if now == 0 else 0
        if self._heard is None and now > 0:
            self._heard = now
        mode, _ = self._find_mode(now)
        return None if mode in (Mode.FOLLOWING, Mode.WAITING) else self._answer(now)

    def _look_at_clock(self, now: int) -> None:
        """Notice a clock that went back: by a little, or because time starts anew."""
        back, self._now = self._now - now, now
        if back <= 0:
            return
        if self._heard is not None:
            self._heard = min(self._heard, now)
        # stamps of before the step are no newer ones
        self._stamp, self._waiting_since = 0, None
        self._forget_when()
        self.tracker.restart()
        if back > CLOCK_STEP:
            self.course.preview = None

    def _forget_when(self) -> None:
        """Forget when what was: it counts no more, or times of before mean nothing."""
        self.guard.forgive()
        self._last_fault, self._braked, self._coasts_until = None, None, 0
        self._fault_times.clear()

    # What odometry says

    def _take(self, stamp: int, motion: Motion) -> Trouble | None:
        """Give the tracker an odometry; return what is wrong with it."""
        tracker, last = self.tracker, self.tracker.motion
        if last is None:
            tracker.see(stamp, motion)
        else:
            expected = tracker.expected_at(stamp)
            trouble = None
            if tracker.observer.velocity_source == "pose":
                motion = motion._replace(speed=expected.speed, yaw_rate=expected.yaw_rate)
            else:
                trouble = self._check_twist(last, motion, (stamp - tracker.stamp) / SECOND)
            if self.safety.has_jumped(expected, motion, tracker.controller.climber.half_track):
                self._start_anew()
                self._unsettled = self.safety.settling_messages
                trouble = None  # no rate explains a jump
            self._unsettled -= self._unsettled > 0
            self._watch(stamp, last, motion, trouble)
            tracker.see(stamp, motion, expected)
        if self._unsettled:
            return Mode.JUMPED, ""
        if self._moved_without_twist > self.safety.max_twist_error:
            return Mode.NO_TWIST, "set velocity_source to pose"
        return None

    def _check_twist(self, last: Motion, motion: Motion, time: float) -> Trouble | None:
        """Whether the twist is missing, or another one than the pose's rate."""
        if motion.speed == 0 and motion.yaw_rate == 0:
            self._moved_without_twist += math.hypot(motion.x - last.x, motion.y - last.y)
            return None
        self._moved_without_twist = 0.0
        self._twist.add(last, motion, time, self.tracker.controller.climber.half_track)
        detail, is_sign = self._twist.trouble(self.safety.max_twist_error)
        if not detail:
            return None
        return Mode.SIGN_WRONG if is_sign else Mode.TWIST_WRONG, detail

    def _start_anew(self) -> None:
        self.tracker.reset()
        self.guard.restart()
        self._twist.restart()
        self._moved_without_twist = 0.0

    def _watch(self, stamp: int, last: Motion, motion: Motion, trouble: Trouble | None) -> None:
        """Let the guard look at a climber that follows; let one that had a fault rest."""
        tracker, guard = self.tracker, self.guard
        climber = tracker.controller.climber
        time = (stamp - tracker.stamp) / SECOND
        if self._fault is None:
            if self.mode in (Mode.FOLLOWING, Mode.APPROACHING) and time > 0:
                acted, disturbance = tracker.mean_torques(stamp), tracker.disturbance
                observed = Observed(last, motion, time, acted, disturbance, tracker.reaction)
                self._fault, self._rested = trouble or self._find_fault(observed), 0.0
                if self._fault is not None:
                    guard.fault(stamp)
            return
        rim = abs(motion.speed) + climber.half_track * abs(motion.yaw_rate)
        self._rested = self._rested + time if rim < REST else 0.0
        needed = guard.options.recovery_time * (STALL_REST if self._is(Mode.STALLED) else 1)
        if self._rested > needed and not self._is_for_good:
            self._fault = None
            guard.restart()
            self._twist.restart()

    def _find_fault(self, observed: Observed) -> Trouble | None:
        """What the guard finds of a climber that follows."""
        target = self.course.target
        if target is None:
            return None
        climber, expected = self.tracker.controller.climber, self.course.expected(target)
        fault = self.guard.watch(climber, observed, expected)
        fault = fault or self.course.strayed(observed.before, target)
        if fault is not None and fault[0] is Mode.TOO_FAST:
            sign = self._twist.opposed(SUSPECTED * self.safety.max_twist_error)
            return (Mode.SIGN_WRONG, sign) if sign else fault
        return fault

    @property
    def _is_for_good(self) -> bool:
        """Whether somebody has to look after the climber first."""
        return self.guard.has_given_up or self._is(Mode.DEAD_WHEEL) or self._is(Mode.SIGN_WRONG)

    def _is(self, mode: Mode) -> bool:
        return self._fault is not None and self._fault[0] is mode

    # What to do

    def _find_mode(self, now: int) -> Trouble:
        """Mode as things are, and a detail of it."""
        if not self._enabled:
            return Mode.DISABLED, ""
        if self._clockless_looks > CLOCK_PATIENCE:
            return Mode.NO_CLOCK, ""
        if self._heard is None:
            return Mode.WAITING, ""
        if now - self._heard > self.safety.odometry_timeout * SECOND:
            return Mode.NO_ODOMETRY, ""
        return self._trouble or self._told_fault() or self._unfit() or self._missing(now)

    def _told_fault(self) -> Trouble | None:
        """What the guard found, and how it ends."""
        if self._fault is None:
            return None
        mode, detail = self._fault
        return mode, f"{detail}; ~/enable to go on" if self._is_for_good else detail

    def _unfit(self) -> Trouble | None:
        """What forbids to follow, though nothing is wrong."""
        tracker, safety = self.tracker, self.safety
        pressure, period = tracker.controller.climber.suction_pressure, tracker.period
        if pressure < safety.least_pressure:
            return Mode.LOW_PRESSURE, f"{pressure:.0f} Pa"
        if period > SELDOM * safety.odometry_timeout:
            return Mode.SELDOM, f"every {period:.2f} s for a timeout of {safety.odometry_timeout} s"
        return None

    def _missing(self, now: int) -> Trouble:
        """Whether there is a reference."""
        if self.course.begins_after(self._stamp):
            return Mode.NOT_BEGUN, ""
        since = now if self._waiting_since is None else self._waiting_since
        if now - since > self.safety.reference_timeout * SECOND:
            return Mode.NO_REFERENCE, ""
        return Mode.FOLLOWING, ""

    def _calmed(self, now: int, mode: Mode, detail: str) -> Trouble:
        """The mode, or the last fault where faults come and go: it has to be over for a while."""
        time = max(now, self._stamp)
        if mode.is_fault:
            if not self.mode.is_fault:
                self._fault_times.append(time)
            self._last_fault = time, (mode, detail)
        elif self.mode.is_fault and self._last_fault is not None and mode is Mode.FOLLOWING:
            over_since, fault = self._last_fault
            flaps = len(self._fault_times) == FLAPPING
            if (
                flaps
                and 0 <= over_since - self._fault_times[0] < FLAPPING_TIME
                and 0 <= time - over_since < CALM
            ):
                return fault
        return mode, detail

    def _answer(self, now: int) -> Answer | None:
        """Torques for the last odometry, in the mode of now."""
        age = min(max(0, now - self._stamp) / SECOND, LONGEST_STEP)
        mode, detail = self._calmed(now, *self._find_mode(now))
        command = None
        if mode in (Mode.FOLLOWING, Mode.NO_REFERENCE):
            found = self.course.follow(self.ages.latency(age, self.tracker.timing.max_latency))
            command = found.command
            if found.mode is not Mode.WAITING or mode is Mode.FOLLOWING:
                mode, detail = found.mode, found.detail
        if mode in (Mode.WAITING, Mode.NO_REFERENCE):
            self._waiting_since = self._waiting_since or self._stamp
        else:
            self._waiting_since = None
        if mode.is_fault and mode is not self.mode:
            self.tracker.forget()
        self.mode, self.detail = mode, detail
        if mode is Mode.WAITING:
            return None
        if command is None:
            self.course.pause(self._stamp)
            torques = self._safe_torques(age)
        else:
            self._braked = None
            torques = command.wheels
        self.answer = Answer(self._stamp, pack(*torques), command)
        return self.answer

    def _safe_torques(self, age: float) -> Torques:
        motion, climber = self.tracker.motion, self.tracker.controller.climber
        if self.mode is Mode.DEAD_WHEEL and climber.seal_friction >= climber.weight_along_wall:
            return self.tracker.let_go(age)  # one wheel that holds turns the climber
        holds = self.safety.safe_output == "hold" and self._stamp >= self._coasts_until
        if holds and motion is not None:
            rim = abs(motion.speed) + climber.half_track * abs(motion.yaw_rate)
            begin, before = self._braked = self._braked or (self._stamp, rim)
            if self._stamp - begin > BRAKING * SECOND and rim > before + PUSHED:
                self._coasts_until, self._braked = self._stamp + round(COASTING * SECOND), None
                return self.tracker.let_go(age)
            braking = 0.0 if self.mode.doubts_odometry else self.safety.braking_rate
            try:
                return self.tracker.hold(age, braking)
            except (ValueError, ArithmeticError):
                self.tracker.reset()  # an absurd state that odometry, finite as it was, gave
        return self.tracker.let_go(age)
