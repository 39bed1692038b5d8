"""Bristles where wheels slip: by then they are bent as far as they go, and rub as Coulomb says."""

import numpy as np
import pytest

from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.friction import LuGre
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.plant import Plant

FLOOR = Climber(inclination=0.0)
CONTACT = Contact(friction=LuGre())
PLANT = Plant(FLOOR, 0.0025, CONTACT, slip=True)


def test_wheels_that_spin_pull_against_the_bristles_friction():
    """By hand: (m - 2 J / r²) v̇ = μ_w N_w - f; the rims turn by themselves."""
    wheels = np.array([5.0, 5.0])
    before = PLANT.advance(State(np.zeros(3), np.zeros(3)), wheels, 200)
    after = PLANT.advance(before, wheels, 200)
    assert (after.slip > 1.0).all()
    grip = CONTACT.grip
    traction = grip.wheel_friction_coefficient * CONTACT.wheel_load(FLOOR, GRAVITY)
    body = FLOOR.mass - 2 * grip.wheel_inertia / FLOOR.wheel_radius**2
    pull = traction - CONTACT.seal_friction(FLOOR)
    assert pull > 10.0
    gained = after.forward_speed - before.forward_speed
    assert gained == pytest.approx(0.5 * pull / body, rel=1e-3)
