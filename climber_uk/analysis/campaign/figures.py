"""A campaign in pictures: what came out how often, and which parameter it depends on."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from scipy.stats import spearmanr

from climber_uk.analysis.campaign.campaign import Campaign
from climber_uk.analysis.campaign.limits import METRICS, Limit
from climber_uk.analysis.campaign.names import PARAMETERS
from climber_uk.analysis.campaign.parts import Store
from climber_uk.analysis.campaign.results import broken, wilson
from climber_uk.mechanics import Array

POINTS = 5000  # in a scatter figure: the first ones are as good as any
BINS = 12  # of a parameter, with as many runs each


def draw(campaign: Campaign, store: Store, directory: Path) -> list[Path]:
    """Write all figures as PNG into `directory`; return their paths."""
    directory.mkdir(parents=True, exist_ok=True)
    failed, by_limit = broken(campaign, store)
    paths = [
        _histograms(campaign, store, directory),
        _failures(campaign, store, by_limit, directory),
    ]
    for metric in dict.fromkeys(limit.metric for limit in campaign.limits):
        if metric != "fell":  # yes or no is no scatter
            paths.append(_scatter(campaign, store, failed, metric, directory))
    return paths


def _histograms(campaign: Campaign, store: Store, directory: Path) -> Path:
    figure, panels = _panels(list(METRICS))
    for axes, (metric, (unit, _)) in zip(panels, METRICS.items(), strict=True):
        values = store.column(metric)
        finite = values[np.isfinite(values)]
        axes.hist(finite, bins=60, color="tab:blue", log=len(finite) > 0)
        axes.set(xlabel=_label(metric, unit), ylabel="runs", ylim=(0.8, None))
        if len(finite) < len(values):
            axes.set_title(f"{len(values) - len(finite)} runs have none", fontsize="small")
        for limit in campaign.limits:
            if limit.metric == metric:
                axes.axvline(limit.bound, color="tab:red", linestyle="--", label=str(limit))
                axes.legend(fontsize="small")
    figure.suptitle(f"How often, in {campaign.size.runs} runs")
    return _written(figure, directory / "histograms.png")


def _failures(
    campaign: Campaign, store: Store, by_limit: dict[Limit, Array], directory: Path
) -> Path:
    figure, panels = _panels(list(campaign.drawn))
    for axes, name in zip(panels, campaign.drawn, strict=True):
        values = store.column(name)
        bins = np.array_split(np.argsort(values, kind="stable"), BINS)
        middles = [np.median(values[runs]) for runs in bins]
        for limit, broke in by_limit.items():
            counts = [(int(np.count_nonzero(broke[runs])), len(runs)) for runs in bins]
            shares = np.array([count / number for count, number in counts])
            spread = np.abs(np.array([wilson(*count) for count in counts]).T - shares)
            axes.errorbar(
                middles, 100 * shares, 100 * spread, fmt=".-", linewidth=1, label=str(limit)
            )
        axes.set(xlabel=_parameter(name), ylabel="broken [%]", ylim=(0, None))
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.suptitle("Runs that broke a limit, by each parameter (95 % intervals)")
    return _written(figure, directory / "failures.png")


def _scatter(campaign: Campaign, store: Store, failed: Any, metric: str, directory: Path) -> Path:
    figure, panels = _panels(list(campaign.drawn))
    unit, values = METRICS[metric][0], store.column(metric)
    kinds = [("ok", "0.6", 2, ~failed), ("failed", "tab:red", 3, failed)]
    for axes, name in zip(panels, campaign.drawn, strict=True):
        parameter = store.column(name)
        for label, colour, size, runs in kinds:
            shown = np.flatnonzero(runs[:POINTS])
            points = parameter[shown], values[shown]
            axes.plot(*points, ".", color=colour, markersize=size, label=label)
        correlation = spearmanr(parameter, values).statistic
        axes.set(xlabel=_parameter(name), ylabel=_label(metric, unit))
        axes.set_title(f"rank correlation {correlation:.2f}", fontsize="small")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, markerscale=5)
    figure.suptitle(f"{metric} of {min(POINTS, len(values))} runs, by each parameter")
    return _written(figure, directory / f"scatter_{metric}.png")


def _panels(names: Sequence[str]) -> tuple[Any, list[Axes]]:
    columns = min(4, len(names))
    rows = math.ceil(len(names) / columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(3.6 * columns, 2.7 * rows), squeeze=False, layout="constrained"
    )
    for unused in axes.flat[len(names) :]:
        unused.set_axis_off()
    return figure, list(axes.flat[: len(names)])


def _parameter(name: str) -> str:
    return _label(name.replace("plant_simulator.", ""), PARAMETERS[name].metadata["unit"])


def _label(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _written(figure: Any, path: Path) -> Path:
    figure.savefig(path, dpi=100)
    plt.close(figure)
    return path
