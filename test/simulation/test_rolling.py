import numpy as np
import pytest
from scipy.optimize import brentq

from climber_uk.simulation.rolling import _zero


@pytest.mark.parametrize(
    ("function", "low", "high"),
    [
        (np.cos, 0.0, 3.0),
        (lambda x: x**3 - 0.2, -1.0, 4.0),
        (lambda x: np.exp(-5 * x) - 1e-3, 0.0, 5.0),
        (lambda x: np.tanh(50 * (0.3 - x)), 0.0, 1.0),
        (lambda x: 1 - x, 0.0, 1.0),
    ],
)
def test_the_instant_of_change_is_where_scipy_finds_it(function, low, high):
    assert _zero(function, low, high) == pytest.approx(brentq(function, low, high, xtol=1e-15))
