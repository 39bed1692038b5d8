"""Metrics of runs side by side: as text, CSV and JSON."""

import csv
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from io import StringIO
from typing import Any

from climber_uk.analysis.metrics import GROUPS, METRICS, Case, Metric, evaluate, prefix

UNKNOWN = "–"


@dataclass(frozen=True)
class Column:
    """A run, under a name that no other one of the table has."""

    label: str
    bag: str
    case: Case
    losses: Sequence[str]  # what of the bag could not be read

    @cached_property
    def values(self) -> dict[str, float]:
        """All metrics, by their names."""
        return evaluate(self.case)

    def shown(self, name: str) -> str:
        """A metric as it reads well."""
        factor, unit = prefix([self.values[name]], METRICS[name].unit)
        return f"{number(factor * self.values[name], 3)} {unit}".rstrip()


@dataclass(frozen=True)
class Row:
    """A metric of all columns, in a unit in which it reads well."""

    metric: Metric
    unit: str
    cells: Sequence[str]
    ratios: Sequence[str]  # of the second and later columns to the first


def number(value: float, digits: int = 6) -> str:
    """A number to be read."""
    return f"{value:.{digits}g}" if math.isfinite(value) else UNKNOWN


def ratio(value: float, first: float) -> float:
    """How many times `first` it is; nan if that cannot be said."""
    return value / first if first else math.nan


def groups(columns: Sequence[Column]) -> Iterator[tuple[str, list[Row]]]:
    """Titles and rows, without metrics that no run has."""
    for title, metrics in GROUPS.items():
        rows = [
            _row(metric, [column.values[metric.name] for column in columns]) for metric in metrics
        ]
        yield title, [row for row in rows if set(row.cells) != {UNKNOWN}]


def _row(metric: Metric, values: Sequence[float]) -> Row:
    factor, unit = prefix(values, metric.unit)
    first, *others = values
    return Row(
        metric,
        unit,
        [number(factor * value) for value in values],
        [number(ratio(value, first), 4) for value in others],
    )


def text(columns: Sequence[Column]) -> str:
    """The table as lines of text; with more than one column, ratios to the first."""
    head = ["", *(column.label for column in columns), "", *_ratio_heads(columns)]
    lines: list[list[str]] = [head] if len(columns) > 1 else []
    for title, rows in groups(columns):
        lines += [[title]] if rows else []
        lines += [[f"  {row.metric.name}", *row.cells, row.unit, *row.ratios] for row in rows]
    widths = [max(len(line[i]) for line in lines if len(line) > i) for i in range(len(head))]
    return "\n".join(_aligned(line, widths) for line in lines)


def _aligned(line: Sequence[str], widths: Sequence[int]) -> str:
    left = {0, len(widths) // 2 + 1}  # name and unit
    cells = zip(line, widths, strict=False)
    padded = [
        cell.ljust(width) if i in left else cell.rjust(width)
        for i, (cell, width) in enumerate(cells)
    ]
    return "  ".join(padded).rstrip()


def _ratio_heads(columns: Sequence[Column]) -> list[str]:
    return [f"{column.label} / {columns[0].label}" for column in columns[1:]]


def unknown(columns: Sequence[Column]) -> list[str]:
    """Names of the metrics that no run has."""
    return [name for name in METRICS if all(math.isnan(c.values[name]) for c in columns)]


def to_csv(columns: Sequence[Column]) -> str:
    """All metrics in SI units, nan where they are not known."""
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["metric", "unit", *(column.label for column in columns)])
    for name, metric in METRICS.items():
        writer.writerow([name, metric.unit, *(repr(column.values[name]) for column in columns)])
    return stream.getvalue()


def to_json(columns: Sequence[Column]) -> str:
    """All metrics in SI units, null where they are not known, with events and losses."""
    runs = [
        {
            "label": column.label,
            "bag": column.bag,
            "namespace": column.case.run.name,
            "metrics": {n: v if math.isfinite(v) else None for n, v in column.values.items()},
            "events": [_event(time, event) for time, event in column.case.run.events],
            "losses": list(column.losses),
        }
        for column in columns
    ]
    units = {name: metric.unit for name, metric in METRICS.items()}
    return json.dumps({"units": units, "runs": runs}, indent=1, ensure_ascii=False) + "\n"


def _event(time: float, event: Any) -> dict[str, Any]:
    told = {name: getattr(event, name) for name in ("node", "kind", "level", "text")}
    return {"time": round(time, 6), **told}
