"""Pulses of wheel torques, or speeds, that move a climber a little.

    τ = k t until it moves, then τ falls at the same rate until it stops

so that friction and weight need not be known, and no torque is higher than it has to be. Where a
board takes speeds, there is a step of speed and one back. Times are in seconds.
"""

import numpy as np

from climber_uk.driver_check.evidence import NOTHING
from climber_uk.driver_check.response import PAIR, expected_gain, expected_rim_gain
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import clipped, wrapped
from climber_uk.mechanics.quantities import State

GOALS = np.array([0.05, 0.2])  # [m/s], [rad/s] at which torques fall again: some 1 cm, 0.1 rad
PLACES = np.array([0.01, 0.05])  # [m], [rad] at which they do if odometry has no speed
# [s] from the first motion to those goals, by the model: friction helps to stop a drive
RISE_TIMES = 0.06, 0.1
RISE_PERIODS = 4.0  # and at least so many odometry messages
LOWEST = 1.5  # times the highest level: √2 stops what nothing else brakes
STOPPED = 0.1  # of the highest speed, at which what is left is damped
RUNAWAY = 4.0  # of the goals, of which 2 are reached: damp at once
DAMPING_TIME, REST_TIME = 0.1, 1.0  # [s] of the motion that is left, and the longest
REST_SHARE = 0.05  # of the goals, below which it is at rest
PUSH_TIME, PUSHED_BY = 0.15, 0.5  # [s], [rad/s²] of yawing, before commands stop
HOLD_TIME, HOLD_PERIODS = 0.4, 12.0  # [s] of a speed, and at least so many odometry messages
MOVES, PATIENCE = 0.1, 1.0  # of the way at that speed; [s] that it is waited for
OBEYED, TOO_FAR = 0.3, 4.0  # of the way at that speed, from which on a board has obeyed; too far
LOOK_TIME = 0.25  # [s] after the watchdog's time, in which the motion is judged


class SpeedPulse:
    """A step of the wheels' rates ωR = ±ωL, held, and one back; a board of torques does nothing."""

    by_speeds = True

    def __init__(self, turns: bool, sign: float, climber: Climber, period: float) -> None:
        self.turns, goal = turns, GOALS[int(turns)]
        self.rates = sign * goal / expected_rim_gain(climber)[int(turns)] * PAIR[int(turns)]
        self.held = max(HOLD_TIME, HOLD_PERIODS * period)  # and as long at rest
        self.ends, self.ways = self.held, GOALS * self.held  # [m], [rad] it would move at both
        self.start: State | None = None
        self.moves = self.is_obeyed = self.done = False

    def command(self, time: float, state: State) -> Array:
        """Rates (2,) (right, left) [rad/s] at `time` [s] since the pulse's begin."""
        self.start = self.start or state
        way = state.pose - self.start.pose
        places = np.array([np.hypot(*way[:2]), abs(wrapped(float(way[2])))])
        self.moves = self.moves or bool((places > MOVES * self.ways).any())
        if not self.moves and time < PATIENCE and self.ends > 0:
            self.ends = time + self.held  # a servo may have to overcome friction first
        self.is_obeyed = self.is_obeyed or bool((places > OBEYED * self.ways).any())
        if (places > TOO_FAR * self.ways).any():
            self.finish()
        self.done = time >= self.ends + self.held
        return self.rates if time < self.ends else NOTHING

    def finish(self) -> None:
        """From now on only stand still."""
        self.ends = 0.0


class Pulse:
    """A pair of torques τR = ±τL that rises, falls, and damps the motion that is left.

    It is `done` when the climber rests, or should.
    """

    by_speeds = False

    def __init__(
        self, turns: bool, sign: float, climber: Climber, period: float, limit: float
    ) -> None:
        self.turns, self.direction, self.limit = turns, sign * PAIR[int(turns)], limit
        channel = int(turns)
        rise_time = max(RISE_TIMES[channel], RISE_PERIODS * period)
        self.goals = GOALS * min(1.0, RISE_TIMES[channel] / rise_time)
        needed = self.goals / expected_gain(climber)  # [N m s] to come to the goals
        self.rate = float(2 * needed[channel]) / rise_time**2  # k [N m/s]
        # at a goal [N m]
        self.damping = float(needed[channel]) / max(DAMPING_TIME, RISE_PERIODS * period)
        self.longest_step, self.last = 2 * period, 0.0
        self.start: State | None = None
        self.rests, self.rested_at = False, 0.0
        self.top = self.level = self.highest = 0.0
        self.reacts, self.sign = int(turns), sign  # which speed reacts, and its sign
        self.falls = self.done = False

    def command(self, time: float, state: State) -> Array:
        """Torques (2,) (right, left) [N m] at `time` [s] since the pulse's begin."""
        self.start = self.start or state
        # missed periods are not made up for: their reaction was not seen
        step, self.last = min(time - self.last, self.longest_step), time
        shares = np.array([float(state.forward_speed), float(state.yaw_rate)]) / self.goals
        if self.rests:
            level = self.rest(shares)
        elif self.falls:
            level = self.fall(shares, step)
        else:
            level = self.rise(state, shares, step)
        self.level = clipped(level, -self.limit, self.limit)
        return self.level * self.direction

    def rise(self, state: State, shares: Array, step: float) -> float:
        """Level [N m] while it rises, until the climber moves or the limit is reached."""
        assert self.start is not None
        way = state.pose - self.start.pose
        places = np.array([np.hypot(*way[:2]), abs(wrapped(float(way[2])))])
        moves = np.abs(shares).max() >= 1 or (places >= PLACES).any()
        if moves or self.level >= self.limit:
            self.falls, self.top = True, self.level
            self.reacts = int(np.argmax(np.abs(shares)))
            self.sign = float(np.sign(shares[self.reacts])) or self.sign
            return self.level if moves else self.rest(shares)
        return self.level + self.rate * step

    def fall(self, shares: Array, step: float) -> float:
        """Level [N m] while it falls, until the climber has almost stopped."""
        share = self.sign * float(shares[self.reacts])
        self.highest = max(self.highest, share)
        level = self.level - self.rate * step
        stopped = share <= STOPPED * self.highest or np.abs(shares).max() > RUNAWAY
        return self.rest(shares) if stopped or level < -LOWEST * self.top else level

    def finish(self) -> None:
        """From now on only damp the motion."""
        self.top = max(self.top, abs(self.level))
        self.rests = True

    def rest(self, shares: Array) -> float:
        """Level [N m] that damps the motion that is left."""
        self.finish()
        self.rested_at = self.rested_at or self.last
        at_rest = bool(np.abs(shares).max() < REST_SHARE)
        self.done = at_rest or self.last - self.rested_at > REST_TIME
        level = -self.sign * float(shares[self.reacts]) * self.damping
        return 0.0 if self.done else clipped(level, -self.top, self.top)


class Silence:
    """A small yawing command (2,), then none, to see the watchdog act; then damping."""

    def __init__(self, yawing: Array, watchdog_time: float, after: Pulse | SpeedPulse) -> None:
        self.yawing, self.after, self.by_speeds = yawing, after, after.by_speeds
        self.pushed = HOLD_TIME if self.by_speeds else PUSH_TIME
        self.resumes_at = self.pushed + watchdog_time + LOOK_TIME

    def command(self, time: float, state: State) -> Array | None:
        """Command as the pulse `after` has it; None: send nothing."""
        if time < min(self.pushed, self.resumes_at):
            return self.yawing
        if time < self.resumes_at:
            return None
        self.after.finish()
        return self.after.command(time - self.resumes_at, state)

    def finish(self) -> None:
        """From now on only damp the motion."""
        self.resumes_at = 0.0

    @property
    def done(self) -> bool:
        """Whether it is over."""
        return self.after.done


Stage = Pulse | SpeedPulse | Silence
"""What a trial consists of."""
