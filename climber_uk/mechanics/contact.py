"""The contact of climber and wall: adhesion and grip, friction of the seal, wheels or tracks.

A new kind of locomotion is one class, a `Locomotion`, and one entry in `LOCOMOTION`, or an entry
point `climber_uk.locomotion` of another package. Everything broadcasts.
"""

from dataclasses import dataclass, field
from typing import Any, Protocol

from climber_uk.mechanics.adhesion import Attachment
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.friction import Coulomb, Friction
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.registry import Variants


class Locomotion(Protocol):
    """What the climber runs on."""

    def turning_resistance(self, load: Any) -> Any:
        """Moment (...) [N m] against yawing under `load` (...) [N]; at rest, at most that."""


@dataclass(frozen=True)
class Wheeled(Locomotion):
    """Wheels on one axle: yawing meets no resistance."""

    def turning_resistance(self, load: Any) -> Any:
        """See `Locomotion`."""
        return 0.0 * load


@parameters
class Tracked(Locomotion):
    """Tracks, which scrub sideways as the climber yaws: μ_t N L / 4, the load spread evenly."""

    scrub_friction_coefficient: float = parameter(
        0.5, "", "μ_t of the tracks, sideways", at_least=0
    )
    length: float = parameter(0.3, "m", "length L of the tracks that is on the wall", above=0)

    def turning_resistance(self, load: Any) -> Any:
        """See `Locomotion`."""
        return self.scrub_friction_coefficient * load * self.length / 4


def is_pulled_off(climber: Climber, normal_force: Any) -> Any:
    """Whether a force onto the wall (...) [N] is none."""
    return normal_force < 1e-9 * climber.mass * GRAVITY  # cos(90°) is 6e-17


LOCOMOTION = Variants[type[Locomotion]]({"wheeled": Wheeled, "tracked": Tracked}, "locomotion")


@dataclass(frozen=True, kw_only=True)
class Contact(Attachment):
    """Adhesion and grip, and with them what resists the motion: seal friction, scrubbing tracks."""

    friction: Friction = field(default_factory=Coulomb)
    locomotion: Locomotion = field(default_factory=Wheeled)
