"""How much later than told a torque acts: learnt where the loop begins to oscillate for it.

Where a torque acts δ later than the model believes, speeds are off by ε = -δ (a - a₀), with a and
a₀ the accelerations by the torques that act at the end and at the begin of a period, so far as the
disturbance observer does not put that down to a disturbance: φ = ∂ε/∂δ goes through the observer
as ε does. δ follows by recursive least squares that forget (Ljung & Söderström 1983, 3.6):

    S ← S (1 - T / T_f) + φ²,    δ ← δ - ε φ / (S + S₀)

A single disturbance looks like a delay, too, while the observer learns it. So only what goes to
and fro counts. A motor's lag is taken for a delay.
"""

from typing import Any, NamedTuple

LONGEST = 0.05  # [s] that is taken for a delay
FAR_OFF = 0.02  # [s] that the loop bears without learning it: docs/control.md
FASTEST = 0.05  # [s/s] by which it changes
MEMORY = 1.0  # T_f [s]
LEAST = 0.1  # S₀ [m²/s²] of changes of acceleration
SWING = 0.3  # [m/s²] by which an acceleration has to go back to count as a reversal
OSCILLATES = 4.0  # reversals in the memory
STEADY: tuple[tuple[float, float], ...] = (0.0, 0.0), (0.0, 0.0)


class Oscillation:
    """How often an acceleration has gone to and fro of late."""

    def __init__(self) -> None:
        self.reversals = 0.0
        self._way, self._extreme = 1.0, 0.0

    def add(self, acceleration: float, left: float) -> bool:
        """Whether it oscillates, with an `acceleration` [m/s²]; `left` of what was before."""
        back = self._way * (self._extreme - acceleration)
        self.reversals *= left
        if back < 0 or back > SWING:
            self._extreme = acceleration
        if back > SWING:
            self._way = -self._way
            self.reversals += 1.0
        return self.reversals > OSCILLATES


class Sample(NamedTuple):
    """What a period tells, of the drive and of the turn; lengths of a turn are at the wheels."""

    accelerations: tuple[float, float]  # a [m/s²]
    errors: tuple[float, float]  # ε [m/s]
    time: float  # [s]
    slides: bool = True  # whether it moves forwards or back


class Latency:
    """δ of one climber, from its drive and its turn."""

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

    def learn(self, sample: Sample, shares: tuple[Any, Any], told: float = 0.0) -> None:
        """Take in a period; `shares` are those of the observer.

        A delay that is `told` [s] may be too long: what is learnt may be as much less than 0.
        """
        accelerations, _, time, slides = sample
        drive, turn = self.oscillations
        left = max(0.0, 1.0 - time / MEMORY)
        # at rest friction goes to and fro, and holds
        drives = slides and drive.add(accelerations[0], left)
        turns = turn.add(accelerations[1], left)
        self._energy *= left
        if drives or turns:
            self._learn(sample, (drives, turns), shares, told)
        else:
            self._slopes = STEADY
        self._before = accelerations

    def _learn(
        self, sample: Sample, oscillates: tuple[bool, bool], shares: tuple[Any, Any], told: float
    ) -> None:
        (new, newer), time, product, slopes = shares, sample.time, 0.0, []
        for i, (slope, rate) in enumerate(self._slopes):
            phi = sample.accelerations[i] - self._before[i] - time * slope
            product += sample.errors[i] * phi * oscillates[i]
            self._energy += phi * phi * oscillates[i]
            slopes.append((slope + time * rate + new * phi / time, rate + newer * phi / time**2))
        self._slopes = tuple(slopes)
        most = FASTEST * time
        change = min(max(-product / (self._energy + LEAST), -most), most)
        self.delay = min(max(self.delay + change, -told), LONGEST)
