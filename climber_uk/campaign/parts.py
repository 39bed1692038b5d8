"""The runs of a campaign in parts that fit the cache, and the Parquet files that keep them.

    DIRECTORY/campaign.json           what the results depend on
    DIRECTORY/runs/part-00000.parquet, ...

A file is there once it is whole: whoever is killed goes on with the parts that are missing.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from climber_uk.campaign.campaign import Campaign
from climber_uk.campaign.limits import METRICS, verdicts
from climber_uk.mechanics import Array

PART = 4096  # runs


@dataclass(frozen=True)
class CampaignPart:
    """Some runs, one after the other."""

    number: int
    first: int
    runs: int


def computed(campaign: Campaign, first: int, runs: int) -> pa.Table:
    """One row for each run: number, what was drawn for it, metrics, verdict."""
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
    """The directory of a campaign; raises `ValueError` if it is that of another one."""

    def __init__(self, directory: Path, campaign: Campaign) -> None:
        self.directory = directory / "runs"
        self.runs = campaign.size.runs
        about, now = directory / "campaign.json", {**campaign.described(), "part": str(PART)}
        if about.exists():
            _check_same(directory, json.loads(about.read_text(encoding="utf-8")), now)
        self.directory.mkdir(parents=True, exist_ok=True)
        _write(about, json.dumps(now, indent=1).encode())

    @property
    def parts(self) -> Iterator[CampaignPart]:
        """All of them."""
        for first in range(0, self.runs, PART):
            yield CampaignPart(first // PART, first, min(PART, self.runs - first))

    @property
    def missing(self) -> Iterator[CampaignPart]:
        """Parts that are still to be computed."""
        return (part for part in self.parts if not self._path(part.number).exists())

    def keep(self, part: CampaignPart, table: pa.Table) -> None:
        """Write a part."""
        sink = pa.BufferOutputStream()
        parquet.write_table(table, sink)
        _write(self._path(part.number), sink.getvalue())

    def batches(self, names: Sequence[str]) -> Iterator[dict[str, Array]]:
        """Columns (n,) of these names, a part at a time: all runs may be too much to hold."""
        for part in self.parts:
            file = parquet.ParquetFile(self._path(part.number))
            table = file.read([*dict.fromkeys(names)], use_threads=False)
            yield {name: table[name].to_numpy() for name in table.column_names}

    def row(self, run: int) -> dict[str, object]:
        """All that is known of one run."""
        table = parquet.ParquetFile(self._path(run // PART)).read()
        row: dict[str, object] = table.slice(run % PART, 1).to_pylist()[0]
        return row

    def _path(self, number: int) -> Path:
        return self.directory / f"part-{number:05}.parquet"


def _check_same(directory: Path, before: dict[str, str], now: dict[str, str]) -> None:
    for name in {**before, **now}:
        was, is_now = before.get(name, "none"), now.get(name, "none")
        if was != is_now:
            raise ValueError(f"{directory} has runs with {name} {was}, not {is_now}")


def _write(path: Path, content: bytes) -> None:
    temporary = path.with_suffix(".tmp")
    temporary.write_bytes(content)
    temporary.replace(path)
