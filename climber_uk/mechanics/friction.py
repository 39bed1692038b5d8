"""Friction laws of the seal: the force against its sliding, as multiples of Coulomb's f.

    coulomb   F = f                                    at rest: whatever holds, up to f
    viscous   F = f v / v₁
    stribeck  F = f γ(v) + f κ v                       at rest: whatever holds, up to f ratio
    lugre     F = σ₀ z + σ₁ ż + f κ v,  ż = v - σ₀ |v| z / g(v)

with γ(v) = 1 + (ratio - 1) exp(-(v/v_s)²) and g = f γ. The LuGre law is that of Canudas de Wit,
Olsson, Åström & Lischinsky, IEEE Trans. Automatic Control 40(3), 1995; σ₀ = f / deflection, so
that it stays sound as the suction, and f with it, goes to zero. A new law is one class and one
entry in `FRICTION`.
"""

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

from climber_uk.mechanics.elementary import exp
from climber_uk.parameters.declaration import parameter, parameters


class Friction(Protocol):
    """A law; f (...) is Coulomb's friction [N], `speed` (...) that of sliding, >= 0 [m/s]."""

    bristles: ClassVar[bool]  # whether it has a state: the bristles' deflection

    def stiction(self, f: Any) -> Any:
        """What it holds at rest, at most (...) [N]; 0 if it holds nothing."""

    def level(self, f: Any, speed: Any) -> Any:
        """Force (...) against steady sliding [N]."""

    def steepness(self, f: Any) -> Any:
        """Most by which the force of sliding changes with its speed (...) [N s/m]."""


@dataclass(frozen=True)
class Coulomb:
    """The same force at every speed."""

    bristles: ClassVar[bool] = False

    def stiction(self, f: Any) -> Any:
        """See `Friction`."""
        return f

    def level(self, f: Any, speed: Any) -> Any:
        """See `Friction`."""
        return f

    def steepness(self, f: Any) -> Any:
        """See `Friction`."""
        return 0.0 * f


@parameters
class Viscous:
    """In proportion to the speed, as of a lubricated seal: it holds nothing."""

    speed: float = parameter(0.1, "m/s", "at which it rubs as much as Coulomb's law", above=0)

    bristles: ClassVar[bool] = False

    def stiction(self, f: Any) -> Any:
        """See `Friction`."""
        return 0.0 * f

    def level(self, f: Any, speed: Any) -> Any:
        """See `Friction`."""
        return f * (speed / self.speed)

    def steepness(self, f: Any) -> Any:
        """See `Friction`."""
        return f / self.speed


@parameters
class Stribeck:
    """More at rest than in motion, and more again the faster it goes."""

    ratio: float = parameter(1.5, "", "of the hold at rest to Coulomb's friction", at_least=1)
    speed: float = parameter(0.02, "m/s", "v_s at which most of the surplus is gone", above=0)
    viscous: float = parameter(0.0, "s/m", "κ: f more per speed", at_least=0)

    bristles: ClassVar[bool] = False

    def stiction(self, f: Any) -> Any:
        """See `Friction`."""
        return f * self.ratio

    def level(self, f: Any, speed: Any) -> Any:
        """See `Friction`."""
        return f * (self.gamma(speed) + self.viscous * speed)

    def gamma(self, speed: Any) -> Any:
        """γ(v) (...)."""
        part = speed / self.speed
        return 1 + (self.ratio - 1) * exp(-part * part)

    def steepness(self, f: Any) -> Any:
        """See `Friction`: √(2/e) at v_s/√2 is that of the Gaussian."""
        return f * (0.858 * (self.ratio - 1) / self.speed + self.viscous)


@dataclass(frozen=True)
class LuGre(Stribeck):
    """Bristles that bend before they slide: hysteresis, pre-sliding, and no edge at rest."""

    deflection: float = parameter(
        1e-3, "m", "of the bristles under Coulomb's friction: f / σ₀", above=0
    )
    damping_time: float = parameter(5e-3, "s", "of the bristles: σ₁ / σ₀", at_least=0)

    bristles: ClassVar[bool] = True

    def stiction(self, f: Any) -> Any:
        """It gives way to any force: see `Friction`."""
        return 0.0 * f

    def relaxation(self, speed: Any) -> Any:
        """Rate σ₀ |v| / g(v) (...) [1/s] at which the bristles tend to where they end up."""
        return speed / (self.deflection * self.gamma(speed))

    def stiffness(self, f: Any) -> Any:
        """σ₀ (...) [N/m]."""
        return f / self.deflection

    def force(self, f: Any, velocity: Any, deflection: Any, bending: Any) -> Any:
        """F (...) [N] against `velocity`, of the deflection z [m] and its rate ż [m/s]."""
        return (
            self.stiffness(f) * (deflection + self.damping_time * bending)
            + f * self.viscous * velocity
        )


FRICTION: dict[str, type[Friction]] = {
    "coulomb": Coulomb,
    "viscous": Viscous,
    "stribeck": Stribeck,
    "lugre": LuGre,
}
