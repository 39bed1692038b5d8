"""The comparison: one row a motion, printed, and written as Markdown and CSV."""

import csv
from collections.abc import Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from climber_uk.bags.run import RecordedRun
from climber_uk.mechanics import Array
from climber_uk.paper.motion import PaperMotion
from climber_uk.report.tables import markdown

COLUMNS = (
    "motion",
    "x error, max [m]",
    "x error, end [m]",
    "x error, growth [m/s]",
    "y error, max [m]",
    "y error, end [m]",
    "y error, growth [m/s]",
    "side slip, max [m/s]",
    "third of Qc, max [m/s²]",
    "torque, max [N m]",
)

# What the text says of its figures; the figures themselves carry no more digits.
PRINTED_UNCORRECTED = ("printed in the paper, (26)", "1.8e-3", "", "", "0.6", "", "> 0", "", "", "")
PRINTED_CORRECTED = (
    *("printed in the paper, (30)", "> 1.8e-3", "", "0"),
    *("an order below 0.6", "", "0", "", "", ""),
)


def row(name: str, motion: PaperMotion | RecordedRun | str) -> tuple[str, ...]:
    """Cells of a motion, or of a message why there is none, in the order of `COLUMNS`."""
    if isinstance(motion, str):
        return f"{name}: {motion}", *[""] * (len(COLUMNS) - 1)
    if isinstance(motion, RecordedRun):  # a bag holds no accelerations, and so no third component
        error: Array = (motion.pose - motion.reference)[:, :2]
        third = None
    else:
        error, third = motion.error, _largest(motion.third)
    ends = ((_largest(e), float(np.abs(e[-1])), growth(motion.time, e)) for e in error.T)
    numbers = *chain(*ends), _largest(motion.side_slip), third, _largest(motion.torques)
    return name, *("" if n is None else f"{n:.3g}" for n in numbers)


def growth(time: Array, error: Array) -> float:
    """Growth of the error [m/s]: slope of the straight line fitted to its norm."""
    return float(np.polyfit(time, np.abs(error), 1)[0])


def write(
    directory: Path, name: str, columns: Sequence[str], rows: Sequence[Sequence[str]]
) -> list[Path]:
    """Write a table as Markdown and CSV; return their paths."""
    paths = [directory / f"{name}.md", directory / f"{name}.csv"]
    paths[0].write_text(markdown(columns, rows), encoding="utf-8")
    with paths[1].open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([columns, *rows])
    return paths


def _largest(values: Array) -> float:
    return float(np.max(np.abs(values)))
