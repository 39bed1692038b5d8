"""Wheels' angles to ways: how far both have rolled since the last sample, or that they rest."""

from typing import NamedTuple

from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics.elementary import turned

LARGEST_SPEED = 10.0  # [m/s] of a wheel's rim, above which a counter has begun anew
REST = 0.3  # [s] without a count, from which on a climber rests


class Rolled(NamedTuple):
    """Between two samples of the encoders."""

    duration: float  # [s]
    distance: float  # [m] forwards, of the middle between the wheels
    path: float  # [m] mean of both wheels' ways, whichever way they roll
    yaw_rate: float  # [rad/s] as the wheels tell
    rests: bool  # for `REST`

    @property
    def speed(self) -> float:
        """[m/s] forwards."""
        return self.distance / self.duration


class Encoders:
    """Remembers the last angles."""

    def __init__(self, options: LocalizationOptions) -> None:
        self.options = options
        self._last: tuple[float, float] | None = None  # [rad] right, left
        self._resting = 0.0  # [s]

    def roll(self, right: float, left: float, duration: float) -> Rolled:
        """What was rolled in `duration` [s] up to angles [rad]; at first nothing.

        Raises `ValueError` where that cannot be, and counts from there.
        """
        before, self._last = self._last or (right, left), (right, left)
        radius, half_track = self.options.wheel_radius, self.options.turning_lever
        angles = zip(self._last, before, strict=True)
        ways = [radius * turned(now, then, duration) for now, then in angles]
        fastest = max(map(abs, ways)) / duration
        if fastest > LARGEST_SPEED:
            raise ValueError(
                f"a wheel of {fastest:.3g} m/s, above {LARGEST_SPEED:g}: counted anew from there"
            )
        self._resting = 0.0 if any(ways) else self._resting + duration
        distance, angle = (ways[0] + ways[1]) / 2, (ways[0] - ways[1]) / (2 * half_track)
        path = (abs(ways[0]) + abs(ways[1])) / 2
        return Rolled(duration, distance, path, angle / duration, self._resting >= REST)
