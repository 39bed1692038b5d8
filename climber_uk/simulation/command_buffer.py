"""Commands with the time from which each acts: the latest one acts, until it is too old."""

from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")
MOST = 1000  # values that are kept, as time may stand still while others come


class CommandBuffer(Generic[T]):
    """Values, each in force from a time on until the next or for `timeout` (0: no limit) [ns]."""

    def __init__(self, timeout: int = 0) -> None:
        self.timeout = timeout
        self._coming: deque[tuple[int, T]] = deque(maxlen=MOST)

    def add(self, begin: int, value: T) -> None:
        """Put `value` in force from `begin` [ns] on, in place of all that would begin later."""
        while self._coming and self._coming[-1][0] > begin:
            self._coming.pop()
        self._coming.append((begin, value))

    def at(self, time: int) -> tuple[T | None, bool]:
        """Value in force at `time` [ns], or None; and whether it is None because of the timeout."""
        while len(self._coming) > 1 and self._coming[1][0] <= time:
            self._coming.popleft()
        if not self._coming or self._coming[0][0] > time:
            return None, False
        begin, value = self._coming[0]
        stale = self.timeout > 0 and time - begin > self.timeout
        return (None if stale else value), stale
