"""Runs as one page of HTML that is complete in itself: no network, no other file."""

import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from html import escape

from climber_uk.bags.events import ERROR, OK, WARNING
from climber_uk.mechanics import SECOND
from climber_uk.report.cards import cards, verdict
from climber_uk.report.page_template import PAGE
from climber_uk.report.tables import Column, groups, ratio_heads, unknown
from climber_uk.system.command_line import printable

MOST_EVENTS = 200  # of a run
CODE = re.compile("`([^`]*)`")
LEVELS = {OK: "ok", WARNING: "warning", ERROR: "error"}
TIME_LINE = "modes"


def page(title: str, columns: Sequence[Column], figures: Mapping[str, bytes]) -> str:
    """HTML of some runs, each a column, and of their figures, PNG by name."""
    return PAGE.substitute(
        title=_safe(title),
        summaries="".join(map(_summary, columns)),
        losses="".join(map(_losses, columns)),
        modes="".join(_figure(name, figures[name]) for name in figures if name == TIME_LINE),
        figures="".join(_figure(name, figures[name]) for name in figures if name != TIME_LINE),
        events="".join(map(_events, columns)) or "<p>Nothing was reported.</p>",
        table=_table(columns),
        unknown=_safe(", ".join(unknown(columns)) or "none"),
    )


def _summary(column: Column) -> str:
    tiles = "".join(
        f'<div class="tile {LEVELS[level]}"><h3>{name}</h3><b>{_safe(main)}</b>'
        f"<p>{_safe(note)}</p></div>"
        for name, main, note, level in cards(column)
    )
    run = column.case.run
    recorded = datetime.fromtimestamp(run.odometry.arrivals[0] // SECOND, UTC)
    about = (
        f"{column.shown('duration')} with {len(run.time)} odometry messages, recorded on "
        f"{recorded:%Y-%m-%d at %H:%M:%S} UTC: {column.bag}"
    )
    return (
        f'<h2>{_safe(column.label)}</h2><p class="about">{_safe(about)}</p>'
        f'<div class="tiles">{tiles}</div><p>{_safe(verdict(column))}</p>'
    )


def _losses(column: Column) -> str:
    if not column.losses:
        return ""
    items = "".join(f"<li>{_safe(loss)}</li>" for loss in column.losses)
    return f'<div class="losses"><h3>To know of {_safe(column.bag)}</h3><ul>{items}</ul></div>'


def _figure(name: str, png: bytes) -> str:
    data = b64encode(png).decode()
    image = f'<img alt="{name}" src="data:image/png;base64,{data}">'
    return f'<label class="figure"><input type="checkbox">{image}</label>'


def _events(column: Column) -> str:
    reported = column.case.run.events
    rows = "".join(
        f'<tr class="event {LEVELS[event.level]}"><td class="number">{time:.3f} s</td>'
        f"<td>{_safe(event.node)}</td><td>{event.kind}</td><td>{_safe(event.text)}</td></tr>"
        for time, event in reported[:MOST_EVENTS]
    )
    more = f"<p>{len(reported) - MOST_EVENTS} more are in the JSON file.</p>"
    return (
        f'<h3>{_safe(column.label)}</h3><div class="wide"><table>{rows}</table></div>'
        f"{more if len(reported) > MOST_EVENTS else ''}"
        if reported
        else ""
    )


def _table(columns: Sequence[Column]) -> str:
    labels = [column.label for column in columns]
    heads = [*labels, "", *ratio_heads(columns)]
    cells = "".join(f'<th class="number">{_safe(head)}</th>' for head in heads)
    parts = [f"<tr><th></th>{cells}</tr>"] if len(columns) > 1 else []
    for title, rows in groups(columns):
        parts.append(f'<tr class="group"><td colspan="{len(heads) + 1}">{title}</td></tr>')
        for row in rows:
            numbers, ratios = (
                "".join(f'<td class="number">{cell}</td>' for cell in cells)
                for cells in (row.cells, row.ratios)
            )
            meaning = CODE.sub(r"<code>\1</code>", _safe(row.metric.definition))
            parts.append(
                f"<tr><td><code>{row.metric.name}</code><small>{meaning}</small></td>"
                f"{numbers}<td>{row.unit}</td>{ratios}</tr>"
            )
    return f'<div class="wide"><table>{"".join(parts)}</table></div>'


def _safe(text: str) -> str:
    """Text of a bag as text of HTML, without characters that command who shows it."""
    return escape(printable(text))
