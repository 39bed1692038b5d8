"""Adhesion to the wall, and the margins to slipping, tipping and falling off (§7).

    slip margin = min over R, L of μ_w N / |traction demanded|
    tip margin = (F_a + m g_n) l/2 / (m g_t h)

F_a is the adhesion, N the load on a wheel, g_n and g_t gravity into the wall and along it. A
new kind of adhesion is one class, an `Adhesion`, and one entry in `ADHESION`, or an entry point
`climber_uk.adhesion` of another package. Everything broadcasts.
"""

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Protocol

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import clipped, everywhere, exp, select, sqrt, with_sign_of
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.registry import Variants

MAX_MARGIN = 100.0  # margins are clipped to ± this: where nothing is demanded they are infinite


class Adhesion(Protocol):
    """What pulls a climber towards its wall."""

    def force(self, climber: Climber) -> float:
        """Adhesion F_a [N], along the wall's normal."""

    # What most need not say:

    has_seal: ClassVar[bool] = False
    """Whether a seal carries the share 1 - k of F_a and rubs, as the climber's parameters say."""

    def seal_friction(self, climber: Climber) -> float:
        """Coulomb's friction f of what slides on the wall [N]."""
        return climber.seal_friction if self.has_seal else 0.0

    def final_pressure(self, pump: Any) -> Any:
        """Pressure (...) [Pa] that a pump good for `pump` (...) [Pa] reaches in the end."""
        return pump

    def pressure(self, before: Any, pump: Any, time: Any) -> Any:
        """Pressure (...) [Pa] after `time` (...) [s]."""
        return before


@parameters
class Suction(Adhesion):
    """Suction force P S; its seal carries (1 - k) of it and rubs; the pumped volume leaks.

    Ṗ = (P_pump - P) / T_pump - P / T_leak, so that P ends at P_pump T_leak / (T_leak + T_pump).
    """

    pump_time: float = parameter(0.0, "s", "time constant T_pump; 0: pumped at once", at_least=0)
    leak_time: float = parameter(0.0, "s", "time constant T_leak; 0: it does not leak", at_least=0)

    has_seal: ClassVar[bool] = True

    def force(self, climber: Climber) -> float:
        """See `Adhesion`."""
        return climber.suction_pressure * climber.suction_area

    def final_pressure(self, pump: Any) -> Any:
        """P_pump against the leak: see `Adhesion`."""
        tight = self.leak_time == 0
        return pump if tight else pump * self.leak_time / (self.leak_time + self.pump_time)

    def pressure(self, before: Any, pump: Any, time: Any) -> Any:
        """Pressure (...) [Pa] a `time` (...) [s] after `before` (...) [Pa]."""
        if self.pump_time == 0:
            return pump
        rate = 1 / self.pump_time + (1 / self.leak_time if self.leak_time > 0 else 0.0)
        final = self.final_pressure(pump)
        return final + (before - final) * exp(-rate * time)


@parameters
class Magnetic(Adhesion):
    """Magnets: F₀ / (1 + gap/g₀)², as the flux crosses the gap twice; no seal rubs."""

    force_at_contact: float = parameter(
        300.0, "N", "force F₀ of all magnets on bare steel", at_least=0, plausible=(1, 1e5)
    )
    gap: float = parameter(
        0.0,
        "m",
        "gap of air or paint at the magnets",
        at_least=0,
        runtime=True,
        plausible=(1e-6, 0.1),
    )
    gap_of_a_quarter: float = parameter(
        2e-3, "m", "gap g₀ at which a quarter of F₀ is left", above=0, plausible=(1e-6, 0.1)
    )

    def force(self, climber: Climber) -> float:
        """See `Adhesion`."""
        wider = 1 + self.gap / self.gap_of_a_quarter
        return self.force_at_contact / (wider * wider)


@dataclass(frozen=True)
class NoAdhesion(Adhesion):
    """No adhesion: weight alone, as on a floor."""

    def force(self, climber: Climber) -> float:
        """See `Adhesion`."""
        return 0.0


ADHESION = Variants[type[Adhesion]](
    {"suction": Suction, "magnetic": Magnetic, "none": NoAdhesion}, "adhesion"
)


def with_its_seal(climber: Climber, adhesion: str) -> Climber:
    """The climber with the friction that its kind of `ADHESION` has: none without a seal.

    For models that know of the adhesion only the parameters of `Climber`.
    """
    has_seal = ADHESION[adhesion].has_seal
    return climber if has_seal else replace(climber, seal_friction_coefficient=0.0)


@parameters
class Grip:
    """Wheels, seal and centre of mass on the wall, by which slipping and tipping are warned of."""

    wheel_friction_coefficient: float = parameter(
        0.8,
        "",
        "friction coefficient μ_w of the wheels on the wall; too high: slip comes unwarned",
        at_least=0,
        plausible=(0.01, 3),
    )
    wheel_inertia: float = parameter(
        2e-5,
        "kg m²",
        "inertia of the wheels of a side about their axles; mass and yaw inertia contain it",
        above=0,
        plausible=(1e-8, 1),
    )
    centre_height: float = parameter(
        0.05, "m", "height h of the centre of mass above the wall", at_least=0, plausible=(0.001, 1)
    )
    wheelbase: float = parameter(
        0.25,
        "m",
        "distance l between the edges that the climber would tip about",
        above=0,
        plausible=(0.02, 3),
    )
    seal_radius: float = parameter(
        0.0,
        "m",
        "radius of the seal's ring, whose friction resists yawing; 0: none",
        at_least=0,
        plausible=(0.01, 1),
    )


@dataclass(frozen=True, kw_only=True)
class Attachment:
    """Adhesion and grip: what the normal force and the margins depend on."""

    adhesion: Adhesion = field(default_factory=Suction)
    grip: Grip = field(default_factory=Grip)

    def seal_friction(self, climber: Climber) -> float:
        """Coulomb's friction f of the seal [N]."""
        return self.adhesion.seal_friction(climber)

    def normal_force(self, climber: Climber, into_wall: Any) -> Any:
        """F_a + m g_n (...) [N], which presses the climber onto its wall; below 0 it falls off.

        `into_wall` (...) [m/s²] is g_n, with what a curved wall adds to it: see `Wall.into`.
        """
        return self.adhesion.force(climber) + climber.mass * into_wall

    def wheel_load(self, climber: Climber, into_wall: Any) -> Any:
        """Load N_w (...) [N] on the wheels together: the normal force that the seal does not carry.

        The seal carries its share of the suction, whatever the weight (§2.2).
        """
        seal_load = 0.0
        if self.adhesion.has_seal:
            seal_load = (1 - climber.wheel_load_share) * self.adhesion.force(climber)
        return clipped(self.normal_force(climber, into_wall) - seal_load, 0.0, float("inf"))

    def wheel_loads(self, climber: Climber, load: Any, across: Any) -> tuple[Any, Any]:
        """Loads N_R, N_L (...) [N] of the sides, `load` together.

        `across` (...) [N] is what pulls the centre of mass to the left, which is h above the wall.
        """
        shifted = across * self.grip.centre_height / (2 * climber.half_track)
        right, left = load / 2 - shifted, load / 2 + shifted
        return clipped(right, 0.0, load), clipped(left, 0.0, load)

    def slip_margin(
        self, climber: Climber, into_wall: Any, forces: tuple[Any, Any], lateral: Any, across: Any
    ) -> Any:
        """Least μ_w N / √(F² + L²) of a wheel (...): below 1 it slips; at most `MAX_MARGIN`.

        `forces` (...) [N] are what the right and the left wheel pass on along the climber,
        `lateral` (...) [N] both across it, each by its load; `across` as for `wheel_loads`.
        """
        load, friction = self.wheel_load(climber, into_wall), self.grip.wheel_friction_coefficient
        margins = []
        for side, force in zip(self.wheel_loads(climber, load, across), forces, strict=True):
            share = lateral * side / select(load > 0, load, 1.0)
            margins.append(_margin(friction * side, sqrt(force * force + share * share)))
        right, left = margins
        return select(right < left, right, left)

    def tip_margin(self, climber: Climber, into_wall: Any, along_wall: Any) -> Any:
        """Holding moment by tipping moment about the lower edge (...): below 1 the climber tips.

        `along_wall` (...) [m/s²] is gravity along the wall.
        """
        righting_moment = self.normal_force(climber, into_wall) * self.grip.wheelbase / 2
        return _margin(righting_moment, climber.mass * abs(along_wall) * self.grip.centre_height)


@parameters
class Alarm:
    """Margins of slipping and tipping below which diagnostics warn; see `Attachment`."""

    warn_margin: float = parameter(
        1.5, "", "slip or tip margin below which diagnostics warn", at_least=0, runtime=True
    )
    error_margin: float = parameter(
        1.0,
        "",
        "slip or tip margin below which diagnostics tell an error",
        at_least=0,
        runtime=True,
    )

    def level(self, margin: float) -> int:
        """Diagnostic level of a margin: 0 fine, 1 warning, 2 error."""
        return int(margin < self.warn_margin) + int(
            margin < min(self.error_margin, self.warn_margin)
        )


def _margin(available: Any, demanded: Any) -> Any:
    """`available` by `demanded` (>= 0), clipped to ± `MAX_MARGIN`."""
    within = abs(available) < MAX_MARGIN * demanded
    if everywhere(within):
        return available / demanded
    largest = with_sign_of(MAX_MARGIN, available)
    return select(within, available / select(within, demanded, 1.0), largest)
