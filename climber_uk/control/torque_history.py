"""Which torques act when: those that were sent, from when each reaches the wheels."""

from collections import deque

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import Torques

NONE = Torques(0.0, 0.0)


class TorqueHistory:
    """Torques in the order in which they act; none before the first."""

    def __init__(self) -> None:
        self._begun: deque[tuple[int, Torques]] = deque()  # [ns] from when, torques
        self.last = NONE  # the torques that will act in the end

    def begin(self, wanted: int) -> int:
        """When torques would begin to act [ns]: as wanted, but none overtakes the last ones."""
        return max(wanted, self._begun[-1][0]) if self._begun else wanted

    def add(self, begins: int, torques: Torques) -> None:
        """Torques that act from `begins` [ns] on."""
        self._begun.append((begins, torques))
        self.last = torques

    def correct(self, torques: Torques) -> None:
        """Have other torques acting in the place of the last ones."""
        begins, _ = self._begun.pop()
        self.add(begins, torques)

    def forget_before(self, time: int) -> None:
        """Keep only what matters from `time` [ns] on."""
        while len(self._begun) > 1 and self._begun[1][0] <= time:
            self._begun.popleft()

    def restart(self) -> None:
        """Times of before mean nothing any more; the last torques have acted for ever."""
        if self._begun:
            self._begun = deque([(0, self.last)])

    def are_known_since(self, time: int) -> bool:
        """Whether it is known what acts from `time` [ns] on."""
        return bool(self._begun) and self._begun[0][0] <= time

    def between(self, start: int, end: int) -> list[tuple[Torques, float]]:
        """Torques that act from `start` to `end` [ns], each with how long it does [s]."""
        torques, spans = NONE, []
        for begins, following in self._begun:
            if begins >= end:
                break
            if begins > start:
                spans.append((torques, (begins - start) / SECOND))
                start = begins
            torques = following
        if end > start:
            spans.append((torques, (end - start) / SECOND))
        return spans
