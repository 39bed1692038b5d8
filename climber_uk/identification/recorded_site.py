"""The wall and the settings of a recorded run, and which of them identification neglects.

Parameters of the controller are in a bag (`~/parameters`); those of the plant only in parameter
files.
"""

from collections.abc import Callable, Iterator
from dataclasses import fields
from typing import Any

from climber_uk.bags.run_reader import Parameters
from climber_uk.identification.integral_equations import Site
from climber_uk.mechanics.adhesion import ADHESION
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.wall import WALLS
from climber_uk.messages.names import Names
from climber_uk.parameters.parameter_file import Values

# Settings that identification neglects: the values that matter, and what follows.
ASSUMED_AWAY: dict[str, tuple[Callable[[Any], bool], str]] = {
    "seal_radius": (
        lambda radius: radius > 0,
        "a ring rubs less along the heading the more it turns, and resists turning: it is fitted "
        "as if it did not",
    ),
    "friction": (lambda law: law != "coulomb", "it is fitted as Coulomb's and a viscous one"),
    "odometry_source": (
        lambda source: source == "wheels",
        "radius and track are what the odometry was made with, and slip is taken for motion",
    ),
    "heading_bias": (lambda bias: bias != 0, "the weight is taken to pull another way"),
}
OF_SUCTION = ("seal_friction_coefficient", "wheel_load_share", "suction_pressure", "suction_area")


def site_of(controller: Parameters, plant: Parameters) -> Site:
    """Wall of the plant, or else of the controller, whether there is a seal, and what scrubs.

    Raises `ValueError` for unknown names.
    """
    values = {**controller, **plant}
    wall = values.get("wall", "plane")
    if wall not in WALLS:
        raise ValueError(f"wall={wall!r} must be one of {', '.join(WALLS)}")
    adhesion = controller.get("adhesion", plant.get("adhesion", "suction"))
    if adhesion not in ADHESION:
        raise ValueError(f"adhesion={adhesion!r} must be one of {', '.join(ADHESION)}")
    names = Values(controller).read(Names).wheels
    scrubs = len(names.left) > 1 or plant.get("locomotion", "wheeled") != "wheeled"
    return Site(Values(values).read(WALLS[wall], f"{wall}."), ADHESION[adhesion].has_seal, scrubs)


def differences(file: Parameters, recorded: Parameters, site: Site) -> Iterator[str]:
    """Sentences on the climber's parameters that differ between a parameter file and a bag."""
    for field in fields(Climber):
        if field.name in OF_SUCTION and not site.has_seal:
            continue
        then, now = recorded.get(field.name), file.get(field.name, field.default)
        if then is not None and file and then != now:
            yield f"{field.name} was {then:g} when this was recorded; {now:g} of the file is used"


def assumed_away(controller: Parameters, plant: Parameters) -> Iterator[str]:
    """Sentences on settings that the model does not have."""
    for name, (violates, follows) in ASSUMED_AWAY.items():
        value = plant.get(name, controller.get(name))
        if value is not None and violates(value):
            yield f"{name} is {value}: {follows}"
    wall = plant.get("wall", controller.get("wall", "plane"))
    if wall != "plane":
        yield f"the wall is a {wall}, as the parameter file has it"
