"""Whether an odometry's twist is that of its stamp, or the mean of the period before it.

Encoders tell means: the way of a period, by its time. A twist of the stamp is that way by the time
only together with the one before: (v + v₀)/2. What fits the poses better is taken; if in doubt,
the twist is that of its stamp.
"""

from climber_uk.mechanics.quantities import Motion

MEMORY = 1.0  # [s]
SURELY = 0.1  # share of the other's squares of misfits, below which a twist is taken for a mean


class TwistKind:
    """Which of both it has been of late."""

    def __init__(self) -> None:
        self.is_mean = False
        self._as_mean = self._as_instant = 0.0  # [m²/s²] sums of squares of misfits

    def learn(self, before: Motion, now: Motion, time: float) -> None:
        """Take in an odometry, `time` [s] after the one `before`."""
        speed, rate = mean_twist(before, now, time)
        left = max(0.0, 1.0 - time / MEMORY)
        off, turned_off = now.speed - speed, now.yaw_rate - rate
        off_0, turned_off_0 = before.speed - speed, before.yaw_rate - rate
        self._as_mean = left * self._as_mean + off * off + turned_off * turned_off
        off, turned_off = (off + off_0) / 2, (turned_off + turned_off_0) / 2
        self._as_instant = left * self._as_instant + off * off + turned_off * turned_off
        self.is_mean = self._as_mean < SURELY * self._as_instant


def mean_twist(before: Motion, now: Motion, time: float) -> tuple[float, float]:
    """Forward speed [m/s] and yaw rate [rad/s] that lead from one pose to another in `time` [s]."""
    x, y, heading, cosine, sine, _, _ = before
    turned = now.heading - heading
    ahead = ((now.x - x) * (cosine + now.cosine) + (now.y - y) * (sine + now.sine)) / 2
    # halfway (cosine, sine) is longer by 1 / cos(turned / 2) than the mean of those at the ends
    ahead = ahead * (1 + turned * turned / 8)
    return ahead / time, turned / time
