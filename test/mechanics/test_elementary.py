import math

import numpy as np
import pytest

from climber_uk.mechanics import elementary

VALUES = [-4.0, -0.5, -0.0, 0.3, 2.0, 7.0]


@pytest.mark.parametrize(
    "function",
    [
        *(elementary.cos, elementary.sin, elementary.arctan, elementary.tanh, elementary.sign),
        *(lambda x: elementary.sqrt(abs(x)), elementary.wrapped),
        lambda x: elementary.clipped(x, -1.5, 0.5),
        lambda x: elementary.select(x > 0.1, x, -2 * x),
    ],
)
def test_one_number_gives_what_it_gives_among_many_and_stays_a_float(function):
    together = function(np.array(VALUES))
    for value, expected in zip(VALUES, together, strict=True):
        alone = function(value)
        assert type(alone) is float
        assert alone == pytest.approx(expected, rel=1e-15, abs=1e-15)


def test_angles_are_wrapped_to_half_a_turn_either_way():
    assert elementary.wrapped(math.pi) == -math.pi
    assert elementary.wrapped(3 * math.pi / 2) == pytest.approx(-math.pi / 2)
