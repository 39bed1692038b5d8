import math

import numpy as np
import pytest

from climber_uk.analysis.campaign import figures, parts
from climber_uk.analysis.campaign.limits import Limit, verdicts
from climber_uk.analysis.campaign.parts import Store, computed
from climber_uk.analysis.campaign.results import report, wilson
from climber_uk.analysis.tally import Outcome


def by_hand(count, number):
    z, p = 1.959963984540054, count / number
    middle = (p + z**2 / (2 * number)) / (1 + z**2 / number)
    half = z / (1 + z**2 / number) * math.sqrt(p * (1 - p) / number + z**2 / (4 * number**2))
    return middle - half, middle + half


@pytest.mark.parametrize(("count", "number"), [(8, 10), (0, 20), (20, 20), (97_312, 100_000)])
def test_the_interval_is_wilsons(count, number):
    assert wilson(count, number) == pytest.approx(by_hand(count, number), abs=1e-12)
    if (count, number) == (8, 10):
        assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=5e-5)  # as textbooks have it


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("fell < 1", [True, False, False, False]),
        ("fell <= 1", [True, True, False, False]),
        ("fell > 1", [False, False, True, False]),
        ("fell >= 1.0", [False, True, True, False]),
        ("fell==1", [False, True, False, False]),
    ],
)
def test_a_limit_holds_what_its_text_says_and_never_what_is_no_number(text, holds):
    limit = Limit.read(text)
    values = np.array([0.0, 1.0, 2.0, math.nan])
    assert limit.holds(values).tolist() == holds
    assert limit.excess(values)[3] == math.inf


def test_the_verdict_tells_all_that_was_broken():
    limits = Limit.read("max_distance < 0.05"), Limit.read("fell == 0")
    metrics = {"max_distance": np.array([0.01, 0.06, 0.07]), "fell": np.array([0.0, 0.0, 1.0])}
    expected = ["ok", "max_distance < 0.05", "max_distance < 0.05; fell == 0"]
    assert verdicts(limits, metrics) == expected


@pytest.fixture
def store(monkeypatch, campaign, tmp_path):
    """Results in parts of 7 runs, of which the first 20 are off by 0.02 m, ..., 0.40 m."""
    monkeypatch.setattr(parts, "PART", 7)
    found = campaign(runs=23, limits=["max_distance < 0.305", "fell == 0"])
    store = Store(tmp_path / "out", found)
    for part in store.parts:
        table = computed(found, part.first, part.runs)
        numbers = np.arange(part.first, part.first + part.runs)
        distance = np.where(numbers < 20, 0.02 * (numbers + 1), 0.001)
        metrics = {"max_distance": distance, "fell": 0.0 * distance}
        for name, values in (*metrics.items(), ("verdict", verdicts(found.limits, metrics))):
            table = table.set_column(table.column_names.index(name), name, [values])
        store.keep(part, table)
    return found, store


def test_the_report_counts_and_names_the_worst_first(store):
    text = report(*store, rerun="again {}")
    lines = text.splitlines()
    low, high = by_hand(18, 23)
    assert f"succeeded {18:>29}{18 / 23:>11.3%}   {low:.3%} to {high:.3%}" in text
    assert [line for line in lines if "again" in line] == ["  again 19", "  again 18", "  again 17"]
    assert "run 19: max_distance 0.4, verdict max_distance < 0.305" in lines
    own = computed(store[0], 19, 1).to_pylist()[0]
    assert f"mass={own['plant_simulator.mass']:.6g}" in text
    assert f"seed={own['plant_simulator.seed']}" in text
    quantiles = next(line for line in lines if line.startswith("max_distance")).split()[2:]
    # of 23 sorted values: the first, the first, the 12th, the last, the last
    assert quantiles == ["0.001", "0.001", "0.18", "0.4", "0.4"]


def test_figures_are_drawn_of_every_limit_but_yes_and_no(store, tmp_path):
    paths = figures.draw(*store, tmp_path / "figures")
    names = ["histograms.png", "failures.png", "scatter_max_distance.png"]
    assert [path.name for path in paths] == names
    assert all(path.stat().st_size > 10_000 for path in paths)


def test_metrics_come_from_what_they_are_named_after():
    fields = dict.fromkeys(Outcome._fields, np.zeros(1))
    fell = Outcome(**{**fields, "fell": np.array([math.inf, 3.0])})
    assert parts.METRICS["fell"][1](fell).tolist() == [0.0, 1.0]
    assert parts.METRICS["fall_time"][1](fell).tolist() == [math.inf, 3.0]
