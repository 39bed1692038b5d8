"""What is refused, and what is believed in the end."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import gammainc, gammaincinv

from climber_uk.localization.gate import Fix, Gate, chi_square, quantile, told_anew
from climber_uk.localization.kalman import Estimate
from climber_uk.localization.options import LocalizationOptions

BOOLS = st.booleans()
OPTIONS = LocalizationOptions()
ESTIMATE = Estimate.start(OPTIONS)
NOISE = 0.025**2 * np.eye(2)


def fix(x=0.0, y=0.0):
    return Fix(0, (0, 1), np.array([x, y]), NOISE)


def judged(gate, x, y=0.0):
    return gate.judge(ESTIMATE, fix(x, y))


@given(probability=st.floats(0.01, 0.999999), parts=st.sampled_from([1, 2, 3]))
def test_quantiles_are_scipys(probability, parts):
    assert quantile(probability, parts) == pytest.approx(
        2 * gammaincinv(parts / 2, probability), rel=1e-6
    )
    assert chi_square(2.0, parts) == pytest.approx(gammainc(parts / 2, 1.0))


def test_good_fixes_pass_as_often_as_they_should():
    random, gate = np.random.default_rng(3), Gate(LocalizationOptions(gate_probability=0.99))
    spread = np.sqrt(NOISE[0, 0] + ESTIMATE.covariance[0, 0])
    passed = [judged(gate, *random.normal(0, spread, 2)).taken for _ in range(4000)]
    assert np.mean(passed) == pytest.approx(0.99, abs=0.005)


def test_fixes_that_are_off_by_metres_each_another_way_are_never_believed():
    random, gate = np.random.default_rng(4), Gate(OPTIONS)
    for _ in range(500):
        verdict = judged(gate, *random.normal(0, 3, 2))
        assert not verdict.taken or (abs(gate.ratio) <= 1 and not verdict.believed)


def test_as_many_as_agree_are_believed_and_that_is_said():
    random, gate = np.random.default_rng(5), Gate(OPTIONS)
    verdicts = [
        judged(gate, 1.0 + random.normal(0, 0.025), random.normal(0, 0.025))
        for _ in range(OPTIONS.agreeing_fixes)
    ]
    assert [verdict.taken for verdict in verdicts] == [False] * 4 + [True]
    assert verdicts[-1].believed
    assert "believed, as 5 in a row agree" in verdicts[-1].said
    assert "times what may be" in verdicts[0].said


def test_a_good_fix_between_makes_the_count_begin_anew():
    gate = Gate(OPTIONS)
    for _ in range(10):
        assert not any(judged(gate, 1.0).taken for _ in range(OPTIONS.agreeing_fixes - 1))
        assert judged(gate, 0.0).taken


def test_an_estimate_that_is_told_anew_has_the_fix_and_its_noise():
    after = told_anew(ESTIMATE, fix(1.0, 2.0))
    np.testing.assert_allclose(after.mean[:2] - ESTIMATE.mean[:2], [1.0, 2.0])
    np.testing.assert_allclose(after.covariance[:2, :2], NOISE)
    np.testing.assert_allclose(after.covariance[2:, 2:], ESTIMATE.covariance[2:, 2:])


def test_a_fix_in_another_frame_is_turned_and_moved_with_its_noise():
    noise = np.diag([0.04, 0.01, 0.09])
    moved = Fix(0, (0, 1, 2), np.array([2.0, 1.0, 0.3]), noise).moved(10.0, 20.0, np.pi / 2)
    np.testing.assert_allclose(moved.values, (9.0, 22.0, 0.3 + np.pi / 2))
    np.testing.assert_allclose(moved.noise, np.diag([0.01, 0.04, 0.09]), atol=1e-12)
    only_y = Fix(0, (1,), np.array([1.0]), noise[:1, :1])
    assert only_y.moved(10.0, 20.0, 0.0).values.tolist() == [21.0]
    with pytest.raises(ValueError, match="x and y have to be measured both"):
        only_y.moved(10.0, 20.0, 0.1)


@given(heading=st.floats(-3, 3), lever=st.tuples(*[st.floats(-0.5, 0.5)] * 2), has_heading=BOOLS)
def test_what_a_tag_away_from_the_centre_tells_is_the_centre(heading, lever, has_heading):
    """Believed for what it is, or against the estimate, by 3 m and by half a turn."""
    parts = (0, 1, 2) if has_heading else (0, 1)
    true = np.array([3.0, -1.0, heading])
    turn = np.exp(1j * heading) * complex(*lever)
    told = Fix(
        0,
        parts,
        np.array([true[0] + turn.real, true[1] + turn.imag, heading])[list(parts)],
        np.eye(len(parts)),
        lever,
    )
    mean = np.array([*true, *np.zeros(5)])
    np.testing.assert_allclose(told.innovation(Estimate(mean, ESTIMATE.covariance)), 0, atol=1e-12)
    mean[:2] -= 3.0
    mean[2] += 2.0 * has_heading
    after = told_anew(Estimate(mean, ESTIMATE.covariance), told)
    np.testing.assert_allclose(after.mean[:2], true[:2], atol=1e-12)
    assert np.exp(1j * after.mean[2]) == pytest.approx(np.exp(1j * heading))
    assert np.linalg.eigvalsh(after.covariance).min() >= 0
