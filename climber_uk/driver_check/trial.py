"""A trial: pulses of torque, or of speed, from odometry to odometry, within bounds."""

from collections.abc import Sequence

import numpy as np

from climber_uk.driver_check import evidence, thresholds
from climber_uk.driver_check.evidence import NOTHING, Arrival, WheelCommand, motion_of
from climber_uk.driver_check.pulses import PUSHED_BY, Pulse, Silence, SpeedPulse, Stage
from climber_uk.driver_check.response import PAIR, expected_gain, respond
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import State, along
from climber_uk.messages import reading
from climber_uk.parameters.declaration import parameter, parameters

REST_MESSAGES = 20  # by which it is judged whether the climber is at rest
ORDER = True, False, False, True  # whether each pulse yaws, or drives
# odometry is late by so much [s] or so many periods, whichever is more
LATE, LATE_PERIODS = 0.02, 4
TRIES = 20  # of stages in all, as a busy computer spoils some
AGAIN = "and try again"
LOOK = f"look what has moved it, {AGAIN}"  # if nothing better is known of a trial that stopped
BACK = 0.005, 0.02  # [m], [rad] from its start at which the next pulse leads back


@parameters
class Bounds:
    """Limits of a trial: torque, travel, yaw, and the watchdog's time."""

    torque_share: float = parameter(
        0.5,
        "",
        "share of `max_wheel_torque` that a trial commands at most; too low: it does not move",
        above=0,
        at_most=1,
    )
    max_travel: float = parameter(
        0.15, "m", "distance at which a trial is stopped; too short: it is not completed", above=0
    )
    max_turn: float = parameter(
        0.6, "rad", "yaw angle at which a trial is stopped; too small: likewise", above=0
    )
    watchdog_time: float = parameter(
        0.5, "s", "longest torque without a command; below the driver's: `watchdog` fails", above=0
    )


class Trial:
    """Yaws left, drives forward and back, yaws right, and stops commanding during a small yaw.

    First by speeds, without torque: a board that obeys them is tried by them alone.
    A stage in which odometry came late, on the wall clock, is ended and repeated, as it is not
    known from when on its torques acted.
    """

    def __init__(
        self,
        climber: Climber,
        bounds: Bounds,
        heard: Sequence[Arrival],
        period: float,
        on_wall_clock: bool,
    ) -> None:
        self.climber, self.bounds, self.heard, self.period = climber, bounds, heard, period
        self.on_wall_clock = on_wall_clock
        self.limit = bounds.torque_share * climber.max_wheel_torque
        self.late = round(max(LATE, LATE_PERIODS * period) * SECOND)
        ages = [a.wall - reading.nanoseconds(a.message.header.stamp) for a in heard]
        self.usual_age = float(np.median(ages))  # [ns]
        self.commands: list[WheelCommand] = []
        self.takes_speeds: bool | None = None  # not known yet
        self.pulses: list[evidence.PulseTimes] = []
        self.silence: tuple[int, int] | None = None
        self.trouble, self.hint = "", LOOK
        self.start: State | None = None
        self.way = np.zeros(2)  # forward [m], turned [rad] since the start
        self.stage: Stage | None = self.pulse(ORDER[0])
        self.tries, self.spoilt = 1, False
        self.begun_at = self.last = 0  # [ns] stamps: at which the stage began; the last one

    def next_stage(self) -> Stage | None:
        """The first stage that is not done yet; None if all are, or the trial is in trouble."""
        self.tries, self.spoilt, self.begun_at = self.tries + 1, False, 0
        if self.tries > TRIES:
            late = f"odometry came late in {TRIES - len(self.pulses)} of {TRIES} pulses"
            self.stop(late, f"computer or network are too busy: end what else runs there, {AGAIN}")
        if self.trouble:
            return None
        if len(self.pulses) < len(ORDER):
            return self.pulse(ORDER[len(self.pulses)])
        return self.silence_in_a_yaw() if self.on_wall_clock and self.silence is None else None

    def pulse(self, turns: bool) -> Pulse | SpeedPulse:
        """Pulse to the left or forward at first, then to the right or back, to stay near."""
        way, back = self.way[int(turns)], BACK[int(turns)]
        is_second = len(self.pulses) >= len(ORDER) / 2
        sign = -1.0 if way > back or (is_second and way > -back) else 1.0
        if self.takes_speeds is not False:
            return SpeedPulse(turns, sign, self.climber, self.period)
        return Pulse(turns, sign, self.climber, self.period, self.limit)

    def silence_in_a_yaw(self) -> Silence | None:
        """Stage that tries the watchdog; None if no command is known that yaws the climber."""
        response = respond(motion_of(self.heard), self.record(), self.climber)
        name, likeness = response.wiring
        gain, offset = response.gains[1, 1], response.offsets[1, 1]
        if name or likeness < thresholds.LIKENESS or not gain > 0:
            return None
        if self.takes_speeds:
            speeds = SpeedPulse(True, 1.0, self.climber, self.period)
            return Silence(speeds.rates, self.bounds.watchdog_time, speeds)
        torque = float((PUSHED_BY - offset) / (gain * expected_gain(self.climber)[1]))
        after = Pulse(True, 1.0, self.climber, self.period, self.limit)
        after.top = after.damping
        yawing = torque * PAIR[1]
        return Silence(yawing, self.bounds.watchdog_time, after) if torque <= self.limit else None

    def record(self) -> evidence.TrialRecord:
        """Pulses, commands and trouble so far."""
        return evidence.TrialRecord(
            self.pulses,
            self.commands,
            self.limit,
            self.silence,
            self.trouble,
            self.hint,
            self.takes_speeds,
        )

    def stop(self, why: str, hint: str = LOOK) -> None:
        """Command zero from now on; `why` is the trouble, unless there is one."""
        self.stage = None
        if not self.trouble:
            self.trouble, self.hint = why, hint

    def command(self, stamp: int, now: int, state: State) -> WheelCommand | None:
        """What answers an odometry; None: send nothing."""
        self.keep_within_bounds(state)
        is_late = self.on_wall_clock and (
            now - stamp > self.usual_age + self.late or 0 < self.last < stamp - self.late
        )
        self.last = stamp
        told: WheelCommand | None = WheelCommand(max(stamp, now), NOTHING)
        if self.stage is not None and (self.begun_at or not is_late):
            self.begun_at = self.begun_at or stamp
            if is_late:
                self.spoilt = True
                self.stage.finish()
            told = self.stage_command(self.stage, stamp, max(stamp, now), state)
        if told is not None:
            self.commands.append(told)
        return told

    def keep_within_bounds(self, state: State) -> None:
        """Do not begin if the climber moves; only damp its motion if it has gone too far."""
        if self.start is None:
            self.start = state
            speed, rate = np.median(np.abs(motion_of(self.heard[-REST_MESSAGES:]).reaction), axis=0)
            if speed > thresholds.STANDING_SPEED or rate > thresholds.STANDING_RATE:
                moves = f"it moves already, with {speed:.2f} m/s and {rate:.2f} rad/s"
                self.stop(moves, f"stop it, hold it, {AGAIN}")
        way = state.pose - self.start.pose
        gone, turned = float(np.hypot(*way[:2])), wrapped(float(way[2]))
        self.way = np.array([along(self.start.heading, way), turned])
        if gone > self.bounds.max_travel:
            self.trouble = self.trouble or f"it moved {gone:.3f} m, more than max_travel"
        elif abs(turned) > self.bounds.max_turn:
            self.trouble = self.trouble or f"it turned {abs(turned):.3f} rad, more than max_turn"
        if self.trouble and self.stage is not None:
            self.stage.finish()

    def stage_command(
        self, stage: Stage, stamp: int, time: int, state: State
    ) -> WheelCommand | None:
        """Command of a stage from a `time` [ns] on; begins the next one if it is done."""
        numbers = stage.command((stamp - self.begun_at) / SECOND, state)
        if numbers is None:
            self.silence = self.silence[0] if self.silence else stamp, stamp
        if stage.done:
            if self.spoilt and isinstance(stage, Silence):
                self.silence = None
            elif not self.spoilt and not isinstance(stage, Silence):
                if isinstance(stage, SpeedPulse) and self.takes_speeds is None:
                    self.takes_speeds = stage.is_obeyed
                if stage.by_speeds == self.takes_speeds:
                    self.pulses.append(evidence.PulseTimes(stage.turns, self.begun_at, stamp))
            self.stage = self.next_stage()
        if numbers is None:
            return None
        return WheelCommand(time, *((NOTHING, numbers) if stage.by_speeds else (numbers,)))
