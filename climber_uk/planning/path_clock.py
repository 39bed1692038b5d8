"""How fast a trajectory's own time goes on: u(t) = u₀ + r (t - t₀) + Σ Δᵢ S(t - tᵢ).

S is the distance of a smooth start: each change Δᵢ of the rate takes `ramp_time` from tᵢ on, and
changes may overlap. The rate is the mean of what was asked for, with weights >= 0: it is never
beyond all that was asked for, it does not overshoot, and it is there after `ramp_time`, exactly.
"""

from dataclasses import dataclass, replace

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.elementary import Derivatives
from climber_uk.mechanics.time_laws import smooth_start


@dataclass(frozen=True)
class PathClock:
    """A trajectory's own time u(t) [s]: at the clock's rate at first, slower, or backwards."""

    ramp_time: float = 1.0  # [s] of each change of the rate
    since: float = 0.0  # [s] t₀
    begin: float = 0.0  # [s] u₀
    rate: float = 1.0  # r
    changes: tuple[tuple[float, float], ...] = ()  # tᵢ [s], Δᵢ

    def at(self, time: Array | float) -> Derivatives:
        """u, u̇, ü, u⃛ at `time` (...) [s]."""
        t = np.asarray(time, dtype=float)
        u = self.begin + self.rate * (t - self.since)
        u_1, u_2, u_3 = self.rate + 0 * t, 0 * t, 0 * t
        for start, change in self.changes:
            step = smooth_start(t - start, self.ramp_time)
            u, u_1, u_2, u_3 = (
                x + change * d for x, d in zip((u, u_1, u_2, u_3), step, strict=True)
            )
        return u, u_1, u_2, u_3

    @property
    def asked(self) -> float:
        """The rate that it goes to."""
        return self.rate + sum(change for _, change in self.changes)

    def changed(self, time: float, rate: float, done: float) -> "PathClock":
        """Clock that goes to another rate from `time` [s] on, whatever would have begun after it.

        What came before `done` [s] will not be asked for again.
        """
        past = tuple((t, d) for t, d in self.changes if t + self.ramp_time <= done)
        lasting = tuple((t, d) for t, d in self.changes if t + self.ramp_time > done and t < time)
        begin, before, *_ = replace(self, changes=past).at(done)
        clock = PathClock(self.ramp_time, done, float(begin), float(before), lasting)
        change = rate - clock.asked
        return replace(clock, changes=(*lasting, (time, change))) if change else clock

    def turned(self, time: float, rate: float, done: float) -> "PathClock":
        """The same, by way of rest if it goes the other way: there friction turns round."""
        clock = self.changed(time, 0.0, done)
        if float(clock.at(time)[1]) * rate < 0:
            return clock.changed(clock.settles(), rate, done)
        return self.changed(time, rate, done)

    def settles(self) -> float:
        """Time [s] from which on the rate is the one asked for."""
        return max((t + self.ramp_time for t, _ in self.changes), default=self.since)
