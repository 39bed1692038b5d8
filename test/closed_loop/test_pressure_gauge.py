from dataclasses import replace

import numpy as np
import pytest

from climber_uk.closed_loop.pressure_gauge import controllers
from climber_uk.control.control_law import ControlLaw, ControlOptions
from climber_uk.control.guidance import Guidance
from climber_uk.mechanics.climber import Climber

HIGH, LOW = 8000.0, 3000.0
CONTROLLER = ControlLaw(Climber(mass=6.0, suction_pressure=2500.0), Guidance(), ControlOptions())


def known(lost, period, gauge, periods=30):
    """Pressures that the controller knows in each period; it is lost at the begin of `lost`."""
    before = Climber(suction_pressure=HIGH)
    after = replace(before, suction_pressure=LOW)
    climbers = [after if period >= lost else before for period in range(periods)]
    heard = list(controllers(CONTROLLER, climbers, period, gauge))
    assert {law.climber.mass for law in heard} == {6.0}
    return [law.climber.suction_pressure for law in heard]


# 20 times a second is every tenth period of 5 ms. What is told at period 10 is the pressure in
# period 9, and period 11 knows it.
@pytest.mark.parametrize(("lost", "heard"), [(9, 11), (10, 21), (11, 21), (19, 21), (20, 31)])
def test_a_loss_is_heard_of_when_the_node_of_the_plant_has_told_it(lost, heard):
    pressures = known(lost, 0.005, 0.05, periods=40)
    assert pressures == [HIGH] * heard + [LOW] * (40 - heard)


def test_of_longer_periods_it_is_heard_in_each():
    assert known(5, 0.1, 0.05) == [HIGH] * 7 + [LOW] * 23


def test_without_a_gauge_it_believes_what_it_did():
    assert known(5, 0.005, 0.0) == [2500.0] * 30


def test_each_of_many_hears_of_its_own():
    before = Climber(suction_pressure=np.array([HIGH, HIGH]))
    after = replace(before, suction_pressure=np.array([HIGH, LOW]))
    *_, last = controllers(CONTROLLER, [before] * 5 + [after] * 20, 0.005, 0.05)
    assert last.climber.suction_pressure.tolist() == [HIGH, LOW]
