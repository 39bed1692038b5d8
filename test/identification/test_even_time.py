import numpy as np
import pytest

from climber_uk.identification.even_time import rate


@pytest.mark.parametrize("number", [3, 5, 8, 200])
def test_the_rate_of_a_cubic_is_exact_up_to_the_ends(number):
    """Of a line, where there are too few samples for a cubic."""
    cubic = np.poly1d([0.3, -2.0, 1.0, 5.0] if number > 4 else [1.0, 5.0])
    time = 7.0 + 0.01 * np.arange(number)
    assert rate(time, cubic(time), 0.1) == pytest.approx(cubic.deriv()(time), abs=1e-8)


def test_each_stretch_between_gaps_has_a_rate_of_its_own():
    time = np.concatenate([np.arange(0.0, 1.0, 0.01), np.arange(2.0, 3.0, 0.01)])
    assert rate(time, np.where(time < 1.5, time, -time), 0.1) == pytest.approx(
        np.where(time < 1.5, 1.0, -1.0)
    )


def test_the_rate_in_noise_is_that_of_the_cubic_fitted_around_it():
    noise, half, middle = np.random.default_rng(1).normal(size=200), 10, 100
    around = np.arange(-half, half + 1)
    cubic = np.poly1d(np.polyfit(around, noise[middle + around], 3))
    found = rate(np.arange(200) / 100, noise, half / 100)[middle]
    assert found == pytest.approx(100 * cubic.deriv()(0))
