from dataclasses import replace

import numpy as np
import pytest
from test_unicycle import PAPER, many_starts, wheels

from climber_uk.closed_loop import unicycle
from climber_uk.closed_loop.unicycle import UnicycleModel
from climber_uk.mechanics.quantities import Wrench

pytestmark = pytest.mark.soak  # numba compiles for a quarter of a minute


@pytest.fixture(scope="module")
def compiled():
    """Imported here, as numba takes its time, and all workers collect all tests."""
    return pytest.importorskip("climber_uk.closed_loop.compiled", reason="numba is not installed")


@pytest.mark.parametrize("fastest", [0.2, 6.0])
def test_what_is_compiled_is_what_it_was_compiled_from(compiled, fastest):
    random, number = np.random.default_rng(3), 540  # more than a block
    masses = random.uniform(4, 6, number)
    body, motion = UnicycleModel.of(replace(PAPER, mass=masses)), many_starts(number, fastest)
    for _ in range(30):
        wrench = Wrench(*PAPER.wrench(*wheels(random, motion)))
        expected = unicycle.advanced_often(body, motion, wrench, 0.0025, 2)
        motion = compiled.advanced(body, motion, wrench, 0.0025, 2)
        np.testing.assert_allclose(motion, expected, rtol=1e-12, atol=1e-12)
    assert 10 < np.count_nonzero(motion.speed == 0) < number - 10  # sticking is in it


def test_what_turns_too_fast_for_the_series_is_left_to_numpy(compiled):
    motion = many_starts(5, 0.2)
    motion = motion._replace(yaw_rate=motion.yaw_rate + 1000.0)
    wrench = Wrench(np.zeros(5), np.zeros(5))
    expected = unicycle.advanced_often(UnicycleModel.of(PAPER), motion, wrench, 0.0025, 3)
    got = compiled.advanced(UnicycleModel.of(PAPER), motion, wrench, 0.0025, 3)
    np.testing.assert_array_equal(got, expected)
