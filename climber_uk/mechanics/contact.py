"""All that is between a climber and its wall: its hold, the seal's friction, and what it runs on.

A new kind of locomotion is one class and one entry. Everything broadcasts.
"""

from dataclasses import dataclass, field
from typing import Any, Protocol

from climber_uk.mechanics.adhesion import Attachment
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.friction import Coulomb, Friction
from climber_uk.parameters.declaration import parameter, parameters


class Locomotion(Protocol):
    """What the climber runs on."""

    def turning_resistance(self, load: Any) -> Any:
        """Moment (...) [N m] against turning under `load` (...) [N]; at rest, up to that."""


@dataclass(frozen=True)
class Wheeled:
    """Wheels on one axle: they turn about the vertical without resistance."""

    def turning_resistance(self, load: Any) -> Any:
        """See `Locomotion`."""
        return 0.0 * load


@parameters
class Tracked:
    """Tracks that scrub sideways when they turn: μ_t N L / 4, the load spread evenly over L."""

    scrub_friction_coefficient: float = parameter(0.5, "", "μ_t, sideways", at_least=0)
    length: float = parameter(0.3, "m", "L of the tracks on the wall", above=0)

    def turning_resistance(self, load: Any) -> Any:
        """See `Locomotion`."""
        return self.scrub_friction_coefficient * load * self.length / 4


def is_pulled_off(climber: Climber, hold: Any) -> Any:
    """Whether a force onto the wall (...) [N] is none."""
    return hold < 1e-9 * climber.mass * GRAVITY  # cos(90°) is 6e-17


LOCOMOTION: dict[str, type[Locomotion]] = {"wheeled": Wheeled, "tracked": Tracked}


@dataclass(frozen=True, kw_only=True)
class Contact(Attachment):
    """How a climber is held, and what resists its motion."""

    friction: Friction = field(default_factory=Coulomb)
    locomotion: Locomotion = field(default_factory=Wheeled)
