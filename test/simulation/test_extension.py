"""The friction laws of docs/extending.md, beside the package's own ones that they are."""

import numpy as np
import pytest
from extension import block

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.friction import Coulomb, LuGre
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.plant import Plant

EXAMPLE = {"__name__": "my_climber"}


@pytest.fixture(scope="module", autouse=True)
def example():
    exec(compile(block("python"), "docs/extending.md", "exec"), EXAMPLE)


def end_of(law, slip):
    """Where a climber comes to, from rest, with torques that swing."""
    plant, state = Plant(Climber(), 0.0025, Contact(friction=law), slip=slip), None
    state = State(np.array([0.0, 1.0, 0.3]), np.zeros(3))
    for number in range(90):
        pull = 2.0 * np.sin(0.05 * number)
        state = plant.advance(state, np.array([pull, 0.9 * pull + 0.1]), 1)
    return np.concatenate([state.pose, state.velocity, getattr(state, "deflection", [])])


@pytest.mark.parametrize("slip", [False, True])
def test_a_law_with_a_memory_needs_no_more_than_its_class(slip):
    """Dahl's law is LuGre's without Stribeck's surplus and without damping."""
    same = LuGre(ratio=1.0, viscous=0.0, deflection=2e-3, damping_time=0.0)
    np.testing.assert_array_equal(
        end_of(EXAMPLE["Dahl"](deflection=2e-3), slip), end_of(same, slip)
    )


@pytest.mark.parametrize("slip", [False, True])
def test_a_law_with_an_edge_at_rest_needs_no_more_than_its_class(slip):
    found = end_of(EXAMPLE["Fading"](surplus=0.0), slip)
    np.testing.assert_array_equal(found, end_of(Coulomb(), slip))
    assert np.abs(end_of(EXAMPLE["Fading"](surplus=0.5), slip) - found).max() > 1e-3
