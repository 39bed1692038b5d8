"""What is not known well enough any more, once it was; and fixes that have stopped."""

from climber_uk.localization.kalman import Estimate
from climber_uk.localization.models import HEADING, X, Y
from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import SECOND

KNOWN_AGAIN = 0.7  # of a limit, below which a deviation is small again
SILENCE = 5.0  # [s] without a fix, from which on they may have stopped,
INTERVALS = 5.0  # and as many times the longest time between two before


class Doubts:
    """Looks at each estimate, and at each fix that is taken."""

    def __init__(self, options: LocalizationOptions) -> None:
        self.limits = {
            "position": (options.initial_position_limit, "m"),
            "heading": (options.initial_heading_limit, "rad"),
        }
        self.unknown: dict[str, float] = {}  # deviations [m], [rad] that are too large
        self._fixed: int | None = None  # [ns] stamp of the last fix
        self._longest = 0.0  # [s] between two

    def look(self, estimate: Estimate) -> None:
        """Look at an estimate."""
        deviations = {
            "position": max(estimate.deviation(X), estimate.deviation(Y)),
            "heading": estimate.deviation(HEADING),
        }
        self.unknown = {
            part: deviation
            for part, deviation in deviations.items()
            if deviation > self.limits[part][0] * (KNOWN_AGAIN if part in self.unknown else 1)
        }

    def on_fix(self, stamp: int) -> None:
        """Take the stamp [ns] of a fix."""
        if self._fixed is not None:
            self._longest = max(self._longest, (stamp - self._fixed) / SECOND)
        self._fixed = max(stamp, self._fixed or stamp)

    def have_stopped(self, stamp: int) -> bool:
        """Whether fixes have, at `stamp` [ns]; not if there never was one."""
        if self._fixed is None:
            return False
        return (stamp - self._fixed) / SECOND > max(SILENCE, INTERVALS * self._longest)

    @property
    def said(self) -> str:
        """Which deviations are too large, and how large they may be."""
        return ", ".join(
            f"{part} by {deviation:.2g}, above {self.limits[part][0]:g} {self.limits[part][1]}"
            for part, deviation in self.unknown.items()
        )
