"""When torques act: as configured (`Timing`), as clocks show (`Ages`), as learnt (`Latency`).

Which act when, of those that were sent, is in a `TorqueHistory`. Stamps and times of clocks are
integers in nanoseconds.
"""

from collections import deque
from typing import NamedTuple

from climber_uk.control.model import Shares
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.quantities import NO_TORQUES, Torques
from climber_uk.parameters.declaration import parameter, parameters

LONGEST_STEP = 0.3  # [s] for which the model is trusted without an odometry
WINDOW = SECOND // 2  # [ns] in which one odometry at least is not late
LONGEST_DELAY = 0.22  # [s] that is learnt at once
SLOWLY = 0.05  # [s] that is learnt in small steps
FAR_OFF = 0.02  # [s] that the loop bears without learning it: docs/control.md
FASTEST_CHANGE = 0.05  # [s/s] by which it changes
MEMORY_TIME = 1.0  # T_f [s]
LEAST_ENERGY = 0.1  # S₀ [m²/s²] of changes of acceleration
SWING = 0.3  # [m/s²] by which an acceleration has to go back to count as a reversal
OSCILLATES = 4.0  # reversals in the memory
STEADY: tuple[tuple[float, float], ...] = (0.0, 0.0), (0.0, 0.0)


@parameters(slots=True)
class Timing:
    """When a torque acts: from its arrival at the wheels to that of the next.

    It arrives `transport_delay` and the odometry's age, the clock minus its stamp, after the stamp.
    """

    control_period: float = parameter(
        0.005, "s", "time from an odometry to the next, until it is measured", above=0, at_most=1
    )
    transport_delay: float = parameter(
        0.0,
        "s",
        "delay that the clock does not show: before the odometry's stamp and on the way to the "
        "wheels",
        at_least=0,
        at_most=LONGEST_STEP,
        runtime=True,
    )
    max_latency: float = parameter(
        0.05,
        "s",
        "least age of odometry that is latency; what is always beyond is the clocks' offset",
        at_least=0,
        at_most=LONGEST_STEP,
    )
    measure_delay: bool = parameter(
        True, "", "add the odometry's age to the transport delay", runtime=True
    )

    learn_delay: bool = parameter(
        True, "", "learn what is missing in the transport delay while it runs", runtime=True
    )


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
        least, before = self._least, self._least_before
        if least is None:
            return 0.0 if before is None else before
        return least if before is None else min(least, before)

    def offset(self, max_latency: float) -> float:
        """Offset of the odometry's clock [s]: that part of its age that no latency explains.

        If in doubt it is latency: a loop that believes in too much of it is slower, and one that
        believes in too little oscillates.
        """
        least = self.least
        if least > max_latency:
            return least - max_latency
        return least if least < -max_latency else 0.0

    def latency(self, age: float, max_latency: float) -> float:
        """Latency [s] of an odometry of some age [s], without the offset."""
        return max(age - self.offset(max_latency), 0.0)


class TorqueHistory:
    """Torques in the order in which they act; none before the first."""

    def __init__(self) -> None:
        self._begun: deque[tuple[int, Torques]] = deque()  # [ns] from when, torques
        self.last = NO_TORQUES  # the torques that will act in the end

    def begin(self, wanted: int) -> int:
        """When torques begin to act [ns]: at `wanted` [ns], but no earlier than the last ones."""
        return max(wanted, self._begun[-1][0]) if self._begun else wanted

    def add(self, begins: int, torques: Torques) -> None:
        """Torques that act from `begins` [ns] on."""
        self._begun.append((begins, torques))
        self.last = torques

    def correct(self, torques: Torques) -> None:
        """Replace the last torques, from when those begin to act."""
        begins, _ = self._begun.pop()
        self.add(begins, torques)

    @property
    def begun(self) -> tuple[tuple[int, Torques], ...]:
        """All that it has: from when torques act [ns], and these."""
        return tuple(self._begun)

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
        spans = []
        for begins, torques in reversed(self._begun):
            if start >= end:
                break
            since = max(begins, start)
            if since < end:
                spans.append((torques, (end - since) / SECOND))
                end = since
        if end > start:
            spans.append((NO_TORQUES, (end - start) / SECOND))
        return spans[::-1]


class Oscillation:
    """How often an acceleration has gone to and fro of late."""

    def __init__(self) -> None:
        self.reversals = 0.0
        self._direction, self._extreme = 1.0, 0.0

    def add(self, acceleration: float, left: float) -> bool:
        """Whether it oscillates, with an `acceleration` [m/s²]; `left` of what was before."""
        back = self._direction * (self._extreme - acceleration)
        self.reversals *= left
        if back < 0 or back > SWING:
            self._extreme = acceleration
        if back > SWING:
            self._direction = -self._direction
            self.reversals += 1.0
        return self.reversals > OSCILLATES


class Sample(NamedTuple):
    """What a period tells of (drive, yaw); of yaw as speed and acceleration of a wheel's rim."""

    accelerations: tuple[float, float]  # a [m/s²]
    errors: tuple[float, float]  # ε [m/s]
    time: float  # [s]
    slides: bool = True  # whether it moves forwards or back


class Latency:
    """How much later than configured a torque acts: learnt where the loop oscillates for it.

    Where a torque acts δ later than the model believes, speeds are off by ε = -δ (a - a₀), with a
    and a₀ the accelerations by the torques that act at the end and at the begin of a period, so far
    as the disturbance observer does not put that down to a disturbance: φ = ∂ε/∂δ goes through the
    observer as ε does. δ of drive and yaw together follows by recursive least squares that forget
    (Ljung & Söderström 1983, 3.6):

        S ← S (1 - T / T_f) + φ²,    δ ← δ - ε φ / (S + S₀)

    A single disturbance looks like a delay, too, while the observer learns it. So only what goes to
    and fro counts. A motor's lag is taken for a delay.
    """

    def __init__(self) -> None:
        self.delay = 0.0  # [s]
        self.oscillations = Oscillation(), Oscillation()
        self._far_off = False
        self._energy = 0.0  # S
        self._before = 0.0, 0.0  # [m/s²]
        # ∂/∂δ of the observer's disturbance, as accelerations, and of its rates
        self._slopes = STEADY

    @property
    def is_far_off(self) -> bool:
        """Whether it is more than the loop bears without learning; until it is less than half."""
        self._far_off = abs(self.delay) > FAR_OFF / (2 if self._far_off else 1)
        return self._far_off

    def takes(self, delay: float) -> bool:
        """Take over a delay [s] that was found at once; whether it may be as long."""
        if delay > LONGEST_DELAY:
            return False
        self.delay = delay
        return True

    def learn(self, sample: Sample, shares: Shares, configured_delay: float = 0.0) -> None:
        """Take in a period; `shares` are those of the observer.

        The `configured_delay` [s] may be too long: what is learnt may be below 0 by as much.
        """
        accelerations, _, time, slides = sample
        drive, yaw = self.oscillations
        left = max(0.0, 1.0 - time / MEMORY_TIME)
        # at rest friction oscillates with the force that it balances
        drive_oscillates = slides and drive.add(accelerations[0], left)
        yaw_oscillates = yaw.add(accelerations[1], left)
        self._energy *= left
        if drive_oscillates or yaw_oscillates:
            self._learn(sample, (drive_oscillates, yaw_oscillates), shares, -configured_delay)
        else:
            self._slopes = STEADY
        self._before = accelerations

    def _learn(
        self, sample: Sample, oscillates: tuple[bool, bool], shares: Shares, least: float
    ) -> None:
        (new, newer), time, product, slopes = shares, sample.time, 0.0, []
        for i, (slope, rate) in enumerate(self._slopes):
            phi = sample.accelerations[i] - self._before[i] - time * slope
            product += sample.errors[i] * phi * oscillates[i]
            self._energy += phi * phi * oscillates[i]
            slopes.append((slope + time * rate + new * phi / time, rate + newer * phi / time**2))
        self._slopes = tuple(slopes)
        most = FASTEST_CHANGE * time
        change = min(max(-product / (self._energy + LEAST_ENERGY), -most), most)
        most = max(SLOWLY, self.delay)
        self.delay = min(max(self.delay + change, least), most)
