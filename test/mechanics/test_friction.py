import numpy as np
import pytest

from climber_uk.mechanics.friction import FRICTION, Coulomb, LuGre, Stribeck, Viscous

F = 56.4  # [N], the paper's


@pytest.mark.parametrize("name", FRICTION)
def test_every_law_broadcasts_as_it_computes_one(name):
    law, speeds = FRICTION[name](), np.array([0.0, 0.003, 0.2, 5.0])
    together = law.level(F, speeds)
    np.testing.assert_allclose(together + 0 * speeds, [law.level(F, v) for v in speeds.tolist()])
    assert (law.level(np.array([0.0, F]), 0.3)[0], law.stiction(0.0), law.steepness(0.0)) == (
        0,
    ) * 3


@pytest.mark.parametrize("name", FRICTION)
def test_the_stated_steepness_is_what_finite_differences_find(name):
    law, speeds = FRICTION[name](), np.linspace(0, 0.2, 20_001)
    slope = np.abs(np.diff(law.level(F, speeds) + 0 * speeds) / np.diff(speeds)).max()
    assert law.steepness(F) == pytest.approx(slope, rel=1e-3, abs=1e-9)


def test_levels_are_those_by_hand():
    assert Coulomb().level(F, 3.0) == Coulomb().stiction(F) == F
    assert Viscous(speed=0.1).level(F, 0.25) == pytest.approx(2.5 * F)
    assert Viscous().stiction(F) == LuGre().stiction(F) == 0
    stribeck = Stribeck(ratio=1.5, speed=0.02, viscous=0.4)
    assert stribeck.stiction(F) == pytest.approx(1.5 * F)
    assert stribeck.level(F, 0.0) == pytest.approx(1.5 * F)
    assert stribeck.level(F, 0.02) == pytest.approx(F * (1 + 0.5 / np.e + 0.008))
    assert stribeck.level(F, 2.0) == pytest.approx(1.8 * F)


@pytest.mark.parametrize("speed", [1e-4, 0.01, 0.03, 1.0])
def test_bristles_that_bend_no_more_rub_as_stribeck_says(speed):
    law = LuGre(viscous=0.4)
    deflection = speed / law.relaxation(speed)  # ż = 0
    stribeck = Stribeck(viscous=0.4).level(F, speed)
    assert law.force(F, speed, deflection, 0.0) == pytest.approx(stribeck, rel=1e-12)


def test_bristles_first_act_as_a_spring():
    law = LuGre(deflection=1e-3)
    assert law.force(F, 0.0, 1e-5, 0.0) == pytest.approx(F / 100)
    assert law.relaxation(0.0) == 0


@pytest.mark.parametrize(
    ("kind", "wrong", "said"),
    [
        (Viscous, {"speed": 0.0}, r"speed=0.0 must be > 0 \[m/s\]"),
        (Stribeck, {"ratio": 0.9}, "ratio=0.9 must be >= 1"),
        (LuGre, {"deflection": -1.0}, r"deflection=-1.0 must be > 0 \[m\]"),
    ],
)
def test_what_cannot_be_is_refused(kind, wrong, said):
    with pytest.raises(ValueError, match=said):
        kind(**wrong)
