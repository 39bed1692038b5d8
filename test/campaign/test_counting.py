import numpy as np
import pytest

from climber_uk.campaign.counting import histograms, quantiles, rank_correlations

SHARES = [0.0, 0.01, 0.07, 0.5, 0.99, 1.0]


class Runs:
    """Columns in memory, 100 runs at a time."""

    def __init__(self, **columns):
        self.columns = columns

    def batches(self, names):
        for first in range(0, len(next(iter(self.columns.values()))), 100):
            yield {name: self.columns[name][first : first + 100] for name in names}


def columns(number):
    noise = np.random.default_rng(number)
    normal = noise.normal(size=number)
    return {
        "normal": normal,
        "tiny": 1e-310 * normal,
        "ties": np.round(normal),  # with -0.0
        "same": np.full(number, 3.0),
        "some": np.where(normal > 0, np.inf, normal),
        "none": np.full(number, np.inf),
        "unknown": np.where(noise.random(number) < 0.3, -np.nan, -np.abs(normal) * 1e9),
    }


@pytest.mark.parametrize("number", [1, 2, 99, 700, 1234])
def test_quantiles_are_those_of_all_values_at_once(number):
    of_all = columns(number)
    found = quantiles(Runs(**of_all), [*of_all], SHARES)
    for name, values in of_all.items():
        if not np.isnan(values).all():
            expected = np.nanquantile(values, SHARES, method="inverted_cdf")
            np.testing.assert_array_equal(found[name], expected)


def test_what_is_never_known_has_no_quantiles():
    runs = Runs(a=np.full(3, np.nan))
    assert np.isnan(quantiles(runs, ["a"], SHARES)["a"]).all()


@pytest.mark.parametrize("number", [1, 700, 1234])
def test_histograms_are_those_of_all_values_at_once(number):
    of_all = columns(number)
    for name, found in histograms(Runs(**of_all), [*of_all], 60).items():
        finite = of_all[name][np.isfinite(of_all[name])]
        counts, edges = np.histogram(finite, 60)
        np.testing.assert_array_equal(found.counts, counts)
        np.testing.assert_array_equal(found.edges, edges)
        assert found.infinite == number - len(finite)


def test_values_that_differ_by_their_last_bits_have_a_histogram():
    found = histograms(Runs(a=np.array([2.0, np.nextafter(2.0, 3.0)])), ["a"], 60)["a"]
    assert found.counts.sum() == 2
    np.testing.assert_allclose(found.edges[[0, -1]], [1.5, 2.5])


def correlated(number):
    noise = np.random.default_rng(1)
    a, b, c = noise.normal(size=(3, number))
    return {"a": a, "b": np.exp(a + b), "c": np.round(c - a), "d": np.where(c > 0, np.inf, -a)}


def spearman(of_all, rows, columns):
    from scipy.stats import spearmanr  # slow to import, and each test process imports this file

    return [[spearmanr(of_all[r], of_all[c]).statistic for c in columns] for r in rows]


def test_rank_correlations_are_spearmans_and_exact_if_all_are_shown():
    of_all = correlated(1234)
    found = rank_correlations(Runs(**of_all), ["b", "c"], ["a", "c", "d"], of_all)
    np.testing.assert_allclose(found, spearman(of_all, "bc", "acd"), rtol=0, atol=1e-12)


def test_rank_correlations_with_ranks_of_some_are_as_good_as_are_told():
    of_all = correlated(50_000)
    some = {name: values[:1000] for name, values in of_all.items()}
    found = rank_correlations(Runs(**of_all), ["b", "c"], ["a", "c", "d"], some)
    np.testing.assert_allclose(found, spearman(of_all, "bc", "acd"), rtol=0, atol=1e-4)


def test_what_is_the_same_in_all_runs_has_no_rank_correlation():
    of_all = columns(100)
    assert np.isnan(rank_correlations(Runs(**of_all), ["same"], ["normal"], of_all))
