"""Whether odometry tells again what it told before: a buffer that repeats itself, with new stamps.

What moves is never again exactly where it was, as fast as it was, message by message. Nor does it
leap back along its way: if it does without repeating a message, that way is how old it is.
"""

import math

from climber_uk.control.delay_check import MOVES
from climber_uk.control.timing import LONGEST_STEP
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import Motion

KEPT = SECOND  # [ns] for which a message is kept
IN_A_ROW = 4  # messages that move and were told before in the same order, each with another pose

# [m] by which it leaps back at least, as many times the leaps of before (root mean square), and
# [s] as old as it is then at least: stamps may be a little off
BACK, SHARPLY, OLD = 0.02, 6.0, 0.05
MEMORY = 0.5  # [s] of leaps


class RepeatCheck:
    """Compares each message of odometry with those of the last second."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Compare from now on."""
        self._told: dict[Motion, tuple[int, int]] = {}  # number, and stamp [ns]; the oldest first
        self._last: Motion | None = None
        self._number = self._back = 0  # of what moves, and how many back the last one was told
        self._in_a_row = 0
        # [ns] of the last message, and until when it tells what was, by so much [s]; [m²] of leaps
        self._stamp, self._until, self._back_by, self._leaps = 0, 0, 0.0, 0.0
        self.older = 0.0  # [s] than its stamp, where odometry is back where it was
        self.repeated = 0.0  # [s] the same, as far as it told that message by message

    def add(self, stamp: int, motion: Motion, half_track: float) -> None:
        """Take an odometry of `stamp` [ns]."""
        before, self._last = self._last, motion
        if before is not None and stamp > self._stamp:
            self._look_for_leaps(stamp, before, motion)
        self._stamp = stamp
        self._compare(stamp, before, motion, half_track)
        back_by = self._back_by if stamp < self._until else 0.0
        self.older = max(self.repeated, back_by)

    def _look_for_leaps(self, stamp: int, before: Motion, motion: Motion) -> None:
        """Notice a pose that leaps back by what it went in some time."""
        time, speed = (stamp - self._stamp) / SECOND, motion.speed
        gone = (motion.x - before.x) * motion.cosine + (motion.y - before.y) * motion.sine
        went = time * (before.speed + speed) / 2
        back = math.copysign(1.0, speed) * (went - gone)
        is_leap = back > max(BACK, SHARPLY * math.sqrt(self._leaps))
        self._leaps = max(math.exp(-time / MEMORY) * self._leaps, back * back)
        if not is_leap or abs(speed) < MOVES or time > LONGEST_STEP:
            return  # after a silence it may have been stopped
        older = round(back / abs(speed) * SECOND)
        if OLD * SECOND < older < KEPT:
            self._back_by, self._until = older / SECOND, stamp + older

    def _compare(
        self, stamp: int, before: Motion | None, motion: Motion, half_track: float
    ) -> None:
        """Notice what was told before, message by message."""
        if max(abs(motion.speed), half_track * abs(motion.yaw_rate)) < MOVES:
            self._in_a_row, self.repeated = 0, 0.0
            return
        # a driver may tell the same more often than it knows anything new
        if before is not None and motion[:3] == before[:3]:
            return
        self._number += 1
        number, told = self._told.pop(motion, (0, 0))
        self._told[motion] = self._number, stamp
        while stamp - next(iter(self._told.values()))[1] > KEPT:
            del self._told[next(iter(self._told))]
        back, before_that = self._number - number, self._back
        self._back = back
        is_again = number > 0 and (self._in_a_row == 0 or back == before_that)
        self._in_a_row = self._in_a_row + 1 if is_again else 0
        self.repeated = (stamp - told) / SECOND if self._in_a_row >= IN_A_ROW else 0.0
