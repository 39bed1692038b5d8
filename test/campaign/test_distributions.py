import math

import numpy as np
import pytest
from scipy.special import log_ndtr, ndtr

from climber_uk.campaign.distributions import (
    EXTREMES,
    Categorical,
    Uniform,
    distribution,
    drawn,
    extremes,
)

N = 200_000
# of a normal distribution between two bounds, in its standard deviations: density and its share
BOUNDS = np.array([-1.0, 0.5])
DENSITY = np.exp(-(BOUNDS**2) / 2) / math.sqrt(2 * math.pi) / np.ptp(ndtr(BOUNDS))
SHIFT = -np.diff(DENSITY)[0]
CUT = 2.0 + 0.4 * SHIFT, 0.4 * math.sqrt(1 - np.diff(BOUNDS * DENSITY)[0] - SHIFT**2)
# the second moment of exp(x), x normal, is exp(2 μ + 2 σ²)
SPREAD = 0.7 * math.sqrt(math.exp(0.5**2) * (math.exp(0.5**2) - 1))
# of the standard normal one beyond 10: density by share
TAIL = math.exp(-(10.0**2) / 2 - math.log(math.sqrt(2 * math.pi)) - log_ndtr(-10.0))
MOMENTS = {
    "uniform": ([1.0, 4.0], 2.5, 3 / math.sqrt(12)),
    "normal": ([2.0, 0.4], 2.0, 0.4),
    "normal, cut": ([2.0, 0.4, 1.6, 2.2], *CUT),
    "normal, upper tail": ([0.0, 1.0, 10.0, 20.0], TAIL, math.sqrt(1 + 10 * TAIL - TAIL**2)),
    "normal, lower tail": ([0.0, 1.0, -20.0, -10.0], -TAIL, math.sqrt(1 + 10 * TAIL - TAIL**2)),
    "lognormal": ([0.7, 0.5], 0.7 * math.exp(0.5**2 / 2), SPREAD),
    "choice": ([1.0, 2.0, 6.0], 3.0, math.sqrt(14 / 3)),
    "choice, weighed": ({0.0: 3.0, 4.0: 1.0}, 1.0, math.sqrt(3)),
}


@pytest.mark.parametrize("name", MOMENTS)
def test_draws_have_the_mean_and_the_deviation_that_are_known(name):
    told, mean, deviation = MOMENTS[name]
    values = drawn(distribution({name.split(",")[0]: told}), 1, "plant_simulator.mass", 0, N)
    assert values.mean() == pytest.approx(mean, abs=5 * deviation / math.sqrt(N))
    assert values.std() == pytest.approx(deviation, rel=0.02)


@pytest.mark.parametrize("name", MOMENTS)
def test_a_run_alone_is_the_same_as_among_all(name):
    of = distribution({name.split(",")[0]: MOMENTS[name][0]})
    whole = drawn(of, 3, "plant_simulator.mass", 0, 5000)
    for first, number in ((0, 1), (1, 1), (4999, 1), (17, 1000)):
        alone = drawn(of, 3, "plant_simulator.mass", first, number)
        np.testing.assert_array_equal(alone, whole[first : first + number])


def test_other_seeds_and_other_parameters_have_nothing_in_common():
    keys = (1, "a"), (2, "a"), (1, "b")
    columns = [drawn(Uniform(0.0, 1.0), seed, name, 0, N) for seed, name in keys]
    np.testing.assert_allclose(np.corrcoef(columns), np.eye(3), atol=5 / math.sqrt(N))


@pytest.mark.parametrize("name", MOMENTS)
def test_nothing_is_drawn_beyond_its_extremes(name):
    of = distribution({name.split(",")[0]: MOMENTS[name][0]})
    lowest, highest = extremes(of)
    assert math.isfinite(lowest)
    assert math.isfinite(highest)
    shares = np.concatenate([EXTREMES, np.random.default_rng(1).random(1000)])
    values = of.quantile(shares)
    assert (lowest <= values).all()
    assert (values <= highest).all()


def test_what_has_no_weight_is_never_chosen():
    of = Categorical((1.0, 2.0, 3.0), (0.0, 1.0, 0.0))
    np.testing.assert_array_equal(of.quantile(np.append(EXTREMES, 0.5)), 2.0)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"uniform": [2.0, 1.0]}, "highest=1.0 must be >= lowest=2.0"),
        ({"uniform": [1.0]}, "uniform [1.0] must be `[lowest, highest]`"),
        ({"uniform": 1.0}, "uniform 1.0 must be a list of numbers"),
        ({"uniform": [1.0, "2"]}, "must be a list of numbers"),
        ({"uniform": [0.0, math.inf]}, "must be finite"),
        ({"normal": [0.0, 0.0]}, "deviation=0.0 must be > 0"),
        ({"normal": [0.0, 1.0, 2.0, 1.0]}, "highest=1.0 must be > lowest=2.0"),
        ({"normal": [0.0, 1.0, 50.0, 60.0]}, "too far from mean=0.0 to be drawn"),
        ({"lognormal": [-1.0, 0.1]}, "median=-1.0"),
        ({"choice": []}, "must be"),
        ({"choice": {1.0: -1.0, 2.0: 2.0}}, "weights=[-1.0, 2.0] must be >= 0"),
        ({"choice": {1.0: 0.0}}, "one of them > 0"),
        ({"triangular": [1.0, 2.0]}, "must be a value or one of uniform, normal"),
        ({"uniform": [0.0, 1.0], "normal": [0.0, 1.0]}, "must be a value or one of"),
    ],
)
def test_what_cannot_be_drawn_from_is_refused(given, said):
    with pytest.raises(ValueError, match=r".") as refused:
        distribution(given)
    assert said in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1
