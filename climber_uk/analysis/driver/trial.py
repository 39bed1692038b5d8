"""A trial: one stage after the other, from odometry to odometry, within bounds."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from climber_uk.analysis.driver import evidence, thresholds
from climber_uk.analysis.driver.evidence import Arrival, Command, motion_of
from climber_uk.analysis.driver.pulses import PUSHED_BY, Pulse, Silence, Stage
from climber_uk.analysis.driver.response import expected_gain, respond
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber, State
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.parameter import check, parameter
from climber_uk.mechanics.preview import SECOND

RECENT = 20  # messages that tell whether it stands


@dataclass(frozen=True)
class Bounds:
    """How far a trial may go."""

    torque_share: float = parameter(
        0.5, "", "of `max_wheel_torque` that a trial may command", above=0, at_most=1
    )
    max_travel: float = parameter(0.15, "m", "from its start, at which a trial is stopped", above=0)
    max_turn: float = parameter(0.6, "rad", "from its start, at which a trial is stopped", above=0)
    watchdog_time: float = parameter(
        0.5, "s", "after which a torque must have ended if no other came", above=0
    )

    def __post_init__(self) -> None:
        check(self)


class Trial:
    """Turns left, drives forward, back, turns right, and is silent while it turns a little."""

    def __init__(
        self,
        climber: Climber,
        bounds: Bounds,
        heard: Sequence[Arrival],
        period: float,
        with_silence: bool,
    ) -> None:
        self.climber, self.bounds, self.heard, self.period = climber, bounds, heard, period
        self.with_silence = with_silence
        self.limit = bounds.torque_share * climber.max_wheel_torque
        self.commands: list[Command] = []
        self.pulses: list[evidence.Pulse] = []
        self.silence: tuple[int, int] | None = None
        self.trouble = ""
        self.start: State | None = None
        self.stages = self.in_order()
        self.stage: Stage | None = next(self.stages)
        self.begun_at = 0  # [ns] stamp at which the stage began

    def in_order(self) -> Iterator[Stage]:
        """Stages, each made when the one before is over."""
        for turns, sign in ((True, 1.0), (False, 1.0), (False, -1.0), (True, -1.0)):
            yield self.pulse(turns, sign)
        response = respond(motion_of(self.heard), self.record(), self.climber)
        name, likeness = response.wiring
        gain, offset = response.gains[1, 1], response.offsets[1, 1]
        if self.with_silence and not name and likeness > thresholds.LIKENESS and gain > 0:
            torque = (PUSHED_BY - offset) / (gain * expected_gain(self.climber)[1])
            if 0 < torque <= self.limit:
                yield Silence(float(torque), self.bounds.watchdog_time, self.pulse(True, 1.0))

    def pulse(self, turns: bool, sign: float) -> Pulse:
        """Pulse of this climber."""
        return Pulse(turns, sign, self.climber, self.period, self.limit)

    def record(self) -> evidence.Trial:
        """What was done so far."""
        return evidence.Trial(self.pulses, self.commands, self.limit, self.silence, self.trouble)

    def stop(self, why: str) -> None:
        """Say nothing more but zero, at once."""
        self.stage, self.trouble = None, self.trouble or why

    def finish(self, why: str) -> None:
        """Let this be the last stage, and damp what motion there is."""
        self.trouble, self.stages = self.trouble or why, iter(())
        if self.stage is not None:
            self.stage.finish()

    def torques(self, stamp: int, now: int, state: State) -> Array | None:
        """Torques (2,) right, left [N m] that answer an odometry; None: say nothing."""
        if self.start is None:
            self.start = state
            self.stop_if_moving()
        way = state.pose - self.start.pose
        gone, turned = float(np.hypot(*way[:2])), abs(wrapped(float(way[2])))
        if gone > self.bounds.max_travel:
            self.finish(f"it moved {gone:.3f} m, more than max_travel")
        elif turned > self.bounds.max_turn:
            self.finish(f"it turned {turned:.3f} rad, more than max_turn")
        torques = self._of_stage(stamp, state) if self.stage else np.zeros(2)
        if torques is not None:
            self.commands.append(Command(max(stamp, now), torques))
        return torques

    def stop_if_moving(self) -> None:
        """Do not begin unless it has stood for a while."""
        speed, rate = np.median(np.abs(motion_of(self.heard[-RECENT:]).reaction), axis=0)
        if speed > thresholds.STANDING_SPEED or rate > thresholds.STANDING_RATE:
            self.stop(f"it moves already, with {speed:.2f} m/s and {rate:.2f} rad/s")

    def _of_stage(self, stamp: int, state: State) -> Array | None:
        assert self.stage is not None
        self.begun_at = self.begun_at or stamp
        torques = self.stage.torques((stamp - self.begun_at) / SECOND, state)
        if torques is None:
            begin = self.silence[0] if self.silence else stamp
            self.silence = begin, stamp
        if self.stage.done:
            if isinstance(self.stage, Pulse):
                self.pulses.append(evidence.Pulse(self.stage.turns, self.begun_at, stamp))
            self.stage, self.begun_at = next(self.stages, None), 0
        return torques
