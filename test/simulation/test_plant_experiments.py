import numpy as np
import pytest
from plant_experiments import (
    BLOCK,
    PUBLISHED,
    errors_by_step,
    found_period,
    friction_at,
    published,
    pulled,
    spring,
    stick_slip_period,
    swinging,
)

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.friction import FRICTION, Stribeck, Viscous
from climber_uk.mechanics.quantities import State
from climber_uk.simulation.plant import Plant


def test_the_block_rubs_with_one_newton():
    assert BLOCK.seal_friction == 1.0


@pytest.mark.soak
def test_stribecks_stick_slip_comes_to_the_period_by_hand_as_its_edge_sharpens():
    found = [found_period(pulled(Stribeck(1.5, v), spring(), 25.0, 2e-3)) for v in (1e-3, 1e-4)]
    far, near = (abs(period - stick_slip_period()) for period in found)
    assert far < 0.01 * stick_slip_period()
    assert near < far / 3


def test_viscous_friction_follows_the_spring_without_stick_slip():
    late = pulled(Viscous(speed=0.5), spring(), 40.0, 5e-3)
    np.testing.assert_allclose(late.v[-400:], 0.1, atol=1e-9)
    np.testing.assert_allclose(late.force[-400:], 0.2, atol=1e-9)


def test_lugres_first_slip_is_that_of_the_published_equations():
    stiff = spring(8.0)
    ours = pulled(PUBLISHED, stiff, 2.6, 2e-3)
    theirs = published(stiff, 2.6, ours.time)
    assert ours.x[-1] > 0.1  # it has slipped
    assert np.abs(ours.x - theirs.x).max() < 1e-5


def test_lugres_hysteresis_before_sliding_is_that_of_the_published_equations():
    ours = pulled(PUBLISHED, swinging(), 6.0)
    theirs = published(swinging(), 6.0, ours.time)
    swing = np.ptp(ours.x)
    assert 2e-5 < swing < 2e-4  # of bristles that bend by 1e-5 m under 1 N
    assert np.abs(ours.x - theirs.x).max() < 1e-3 * swing
    going, coming = ours.x[500], ours.x[1500]  # at the same force
    assert ours.force[500] == pytest.approx(ours.force[1500], abs=1e-9)
    assert coming > going + 1e-5


@pytest.mark.parametrize(
    ("name", "speed"),
    [  # bristles take long to bend at a low speed
        pytest.param(n, v, marks=() if v == (0.1 if n == "lugre" else 1e-3) else pytest.mark.soak)
        for n in FRICTION
        for v in (5e-4, 1e-3, 0.1)
    ],
)
def test_the_plant_feels_the_force_of_its_law(name, speed):
    law = PUBLISHED if name == "lugre" else FRICTION[name]()
    assert friction_at(law, speed, step=1e-5) == pytest.approx(law.level(1.0, speed), rel=2e-3)


def test_halving_the_step_shows_the_order():
    start = State.rolling(np.array([0.0, 0.0, 0.3]), 6.0, 1.0)
    errors = errors_by_step(
        lambda h: Plant(Climber(), h), start, np.array([1.4, 1.5]), 1.0, [25, 50]
    )
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.1)
