"""What holds a climber on its wall, and how near it is to slipping, tipping and falling (§7).

    slip margin = μ_w N_w / |traction demanded|     tip margin = (F_a + m g_n) l/2 / (m g_t h)

F_a is the adhesion, N_w the load on the wheels, g_n and g_t gravity into the wall and along it. A
new kind of adhesion is one class and one entry. Everything broadcasts.
"""

from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import clipped, everywhere, exp, select, sqrt, with_sign_of
from climber_uk.mechanics.parameter import check, parameter

AMPLE = 100.0  # margins are told within ± that: without a demand there would be no end


class Adhesion(Protocol):
    """What pulls a climber towards its wall."""

    def force(self, climber: Climber) -> float:
        """F_a [N]."""

    def seal_friction(self, climber: Climber) -> float:
        """Coulomb's friction f of what slides on the wall [N]."""


@dataclass(frozen=True)
class Suction:
    """P S, of which a seal carries (1 - k), and rubs; the pump fills a volume that leaks.

    Ṗ = (P_pump - P) / T_pump - P / T_leak, so that P ends at P_pump T_leak / (T_leak + T_pump).
    """

    pump_time: float = parameter(0.0, "s", "T_pump; 0: at once", at_least=0)
    leak_time: float = parameter(0.0, "s", "T_leak; 0: it does not leak", at_least=0)

    def __post_init__(self) -> None:
        check(self)

    def force(self, climber: Climber) -> float:
        """See `Adhesion`."""
        return climber.suction_pressure * climber.suction_area

    def seal_friction(self, climber: Climber) -> float:
        """See `Adhesion`."""
        return climber.seal_friction

    def final_pressure(self, pump: Any) -> Any:
        """Pressure (...) [Pa] that a pump good for `pump` (...) [Pa] reaches against the leak."""
        tight = self.leak_time == 0
        return pump if tight else pump * self.leak_time / (self.leak_time + self.pump_time)

    def pressure(self, before: Any, pump: Any, time: Any) -> Any:
        """Pressure (...) [Pa] after `time` (...) [s]."""
        if self.pump_time == 0:
            return pump
        rate = 1 / self.pump_time + (1 / self.leak_time if self.leak_time > 0 else 0.0)
        final = self.final_pressure(pump)
        return final + (before - final) * exp(-rate * time)


@dataclass(frozen=True)
class Magnetic:
    """F₀ / (1 + gap/g₀)², as of a magnet whose flux crosses the gap twice; nothing slides."""

    force_at_contact: float = parameter(
        300.0, "N", "F₀, of the magnets on bare steel", at_least=0, plausible=(1, 1e5)
    )
    gap: float = parameter(
        0.0, "m", "of air or paint", at_least=0, runtime=True, plausible=(1e-6, 0.1)
    )
    gap_of_a_quarter: float = parameter(
        2e-3, "m", "g₀, which leaves a quarter of F₀", above=0, plausible=(1e-6, 0.1)
    )

    def __post_init__(self) -> None:
        check(self)

    def force(self, climber: Climber) -> float:
        """See `Adhesion`."""
        wider = 1 + self.gap / self.gap_of_a_quarter
        return self.force_at_contact / (wider * wider)

    def seal_friction(self, climber: Climber) -> float:
        """See `Adhesion`."""
        return 0.0


@dataclass(frozen=True)
class NoAdhesion:
    """Weight alone, as on a floor."""

    def force(self, climber: Climber) -> float:
        """See `Adhesion`."""
        return 0.0

    def seal_friction(self, climber: Climber) -> float:
        """See `Adhesion`."""
        return 0.0


ADHESION: dict[str, type[Adhesion]] = {
    "suction": Suction,
    "magnetic": Magnetic,
    "none": NoAdhesion,
}


def with_its_seal(climber: Climber, adhesion: str) -> Climber:
    """The climber with the friction that its kind of `ADHESION` has: without suction, no seal rubs.

    For models that know no more of what holds a climber than its own parameters.
    """
    return climber if adhesion == "suction" else replace(climber, seal_friction_coefficient=0.0)


@dataclass(frozen=True)
class Grip:
    """How a climber stands on its wall."""

    wheel_friction_coefficient: float = parameter(
        0.8, "", "μ_w of the wheels (or tracks) on the wall", at_least=0, plausible=(0.01, 3)
    )
    wheel_inertia: float = parameter(
        2e-5,
        "kg m²",
        "of a wheel about its axle, counted in mass and yaw inertia",
        above=0,
        plausible=(1e-8, 1),
    )
    centre_height: float = parameter(
        0.05, "m", "h of the centre of mass above the wall", at_least=0, plausible=(0.001, 1)
    )
    wheelbase: float = parameter(
        0.25, "m", "l between the edges it would tip about", above=0, plausible=(0.02, 3)
    )
    seal_radius: float = parameter(
        0.0,
        "m",
        "of the ring that resists turning; 0: it does not",
        at_least=0,
        plausible=(0.01, 1),
    )

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, kw_only=True)
class Hold:
    """All that a climber's hold on its wall depends on."""

    adhesion: Adhesion = field(default_factory=Suction)
    grip: Grip = field(default_factory=Grip)

    def seal_friction(self, climber: Climber) -> float:
        """Coulomb's friction f of the seal [N]."""
        return self.adhesion.seal_friction(climber)

    def hold(self, climber: Climber, into_wall: Any) -> Any:
        """Force (...) [N] that keeps it on the wall: F_a + m g_n; below 0 it falls.

        `into_wall` (...) [m/s²] is g_n, and what curvature of the way adds to it.
        """
        return self.adhesion.force(climber) + climber.mass * into_wall

    def wheel_load(self, climber: Climber, into_wall: Any) -> Any:
        """N_w (...) [N]: what the seal does not carry. f is that of the suction alone (§2.2)."""
        held_by_seal = 0.0
        if isinstance(self.adhesion, Suction):
            held_by_seal = (1 - climber.wheel_load_share) * self.adhesion.force(climber)
        return clipped(self.hold(climber, into_wall) - held_by_seal, 0.0, float("inf"))

    def slip_margin(self, climber: Climber, into_wall: Any, drive: Any, lateral: Any) -> Any:
        """μ_w N_w / √(drive² + lateral²) (...): below 1 a real climber slips; see `AMPLE`."""
        traction = self.grip.wheel_friction_coefficient * self.wheel_load(climber, into_wall)
        return _margin(traction, sqrt(drive * drive + lateral * lateral))

    def tip_margin(self, climber: Climber, into_wall: Any, along_wall: Any) -> Any:
        """Of the moments about the lower edge, holding to tipping (...): below 1 it tips."""
        holding = self.hold(climber, into_wall) * self.grip.wheelbase / 2
        return _margin(holding, climber.mass * abs(along_wall) * self.grip.centre_height)


@dataclass(frozen=True)
class Alarm:
    """Margins that are worth a word; see `Hold`."""

    warn_margin: float = parameter(1.5, "", "below which margins warn", at_least=0, runtime=True)
    error_margin: float = parameter(
        1.0, "", "below which they are errors", at_least=0, runtime=True
    )

    def __post_init__(self) -> None:
        check(self)

    def level(self, margin: float) -> int:
        """0 for ample, 1 for a warning, 2 for an error."""
        return int(margin < self.warn_margin) + int(
            margin < min(self.error_margin, self.warn_margin)
        )


def _margin(held: Any, demanded: Any) -> Any:
    within = abs(held) < AMPLE * demanded
    if everywhere(within):
        return held / demanded
    return select(within, held / select(within, demanded, 1.0), with_sign_of(AMPLE, held))
