"""Metrics of runs side by side: as text, CSV and JSON."""

import csv
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from io import StringIO
from typing import Any

from climber_uk.report.metrics import GROUPS, METRICS, Case, Metric, evaluate, prefix

UNKNOWN = "–"
FORMULA = tuple("=+-@\t\r\n")  # with which a cell begins that spreadsheets would compute


@dataclass(frozen=True)
class Column:
    """A run in the table, under a label of its own."""

    label: str
    bag: str
    case: Case
    losses: Sequence[str] = ()  # a line on each thing in the bag that could not be read
    base: "Column | None" = None  # whose values the ratios are to

    @cached_property
    def values(self) -> dict[str, float]:
        """All metrics, by their names."""
        return evaluate(self.case)

    def shown(self, name: str) -> str:
        """A metric as text, with a unit prefix that suits its size."""
        factor, unit = prefix([self.values[name]], METRICS[name].unit)
        value = factor * self.values[name]
        return f"{number(value, 3 if abs(value) < 1000 else 6)} {unit}".rstrip()


@dataclass(frozen=True)
class TableRow:
    """A metric of all columns, as text in one unit with a prefix that suits them."""

    metric: Metric
    unit: str
    cells: Sequence[str]
    ratios: Sequence[str]  # of the columns that have a base


def number(value: float, digits: int = 6) -> str:
    """A number as text; – for what is not finite."""
    return f"{value:.{digits}g}" if math.isfinite(value) else UNKNOWN


def groups(columns: Sequence[Column]) -> Iterator[tuple[str, list[TableRow]]]:
    """Titles and rows of the groups of metrics, without those that are unknown of all runs."""
    for title, metrics in GROUPS.items():
        rows = [_row(metric, columns) for metric in metrics]
        if known := [row for row in rows if set(row.cells) != {UNKNOWN}]:
            yield title, known


def _row(metric: Metric, columns: Sequence[Column]) -> TableRow:
    values = [column.values[metric.name] for column in columns]
    factor, unit = prefix(values, metric.unit)
    bases = [column.base.values[metric.name] if column.base else None for column in columns]
    return TableRow(
        metric,
        unit,
        [number(factor * value) for value in values],
        [
            number(value / base if base else math.nan, 4)
            for value, base in zip(values, bases, strict=True)
            if base is not None
        ],
    )


def ratio_heads(columns: Sequence[Column]) -> list[str]:
    """Headings of the columns of ratios."""
    return [f"{column.label} / {column.base.label}" for column in columns if column.base]


def text(columns: Sequence[Column]) -> str:
    """The table as lines of text."""
    head = ["", *(column.label for column in columns), "", *ratio_heads(columns)]
    lines: list[Sequence[str]] = [head] if len(columns) > 1 else []
    for title, rows in groups(columns):
        lines.append([title])
        lines += [[f"  {row.metric.name}", *row.cells, row.unit, *row.ratios] for row in rows]
    widths = [max(len(line[i]) for line in lines if len(line) > i) for i in range(len(head))]
    left = 0, len(columns) + 1  # name and unit
    return "\n".join(_aligned(line, widths, left) for line in lines)


def _aligned(line: Sequence[str], widths: Sequence[int], left: Sequence[int]) -> str:
    cells = [
        cell.ljust(widths[i]) if i in left else cell.rjust(widths[i]) for i, cell in enumerate(line)
    ]
    return "  ".join(cells).rstrip()


def unknown(columns: Sequence[Column]) -> list[str]:
    """Names of the metrics that are unknown of all runs, though they apply to a climber."""
    return [
        name
        for name, metric in METRICS.items()
        if all(math.isnan(c.values[name]) for c in columns)
        and any(metric.concerns(c.case) for c in columns)
    ]


def to_csv(columns: Sequence[Column]) -> str:
    """All metrics in SI units, nan where they are not known."""
    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["metric", "unit", *(plain(column.label) for column in columns)])
    for name, metric in METRICS.items():
        writer.writerow([name, metric.unit, *(repr(column.values[name]) for column in columns)])
    return stream.getvalue()


def plain(text: str) -> str:
    """Text that no spreadsheet takes for a formula."""
    return f"'{text}" if text.startswith(FORMULA) else text


def to_json(columns: Sequence[Column]) -> str:
    """All metrics in SI units, null where they are not known, with events and losses."""
    runs = [
        {
            "label": column.label,
            "bag": column.bag,
            "namespace": column.case.run.name,
            "part": column.case.run.part,
            "metrics": {n: v if math.isfinite(v) else None for n, v in column.values.items()},
            "events": [_event(time, event) for time, event in column.case.run.events],
            "losses": list(column.losses),
        }
        for column in columns
    ]
    units = {name: metric.unit for name, metric in METRICS.items()}
    return json.dumps({"units": units, "runs": runs}, indent=1, ensure_ascii=False) + "\n"


def _event(time: float, event: Any) -> dict[str, Any]:
    values = {name: getattr(event, name) for name in ("node", "kind", "level", "text")}
    return {"time": round(time, 6), **values}


def markdown(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table with aligned columns."""
    widths = [max(map(len, column)) for column in zip(columns, *rows, strict=True)]
    lines = [columns, ["-" * width for width in widths], *rows]
    padded = (
        " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True))
        for line in lines
    )
    return "\n".join(f"| {line} |" for line in padded) + "\n"
