"""A crawler on magnets on walls that are round: the controller knows none of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from climber_uk.closed_loop.simulate import Link, simulate
from climber_uk.control.build import build_controller
from climber_uk.mechanics.adhesion import Magnetic
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.mechanics.wall import Cone, Cylinder, Sphere, Tank
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.simulation.plant import Plant

CONFIG = Path(__file__).parents[2] / "config" / "magnetic.yaml"
WALLS = {
    "upright tank": (Tank(-5.0), 90.0),
    "inside it": (Tank(5.0), 90.0),
    "leaning tank": (Tank(-5.0), 60.0),
    "cylinder": (Cylinder(-5.0), 90.0),
    "sphere": (Sphere(-5.0), 90.0),
    "roof": (Cone(6.0), 70.0),
}
BRIEF = {"upright tank": 12.0}  # [s]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seconds"),
    [*BRIEF.items(), *(pytest.param(name, 60.0, marks=pytest.mark.soak) for name in WALLS)],
)
def test_on_what_is_round_magnets_stay_within_a_tenth_of_a_millimetre(name, seconds):
    wall, inclination = WALLS[name]
    believed = {**read_file(CONFIG, "/uk_torque_controller"), "inclination": inclination}
    trajectory = build_trajectory(Values(read_file(CONFIG, "/trajectory_publisher")).read)
    climber = replace(Values(believed).read(Climber), inclination=inclination)
    contact = Contact(adhesion=Magnetic(force_at_contact=400.0))
    run = simulate(
        trajectory,
        State(trajectory.at(0.0).pose, np.zeros(3)),
        seconds,
        build_controller(Values(believed), None),
        climber,
        Link(period=0.01),
        plant_of=lambda climber, step: Plant(climber, step, contact, wall, slip=True),
    )
    print(f"{name}: {1e3 * run.rms():.4f} mm RMS, {1e3 * run.distance.max():.4f} at most")
    assert run.distance.max() < 1e-4
