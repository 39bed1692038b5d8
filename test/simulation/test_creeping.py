"""A ring that slides slowly is not integrated in steps: its friction turns too fast for them."""

import numpy as np
import pytest

from climber_uk.mechanics.adhesion import Grip
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.wall import Plane
from climber_uk.simulation.inputs import Inputs
from climber_uk.simulation.rigid_body import RigidBody
from climber_uk.simulation.rolling import STIFF, NoSlipStepper

RADIUS = 0.1  # [m] of the ring
FREE = Inputs(0.0, 0.0, 0.0, 0.0, 0.0)
FLOOR = Climber(inclination=0.0)
BODY = RigidBody(FLOOR, Contact(grip=Grip(seal_radius=RADIUS)), Plane(), 0.001)
# friction changes the speed of what it moves most easily by STIFF of it within a step
SLOWEST = BODY.stiction * BODY.step / min(FLOOR.mass, FLOOR.yaw_inertia / RADIUS**2) / STIFF


def after_a_step(speed, yaw_rate):
    state = State.rolling(np.zeros(3), speed, yaw_rate)
    return NoSlipStepper(BODY).step(np.concatenate([state.pose, state.velocity]), FREE)


@pytest.mark.parametrize(("share_along", "share_around"), [(1.0, 0.0), (0.0, 1.0), (0.6, 0.8)])
def test_steps_are_for_what_slides_fast_enough(share_along, share_around):
    def stepped(factor):
        return after_a_step(
            factor * SLOWEST * share_along, factor * SLOWEST * share_around / RADIUS
        )

    assert stepped(0.9) is None
    assert stepped(1.01) is None  # it would creep at the step's end
    assert stepped(3.0) is not None


def test_a_sliding_ring_slows_down_by_its_friction():
    """By hand: along a line, v̇ = -f / m."""
    speed = 10 * SLOWEST
    end = after_a_step(speed, 0.0)
    assert end[3] == pytest.approx(speed - BODY.friction / FLOOR.mass * BODY.step, rel=1e-9)
