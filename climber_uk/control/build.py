"""The controller as its parameters say, for its node, and for a replay of its bag."""

from dataclasses import replace
from typing import Protocol, TypeVar

from climber_uk.control.approach import Approach
from climber_uk.control.constraints import CONSTRAINTS, FORCE_LAWS, UDWADIA_KALABA
from climber_uk.control.control_law import ControlLaw, ControlOptions
from climber_uk.control.controller import Controller, Settings
from climber_uk.control.guard import GuardOptions
from climber_uk.control.guidance import Guidance
from climber_uk.control.model import Observer
from climber_uk.control.safety import Safety
from climber_uk.control.speed_command import MotorBoard
from climber_uk.control.stops import StopOptions, Stops
from climber_uk.control.time_scaling import Pacing
from climber_uk.control.timing import Timing
from climber_uk.mechanics.adhesion import ADHESION, with_its_seal
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.wall import WALLS, Wall, told
from climber_uk.parameters.declaration import parameter, parameters

T = TypeVar("T")


class ParameterSource(Protocol):
    """Where parameters come from."""

    def read(self, kind: type[T], prefix: str = "") -> T:
        """Instance of `kind`; raises `ValueError` naming parameter, value and bound."""


@parameters
class ControllerChoice:
    """Which control law runs, with which constraints, and which adhesion."""

    constraints: str = parameter("guidance", "", "constraint set", choices=CONSTRAINTS)
    controller: str = parameter(
        UDWADIA_KALABA,
        "",
        "control law: that of the constraints, or of another package in their place",
        choices=(UDWADIA_KALABA, *FORCE_LAWS),
    )
    adhesion: str = parameter("suction", "", "what holds the climber", choices=ADHESION)
    wall: str = parameter(
        "plane", "", "shape of the wall, by which the weight along it is known", choices=WALLS
    )


KINDS: list[tuple[type, str]] = [
    *((kind, "") for kind in (ControllerChoice, Climber, ControlOptions, MotorBoard)),
    *((kind, "") for kind in (Timing, Safety, Approach)),
    *((kind, f"{name}.") for name, kind in [*CONSTRAINTS.items(), *FORCE_LAWS.items()]),
    (Observer, "observer."),
    (Pacing, "pacing."),
    (GuardOptions, "guard."),
    (StopOptions, "stops."),
    *((kind, f"{name}.") for name, kind in WALLS.items()),
]
"""All that is read, with the prefix of its parameters."""


def known_wall(parameters: ParameterSource) -> Wall | None:
    """The wall that a controller is told; None if it is all in the climber's inclination."""
    return told(parameters.read, parameters.read(ControllerChoice).wall)


def settings(parameters: ParameterSource, pressure: float | None) -> Settings:
    """Settings by the parameters; a measured `pressure` [Pa] replaces the climber's.

    Raises `ValueError` naming parameter, value and bound.
    """
    read = parameters.read
    choice = read(ControllerChoice)
    name, climber = choice.constraints, with_its_seal(read(Climber), choice.adhesion)
    if pressure is not None:
        climber = replace(climber, suction_pressure=pressure)
    constraints, options = read(CONSTRAINTS[name], f"{name}."), read(ControlOptions)
    if options.solver == "closed_form" and hasattr(constraints, "rows"):
        raise ValueError(f"solver=closed_form must be generic for {name}, which gives rows")
    other = choice.controller
    force_law = read(FORCE_LAWS[other], f"{other}.") if other != UDWADIA_KALABA else None
    law = ControlLaw(climber, constraints, options, force_law, known_wall(parameters))
    observer, pacing = read(Observer, "observer."), read(Pacing, "pacing.")
    return Settings(law, observer, read(Timing), pacing, read(MotorBoard))


def build_controller(parameters: ParameterSource, pressure: float | None) -> Controller:
    """New controller by the parameters; see `settings`."""
    read = parameters.read
    name = read(ControllerChoice).adhesion
    return Controller(
        settings(parameters, pressure),
        read(Safety),
        read(Approach),
        read(GuardOptions, "guard."),
        read(ADHESION[name], f"{name}."),
        read(Guidance, "guidance."),
        Stops(read(StopOptions, "stops.")),
    )
