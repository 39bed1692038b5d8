"""Friction laws of the seal: the force against its sliding, as multiples of Coulomb's f.

    coulomb   F = f                                    at rest: whatever holds, up to f
    viscous   F = f v / v₁
    stribeck  F = f γ(v) + f κ v                       at rest: whatever holds, up to f ratio
    lugre     F = σ₀ z + σ₁ ż + f κ v,  ż = v - σ₀ |v| z / g(v)

with γ(v) = 1 + (ratio - 1) exp(-(v/v_s)²) and g = f γ. The LuGre law is that of Canudas de Wit,
Olsson, Åström & Lischinsky, IEEE Trans. Automatic Control 40(3), 1995; σ₀ = f / deflection, so
that it stays sound as the suction, and f with it, goes to zero. A new law is one class, a
`Friction`, and one entry in `FRICTION`, or an entry point `climber_uk.friction` of another package.
"""

from dataclasses import dataclass
from typing import Any, Protocol

from climber_uk.mechanics.elementary import exp
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.registry import Variants


class Friction(Protocol):
    """A friction law; f (...) is Coulomb's [N], `speed` (...) that of sliding, >= 0 [m/s]."""

    def stiction(self, f: Any) -> Any:
        """Largest force that friction balances at rest (...) [N]; 0 for one without stiction."""

    def level(self, f: Any, speed: Any) -> Any:
        """Force (...) against steady sliding [N]."""

    def steepness(self, f: Any) -> Any:
        """Steepest slope of the force over the sliding speed (...) [N s/m]."""

    # What most laws need not say:

    def drag(self, f: Any) -> Any:
        """Part, in proportion to the speed, of a force with stiction or bristles (...) [N s/m]."""
        return 0.0

    @property
    def bristles(self) -> "Bristles | None":
        """Bristles that give way before it slides, of a law without stiction; else None."""
        return None


class Bristles(Friction, Protocol):
    """A law with a memory: the deflection z [m], ż = v - `relaxation` z, in every direction."""

    damping_time: float  # of the bristles: σ₁ / σ₀ [s]

    def stiction(self, f: Any) -> Any:
        """0: any force bends the bristles; see `Friction`."""
        return 0.0 * f

    def relaxation(self, speed: Any) -> Any:
        """Rate (...) [1/s] at which the bristles tend to where they end up."""

    def stiffness(self, f: Any) -> Any:
        """σ₀ (...) [N/m]."""

    @property
    def bristles(self) -> "Bristles":
        """See `Friction`."""
        return self

    def force(self, f: Any, velocity: Any, deflection: Any, bending: Any) -> Any:
        """F (...) [N] against `velocity`, of the deflection z [m] and its rate ż [m/s]."""
        return (
            self.stiffness(f) * (deflection + self.damping_time * bending) + self.drag(f) * velocity
        )


@dataclass(frozen=True)
class Coulomb(Friction):
    """Coulomb friction: the same force at every speed."""

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
class Viscous(Friction):
    """Viscous friction, in proportion to the speed, as of a lubricated seal: no stiction."""

    speed: float = parameter(
        0.1, "m/s", "speed at which viscous friction equals Coulomb's", above=0
    )

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
class Stribeck(Friction):
    """Stribeck friction: highest at rest, lower in motion, and growing again with speed."""

    ratio: float = parameter(1.5, "", "ratio of stiction to Coulomb's friction", at_least=1)
    speed: float = parameter(0.02, "m/s", "speed v_s at which most of the surplus is gone", above=0)
    viscous: float = parameter(0.0, "s/m", "κ, viscous part of f per speed", at_least=0)

    def stiction(self, f: Any) -> Any:
        """See `Friction`."""
        return f * self.ratio

    def level(self, f: Any, speed: Any) -> Any:
        """See `Friction`."""
        return f * (self.gamma(speed) + self.viscous * speed)

    def gamma(self, speed: Any) -> Any:
        """γ(v) (...), the level without its viscous part, by f."""
        relative = speed / self.speed
        return 1 + (self.ratio - 1) * exp(-relative * relative)

    def steepness(self, f: Any) -> Any:
        """See `Friction`: √(2/e) at v_s/√2 is that of the Gaussian."""
        return f * (0.858 * (self.ratio - 1) / self.speed + self.viscous)

    def drag(self, f: Any) -> Any:
        """See `Friction`."""
        return f * self.viscous


@parameters
class LuGre(Bristles, Stribeck):
    """Bristles that bend before they slide: hysteresis, pre-sliding, and no edge at rest."""

    deflection: float = parameter(
        1e-3,
        "m",
        "deflection of the bristles under Coulomb's friction, f / σ₀; smaller is stiffer",
        above=0,
    )
    damping_time: float = parameter(
        5e-3, "s", "damping of the bristles by their stiffness, σ₁ / σ₀", at_least=0
    )

    def relaxation(self, speed: Any) -> Any:
        """σ₀ |v| / g(v): see `Bristles`."""
        return speed / (self.deflection * self.gamma(speed))

    def stiffness(self, f: Any) -> Any:
        """See `Bristles`."""
        return f / self.deflection


FRICTION = Variants[type[Friction]](
    {"coulomb": Coulomb, "viscous": Viscous, "stribeck": Stribeck, "lugre": LuGre}, "friction"
)
