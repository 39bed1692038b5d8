"""Whether odometry tells again what it told before: a buffer that repeats itself, with new stamps.

What moves is never again exactly where it was, as fast as it was, message by message.
"""

from climber_uk.control.delay_check import MOVES
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import Motion

KEPT = SECOND  # [ns] for which a message is kept
IN_A_ROW = 4  # messages that move and were told before in the same order, each with another pose


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
        self.older = 0.0  # [s] than its stamp, where odometry repeats itself

    def add(self, stamp: int, motion: Motion, half_track: float) -> None:
        """Take an odometry of `stamp` [ns]."""
        before, self._last = self._last, motion
        if max(abs(motion.speed), half_track * abs(motion.yaw_rate)) < MOVES:
            self._in_a_row, self.older = 0, 0.0
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
        self.older = (stamp - told) / SECOND if self._in_a_row >= IN_A_ROW else 0.0
