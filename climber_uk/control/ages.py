"""How old odometry is when it arrives, and which part of that is the offset of two clocks."""

from climber_uk.mechanics import SECOND

WINDOW = SECOND // 2  # [ns] in which one odometry at least is not late


class Ages:
    """Ages of the last half to whole second: the least of them is no accident."""

    def __init__(self) -> None:
        self._begin = 0  # [ns] of the window
        self._least: float | None = None
        self._least_before: float | None = None

    def add(self, now: int, age: float) -> None:
        """Add the age [s] of an odometry that arrived at `now` [ns]."""
        if not 0 <= now - self._begin < WINDOW:
            self._begin, self._least_before, self._least = now, self._least, None
        self._least = age if self._least is None else min(self._least, age)

    @property
    def least(self) -> float:
        """Least age [s]; below 0 where stamps are ahead of the clock."""
        known = [age for age in (self._least, self._least_before) if age is not None]
        return min(known, default=0.0)

    def offset(self, max_latency: float) -> float:
        """Offset of the odometry's clock [s]: that part of its age that no latency explains."""
        return 0.0 if abs(self.least) <= max_latency else self.least

    def latency(self, age: float, max_latency: float) -> float:
        """Latency [s] of an odometry of some age [s], without the offset."""
        return min(max(age - self.offset(max_latency), 0.0), max_latency)
