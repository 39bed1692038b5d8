"""Log times that do not go back, though the system clock may be set back."""

import time
from collections.abc import Callable

STEP = 10_000_000  # [ns] by which the clock is set, not drifting


class LogClock:
    """The system clock, ahead of it by what it was set back: by steps, seen beside a steady clock.

    Times are integers in nanoseconds; where the clock is set forwards again, that is made up for.
    """

    def __init__(
        self,
        system: Callable[[], int] = time.time_ns,
        steady: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._system, self._steady = system, steady
        self.ahead = self._ahead_before = 0
        self._offset = self._measured()

    def look(self) -> int:
        """Take notice of a step of the system clock since the last look, and return it, else 0."""
        before, self._offset = self._offset, self._measured()
        step = self._offset - before
        if abs(step) < STEP:
            return 0
        self._ahead_before, self.ahead = self.ahead, max(0, self.ahead - step)
        return step

    def at(self, steady: int) -> int:
        """Log time of a time of the steady clock, as of the last look."""
        return steady + self._offset + self.ahead

    def shift(self, received: int) -> int:
        """How much later the log time of what was received lately is than it.

        It may have been received before the last step, and taken after it.
        """
        now = self.at(self._steady())
        return min((self.ahead, self._ahead_before), key=lambda ahead: abs(received + ahead - now))

    def _measured(self) -> int:
        """System clock less steady clock: of three tries the one least interrupted."""
        tries = []
        for _ in range(3):
            before, now, after = self._steady(), self._system(), self._steady()
            tries.append((after - before, now - (before + after) // 2))
        return min(tries)[1]
