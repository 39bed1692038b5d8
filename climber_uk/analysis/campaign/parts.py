"""The runs of a campaign in parts that fit the cache, and the Parquet files that keep them.

    DIRECTORY/campaign.json           what the results depend on
    DIRECTORY/runs/part-00000.parquet, ...

A file is there once it is whole: whoever is killed goes on with the parts that are missing.
"""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from climber_uk.analysis.campaign.campaign import Campaign
from climber_uk.analysis.campaign.limits import METRICS, verdicts
from climber_uk.mechanics import Array

PART = 4096  # runs


@dataclass(frozen=True)
class Part:
    """Some runs, one after the other."""

    number: int
    first: int
    runs: int


def parts(runs: int) -> list[Part]:
    """All parts of a campaign."""
    return [Part(first // PART, first, min(PART, runs - first)) for first in range(0, runs, PART)]


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
        self.parts = parts(campaign.size.runs)
        about, now = directory / "campaign.json", {**campaign.described(), "part": str(PART)}
        if about.exists():
            _check_same(directory, json.loads(about.read_text(encoding="utf-8")), now)
        self.directory.mkdir(parents=True, exist_ok=True)
        _write(about, json.dumps(now, indent=1).encode())

    @property
    def missing(self) -> list[Part]:
        """Parts that are still to be computed."""
        return [part for part in self.parts if not self._path(part).exists()]

    def keep(self, part: Part, table: pa.Table) -> None:
        """Write a part."""
        sink = pa.BufferOutputStream()
        parquet.write_table(table, sink)
        _write(self._path(part), sink.getvalue())

    def column(self, name: str) -> Array:
        """What all runs have of one thing, (runs,): a column at a time is not too much to hold."""
        tables = (parquet.read_table(self._path(part), columns=[name]) for part in self.parts)
        return np.concatenate([table[name].to_numpy() for table in tables])

    def row(self, run: int) -> dict[str, object]:
        """All that is known of one run."""
        part = self.parts[run // PART]
        row: dict[str, object] = (
            parquet.read_table(self._path(part)).slice(run - part.first, 1).to_pylist()[0]
        )
        return row

    def _path(self, part: Part) -> Path:
        return self.directory / f"part-{part.number:05}.parquet"


def _check_same(directory: Path, before: dict[str, str], now: dict[str, str]) -> None:
    for name in {**before, **now}:
        was, is_now = before.get(name, "none"), now.get(name, "none")
        if was != is_now:
            raise ValueError(f"{directory} has runs with {name} {was}, not {is_now}")


def _write(path: Path, content: bytes) -> None:
    temporary = path.with_suffix(".tmp")
    temporary.write_bytes(content)
    temporary.replace(path)
