from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from climber_uk.mechanics.adhesion import (
    ADHESION,
    MAX_MARGIN,
    Attachment,
    Grip,
    Magnetic,
    NoAdhesion,
    Suction,
)
from climber_uk.mechanics.climber import GRAVITY, Climber

PAPER = Climber()  # P S = 150 N, k = 0.53
HELD = Attachment()


def test_the_papers_wheels_carry_k_p_s_and_its_seal_rubs_with_f():
    assert HELD.wheel_load(PAPER, 0.0) == pytest.approx(79.5)
    assert HELD.seal_friction(PAPER) == PAPER.seal_friction
    assert HELD.normal_force(PAPER, 0.0) == pytest.approx(150.0)


@pytest.mark.parametrize(("inclination", "load"), [(0, 128.55), (60, 104.025), (180, 30.45)])
def test_weight_into_the_wall_loads_the_wheels_and_on_a_ceiling_relieves_them(inclination, load):
    into = GRAVITY * np.cos(np.radians(inclination))
    assert HELD.wheel_load(PAPER, into) == pytest.approx(load)


def test_wheels_never_pull_at_the_wall():
    weak = replace(PAPER, suction_pressure=1000.0)  # k P S = 31.8 N < 49.05 N < P S = 60 N
    assert HELD.wheel_load(weak, -GRAVITY) == 0
    assert HELD.normal_force(weak, -GRAVITY) == pytest.approx(10.95)


def test_without_seal_all_adhesion_is_on_the_wheels():
    magnetic = Attachment(adhesion=Magnetic(force_at_contact=200.0))
    assert magnetic.wheel_load(PAPER, 0.0) == pytest.approx(200.0)
    assert magnetic.seal_friction(PAPER) == 0
    on_floor = Attachment(adhesion=NoAdhesion())
    assert on_floor.wheel_load(PAPER, GRAVITY) == pytest.approx(49.05)


@pytest.mark.parametrize(("gap", "force"), [(0.0, 300.0), (0.002, 75.0), (0.004, 100 / 3)])
def test_a_magnets_force_falls_with_the_square_of_the_gap(gap, force):
    assert Magnetic(gap=gap).force(PAPER) == pytest.approx(force)


def test_pressure_follows_pump_and_leak_as_their_equation_integrated():
    suction, pump = Suction(pump_time=0.5, leak_time=2.0), 8000.0

    def rate(_, pressure):
        return (pump - pressure) / 0.5 - pressure / 2.0

    expected = solve_ivp(rate, (0, 0.7), [1000.0], "DOP853", rtol=1e-12).y[0, -1]
    assert suction.pressure(1000.0, pump, 0.7) == pytest.approx(expected, rel=1e-9)
    assert suction.final_pressure(pump) == pytest.approx(6400.0)
    half_way = suction.pressure(1000.0, pump, 0.35)
    assert suction.pressure(half_way, pump, 0.35) == pytest.approx(expected, rel=1e-9)


def test_without_lag_the_pressure_is_the_pumps():
    assert Suction().pressure(3.0, 2500.0, 0.0025) == Suction().final_pressure(2500.0) == 2500.0
    assert Suction(pump_time=1.0).final_pressure(2500.0) == 2500.0


def test_the_slip_margin_is_that_by_hand():
    # 0.8 · 39.75 N / √(15² + 20²) N of each wheel
    assert HELD.slip_margin(PAPER, 0.0, (15.0, 15.0), -40.0, 0.0) == pytest.approx(1.272)
    assert HELD.slip_margin(PAPER, 0.0, (0.0, 0.0), 0.0, 0.0) == MAX_MARGIN


def test_it_is_that_of_the_wheel_that_is_asked_for_more_or_bears_less():
    # 0.8 · 39.75 N / 60 N, however both add up
    for forces in ((60.0, -60.0), (-5.0, 60.0)):
        assert HELD.slip_margin(PAPER, 0.0, forces, 0.0, 0.0) == pytest.approx(0.53)
    # weight to the right: 49.05 N · 0.05 m / 0.6 m go from the left wheel to the right one
    right, left = HELD.wheel_loads(PAPER, 79.5, -49.05)
    assert (right, left) == pytest.approx((39.75 + 4.0875, 39.75 - 4.0875))
    assert HELD.slip_margin(PAPER, 0.0, (20.0, 20.0), 0.0, -49.05) == pytest.approx(0.04 * left)
    assert HELD.wheel_loads(PAPER, 6.0, 49.05) == (0.0, 6.0)  # none pulls at the wall


def test_the_tip_margin_is_that_by_hand_and_one_at_the_critical_pressure():
    # 150 N · 0.125 m / (49.05 N · 0.05 m)
    assert HELD.tip_margin(PAPER, 0.0, GRAVITY) == pytest.approx(18.75 / 2.4525)
    critical = 49.05 * 0.05 / 0.125 / 0.06  # 327 Pa
    weak = replace(PAPER, suction_pressure=critical)
    assert HELD.tip_margin(weak, 0.0, GRAVITY) == pytest.approx(1.0, abs=1e-12)
    assert critical == pytest.approx(327.0, abs=1e-6)


def test_a_margin_of_nothing_held_is_below_one():
    loose = replace(PAPER, suction_pressure=0.0)
    assert HELD.slip_margin(loose, 0.0, (1.0, 1.0), 0.0, 0.0) == 0
    assert HELD.tip_margin(loose, -GRAVITY, 1.0) < 0
    assert (
        HELD.tip_margin(loose, -GRAVITY, 0.0) == -MAX_MARGIN
    )  # it falls, and need not tip for that
    none = np.zeros(2)
    assert HELD.tip_margin(loose, np.array([-GRAVITY, GRAVITY]), none).tolist() == [
        -MAX_MARGIN,
        MAX_MARGIN,
    ]


def test_margins_of_many_are_those_of_each():
    random = np.random.default_rng(1)
    into, right, left, lateral, across = many = random.normal(size=(5, 4, 5)) * 50
    slip = HELD.slip_margin(PAPER, into, (right, left), lateral, across)
    tip = HELD.tip_margin(PAPER, into, right)
    for i in np.ndindex(4, 5):
        into, right, left, lateral, across = many[:, *i].tolist()
        alone = HELD.slip_margin(PAPER, into, (right, left), lateral, across)
        assert slip[i] == pytest.approx(alone)
        assert tip[i] == pytest.approx(HELD.tip_margin(PAPER, into, right))


@pytest.mark.parametrize("name", ADHESION)
def test_every_adhesion_holds_and_rubs_with_finite_force(name):
    adhesion = ADHESION[name]()
    assert 0 <= adhesion.seal_friction(PAPER) <= adhesion.force(PAPER) < np.inf


@pytest.mark.parametrize(
    ("kind", "wrong", "said"),
    [
        (Suction, {"pump_time": -1.0}, r"pump_time=-1.0 must be >= 0 \[s\]"),
        (Magnetic, {"gap": -0.1}, r"gap=-0.1 must be >= 0 \[m\]"),
        (Grip, {"wheelbase": 0.0}, r"wheelbase=0.0 must be > 0 \[m\]"),
    ],
)
def test_what_cannot_be_is_refused(kind, wrong, said):
    with pytest.raises(ValueError, match=said):
        kind(**wrong)
