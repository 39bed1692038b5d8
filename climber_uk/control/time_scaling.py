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

SLOW = 0.01  # [m/s] speed of a reference that is not worth waiting for
LONGEST_LAG = 5.0  # [s] that is made up for later; a longer delay shifts the rest of the reference
LONGEST_GAP = 0.3  # [s] between two answers over which the reference goes on
IN_TIME_AGAIN = 1e-3  # [1] of σ that is missing at the end of a restart


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
        1.0, "s", "in which lost time is made up for, at last", above=0, runtime=True
    )
    settling_time: float = parameter(
        0.2, "s", "in which σ goes back to where it should be", above=0, runtime=True
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
        found = preview.target(time - round(self.lag * SECOND))
        if found is None:
            return self
        speed = found.speed
        if missing * speed <= 0 or abs(speed) < SLOW:
            return self
        return self._replace(change=max(self.change - missing / speed, -self.rate / step))

    def target(self, preview: Preview, time: int) -> ReferencePoint | None:
        """Target for `time` [ns] at this pace; None outside of the preview."""
        found = preview.target(time - round(self.lag * SECOND))
        if found is None or (self.rate == 1 and self.change == 0):
            return found
        x, y, heading, v_x, v_y, omega, a_x, a_y, omega_1, j_x, j_y = found
        rates = self.rate, self.change, 0.0
        _, v_x, a_x, j_x = compose((x, v_x, a_x, j_x), rates)
        _, v_y, a_y, j_y = compose((y, v_y, a_y, j_y), rates)
        # the jerk of the heading is not known, nor needed
        _, omega, omega_1, _ = compose((heading, omega, omega_1, 0.0), rates)
        return ReferencePoint(x, y, heading, v_x, v_y, omega, a_x, a_y, omega_1, j_x, j_y)


IN_TIME = Pace()


class Progress(NamedTuple):
    """How far along a reference the climber is: at its time `position`, by the climber's clock.

    `waited` is for good: the rest of the reference comes later by it. `pace.lag` is made up for.
    """

    time: int | None = None  # [ns] from when the last answer acts; None: there was none
    waited: int = 0  # [ns]
    pace: Pace = IN_TIME
    is_restarting: bool = False  # σ is on its way up to 1, and what is lost by it is waited

    @property
    def position(self) -> int | None:
        """Time of the reference [ns] that the last answer was for; None if there was none."""
        return None if self.time is None else self.at(self.time)

    def at(self, time: int) -> int:
        """Time of the reference [ns] at `time` [ns], near that of the last answer."""
        return time - self.waited - round(self.pace.lag * SECOND)

    def target(self, preview: Preview, time: int) -> ReferencePoint | None:
        """Target for `time` [ns]; None outside of the preview."""
        if self.pace == IN_TIME:
            return preview.target(time - self.waited)
        return self.pace.target(preview, time - self.waited)

    def advanced(self, time: int, pacing: Pacing) -> "Progress":
        """Progress at `time` [ns]; the reference stands still where the clock has jumped."""
        if self.time is None:
            return self._replace(time=time)
        passed = time - self.time
        if not 0 <= passed <= LONGEST_GAP * SECOND:
            return self._replace(time=time, waited=self.waited + passed)
        if self.pace == IN_TIME:  # in nearly every tick: `_replace` takes twice as long
            return Progress(time, self.waited, IN_TIME, self.is_restarting)
        pace, waited = self.pace.after(passed / SECOND, pacing), self.waited
        is_restarting = self.is_restarting and pace.rate < 1 - IN_TIME_AGAIN
        excess = pace.lag if self.is_restarting else pace.lag - LONGEST_LAG
        if excess > 0:
            waited += round(excess * SECOND)
            pace = pace._replace(lag=pace.lag - excess)
        if self.is_restarting and not is_restarting:
            pace = IN_TIME
        return Progress(time, waited, pace, is_restarting)

    def slowed(self, missing: float, preview: Preview, time: int, step: float) -> "Progress":
        """Progress that asks `missing` [m/s²] less along the climber; see `Pace.slowed`."""
        pace = self.pace.slowed(missing, preview, time - self.waited, step)
        return self._replace(pace=pace)


def restarted(time: int, position: int, rate: float) -> Progress:
    """Progress that goes on at `position` [ns] of the reference, at first at the rate σ `rate`."""
    pace = IN_TIME if rate > 1 - IN_TIME_AGAIN else Pace(rate=rate)
    return Progress(time, time - position, pace, pace != IN_TIME)
