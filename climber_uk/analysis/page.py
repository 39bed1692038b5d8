"""Runs as one page of HTML that needs nothing but itself: no network, no other file."""

import math
import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from html import escape
from string import Template

from climber_uk.analysis.events import ERROR, OK, WARNING
from climber_uk.analysis.tables import Column, groups, ratio_heads, unknown
from climber_uk.mechanics.contact import Alarm
from climber_uk.mechanics.preview import SECOND

MOST_EVENTS = 200  # of a run
STOPS = {0.0: "no stop", 1.0: "1 stop"}
CODE = re.compile("`([^`]*)`")
LEVELS = {OK: "ok", WARNING: "warning", ERROR: "error"}
TIME_LINE = "modes"


def page(title: str, columns: Sequence[Column], figures: Mapping[str, bytes]) -> str:
    """The page of some runs and their figures, PNG by name."""
    return PAGE.substitute(
        title=escape(title),
        summaries="".join(map(_summary, columns)),
        losses="".join(map(_losses, columns)),
        modes="".join(_figure(name, figures[name]) for name in figures if name == TIME_LINE),
        figures="".join(_figure(name, figures[name]) for name in figures if name != TIME_LINE),
        events="".join(map(_events, columns)) or "<p>Nothing was told.</p>",
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
    """Name, metric that has to be known, what matters most, what else does, and how bad it is."""
    values, shown = column.values, column.shown
    is_settled = math.isfinite(values["settling_time"])
    settled = f"settled after {shown('settling_time')}" if is_settled else "not settled"
    yield (
        "Tracking",
        "rms_distance",
        f"{shown('rms_distance')} RMS",
        f"at most {shown('max_distance')}; {settled}",
        OK if is_settled else WARNING,
    )
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
        f"{shown('lowest_tip_margin')} tip margin; below 1 it slips, it tips",
        Alarm().level(min(values["lowest_slip_margin"], values["lowest_tip_margin"])),
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
    return f'<div class="losses"><h3>Not read of {escape(column.bag)}</h3><ul>{items}</ul></div>'


def _figure(name: str, image: bytes) -> str:
    data = b64encode(image).decode()
    return f'<img alt="{name}" src="data:image/png;base64,{data}">'


def _events(column: Column) -> str:
    told = column.case.run.events
    rows = "".join(
        f'<tr class="{LEVELS[event.level]}"><td class="number">{time:.3f} s</td>'
        f"<td>{escape(event.node)}</td><td>{event.kind}</td><td>{escape(event.text)}</td></tr>"
        for time, event in told[:MOST_EVENTS]
    )
    more = f"<p>{len(told) - MOST_EVENTS} more are in the JSON file.</p>"
    return (
        f"<h3>{escape(column.label)}</h3><table>{rows}</table>"
        f"{more if len(told) > MOST_EVENTS else ''}"
        if told
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


PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 1000px; margin: 2em auto;
  padding: 0 1em; }
h1 { font-size: 1.6em; margin-bottom: 0; }
h2 { font-size: 1.2em; margin: 1.6em 0 0; border-bottom: 1px solid #ddd; }
h3 { font-size: 1em; margin: 0.8em 0 0.3em; }
.about, small { color: #666; }
.about { margin: 0.2em 0 0.6em; overflow-wrap: anywhere; }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(175px, 1fr)); gap: 10px; }
.tile { border-left: 5px solid #2a9d4a; background: #f6f7f8; padding: 8px 12px; }
.tile h3 { margin: 0; color: #666; font-weight: normal; }
.tile b { font-size: 1.15em; }
.tile p { margin: 0; font-size: 0.85em; color: #666; }
.tile.warning { border-color: #e0a000; }
.tile.error { border-color: #d03030; }
.losses { background: #fff4e0; padding: 4px 14px; margin-top: 1em; }
img { display: block; width: 100%; max-width: 990px; margin: 1em 0; }
table { border-collapse: collapse; width: 100%; }
td, th { padding: 3px 8px; border-bottom: 1px solid #eee; text-align: left; vertical-align: top; }
.number { font-variant-numeric: tabular-nums; text-align: right; }
td.number { white-space: nowrap; }
.group td { font-weight: bold; background: #f0f2f4; }
small { display: block; }
tr.warning td:first-child { border-left: 4px solid #e0a000; }
tr.error td:first-child { border-left: 4px solid #d03030; }
tr.ok td:first-child { border-left: 4px solid #2a9d4a; }
</style>
</head>
<body>
<h1>$title</h1>
$summaries
$losses
<h2>What happened when</h2>
$modes
$events
<h2>Figures</h2>
$figures
<h2>Metrics</h2>
$table
<p class="about">Not known from what was recorded: $unknown.</p>
</body>
</html>
""")
