"""Report of a campaign: shares of runs that broke a limit, quantiles, and the worst runs."""

import textwrap
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from climber_uk.campaign.campaign import Campaign
from climber_uk.campaign.counting import quantiles
from climber_uk.campaign.limits import METRICS, Limit
from climber_uk.campaign.names import SEED
from climber_uk.campaign.parts import Store
from climber_uk.mechanics import Array
from climber_uk.messages.topics import PLANT
from climber_uk.report.proportion import wilson

QUANTILES = {"lowest": 0.0, "1 %": 0.01, "50 %": 0.5, "99 %": 0.99, "highest": 1.0}
WORST = 3  # runs that are reported for each limit


def broken(limits: Sequence[Limit], batch: dict[str, Array]) -> Any:
    """Whether each limit is broken by each run of a batch, (limits, n)."""
    return np.array([~limit.holds(batch[limit.metric]) for limit in limits])


def report(campaign: Campaign, store: Store, rerun: str) -> str:
    """The report; `rerun` is the command that repeats a run, with {} for its number."""
    size, limits = campaign.size, campaign.limits
    failed, by_limit = _counted(limits, store)
    found = quantiles(store, [*METRICS], [*QUANTILES.values()])
    lines = [
        f"{size.runs} runs of {size.duration:g} s, seed {size.seed}",
        "",
        f"{'':<30}{'runs':>9}{'share':>11}   95 %",
        _share("succeeded", size.runs - failed, size.runs),
        *(_share(f"broke {of}", n, size.runs) for of, n in zip(limits, by_limit, strict=True)),
        "",
        f"{'':<22}{'':<4}" + "".join(f"{name:>12}" for name in QUANTILES),
        *(_quantiles(name, unit, found[name]) for name, (unit, _) in METRICS.items()),
    ]
    for limit in limits:
        lines += _worst(limit, store, rerun)
    return "\n".join(lines)


def _counted(limits: Sequence[Limit], store: Store) -> tuple[int, list[int]]:
    """Number of runs that broke any limit, and numbers that broke each."""
    failed, by_limit = 0, np.zeros(len(limits), int)
    for batch in store.batches([limit.metric for limit in limits]):
        broke = broken(limits, batch)
        failed += int(np.count_nonzero(broke.any(axis=0)))
        by_limit += np.count_nonzero(broke, axis=1)
    return failed, by_limit.tolist()


def _share(what: str, count: int, number: int) -> str:
    low, high = wilson(count, number)
    return f"{what:<30}{count:>9}{count / number:>11.3%}   {low:.3%} to {high:.3%}"


def _quantiles(name: str, unit: str, values: Array) -> str:
    return f"{name:<22}{unit:<4}" + "".join(f"{value:>12.5g}" for value in values)


def _worst(limit: Limit, store: Store, rerun: str) -> Iterator[str]:
    numbers, excess = np.zeros(0, int), np.zeros(0)
    for batch in store.batches(["run", limit.metric]):
        values = batch[limit.metric]
        numbers = np.append(numbers, batch["run"][~limit.holds(values)])
        excess = np.append(excess, limit.excess(values[~limit.holds(values)]))
        furthest = np.argsort(-excess, kind="stable")[:WORST]
        numbers, excess = numbers[furthest], excess[furthest]
    for run in numbers.tolist():
        row = store.row(run)
        own = [f"{n}={v:.6g}" for n, v in row.items() if "." in n and isinstance(v, float)]
        yield ""
        yield f"run {run}: {limit.metric} {row[limit.metric]:.5g}, verdict {row['verdict']}"
        yield f"  {rerun.format(run)}"
        drawn = ", ".join([*own, f"{SEED}={row[SEED]}"]).replace(f"{PLANT}.", "")
        yield textwrap.fill(drawn, 98, initial_indent="  ", subsequent_indent="  ")
