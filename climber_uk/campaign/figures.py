"""Figures of a campaign: histograms of metrics, and failures and metrics by each parameter."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from climber_uk.campaign.campaign import Campaign
from climber_uk.campaign.counting import histograms, rank_correlations
from climber_uk.campaign.limits import METRICS
from climber_uk.campaign.parts import Store
from climber_uk.campaign.results import broken
from climber_uk.closed_loop.node_parameters import PARAMETERS
from climber_uk.mechanics import Array
from climber_uk.messages.topics import PLANT
from climber_uk.report.plotting import plt, saved
from climber_uk.report.proportion import wilson

POINTS = 5000  # in a scatter figure: the first runs, which are random as all are
BARS = 60  # in a histogram
BINS = 12  # of a parameter, equally likely


def draw(campaign: Campaign, store: Store, directory: Path) -> list[Path]:
    """Write all figures as PNG into `directory`; return their paths."""
    directory.mkdir(parents=True, exist_ok=True)
    paths = [_histograms(campaign, store, directory)]
    if campaign.drawn:
        paths += [_failures(campaign, store, directory), *_scatters(campaign, store, directory)]
    return paths


def _histograms(campaign: Campaign, store: Store, directory: Path) -> Path:
    figure, panels = _panels(list(METRICS))
    found = histograms(store, [*METRICS], BARS)
    for axes, (metric, (unit, _)) in zip(panels, METRICS.items(), strict=True):
        counts, edges, infinite = found[metric]
        axes.stairs(counts, edges, fill=True, color="tab:blue")  # as bars it takes far longer
        axes.set(yscale="log" if counts.any() else "linear")
        axes.set(xlabel=_label(metric, unit), ylabel="runs", ylim=(0.8, None))
        if infinite:
            axes.set_title(f"{infinite} runs have none", fontsize="small")
        for limit in campaign.limits:
            if limit.metric == metric:
                axes.axvline(limit.bound, color="tab:red", linestyle="--", label=str(limit))
                axes.legend(loc="upper right", fontsize="small")
    figure.suptitle(f"How often, in {campaign.size.runs} runs")
    return saved(figure, directory / "histograms.png")


def _failures(campaign: Campaign, store: Store, directory: Path) -> Path:
    figure, panels = _panels(list(campaign.drawn))
    found = binned(campaign, store)
    for axes, name in zip(panels, campaign.drawn, strict=True):
        number, total, *by_limit = found[name][:, found[name][0] > 0]
        for limit, broke in zip(campaign.limits, by_limit, strict=True):
            counts = zip(broke.astype(int).tolist(), number.astype(int).tolist(), strict=True)
            low, high = 100 * np.array([wilson(*count) for count in counts]).T
            axes.fill_between(total / number, low, high, alpha=0.25, linewidth=0)
            axes.plot(total / number, 100 * broke / number, ".-", linewidth=1, label=str(limit))
        axes.set(xlabel=_parameter(name), ylabel="broken [%]", ylim=(0, None))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.suptitle("Runs that broke a limit, by each parameter (95 % intervals)")
    return saved(figure, directory / "failures.png")


def binned(campaign: Campaign, store: Store) -> Mapping[str, Array]:
    """By parameter (2 + limits, bins): runs, sum of their values, runs that broke each limit."""
    inner = np.arange(1, BINS) / BINS
    edges = {name: np.unique(of.quantile(inner)) for name, of in campaign.drawn.items()}
    sums = {name: np.zeros((2 + len(campaign.limits), len(e) + 1)) for name, e in edges.items()}
    for batch in store.batches([*edges, *(limit.metric for limit in campaign.limits)]):
        broke = broken(campaign.limits, batch)
        for name, into in sums.items():
            bins = np.searchsorted(edges[name], batch[name])
            for row, what in zip(into, (1 + 0 * bins, batch[name], *broke), strict=True):
                row += np.bincount(bins, what, into.shape[1])
    return sums


def _scatters(campaign: Campaign, store: Store, directory: Path) -> Iterator[Path]:
    metrics = [*dict.fromkeys(limit.metric for limit in campaign.limits)]
    some = first(store, [*campaign.drawn, *metrics])
    failed = broken(campaign.limits, some).any(axis=0)
    correlations = rank_correlations(store, metrics, [*campaign.drawn], some)
    shown = f"{len(failed)} of {campaign.size.runs} runs are drawn; correlations are of all"
    for metric, correlation in zip(metrics, correlations, strict=True):
        if metric != "fell":  # yes or no is no scatter
            by_name = dict(zip(campaign.drawn, correlation, strict=True))
            figure = _scatter(some, failed, metric, by_name)
            figure.suptitle(f"{metric} by each parameter ({shown})")
            yield saved(figure, directory / f"scatter_{metric}.png")


def first(store: Store, names: Sequence[str]) -> dict[str, Array]:
    """Columns of the first `POINTS` runs, or of all if there are fewer."""
    batches = store.batches(["run", *names])
    held = [*takewhile(lambda batch: batch["run"][0] < POINTS, batches)]
    return {name: np.concatenate([batch[name] for batch in held])[:POINTS] for name in names}


def _scatter(
    some: dict[str, Array], failed: Any, metric: str, correlations: dict[str, float]
) -> Any:
    figure, panels = _panels([*correlations])
    kinds = [("ok", "0.6", 2, ~failed), ("failed", "tab:red", 3, failed)]
    for axes, (name, correlation) in zip(panels, correlations.items(), strict=True):
        for label, colour, size, runs in kinds:
            points = some[name][runs], some[metric][runs]
            axes.plot(*points, ".", color=colour, markersize=size, label=label)
        axes.set(xlabel=_parameter(name), ylabel=_label(metric, METRICS[metric][0]))
        shown = "no" if np.isnan(correlation) else f"{correlation:z.2f}"
        axes.set_title(f"rank correlation: {shown}", fontsize="small")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, markerscale=5)
    return figure


def _panels(names: Sequence[str]) -> tuple[Any, list[Axes]]:
    columns = min(4, len(names))
    rows = math.ceil(len(names) / columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(3.6 * columns, 2.7 * rows), squeeze=False, layout="constrained"
    )
    for unused in axes.flat[len(names) :]:
        unused.set_axis_off()
    for used in axes.flat[: len(names)]:
        used.locator_params(axis="x", nbins=4)  # labels of more would touch
    return figure, list(axes.flat[: len(names)])


def _parameter(name: str) -> str:
    return _label(name.replace(f"{PLANT}.", ""), PARAMETERS[name].metadata["unit"])


def _label(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name
