"""The exact set divides by the speed: where a climber all but rests it asks for no turn."""

import numpy as np
import pytest

from climber_uk.control.constraint_set import demanded
from climber_uk.control.exact import REST_SPEED, Exact
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import ConstantRate
from climber_uk.mechanics.trajectory import Trajectory

REFERENCE = Trajectory(Ellipse(), ConstantRate()).at(1.0)


def turn(speed):
    """Yaw acceleration [rad/s²] asked of a climber beside its path."""
    pose = REFERENCE.pose + np.array([0.1, 0.2, 0.3])
    return float(demanded(Exact(), State.rolling(pose, speed, 0.5), REFERENCE)[1])


def test_the_limit_of_rest_is_a_millimetre_a_second():
    assert REST_SPEED == 1e-3


@pytest.mark.parametrize("sign", [1, -1])
def test_below_it_no_turn_is_asked_for_and_above_it_what_the_path_wants(sign):
    assert turn(sign * 0.99e-3) == 0.0
    slow, slower = turn(sign * 2e-3), turn(sign * 1.01e-3)
    assert slower == pytest.approx(slow * 2 / 1.01, rel=0.01)  # as one over the speed
    assert abs(slower) > 100.0
