"""Waypoints from a text file, as people, spreadsheets and planners write them."""

import codecs
import csv
import math
import re
from dataclasses import dataclass, field

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.parameters.text_file import at_home, content_of

COMMENT = re.compile(r"""("[^"]*")|#.*|^\s*(//|%).*""")  # not in quotes
BEFORE_UNIT = re.compile(r"\s+(?=[\[(])")
UNIT = re.compile(r"[\[(](.*)[\])]|_((?:mm|cm|m|km|ft|in)(?:/s)?|m?s)$", re.IGNORECASE)
EXCEL = re.compile(r"sep=(.?)", re.IGNORECASE)  # a first line that tells the separator
NOT_COMPUTED = re.compile(r"#(?:N/[AD]|NV|[A-ZÄÖÜ/0]+[!?])(?=[\s,;\"]|$)")  # cells of spreadsheets
OTHER_UNIT = re.compile(  # told by a comment
    r"\s*[#/%].*\bunits?\b\W*(?:(?:is|are|in)\b\W*)*(mm|cm|km|ft|feet|inch\w*|milli\w+|centi\w+)\b",
    re.IGNORECASE,
)
BESIDE_COMMA = re.compile(r"(^|\s),|,(\s|$)")  # what has blanks beside it is no decimal comma
LINE_END = re.compile(r"\r\n?")
METRES = "m", "metre", "meter", "metres", "meters"
FARTHEST = 1e6  # [m] of the origin; beyond it a path has no millimetres left
NUMBERS = {  # columns that are, and their units
    **{"x": METRES, "y": METRES},
    "speed": ("m/s",),
    "dwell": ("s", "second", "seconds"),
}
Line = tuple[int, list[str]]  # number of a line, and its cells


@dataclass(frozen=True)
class Marks:
    """What a file says of its n points beside their places."""

    speed: Array  # (n,) [m/s] at most, from each to the next; infinite: as fast as planned
    dwell: Array  # (n,) [s] of rest at each
    tags: tuple[str, ...]  # (n,) that are told when each is reached; empty: nothing is told
    unused: tuple[str, ...] = ()  # columns of the file by which nothing is done

    @classmethod
    def none(cls, number: int) -> "Marks":
        """Of so many points nothing is said."""
        return cls(np.full(number, np.inf), np.zeros(number), ("",) * number)


def read_waypoints(file: str) -> tuple[Array, Marks]:
    """Points (n, 2) [m]: one a line, x and y, or more columns of which a header names x and y.

    It may name speed, dwell and tag as well, of which cells may be empty.
    Columns are separated by semicolons, tabs, commas or blanks. Numbers may have decimal commas
    between semicolons or tabs, or in quotes. Empty lines and comments (# … anywhere, // …
    and % … as lines) are left out. Raises `ValueError` naming the file, the line and what was
    wanted.
    """
    try:
        return read_waypoint_text(read_text(file))
    except ValueError as error:
        raise ValueError(f"file={file!r}: {error}") from None


def read_text(file: str) -> str:
    """Text of a file, of any encoding that is found there; `ValueError` if it is none."""
    path = at_home(file)
    if not path.exists():
        raise ValueError("not found")
    if not path.is_file():
        raise ValueError("is not a file")
    try:
        content = content_of(path)
        is_wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        text = content.decode("utf-16" if is_wide else "utf-8-sig")
    except OSError as error:
        raise ValueError(error.strerror or str(error)) from None
    except UnicodeDecodeError:
        raise ValueError("is not a text file of UTF-8 or UTF-16") from None
    if "\0" in text:
        raise ValueError("is not a text file")
    return LINE_END.sub("\n", text)


@dataclass(frozen=True)
class _Columns:
    """Number of cells in a line, and the index of each column that has a name."""

    number: int
    at: dict[str, int] = field(default_factory=lambda: {"x": 0, "y": 1})
    unused: tuple[str, ...] = ()  # names of the others


def blocks(text: str) -> list[tuple[int, str]]:
    """Texts between empty lines that have points, each with the number of its first line.

    A header, or comments, above the first of them are put above each that has no header of its own.
    """
    head, block = list[str](), list[str]()
    found: list[tuple[int, str]] = []
    for number, line in enumerate([*text.split("\n"), ""], start=1):
        if line.strip():
            block.append(line)
            continue
        bare = [_bare(row) for row in block]
        top = next((i for i, row in enumerate(bare) if _has_number(row)), len(block))
        if not found:
            head += block[:top]
        elif any(bare[:top]):
            head = block[:top]
        if top < len(block) or (found and any(bare)):
            found.append((number - len(block[top:]) - len(head), "\n".join(head + block[top:])))
        block = []
    return found


def _has_number(row: str) -> bool:
    return any(map(_is_number, _split(row, _separator(row))))


def read_waypoint_text(text: str, first: int = 1) -> tuple[Array, Marks]:
    """Points (n, 2) [m] of the text of a file, and marks; `ValueError` naming the line.

    `first` is the number of its first line.
    """
    lines = list(enumerate(text.split("\n"), start=first))
    for n, line in lines:
        if cell := NOT_COMPUTED.search(line):  # it begins as a comment does
            raise ValueError(f"line {n}: {cell[0]} is a cell that a spreadsheet could not compute")
        if unit := OTHER_UNIT.match(line):
            raise ValueError(f"line {n}: units of {unit[1]} must be m")
    rows = [(n, bare) for n, line in lines if (bare := _bare(line))]
    if not rows:
        raise ValueError("no points in it: want x and y [m] of a point a line")
    told = EXCEL.fullmatch(rows[0][1]) if len(rows) > 1 else None
    if told:
        rows = rows[1:]
    separator = (told[1] or "\t") if told else _separator(rows[0][1])
    cells = [(n, _split(row, separator)) for n, row in rows]
    columns, cells = _columns(cells, [line for n, line in lines if n < rows[0][0]], separator)
    if len(cells) < 2:
        raise ValueError(f"{len(cells)} point(s), want >= 2")
    rows_of = [(n, _pick(n, line, columns)) for n, line in cells]
    is_comma = separator is not None and any(
        "," in row.get(name, "") for _, row in rows_of for name in NUMBERS
    )
    points = [[_number(n, row[name], is_comma) for name in "xy"] for n, row in rows_of]
    for number, ((n, _), point) in enumerate(zip(rows_of, points, strict=True), start=1):
        if not all(map(math.isfinite, point)):
            raise ValueError(f"line {n}: point {number} is not finite")
        if max(map(abs, point)) > FARTHEST:
            x, y = point
            raise ValueError(
                f"line {n}: point {number} at ({x:g}, {y:g}) m is beyond {FARTHEST:g} m"
            )
    speed = [_size(n, row, "speed", is_comma, math.inf) for n, row in rows_of]
    dwell = [_size(n, row, "dwell", is_comma, 0.0) for n, row in rows_of]
    tags = tuple(row.get("tag", "") for _, row in rows_of)
    return np.array(points), Marks(np.array(speed), np.array(dwell), tags, columns.unused)


def _size(line: int, row: dict[str, str], name: str, is_comma: bool, default: float) -> float:
    """Number of a column that may not be there, or be empty."""
    if not (cell := row.get(name, "")):
        return default
    value, least = _number(line, cell, is_comma), "> 0" if name == "speed" else ">= 0"
    if not (value > 0 or (value == 0 and name != "speed")) or math.isinf(value):
        raise ValueError(f"line {line}: {name} {cell} must be {least}, and finite")
    return value


def _bare(line: str) -> str:
    """A line without its comment, and blanks around it."""
    return COMMENT.sub(r"\1", line).strip(" \t")


def _separator(row: str) -> str | None:
    marks = ";,\t" if BESIDE_COMMA.search(row) else ";\t,"
    return next((mark for mark in marks if mark in row), None)


def _split(row: str, separator: str | None) -> list[str]:
    cells = row.split(separator)
    if separator and '"' in row:
        try:
            cells = next(csv.reader([row], delimiter=separator, skipinitialspace=True))
        except csv.Error as error:
            raise ValueError(str(error)) from None
    return [cell.strip().strip("\"'").strip() for cell in cells]


def _shortened(cells: list[str], number: int) -> list[str]:
    """Cells without empty ones at their end, but at least so many if there are."""
    while len(cells) > number and not cells[-1]:
        cells = cells[:-1]
    return cells


def _columns(
    lines: list[Line], above: list[str], separator: str | None
) -> tuple[_Columns, list[Line]]:
    """Columns, by a header (which may be a comment) if there is one, and the lines below it."""
    number, first = lines[0][0], _shortened(lines[0][1], 2)
    if not any(_is_number(cell) for cell in first):
        header = BEFORE_UNIT.sub("", " ".join(first)).split() if separator is None else first
        return _named(f"line {number}", header), lines[1:]
    for line in reversed(above):
        bare = BEFORE_UNIT.sub("", line.strip().lstrip("#/%").strip())
        for mark in (separator, None, ",", ";"):  # which may be others than below
            names = _shortened(_split(bare, mark), 2)
            if len(names) == len(first) and {"x", "y"} <= {_name(name) for name in names}:
                return _named("comment", names), lines
    if len(first) <= 2:
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
    at = {}
    for column in (*NUMBERS, "tag"):
        if plain.count(column) > 1:
            raise ValueError(f"{where}: two columns {column}")
        if column in plain:
            at[column] = plain.index(column)
    for column, units in NUMBERS.items():
        name = names[at[column]] if column in at else ""
        unit = UNIT.search(name)
        if unit and (unit[1] or unit[2] or "").strip().lower() not in units:
            raise ValueError(f"{where}: column {name!r} must be in {units[0]}")
    unused = (name for column, name in enumerate(names) if name and column not in at.values())
    return _Columns(len(names), at, tuple(unused))


def _name(cell: str) -> str:
    return UNIT.sub("", cell).strip().lower()


def _pick(number: int, cells: list[str], columns: _Columns) -> dict[str, str]:
    cells = _shortened(cells, columns.number)
    if len(cells) != columns.number:
        raise ValueError(f"line {number}: {len(cells)} column(s), want {columns.number}")
    return {name: cells[column] for name, column in columns.at.items()}


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
