"""The reference goes on along its path only as far as it is followed.

It is followed at its own time s(t). ṡ = σ is 1 until the drive that is left after turning falls
short of the demand, then just small enough that it suffices (online time scaling, Dahl & Nielsen
1990, doi 10.1109/70.63270): the climber stays on the path and lags along it. While the reference is
not followed at all, s stands still.
"""

from typing import NamedTuple

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.elementary import compose
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import ReferencePoint
from climber_uk.parameters.declaration import parameter, parameters

STANDSTILL = 0.01  # [m/s] of a reference that may as well be at rest


@parameters(slots=True)
class Pacing:
    """How time that was lost is made up for; 0 for `catch_up` switches the time scaling off."""

    catch_up: float = parameter(
        0.25,
        "",
        "share by which a reference that waited is sped up; 0: it never waits",
        at_least=0,
        at_most=1,
        runtime=True,
    )
    recovery_time: float = parameter(
        1.0,
        "s",
        "time in which a delay of the reference is made up for, at last",
        above=0,
        runtime=True,
    )
    settling_time: float = parameter(
        0.2,
        "s",
        "time in which the reference's rate σ goes back to where it should be",
        above=0,
        runtime=True,
    )


class Pace(NamedTuple):
    """How far a reference is behind its time, and how fast it goes on."""

    lag: float = 0.0  # [s] t - s
    rate: float = 1.0  # σ
    change: float = 0.0  # σ̇ [1/s]

    def after(self, time: float, pacing: Pacing) -> "Pace":
        """Pace `time` [s] later, on its way back to no lag."""
        if self == IN_TIME:
            return IN_TIME
        rate = max(self.rate + time * self.change, 0.0)
        lag = max(self.lag + time * (1 - (self.rate + rate) / 2), 0.0)
        wanted = 1 + min(lag / pacing.recovery_time, pacing.catch_up)
        return Pace(lag, rate, (wanted - rate) / pacing.settling_time)

    def slowed(self, missing: float, preview: Preview, time: int, step: float) -> "Pace":
        """Pace that asks `missing` [m/s²] less along the climber, as far as `step` [s] can do."""
        target = preview.target(time - round(self.lag * SECOND))
        if target is None:
            return self
        speed = target.speed
        if missing * speed <= 0 or abs(speed) < STANDSTILL:
            return self
        return self._replace(change=max(self.change - missing / speed, -self.rate / step))

    def target(self, preview: Preview, time: int) -> ReferencePoint | None:
        """Target for `time` [ns] at this pace; None outside of the preview."""
        target = preview.target(time - round(self.lag * SECOND))
        if target is None or (self.rate == 1 and self.change == 0):
            return target
        x, y, heading, v_x, v_y, omega, a_x, a_y, omega_1, j_x, j_y = target
        rates = self.rate, self.change, 0.0
        _, v_x, a_x, j_x = compose((x, v_x, a_x, j_x), rates)
        _, v_y, a_y, j_y = compose((y, v_y, a_y, j_y), rates)
        # the jerk of the heading is not known, nor needed
        _, omega, omega_1, _ = compose((heading, omega, omega_1, 0.0), rates)
        return ReferencePoint(x, y, heading, v_x, v_y, omega, a_x, a_y, omega_1, j_x, j_y)


IN_TIME = Pace()
