"""Log times that do not go back, though the system clock may be set back."""

import time
from collections.abc import Callable

STEP = 10_000_000  # [ns] by which the clock is set, not drifting


class LogClock:
    """A clock that follows the system clock, but is not set back with it.

    A step of the system clock is seen by comparing it with a steady one. After a step back this
    clock is `ahead` by as much, until the system clock is set forwards. Times are integers [ns].
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
        """Step [ns] of the system clock since the last call, which is made up for; 0: none."""
        before, self._offset = self._offset, self._measured()
        step = self._offset - before
        if abs(step) < STEP:
            return 0
        self._ahead_before, self.ahead = self.ahead, max(0, self.ahead - step)
        return step

    def at(self, steady: int) -> int:
        """Log time [ns] of a time [ns] of the steady clock, as of the last `look`."""
        return steady + self._offset + self.ahead

    def shift(self, received: int) -> int:
        """Log time less system time [ns] of a message `received` [ns] a short while ago.

        It may have been received before the last step of the system clock.
        """
        now = self.at(self._steady())
        return min((self.ahead, self._ahead_before), key=lambda ahead: abs(received + ahead - now))

    def _measured(self) -> int:
        """System clock less steady clock [ns]: of three tries the one that took least time."""
        tries = []
        for _ in range(3):
            before, now, after = self._steady(), self._system(), self._steady()
            tries.append((after - before, now - (before + after) // 2))
        return min(tries)[1]
