"""Waypoints from a text file, as people, spreadsheets and planners write them."""

import codecs
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from climber_uk.mechanics import Array

COMMENT = re.compile(r"#.*|^\s*(//|%).*")
UNIT = re.compile(r"[\[(](.*)[\])]")
Line = tuple[int, list[str]]  # number of a line, and its cells


def read_waypoints(file: str) -> Array:
    """Points (n, 2) [m]: one a line, x and y, or more columns of which a header names x and y.

    Columns are separated by semicolons, commas, tabs or blanks; with semicolons, numbers may have
    decimal commas. Empty lines and comments (# … anywhere, // … and % … as lines) are left out.
    Raises `ValueError` naming the file, the line and what was wanted.
    """
    try:
        return read_waypoint_text(read_text(file))
    except ValueError as error:
        raise ValueError(f"file={file!r}: {error}") from None


def read_text(file: str) -> str:
    """Text of a file, of any encoding that is found there; `ValueError` if it is none."""
    path = Path(file).expanduser()
    if not path.exists():
        raise ValueError("not found")
    if not path.is_file():
        raise ValueError("is not a file")
    try:
        content = path.read_bytes()
        is_wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        text = content.decode("utf-16" if is_wide else "utf-8-sig")
    except OSError as error:
        raise ValueError(error.strerror or str(error)) from None
    except UnicodeDecodeError:
        raise ValueError("is not a text file") from None
    if "\0" in text:
        raise ValueError("is not a text file")
    return text


@dataclass(frozen=True)
class _Columns:
    """Number of cells in a line, and the indices of x and y among them."""

    number: int
    x: int = 0
    y: int = 1


def read_waypoint_text(text: str) -> Array:
    """Points (n, 2) [m] of the text of a file; `ValueError` naming the line."""
    lines = list(enumerate(re.split(r"\r\n|\r|\n", text), start=1))
    rows = [(n, bare) for n, line in lines if (bare := COMMENT.sub("", line).strip(" \t"))]
    if not rows:
        raise ValueError("no points in it: want x and y [m] of a point a line")
    separator = _separator(rows[0][1])
    cells = [(n, _split(row, separator)) for n, row in rows]
    columns, cells = _columns(cells, [line for n, line in lines if n < rows[0][0]], separator)
    if len(cells) < 2:
        raise ValueError(f"{len(cells)} point(s), want >= 2")
    pairs = [(n, _pick(n, line, columns)) for n, line in cells]
    is_comma = separator == ";" and any("," in cell for _, pair in pairs for cell in pair)
    points = [[_number(n, cell, is_comma) for cell in pair] for n, pair in pairs]
    for number, ((n, _), point) in enumerate(zip(pairs, points, strict=True), start=1):
        if not all(map(math.isfinite, point)):
            raise ValueError(f"line {n}: point {number} is not finite")
    return np.array(points)


def _separator(row: str) -> str | None:
    return next((mark for mark in ";,\t" if mark in row), None)


def _split(row: str, separator: str | None) -> list[str]:
    cells = [cell.strip().strip("\"'").strip() for cell in row.split(separator)]
    while len(cells) > 2 and not cells[-1]:
        cells.pop()
    return cells


def _columns(
    lines: list[Line], above: list[str], separator: str | None
) -> tuple[_Columns, list[Line]]:
    """Columns, by a header (which may be a comment) if there is one, and the lines below it."""
    number, first = lines[0]
    if not any(_is_number(cell) for cell in first):
        return _named(f"line {number}", first), lines[1:]
    for line in reversed(above):
        names = _split(line.strip().lstrip("#/%").strip(), separator)
        if len(names) == len(first) and {"x", "y"} <= {_name(name) for name in names}:
            return _named("comment", names), lines
    if len(first) == 2 or len(first) < 2:
        return _Columns(2), lines
    raise ValueError(
        f"line {number}: {len(first)} columns without a header: "
        "want two columns, x and y, or a header that names them"
    )


def _named(where: str, names: list[str]) -> _Columns:
    """Columns of a header; `where` is what an error calls it."""
    plain = [_name(name) for name in names]
    if plain.count("x") != 1 or plain.count("y") != 1:
        raise ValueError(f"{where}: want one column x and one y, found {', '.join(names)}")
    x, y = plain.index("x"), plain.index("y")
    for name in names[x], names[y]:
        unit = UNIT.search(name)
        if unit and unit[1].strip().lower() not in ("m", "metre", "meter", "metres", "meters"):
            raise ValueError(f"{where}: column {name!r} must be in m")
    return _Columns(len(names), x, y)


def _name(cell: str) -> str:
    return UNIT.sub("", cell).strip().lower()


def _pick(number: int, cells: list[str], columns: _Columns) -> tuple[str, str]:
    if len(cells) != columns.number:
        raise ValueError(f"line {number}: {len(cells)} column(s), want {columns.number}")
    return cells[columns.x], cells[columns.y]


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _number(line: int, cell: str, is_comma: bool) -> float:
    if is_comma and "." in cell:
        raise ValueError(f"line {line}: {cell!r} has a decimal point where others have commas")
    try:
        if "_" in cell:
            raise ValueError
        return float(cell.replace(",", ".") if is_comma else cell)
    except ValueError:
        hint = ""
        if re.search(r"\d[ \t]+[-+\d]", cell):
            hint = " (decimal commas need semicolons between the columns)"
        raise ValueError(f"line {line}: {cell!r} must be a number{hint}") from None
