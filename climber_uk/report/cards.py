"""A run at a glance: five cards, a verdict in a sentence, and what the nodes reported."""

import math
import textwrap
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from climber_uk.bags.events import ERROR, OK, WARNING, Event
from climber_uk.mechanics.adhesion import Alarm
from climber_uk.messages.topics import FELL
from climber_uk.report.metrics.safety import is_start_of
from climber_uk.report.tables import Column

WIDTH = 98  # of lines in a terminal
FEW = 8  # different things that nodes reported, in a terminal
STOPS = {0.0: "no stop", 1.0: "1 stop"}
MARKS = {OK: " ", WARNING: "!", ERROR: "✗"}


class Card(NamedTuple):
    """What matters of one side of a run."""

    title: str
    main: str
    note: str
    level: int


def cards(column: Column) -> list[Card]:
    """Cards of a run, without those of which nothing is known."""
    return [card for metric, card in _cards(column) if math.isfinite(column.values[metric])]


def _cards(column: Column) -> Iterator[tuple[str, Card]]:
    """Each with the metric without which there is none."""
    values, shown = column.values, column.shown
    is_settled = math.isfinite(values["settling_time"])
    settled = f"settled after {shown('settling_time')}" if is_settled else "not settled"
    by_odometry = f"{shown('rms_distance')} RMS", f"at most {shown('max_distance')}"
    main, note = by_odometry
    if math.isfinite(values["truth_rms_distance"]):
        main = f"{shown('truth_rms_distance')} RMS (true)"
        note = f"at most {shown('truth_max_distance')}; by the odometry {', '.join(by_odometry)}"
    level = OK if is_settled else WARNING
    yield "rms_distance", Card("Tracking", main, f"{note}; {settled}", level)
    saturated = values["saturation"] > 0
    told = {
        "saturation": f"saturated {shown('saturation')} of the time",
        "energy_per_metre": shown("energy_per_metre"),
        "rms_torque_change": f"changes by {shown('rms_torque_change')} a period",
    }
    note = "; ".join(said for name, said in told.items() if math.isfinite(values[name]))
    level = WARNING if saturated else OK
    yield "peak_torque", Card("Motors", f"{shown('peak_torque')} peak", note, level)
    note = (
        f"{shown('lowest_tip_margin')} tip margin; below 1 its wheels slip, or it tips over: they "
        f"slipped {shown('slip_share')} of the time"
    )
    main, level = f"{shown('lowest_slip_margin')} slip margin", _hold(column)
    yield "lowest_slip_margin", Card("Hold on the wall", main, note, level)
    stops, errors = values["safety_stops"], values["errors"]
    main = STOPS.get(stops, f"{shown('safety_stops')} stops")
    note = f"followed {shown('following')} of the time; {shown('errors')} errors reported by nodes"
    level = ERROR if stops > 0 or errors > 0 else OK
    yield "safety_stops", Card("Safety", main, note, level)
    lost = values["odometry_lost"] + values["odometry_unfit"]
    note = f"99 % within {shown('latency_p99')}; {lost:.0f} odometry messages lost or unfit"
    level = WARNING if lost > 0 else OK
    yield "latency_p50", Card("Timing", f"{shown('latency_p50')} median latency", note, level)


def _hold(column: Column) -> int:
    """Level of the margins."""
    values = column.values
    lowest = min(values["lowest_slip_margin"], values["lowest_tip_margin"])
    return max(Alarm().level(lowest), WARNING if values["slip_share"] > 0 else OK)


def verdict(column: Column) -> str:
    """What became of a run, in a sentence."""
    values, shown = column.values, column.shown
    of = "truth_" if math.isfinite(values["truth_max_distance"]) else ""
    far = f"at most {shown(f'{of}max_distance')} off"
    stops = values["safety_stops"]
    for time, event in column.case.run.events:
        _, fell, why = event.text.partition(f"{FELL}: ")
        if fell:
            return f"It fell off the wall at {time:.1f} s: {why}."
    if math.isnan(values["max_distance"]) and not stops > 0:
        said = f"There is no reference in it, only that it drove {shown('travelled')}"
    elif values["following"] == 0:
        said = "It did not follow its reference at all"
    elif stops > 0:
        said = f"It stopped for safety ({STOPS.get(stops, f'{stops:.0f} stops')})"
    elif math.isfinite(values["settling_time"]):
        said = f"It followed its path, {far}"
    else:
        said = f"It did not settle on its path, {far}"
    if values["lowest_tip_margin"] < 1:
        return f"{said}; on a real wall it would tip over: more adhesion, or less weight."
    if values["lowest_slip_margin"] < 1:
        return f"{said}; on a real wall its wheels would slip: more adhesion, or slower."
    return f"{said}."


def text(columns: Sequence[Column]) -> str:
    """Cards, events and verdict of runs as lines for a terminal; of several, cards in a table."""
    if len(columns) == 1:
        (column,) = columns
        return "\n".join([*_lines(column), *_reported(column, FEW), verdict(column)])
    lines = _table(columns)
    for column in columns:
        lines += [*_reported(column, FEW // len(columns)), f"{column.label}: {verdict(column)}"]
    return "\n".join(lines)


def _table(columns: Sequence[Column]) -> list[str]:
    """What matters of each run, without notes, a line each below a head."""
    found = [{card.title: card for card in cards(column)} for column in columns]
    titles = list(dict.fromkeys(title for of in found for title in of))
    rows = [["", *(f"  {title}" for title in titles)]]
    for column, of in zip(columns, found, strict=True):
        cells = [
            f"{MARKS[of[name].level]} {of[name].main}" if name in of else "" for name in titles
        ]
        rows.append([column.label, *cells])
    widths = [max(map(len, cells)) for cells in zip(*rows, strict=True)]
    return [" ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


def _lines(column: Column) -> Iterator[str]:
    """Cards of a run, with their notes."""
    for title, main, note, level in cards(column):
        indented = textwrap.wrap(note, WIDTH - 44) or [""]
        yield f"{MARKS[level]} {title:<18}{main:<24}{indented[0]}".rstrip()
        yield from (" " * 44 + line for line in indented[1:])


def _reported(column: Column, few: int) -> Iterator[str]:
    """So many of the things that nodes reported, each once."""
    reported: dict[tuple[str, str], list[tuple[float, Event]]] = {}
    is_start, has_followed = is_start_of(column.case), column.values["following"] > 0
    for time, event in column.case.run.events:
        if event.level > OK and not (has_followed and is_start(time, event)):
            what = event.text if event.kind == "log" else event.kind
            reported.setdefault((event.node, what), []).append((time, event))
    for events in list(reported.values())[:few]:
        time, event = max(events, key=lambda timed: timed[1].level)  # the first of the worst
        more = f" (and {len(events) - 1} more)" if len(events) > 1 else ""
        where = f"{MARKS[event.level]} {time:8.3f} s  "
        said = f"{event.node}: {event.text}{more}"
        yield from textwrap.wrap(said, WIDTH, initial_indent=where, subsequent_indent=" " * 14)
    if len(reported) > few:
        yield f"  and {len(reported) - few} more: see the page"
