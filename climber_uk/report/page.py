"""Runs as one page of HTML that is complete in itself: no network, no other file."""

import math
import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from html import escape

from climber_uk.bags.events import ERROR, OK, WARNING
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.adhesion import Alarm
from climber_uk.report.page_template import PAGE
from climber_uk.report.tables import Column, groups, ratio_heads, unknown

MOST_EVENTS = 200  # of a run
STOPS = {0.0: "no stop", 1.0: "1 stop"}
CODE = re.compile("`([^`]*)`")
LEVELS = {OK: "ok", WARNING: "warning", ERROR: "error"}
TIME_LINE = "modes"


def page(title: str, columns: Sequence[Column], figures: Mapping[str, bytes]) -> str:
    """HTML of some runs, each a column, and of their figures, PNG by name."""
    return PAGE.substitute(
        title=escape(title),
        summaries="".join(map(_summary, columns)),
        losses="".join(map(_losses, columns)),
        modes="".join(_figure(name, figures[name]) for name in figures if name == TIME_LINE),
        figures="".join(_figure(name, figures[name]) for name in figures if name != TIME_LINE),
        events="".join(map(_events, columns)) or "<p>Nothing was reported.</p>",
        table=_table(columns),
        unknown=escape(", ".join(unknown(columns)) or "none"),
    )


def _summary(column: Column) -> str:
    tiles = "".join(
        f'<div class="tile {LEVELS[level]}"><h3>{name}</h3><b>{escape(main)}</b>'
        f"<p>{escape(note)}</p></div>"
        for name, metric, main, note, level in _tiles(column)
        if math.isfinite(column.values[metric])
    )
    run = column.case.run
    recorded = datetime.fromtimestamp(run.odometry.arrivals[0] // SECOND, UTC)
    about = (
        f"{column.shown('duration')} with {len(run.time)} odometry messages, recorded on "
        f"{recorded:%Y-%m-%d at %H:%M:%S} UTC: {column.bag}"
    )
    return (
        f'<h2>{escape(column.label)}</h2><p class="about">{escape(about)}</p>'
        f'<div class="tiles">{tiles}</div>'
    )


def _tiles(column: Column) -> Iterable[tuple[str, str, str, str, int]]:
    """Title, metric without which there is no tile, number, text below it, and level."""
    values, shown = column.values, column.shown
    is_settled = math.isfinite(values["settling_time"])
    settled = f"settled after {shown('settling_time')}" if is_settled else "not settled"
    by_odometry = f"{shown('rms_distance')} RMS", f"at most {shown('max_distance')}"
    main, note = by_odometry
    if math.isfinite(values["truth_rms_distance"]):
        main = f"{shown('truth_rms_distance')} RMS, truly"
        note = f"at most {shown('truth_max_distance')}; by the odometry {', '.join(by_odometry)}"
    yield (*("Tracking", "rms_distance", main, f"{note}; {settled}"), OK if is_settled else WARNING)
    yield (
        "Motors",
        "peak_torque",
        f"{shown('peak_torque')} peak",
        f"saturated {shown('saturation')} of the time; {shown('energy_per_metre')}",
        WARNING if values["saturation"] > 0 else OK,
    )
    yield (
        "Hold on the wall",
        "lowest_slip_margin",
        f"{shown('lowest_slip_margin')} slip margin",
        f"{shown('lowest_tip_margin')} tip margin; below 1 it slips, it tips: it slipped "
        f"{shown('slip_share')} of the time",
        max(
            Alarm().level(min(values["lowest_slip_margin"], values["lowest_tip_margin"])),
            WARNING if values["slip_share"] > 0 else OK,
        ),
    )
    stops = values["safety_stops"]
    yield (
        "Safety",
        "safety_stops",
        STOPS.get(stops, f"{shown('safety_stops')} stops"),
        f"followed {shown('following')} of the time; {shown('errors')} errors of nodes",
        ERROR if stops > 0 or values["errors"] > 0 else OK,
    )
    lost = values["odometry_lost"] + values["odometry_unfit"]
    yield (
        "Timing",
        "latency_p50",
        f"{shown('latency_p50')} latency",
        f"99 %: {shown('latency_p99')}; {lost:.0f} odometry messages lost or unfit",
        WARNING if lost > 0 else OK,
    )


def _losses(column: Column) -> str:
    if not column.losses:
        return ""
    items = "".join(f"<li>{escape(loss)}</li>" for loss in column.losses)
    return f'<div class="losses"><h3>To know of {escape(column.bag)}</h3><ul>{items}</ul></div>'


def _figure(name: str, image: bytes) -> str:
    data = b64encode(image).decode()
    return f'<img alt="{name}" src="data:image/png;base64,{data}">'


def _events(column: Column) -> str:
    reported = column.case.run.events
    rows = "".join(
        f'<tr class="{LEVELS[event.level]}"><td class="number">{time:.3f} s</td>'
        f"<td>{escape(event.node)}</td><td>{event.kind}</td><td>{escape(event.text)}</td></tr>"
        for time, event in reported[:MOST_EVENTS]
    )
    more = f"<p>{len(reported) - MOST_EVENTS} more are in the JSON file.</p>"
    return (
        f"<h3>{escape(column.label)}</h3><table>{rows}</table>"
        f"{more if len(reported) > MOST_EVENTS else ''}"
        if reported
        else ""
    )


def _table(columns: Sequence[Column]) -> str:
    labels = [column.label for column in columns]
    heads = [*labels, "", *ratio_heads(columns)]
    cells = "".join(f'<th class="number">{escape(head)}</th>' for head in heads)
    parts = [f"<tr><th></th>{cells}</tr>"] if len(columns) > 1 else []
    for title, rows in groups(columns):
        parts.append(f'<tr class="group"><td colspan="{len(heads) + 1}">{title}</td></tr>')
        for row in rows:
            numbers, ratios = (
                "".join(f'<td class="number">{cell}</td>' for cell in cells)
                for cells in (row.cells, row.ratios)
            )
            meaning = CODE.sub(r"<code>\1</code>", escape(row.metric.definition))
            parts.append(
                f"<tr><td><code>{row.metric.name}</code><small>{meaning}</small></td>"
                f"{numbers}<td>{row.unit}</td>{ratios}</tr>"
            )
    return f"<table>{''.join(parts)}</table>"
