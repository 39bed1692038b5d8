"""What was sent to act from a time on: the last to begin acts, until it is too old."""

from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class CommandBuffer(Generic[T]):
    """Values with the times at which they begin; a timeout of 0 is none. All times in ns."""

    def __init__(self, timeout: int = 0) -> None:
        self.timeout = timeout
        self._coming: deque[tuple[int, T]] = deque()

    def add(self, begin: int, value: T) -> None:
        """Let `value` act from `begin` on; what was to begin later than that is dropped."""
        while self._coming and self._coming[-1][0] > begin:
            self._coming.pop()
        self._coming.append((begin, value))

    def at(self, time: int) -> tuple[T | None, bool]:
        """What acts at `time`, and whether that is nothing since the last one is too old."""
        while len(self._coming) > 1 and self._coming[1][0] <= time:
            self._coming.popleft()
        if not self._coming or self._coming[0][0] > time:
            return None, False
        begin, value = self._coming[0]
        stale = self.timeout > 0 and time - begin > self.timeout
        return (None if stale else value), stale
