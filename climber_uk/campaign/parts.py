"""Parts of a campaign, each as many runs as fit the cache, and the Parquet files that keep them.

    DIRECTORY/campaign.json           what the results depend on
    DIRECTORY/runs/part-00000.parquet, ...

A file is there once it is complete: after an end on the way, the missing parts are computed.
"""

import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from climber_uk.campaign.campaign import Campaign
from climber_uk.campaign.limits import METRICS, verdicts
from climber_uk.mechanics import Array
from climber_uk.parameters.text_file import text_of

PART = 4096  # runs


@dataclass(frozen=True)
class CampaignPart:
    """Consecutive runs of a campaign."""

    number: int
    first: int
    runs: int


def computed(campaign: Campaign, first: int, runs: int) -> pa.Table:
    """Table of `runs` runs from `first` on: number, values drawn, metrics, verdict."""
    own = campaign.columns(first, runs)
    outcome = campaign.scenario.loops(own).run(campaign.scenario.course(), block=runs)
    metrics = {name: of(outcome) for name, (_, of) in METRICS.items()}
    return pa.table(
        {
            "run": np.arange(first, first + runs),
            **own,
            **metrics,
            "verdict": verdicts(campaign.limits, metrics),
        }
    )


class Store:
    """The directory of a campaign; raises `ValueError` if it holds another campaign."""

    def __init__(self, directory: Path, campaign: Campaign) -> None:
        self.directory = directory / "runs"
        self.runs = campaign.size.runs
        about, now = directory / "campaign.json", {**campaign.described(), "part": str(PART)}
        if about.exists():
            _check_same(directory, _described(about), now)
        self.directory.mkdir(parents=True, exist_ok=True)
        _write(about, json.dumps(now, indent=1).encode())

    @property
    def parts(self) -> Iterator[CampaignPart]:
        """All parts of the campaign."""
        for first in range(0, self.runs, PART):
            yield CampaignPart(first // PART, first, min(PART, self.runs - first))

    @property
    def missing(self) -> Iterator[CampaignPart]:
        """Parts that are still to be computed."""
        return (part for part in self.parts if not self._path(part.number).exists())

    def keep(self, part: CampaignPart, table: pa.Table) -> None:
        """Write the table of a part."""
        sink = pa.BufferOutputStream()
        parquet.write_table(table, sink)
        _write(self._path(part.number), sink.getvalue())

    def batches(self, names: Sequence[str]) -> Iterator[dict[str, Array]]:
        """Columns (n,) of these names, a part at a time, as memory may not hold all."""
        for part in self.parts:
            table = self._table(part.number, [*dict.fromkeys(names)])
            yield {name: table[name].to_numpy() for name in table.column_names}

    def row(self, run: int) -> dict[str, object]:
        """Row of a run: number, values drawn, metrics, verdict."""
        table = self._table(run // PART)
        return table.slice(run % PART, 1).to_pylist()[0]

    def _table(self, number: int, names: Sequence[str] | None = None) -> pa.Table:
        path = self._path(number)
        try:
            table = parquet.ParquetFile(path).read(names, use_threads=False)
        except (OSError, ValueError) as error:
            said = str(error).partition("\n")[0]
            raise ValueError(f"{path}: {said}: remove it, and it is computed again") from None
        if missing := set(names or ()) - set(table.column_names):
            raise ValueError(f"{path} has no {', '.join(sorted(missing))}: remove it")
        return table

    def _path(self, number: int) -> Path:
        return self.directory / f"part-{number:05}.parquet"


def _described(about: Path) -> dict[str, str]:
    with suppress(ValueError, RecursionError):
        found = json.loads(text_of(about))
        if isinstance(found, dict):
            return found
    raise ValueError(f"{about} is not what a campaign writes")


def _check_same(directory: Path, before: dict[str, str], now: dict[str, str]) -> None:
    for name in {**before, **now}:
        was, is_now = before.get(name, "none"), now.get(name, "none")
        if was != is_now:
            raise ValueError(f"{directory} has runs with {name} {was}, not {is_now}")


def _write(path: Path, content: bytes) -> None:
    temporary = path.with_suffix(".tmp")
    temporary.write_bytes(content)
    temporary.replace(path)
