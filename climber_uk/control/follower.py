"""The whole controller without ROS: odometry and reference in, torques out, whatever happens.

Times are integers in nanoseconds: stamps on the odometry's clock, `now` on the node's, which is 0
while there is none.
"""

import math
from typing import NamedTuple

from climber_uk.control.controller import Command
from climber_uk.control.safety import Mode, Safety
from climber_uk.control.tracker import LONGEST_STEP, Tracker
from climber_uk.mechanics import SECOND, Array, pack
from climber_uk.mechanics.climber import State
from climber_uk.mechanics.motion import Motion, Torques
from climber_uk.mechanics.preview import Preview

CLOCK_PATIENCE = 20  # looks at a clock that is not there
MOVED = 0.05  # [m] after which a twist that is always zero is none
SAME = 0.05  # [m, rad] within which a new preview goes on with the old one
LONGEST_LAG = 60.0  # [s] for which the reference may wait


class Answer(NamedTuple):
    """Torques for the odometry of `stamp`."""

    stamp: int  # [ns]
    torques: Array  # (2,) right, left [N m]
    command: Command | None  # what they came from; None: safe output


class Follower:
    """Follows while all is well, else gives the safe output; `mode` and `detail` say why."""

    def __init__(self, tracker: Tracker, safety: Safety) -> None:
        self.tracker, self.safety = tracker, safety
        self.mode, self.detail = Mode.WAITING, ""
        self.preview: Preview | None = None
        self.answer: Answer | None = None  # the last one
        self._enabled = True
        self._clockless_looks = 0
        self._heard: int | None = None  # [ns] time of the last odometry, good or bad
        self._trouble: tuple[Mode, str] | None = None  # with that odometry
        self._stamp = 0  # [ns] of the last good one
        self._now = 0  # [ns] of the last look at the clock
        self._unsettled = 0  # odometry messages until a jump is forgiven
        self._moved_without_twist = 0.0  # [m]
        self._waiting_since: int | None = None  # [ns] stamp of the first one not answered

    @property
    def state(self) -> State | None:
        """State at the last good odometry, as it is believed to be."""
        motion = self.tracker.motion
        return None if motion is None else State.moving(motion)

    def enable(self, enabled: bool) -> None:
        """Follow the reference, or give the safe output."""
        self._enabled = enabled
        self._moved_without_twist = 0.0

    def on_odometry(self, now: int, stamp: int, state: State) -> Answer | None:
        """Answer an odometry; None while a reference is waited for, or if a newer one was here."""
        if now < self._now:  # a simulation started again: times of before say nothing
            self._stamp, self.preview, self._waiting_since = 0, None, None
        self._now = now
        if self._stamp == 0:  # the first one: in simulated time the clock comes right after it
            self._clockless_looks = 0
        if stamp == self._stamp and self.mode is Mode.FOLLOWING:
            return self.answer  # it was not received: the same once more
        timeout = round(self.safety.odometry_timeout * SECOND)
        if now > 0 and abs(now - stamp) > timeout:
            return self.on_bad_odometry(now, "stamp is too far from the clock")
        if 0 < self._stamp - stamp <= timeout:
            return None
        self._heard = stamp
        if stamp != self._stamp:
            if abs(stamp - self._stamp) > timeout:
                self._start_anew()
            self._trouble = self._take(stamp, state.motion)
            self._stamp = stamp
        return self._answer(now)

    def on_bad_odometry(self, now: int, why: str) -> Answer | None:
        """Give the safe output for an odometry that cannot be used."""
        self._heard, self._trouble = now, (Mode.BAD_ODOMETRY, why)
        return self._answer(now)

    def on_reference(self, now: int, preview: Preview) -> Answer | None:
        """Keep a reference; answer the odometry that waits for one."""
        if self.preview is not None and self.preview.goes_on_with(preview, SAME):
            kept = min(self.tracker.pace.lag + 2.0, LONGEST_LAG)
            since = self._stamp - round(kept * SECOND)
            self.preview = self.preview.continued(preview, since)
        else:
            self.preview = preview
            self.tracker.start_pace()
        waits = self._waiting_since is not None or self.mode is Mode.NO_REFERENCE
        return self._answer(now) if waits else None

    def look(self, now: int) -> Answer | None:
        """Give the safe output if odometry has stopped, or its reference does not come."""
        self._clockless_looks = self._clockless_looks + 1 if now == 0 else 0
        if self._heard is None and now > 0:
            self._heard = now
        mode, _ = self._find_mode(now)
        return None if mode in (Mode.FOLLOWING, Mode.WAITING) else self._answer(now)

    def _take(self, stamp: int, motion: Motion) -> tuple[Mode, str] | None:
        """Give the tracker an odometry; return what is wrong with it."""
        tracker, last = self.tracker, self.tracker.motion
        if last is None:
            tracker.see(stamp, motion)
        else:
            expected = tracker.expected_at(stamp)
            if tracker.observer.velocity_source == "pose":
                motion = motion._replace(speed=expected.speed, yaw_rate=expected.yaw_rate)
            elif motion.speed != 0 or motion.yaw_rate != 0:
                self._moved_without_twist = 0.0
            else:
                self._moved_without_twist += math.hypot(motion.x - last.x, motion.y - last.y)
            half_track = tracker.controller.climber.half_track
            if self.safety.has_jumped(expected, motion, half_track):
                self._start_anew()
                self._unsettled = self.safety.settling_messages
            self._unsettled -= self._unsettled > 0
            tracker.see(stamp, motion, expected)
        if self._unsettled:
            return Mode.JUMPED, ""
        if self._moved_without_twist > MOVED:
            return Mode.NO_TWIST, "set velocity_source to pose"
        return None

    def _start_anew(self) -> None:
        self.tracker.reset()
        self._moved_without_twist = 0.0

    def _find_mode(self, now: int) -> tuple[Mode, str]:
        """Mode as things are, and a detail of it."""
        if not self._enabled:
            return Mode.DISABLED, ""
        if self._clockless_looks > CLOCK_PATIENCE:
            return Mode.NO_CLOCK, ""
        if self._heard is None:
            return Mode.WAITING, ""
        if now - self._heard > self.safety.odometry_timeout * SECOND:
            return Mode.NO_ODOMETRY, ""
        if self._trouble is not None:
            return self._trouble
        if self.tracker.controller.climber.suction_pressure < self.safety.least_pressure:
            return Mode.LOW_PRESSURE, ""
        if self.preview is not None and self._stamp < self.preview.times[0]:
            return Mode.NOT_BEGUN, ""
        since = now if self._waiting_since is None else self._waiting_since
        if now - since > self.safety.reference_timeout * SECOND:
            return Mode.NO_REFERENCE, ""
        return Mode.FOLLOWING, ""

    def _answer(self, now: int) -> Answer | None:
        """Torques for the last odometry, in the mode of now."""
        age = min(max(0, now - self._stamp) / SECOND, LONGEST_STEP)
        mode, detail = self._find_mode(now)
        command = None
        if mode in (Mode.FOLLOWING, Mode.NO_REFERENCE):
            try:
                command = self.tracker.answer(self.preview, age) if self.preview else None
                if command is not None:
                    mode, detail = Mode.FOLLOWING, ""
                elif mode is Mode.FOLLOWING:
                    mode = Mode.WAITING
            except (ValueError, ArithmeticError) as error:
                mode, detail = Mode.NO_SOLUTION, str(error)
        if mode in (Mode.WAITING, Mode.NO_REFERENCE):
            self._waiting_since = self._waiting_since or self._stamp
        else:
            self._waiting_since = None
        if mode.is_fault and mode is not self.mode:
            self.tracker.forget()
        self.mode, self.detail = mode, detail
        if mode is Mode.WAITING:
            return None
        torques = command.wheels if command else self._safe_torques(age)
        self.answer = Answer(self._stamp, pack(*torques), command)
        return self.answer

    def _safe_torques(self, age: float) -> Torques:
        if self.safety.safe_output == "hold" and self.tracker.motion is not None:
            try:
                return self.tracker.hold(age, self.safety.braking_rate)
            except (ValueError, ArithmeticError):
                self.tracker.reset()  # an absurd state that odometry, finite as it was, gave
        return self.tracker.let_go(age)
