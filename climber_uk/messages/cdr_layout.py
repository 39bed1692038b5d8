"""The layout of a serialised message: the byte at which each number stands.

CDR puts a field where the strings and lengths before it leave it. So all messages of one type that
have the same strings and the same lengths have their numbers in the same places.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

HEADER = 4  # bytes before the fields: how they are encoded
MOST_PARTS = 100_000  # fields, and elements that are no numbers
BASE, NAME, ARRAY, SEQUENCE = 1, 2, 3, 4  # kinds of fields, as `rosbags.interfaces.Nodetype`
# Name and description of each field of a type: (BASE, (kind of number or "string", ...)),
# (NAME, type), (ARRAY or SEQUENCE, (description of an element, length))
FieldsOf = Callable[[str], Iterable[tuple[str, Any]]]
FORMATS = {
    **dict.fromkeys(("bool", "byte", "char", "uint8"), "u1"),
    **{"int8": "i1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8"},
}


@dataclass
class Layout:
    """Places of the numbers in a message, and in others with the same strings and lengths.

    `walk` fills it; raises `ValueError` if `data` is no CDR, or ends too early.
    """

    data: bytes
    fields_of: FieldsOf
    place: int = HEADER  # of the next byte
    fields: dict[str, tuple[Any, int]] = field(default_factory=dict)  # format and place by path
    # begin and end of all strings and lengths
    fixed: list[tuple[int, int]] = field(default_factory=lambda: [(0, HEADER)])
    strings: dict[str, str] = field(default_factory=dict)
    lengths: dict[str, int] = field(default_factory=dict)
    parts: int = 0
    most_parts: int = MOST_PARTS

    @property
    def order(self) -> str:
        """Order of the bytes in a number; raises `ValueError` unless the encoding is CDR."""
        if self.data[:2] not in (b"\0\0", b"\0\1"):
            raise ValueError(f"encoding {self.data[:2].hex()} is not CDR")
        return "<" if self.data[1] else ">"

    @property
    def numbers(self) -> "np.dtype[Any]":
        """All numbers of a message as one type; raises `ValueError` if they go beyond its end."""
        return self.chosen(self.fields)

    def chosen(self, paths: Iterable[str]) -> "np.dtype[Any]":
        """The numbers at some paths as one type, as `numbers`; `KeyError` if there is no such."""
        names = list(paths)
        formats, places = (
            zip(*(self.fields[name] for name in names), strict=True) if names else ((), ())
        )
        return np.dtype(
            {"names": names, "formats": formats, "offsets": places, "itemsize": len(self.data)}
        )

    @property
    def spans(self) -> list[tuple[int, int]]:
        """As `fixed`, those that follow each other as one."""
        begins = [begin for begin, _ in self.fixed]
        ends = [end for _, end in self.fixed]
        apart = [i for i in range(1, len(begins)) if begins[i] != ends[i - 1]]
        return [
            (begins[i], ends[j - 1]) for i, j in zip([0, *apart], [*apart, len(ends)], strict=True)
        ]

    def fits(self, rows: NDArray[np.uint8]) -> NDArray[np.bool]:
        """Which messages, as rows (n, size) of bytes, have the strings and lengths of the first."""
        fits = np.ones(len(rows), bool)
        if len(rows) > 1:
            places = np.concatenate([np.arange(*span) for span in self.fixed])
            fits = (rows[:, places] == rows[0, places]).all(axis=1)
        return fits

    def walk(self, type_name: str, path: str = "") -> None:
        """Find the fields of a type, from `place` on; `path` is what their names begin with."""
        for name, description in self.fields_of(type_name):
            self._find(description, f"{path}.{name}" if path else name)

    def _find(self, description: Any, path: str) -> None:
        """Find one field, of a `description` as rosbags has it, and go behind it."""
        kind, what = description
        self.parts += 1
        if self.parts > self.most_parts:
            raise ValueError(f"it has more than {self.most_parts} fields")
        if kind == NAME:
            self.walk(what, path)
        elif kind == BASE and what[0] == "string":
            start, size = self._length()
            self.strings[path] = self.data[start : start + size - 1].decode()
            self._keep(start, size)
        elif kind == BASE:
            self._number(path, what[0])
        else:
            element, length = what
            if kind == SEQUENCE:
                _, length = self._length()
                self.lengths[path] = length
            if element[0] == BASE and element[1][0] != "string":
                self._number(path, element[1][0], length)
                return
            for i in range(length):
                self._find(element, f"{path}.{i}")

    def _number(self, path: str, kind: str, length: int | None = None) -> None:
        """Keep a number, or an array of `length` numbers, and go behind it."""
        if length == 0:
            return
        if kind not in FORMATS:
            raise ValueError(f"{path}: numbers of type {kind} are not read")
        code = self.order + FORMATS[kind]
        start = self._aligned(int(code[2:]))
        self.fields[path] = code if length is None else (code, (length,)), start
        self._go_to(start + int(code[2:]) * (1 if length is None else length))

    def _length(self) -> tuple[int, int]:
        """Read a length; return the place behind it, and the length."""
        start = self._aligned(4)
        self._keep(start, 4)
        length = int(np.frombuffer(self.data, f"{self.order}u4", 1, start)[0])
        if length > len(self.data):
            raise ValueError(f"length {length} at byte {start} goes beyond the end")
        return self.place, length

    def _keep(self, start: int, size: int) -> None:
        """Count bytes among those that other messages must have, too, and go behind them."""
        self.fixed.append((start, start + size))
        self._go_to(start + size)

    def _go_to(self, place: int) -> None:
        if place > len(self.data):
            raise ValueError("it ends too early")
        self.place = place

    def _aligned(self, size: int) -> int:
        """Place of the next number of `size` bytes."""
        return self.place + (HEADER - self.place) % size
