"""Messages that differ in their numbers only, decoded many at a time.

CDR puts a field where the strings and lengths before it leave it. So messages of one type with the
same strings and lengths are rows of one table, and a topic hardly ever has more than a few tables.
"""

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

from climber_uk.analysis.bag import Bag
from climber_uk.mechanics import Array
from climber_uk.mechanics.preview import SECOND

CHUNK = 4096  # messages of a topic that are decoded at a time
HEADER = 4  # bytes before the fields: how they are encoded
FORMATS = {
    **dict.fromkeys(("bool", "byte", "char", "uint8"), "u1"),
    **{"int8": "i1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8"},
}


@dataclass(frozen=True)
class Batch:
    """n messages of one type, in the order in which they were recorded."""

    log_times: NDArray[np.int64]  # (n,) [ns]
    strings: dict[str, str]  # by path, as in `header.frame_id` and `name.0`
    lengths: dict[str, int]  # of sequences
    rows: NDArray[Any]  # (n,) of numbers, by path

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, path: str) -> Array:
        """Numbers (n,), of a sequence or an array (n, length); `KeyError` if there are none."""
        if self.lengths.get(path) == 0:
            return np.empty((len(self), 0))
        try:
            return self.rows[path].astype(float)
        except ValueError:
            raise KeyError(path) from None

    def columns(self, *paths: str) -> Array:
        """Numbers (n, k) at k paths."""
        return np.stack([self[path] for path in paths], axis=-1)

    @property
    def stamps(self) -> NDArray[np.int64]:
        """Stamps in the headers (n,) [ns]."""
        return self.times("header.stamp")

    def times(self, path: str) -> NDArray[np.int64]:
        """Times, or durations, at `path` (n,) [ns]."""
        seconds: NDArray[np.int64] = self.rows[f"{path}.sec"].astype(np.int64)
        return seconds * SECOND + self.rows[f"{path}.nanosec"]


def read_batches(bag: Bag, topics: Collection[str]) -> Iterator[tuple[str, Batch]]:
    """Yield topic and batch; the messages of a topic are nearly in the order of their log times."""
    waiting: dict[Any, list[tuple[int, bytes]]] = defaultdict(list)
    connections: dict[Any, Any] = {}

    def decoded(key: tuple[str, str]) -> Iterator[tuple[str, Batch]]:
        topic, type_name = key
        store = bag.store(connections[key])
        assert store is not None
        batches, spoilt = decode(waiting.pop(key), type_name, store)
        if spoilt:
            bag.lose(f"{topic}: a message cannot be read ({spoilt})")
        for batch in batches:
            yield topic, batch

    for connection, log_time, data in bag.raw_messages(topics):
        key = connection.topic, connection.msgtype
        connections[key] = connection
        waiting[key].append((log_time, data))
        if len(waiting[key]) == CHUNK:
            yield from decoded(key)
    for key in list(waiting):
        yield from decoded(key)


def decode(
    messages: Sequence[tuple[int, bytes]], type_name: str, store: Typestore
) -> tuple[list[Batch], str]:
    """Batches of some messages, and what is wrong with the last one that cannot be read."""
    batches, spoilt = [], ""
    by_size = defaultdict(list)
    for log_time, data in messages:
        by_size[len(data)].append((log_time, data))
    if by_size.pop(0, None):
        spoilt = "it is empty"
    for size, alike in by_size.items():
        times = np.array([log_time for log_time, _ in alike], np.int64)
        rows = np.frombuffer(b"".join(data for _, data in alike), np.uint8).reshape(-1, size)
        while len(rows):
            layout = Layout(rows[0].tobytes(), store)
            try:
                layout.walk(type_name)
                numbers = rows.view(layout.numbers)[:, 0]
                same = layout.fits(rows)
                batches.append(Batch(times[same], layout.strings, layout.lengths, numbers[same]))
            except (ValueError, IndexError, UnicodeDecodeError) as error:
                spoilt = str(error)
                same = np.arange(len(rows)) == 0
            times, rows = times[~same], rows[~same]
    return batches, spoilt


@dataclass
class Layout:
    """Where a message, and others with the same strings and lengths, has its numbers."""

    data: bytes
    store: Typestore
    place: int = HEADER
    fields: dict[str, tuple[Any, int]] = field(default_factory=dict)  # format and place by path
    fixed: list[int] = field(default_factory=lambda: list(range(HEADER)))  # places of all else
    strings: dict[str, str] = field(default_factory=dict)
    lengths: dict[str, int] = field(default_factory=dict)

    @property
    def order(self) -> str:
        """Order of the bytes in a number; raises `ValueError` unless the encoding is CDR."""
        if self.data[:2] not in (b"\0\0", b"\0\1"):
            raise ValueError(f"encoding {self.data[:2].hex()} is not CDR")
        return "<" if self.data[1] else ">"

    @property
    def numbers(self) -> "np.dtype[Any]":
        """All numbers of a message as one type; raises `ValueError` if they go beyond its end."""
        formats, places = zip(*self.fields.values(), strict=True) if self.fields else ((), ())
        return np.dtype(
            {
                "names": list(self.fields),
                "formats": list(formats),
                "offsets": list(places),
                "itemsize": len(self.data),
            }
        )

    def fits(self, rows: NDArray[np.uint8]) -> NDArray[np.bool]:
        """Which of some messages (n, size) have the same strings and lengths."""
        fits: NDArray[np.bool] = (rows[:, self.fixed] == rows[0, self.fixed]).all(axis=1)
        return fits

    def walk(self, type_name: str, path: str = "") -> None:
        """Find the fields of a type from here on."""
        for name, description in self.store.fielddefs[type_name][1]:
            self._find(description, f"{path}.{name}" if path else name)

    def _find(self, description: Any, path: str) -> None:
        kind, what = description
        if kind == Nodetype.NAME:
            self.walk(what, path)
        elif kind == Nodetype.BASE and what[0] == "string":
            start, size = self._length()
            self.strings[path] = self.data[start : start + size - 1].decode()
            self._keep(start, size)
        elif kind == Nodetype.BASE:
            self._number(path, what[0])
        else:
            element, length = what
            if kind == Nodetype.SEQUENCE:
                _, length = self._length()
                self.lengths[path] = length
            if element[0] == Nodetype.BASE and element[1][0] != "string":
                self._number(path, element[1][0], length)
                return
            for i in range(length):
                self._find(element, f"{path}.{i}")

    def _number(self, path: str, kind: str, length: int | None = None) -> None:
        if length == 0:
            return
        if kind not in FORMATS:
            raise ValueError(f"{path}: numbers of type {kind} are not read")
        code = self.order + FORMATS[kind]
        start = self._aligned(int(code[2:]))
        self.fields[path] = code if length is None else (code, (length,)), start
        self.place = start + int(code[2:]) * (1 if length is None else length)

    def _length(self) -> tuple[int, int]:
        """Place behind a length, and the length."""
        start = self._aligned(4)
        self._keep(start, 4)
        length = int(np.frombuffer(self.data, f"{self.order}u4", 1, start)[0])
        if length > len(self.data):
            raise ValueError(f"length {length} at byte {start} goes beyond the end")
        return self.place, length

    def _keep(self, start: int, size: int) -> None:
        self.fixed += range(start, start + size)
        self.place = start + size

    def _aligned(self, size: int) -> int:
        return self.place + (HEADER - self.place) % size
