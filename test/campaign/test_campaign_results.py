import math
import tracemalloc

import numpy as np
import pyarrow as pa
import pytest

from climber_uk.campaign import counting, figures, parts
from climber_uk.campaign.limits import Limit, verdicts
from climber_uk.campaign.parts import Store, computed
from climber_uk.campaign.results import report
from climber_uk.closed_loop.outcome import Outcome
from climber_uk.report.proportion import wilson


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
def filled(monkeypatch, campaign, tmp_path):
    """Results in parts of 7 runs, of which the first 20 are off by 0.02 m, ..., 0.40 m."""
    monkeypatch.setattr(parts, "PART", 7)

    def fill(name="out", order=1, **of_campaign):
        found = campaign(runs=23, limits=["max_distance < 0.305", "fell == 0"], **of_campaign)
        store = Store(tmp_path / name, found)
        for part in [*store.parts][::order]:
            table = computed(found, part.first, part.runs)
            numbers = np.arange(part.first, part.first + part.runs)
            distance = np.where(numbers < 20, 0.02 * (numbers + 1), 0.001)
            metrics = {"max_distance": distance, "fell": 0.0 * distance}
            for name, values in (*metrics.items(), ("verdict", verdicts(found.limits, metrics))):
                table = table.set_column(table.column_names.index(name), name, [values])
            store.keep(part, table)
        return found, store

    return fill


@pytest.fixture
def store(filled):
    return filled()


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


@pytest.fixture
def few(monkeypatch):
    """Metrics that are drawn: each panel takes a tenth of a second."""
    some = {name: figures.METRICS[name] for name in ("max_distance", "rms_distance", "fall_time")}
    monkeypatch.setattr(figures, "METRICS", some)


@pytest.mark.usefixtures("few")
def test_figures_are_drawn_of_every_limit_but_yes_and_no_whichever_runs_are_finished_first(
    filled, tmp_path
):
    told, names = [], ["histograms.png", "failures.png", "scatter_max_distance.png"]
    for name, order in (("a", 1), ("b", -1)):
        found, store = filled(name, order)
        paths = figures.draw(found, store, tmp_path / name)
        assert [path.name for path in paths] == names
        assert all(path.stat().st_size > 10_000 for path in paths)
        told.append((report(found, store, "again {}"), [path.read_bytes() for path in paths]))
    assert told[0] == told[1]


def test_bins_of_a_parameter_are_alike_and_of_a_choice_one_for_each_value(filled):
    found, store = filled(parameters={"plant_simulator.yaw_inertia": {"choice": [0.3, 0.4, 0.5]}})
    own = found.columns(0, 23)
    broke = np.isin(np.arange(23), np.arange(15, 20)).astype(float)  # 0.32 m and more
    bins = figures.binned(found, store)
    inertia = bins["plant_simulator.yaw_inertia"]
    inertia = inertia[:, inertia[0] > 0]
    np.testing.assert_allclose(inertia[1] / inertia[0], [0.3, 0.4, 0.5])
    mass, edges = own["plant_simulator.mass"], np.linspace(4.0, 6.0, figures.BINS + 1)
    for row, weights in enumerate((None, mass, broke, 0 * mass)):
        expected = np.histogram(mass, edges, weights=weights)[0]
        np.testing.assert_allclose(bins["plant_simulator.mass"][row], expected)


@pytest.mark.usefixtures("few")
def test_a_campaign_in_which_nothing_is_drawn_but_noise_has_its_histograms(filled, tmp_path):
    fixed = {"plant_simulator.mass": 5.0, "plant_simulator.initial_x": 0.0}
    paths = figures.draw(*filled(parameters=fixed), tmp_path / "figures")
    assert [path.name for path in paths] == ["histograms.png"]


@pytest.mark.soak
def test_memory_does_not_grow_with_the_number_of_runs(campaign, tmp_path):
    """Of what is told, without what matplotlib holds of figures that do not grow either."""
    peaks = []
    for many in (1, 4, 40):  # the first also imports
        found = campaign(runs=many * parts.PART, duration=0.005)
        store = Store(tmp_path / str(many), found)
        some = computed(found, 0, parts.PART)
        for part in store.parts:
            store.keep(part, some.set_column(0, "run", [np.arange(part.runs) + part.first]))
        names = [*found.drawn, "rms_distance"]
        tracemalloc.start()
        report(found, store, "again {}")
        figures.binned(found, store)
        counting.histograms(store, names, figures.BARS)
        counting.rank_correlations(store, names, names, figures.first(store, names))
        peaks.append(tracemalloc.get_traced_memory()[1] + pa.default_memory_pool().max_memory())
        tracemalloc.stop()
    # half of what a column of numbers would take; a part more or less may have been read ahead
    assert peaks[2] - peaks[1] < 4 * 36 * parts.PART


def test_metrics_come_from_what_they_are_named_after():
    fields = dict.fromkeys(Outcome._fields, np.zeros(1))
    fell = Outcome(**{**fields, "fell": np.array([math.inf, 3.0])})
    assert parts.METRICS["fell"][1](fell).tolist() == [0.0, 1.0]
    assert parts.METRICS["fall_time"][1](fell).tolist() == [math.inf, 3.0]
