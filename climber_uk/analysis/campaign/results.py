"""What came out of a campaign, in words: how often, how far, and which runs to look at."""

import textwrap
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.stats import binomtest

from climber_uk.analysis.campaign.campaign import Campaign
from climber_uk.analysis.campaign.limits import METRICS, Limit
from climber_uk.analysis.campaign.names import SEED
from climber_uk.analysis.campaign.parts import Store
from climber_uk.mechanics import Array

QUANTILES = {"lowest": 0.0, "1 %": 0.01, "50 %": 0.5, "99 %": 0.99, "highest": 1.0}
WORST = 3  # runs that are told of each limit


def wilson(count: int, number: int) -> tuple[float, float]:
    """Wilson's 95 % interval of a probability, of which `count` in `number` were seen."""
    interval = binomtest(count, number).proportion_ci(confidence_level=0.95, method="wilson")
    return float(interval.low), float(interval.high)


def broken(campaign: Campaign, store: Store) -> tuple[Any, dict[Limit, Any]]:
    """Which runs (runs,) broke any limit, and which broke each."""
    by_limit = {limit: ~limit.holds(store.column(limit.metric)) for limit in campaign.limits}
    return np.any(list(by_limit.values()), axis=0), by_limit


def report(campaign: Campaign, store: Store, rerun: str) -> str:
    """All of it; `rerun` is the command to run a run again, with its number in place of {}."""
    failed, by_limit = broken(campaign, store)
    size = campaign.size
    lines = [
        f"{size.runs} runs of {size.duration:g} s, seed {size.seed}",
        "",
        f"{'':<30}{'runs':>9}{'share':>11}   95 %",
        _share("succeeded", ~failed),
        *(_share(f"broke {limit}", runs) for limit, runs in by_limit.items()),
        "",
        f"{'':<22}{'':<4}" + "".join(f"{name:>12}" for name in QUANTILES),
        *(_quantiles(name, unit, store.column(name)) for name, (unit, _) in METRICS.items()),
    ]
    for limit in campaign.limits:
        lines += _worst(limit, store, rerun)
    return "\n".join(lines)


def _share(what: str, runs: Array) -> str:
    count, number = int(np.count_nonzero(runs)), len(runs)
    low, high = wilson(count, number)
    return f"{what:<30}{count:>9}{count / number:>11.3%}   {low:.3%} to {high:.3%}"


def _quantiles(name: str, unit: str, values: Array) -> str:
    found = np.nanquantile(values, list(QUANTILES.values()), method="inverted_cdf")
    return f"{name:<22}{unit:<4}" + "".join(f"{value:>12.5g}" for value in found)


def _worst(limit: Limit, store: Store, rerun: str) -> Iterator[str]:
    values = store.column(limit.metric)
    numbers = np.flatnonzero(~limit.holds(values))
    furthest = numbers[np.argsort(-limit.excess(values[numbers]), kind="stable")[:WORST]]
    for run in furthest.tolist():
        row = store.row(run)
        own = [f"{n}={v:.6g}" for n, v in row.items() if "." in n and isinstance(v, float)]
        yield ""
        yield f"run {run}: {limit.metric} {values[run]:.5g}, verdict {row['verdict']}"
        yield f"  {rerun.format(run)}"
        told = ", ".join([*own, f"{SEED}={row[SEED]}"]).replace("plant_simulator.", "")
        yield textwrap.fill(told, 98, initial_indent="  ", subsequent_indent="  ")
