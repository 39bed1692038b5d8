"""The contact of climber and wall: adhesion and grip, friction of the seal, wheels or tracks.

Where wheels do not slip, `Locomotion.turning_resistance` is all that the kinds differ in. Where
they may, each of the `footholds` does, in any direction: what scrubs in a turn holds sideways no
better than something viscous, so that a climber on a wall sags while it turns.

A new kind of locomotion is one class, a `Locomotion`, and one entry in `LOCOMOTION`, or an entry
point `climber_uk.locomotion` of another package. Everything broadcasts.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from climber_uk.mechanics.adhesion import Attachment
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.friction import Coulomb, Friction
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.registry import Variants


class Locomotion(Protocol):
    """What the climber runs on. What is not on its axle scrubs sideways as it yaws."""

    scrub_friction_coefficient: float = 0.0
    """μ_t sideways, of what scrubs."""

    @property
    def footholds(self) -> Sequence[float]:
        """Where each side stands on the wall, ahead of the axle [m]; all bear the same load."""
        return (0.0,)

    def turning_resistance(self, load: Any) -> Any:
        """Moment (...) [N m] against yawing under `load` (...) [N]; at rest, at most that."""
        lever = sum(map(abs, self.footholds)) / len(self.footholds)
        return self.scrub_friction_coefficient * load * lever


@dataclass(frozen=True)
class Wheeled(Locomotion):
    """Wheels on one axle: yawing meets no resistance."""


@parameters
class FourWheeled(Locomotion):
    """Four driven wheels, a belt from front to rear, which resist yawing by μ_t N l / 2."""

    scrub_friction_coefficient: float = parameter(
        0.8, "", "friction coefficient μ_t of the wheels sideways", at_least=0
    )
    wheelbase: float = parameter(
        0.25, "m", "distance l from the front axle to the rear one", above=0
    )

    @property
    def footholds(self) -> Sequence[float]:
        """See `Locomotion`."""
        return self.wheelbase / 2, -self.wheelbase / 2


@parameters
class Tracked(Locomotion):
    """Tracks, which resist yawing by μ_t N L / 4, the load spread evenly."""

    scrub_friction_coefficient: float = parameter(
        0.5, "", "friction coefficient μ_t of the tracks sideways", at_least=0
    )
    length: float = parameter(0.3, "m", "length L of the tracks that is on the wall", above=0)

    @property
    def footholds(self) -> Sequence[float]:
        """Middles of four quarters."""
        eighth = self.length / 8
        return 3 * eighth, eighth, -eighth, -3 * eighth


def is_pulled_off(climber: Climber, normal_force: Any) -> Any:
    """Whether a force onto the wall (...) [N] is none."""
    return normal_force < 1e-9 * climber.mass * GRAVITY  # cos(90°) is 6e-17


LOCOMOTION = Variants[type[Locomotion]](
    {"wheeled": Wheeled, "four_wheeled": FourWheeled, "tracked": Tracked}, "locomotion"
)


@dataclass(frozen=True, kw_only=True)
class Contact(Attachment):
    """Adhesion and grip, and with them what resists the motion: seal friction, scrubbing tracks."""

    friction: Friction = field(default_factory=Coulomb)
    locomotion: Locomotion = field(default_factory=Wheeled)
