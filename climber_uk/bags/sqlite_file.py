"""Read sqlite3 files of rosbag2, as far as they are sound.

A row is sound if its number is larger than the one before, and if the rows together are no larger
than the file. Behind a damaged page reading goes on with the next row that is found.
"""

import sqlite3
from array import array
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

import numpy as np

from climber_uk.bags.connection import MOST_TOPICS, Connection, Logged, Lose, readable
from climber_uk.bags.definitions import LONGEST
from climber_uk.bags.sqlite_database import (
    Patience,
    has_columns,
    open_database,
    recovered,
    stated_size,
)
from climber_uk.bags.unpacking import LARGEST_MESSAGE

TABLES = {
    "topics": ("id", "name", "type", "serialization_format"),
    "messages": ("topic_id", "timestamp", "data"),
}
DEFINITIONS = ("topic_type", "encoding", "encoded_message_definition")
MOST_JUMPS = 1000  # over damaged rows
LAST = 2**63 - 1  # number of a row
BLOCK, BLOCK_SIZE = 1000, 2**24  # rows, and bytes, that are read at a time
WIDEST = 100  # times as many rows, wanted or not, between those of a block
Row = tuple[int, int, int, int]  # number, log time [ns], id of the topic, size [bytes]


class SqliteFile:
    """A sqlite3 file, open for reading; raises `ValueError` if it is none of rosbag2.

    What has to be copied of it goes into the directory `scratch`.
    """

    def __init__(self, path: Path, scratch: Path, lose: Lose) -> None:
        self.name, self._lose = path.name, lose
        self._patience = Patience()
        self._endless = False  # whether to look for many rows at once had no end
        readable = recovered(path, scratch, self.lose)
        self.size = path.stat().st_size
        if readable == path and self.size < stated_size(path):
            self.lose("cut off, read up to the last whole message")
        elif readable != path:
            self.size += sum(file.stat().st_size for file in scratch.glob(f"{path.name}-*"))
        with ExitStack() as stack:
            try:
                database = open_database(readable, self._patience)
                self._database = stack.enter_context(closing(database))
                self._look_into()
            except sqlite3.Error as error:
                raise ValueError(f"no readable database: {error}") from None
            stack.pop_all()  # it stays open

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def lose(self, what: str) -> None:
        """Say what could not be read."""
        self._lose(f"{self.name}: {what}")

    def messages(self, connections: Collection[Connection]) -> Iterator[Logged]:
        """Yield what is sound of some topics, in the order of the log times."""
        wanted = {connection.id: connection for connection in connections}
        chosen = np.flatnonzero(np.isin(self._rows[:, 2], list(wanted)))
        chosen = chosen[np.argsort(self._rows[chosen, 1], kind="stable")]
        for block in self._blocks(chosen):
            data = self._data(block, wanted)
            for number, log_time, topic, _ in block.tolist():
                if number in data:
                    yield wanted[topic], log_time, 0, data[number]

    def _look_into(self) -> None:
        for table, columns in TABLES.items():
            if not has_columns(self._database, table, columns):
                raise ValueError(f"it has no table {table} with {', '.join(columns)}")
        rows = array("q")
        for row in self._sound_rows():
            rows.extend(row)
        self._rows = np.array(rows, np.int64).reshape(-1, 4)  # (n, 4) as `Row`
        times = self._rows[:, 1]
        self.start, self.end = (int(times.min()), int(times.max())) if len(times) else (2**63, 0)
        self.connections = list(readable(self._connections(), self.lose))

    def _sound_rows(self) -> Iterator[Row]:
        for _ in self._selected("SELECT 1 FROM messages NOT INDEXED WHERE _rowid_ < 1 LIMIT 1"):
            self.lose("rows with numbers below 1 are left out")
        last, step, size, unfit = 0, 0, 0, 0
        for _ in range(MOST_JUMPS):
            try:
                for number, log_time, topic, kind, length in self._database.execute(
                    "SELECT _rowid_, timestamp, topic_id, typeof(data), length(data)"
                    " FROM messages NOT INDEXED WHERE _rowid_ > ? ORDER BY _rowid_",
                    [last + step],
                ):
                    if number <= last:
                        raise sqlite3.DatabaseError("rows are not in order")
                    self._patience.renew()
                    last, step = number, 0
                    is_fit = type(log_time) is type(topic) is int and kind == "blob"
                    size += length if is_fit else 0
                    if size > self.size:
                        self.lose("rows are larger than the file, not read from there on")
                        return
                    if is_fit and length <= LARGEST_MESSAGE:
                        yield number, log_time, topic, length
                    else:
                        unfit += 1
                break
            except sqlite3.Error as error:
                self.lose(f"damaged, read in part ({error})")
                step = 2 * step or 1
            if last + step >= LAST:
                break
        if unfit:
            most = f"{LARGEST_MESSAGE >> 20} MiB"
            self.lose(f"{unfit} rows are left out: no message, or larger than {most}")

    def _connections(self) -> Iterator[tuple[Connection, str]]:
        """All topics, with their encodings."""
        definitions = self._definitions()
        counts = Counter(self._rows[:, 2].tolist())
        columns = ", ".join(TABLES["topics"])
        for number, topic, type_name, encoding in self._selected(
            f"SELECT {columns} FROM topics NOT INDEXED LIMIT {MOST_TOPICS}"
        ):
            text = definitions.get(type_name, "")
            yield Connection(number, topic, type_name, counts[number], text), str(encoding)

    def _definitions(self) -> dict[str, str]:
        """Definitions by the names of types, as far as the file has them."""
        if not has_columns(self._database, "message_definitions", DEFINITIONS):
            return {}
        found = self._selected(
            "SELECT topic_type, encoded_message_definition FROM message_definitions NOT INDEXED"
            " WHERE encoding = 'ros2msg' AND typeof(encoded_message_definition) = 'text'"
            f" AND length(encoded_message_definition) <= {LONGEST} LIMIT {MOST_TOPICS}"
        )
        return dict(found)

    def _selected(self, query: str, *values: int) -> Iterator[Any]:
        """Rows up to the first that is damaged."""
        self._patience.renew()
        try:
            yield from self._database.execute(query, values)
        except sqlite3.Error as error:
            self.lose(f"damaged, read in part ({error})")

    def _data(self, block: Any, wanted: Collection[int]) -> dict[int, bytes]:
        """Messages of some rows (n, 4), by their numbers."""
        numbers = block[:, 0]
        first, last = int(numbers[0]), int(numbers[-1])
        found: dict[int, bytes] = {}
        near = (np.diff(numbers) > 0).all() and last - first < WIDEST * len(numbers)
        if near and not self._endless:
            topics = ", ".join(map(str, wanted))
            query = (
                "SELECT _rowid_, data FROM messages NOT INDEXED WHERE _rowid_ BETWEEN ? AND ?"
                f" AND topic_id IN ({topics}) AND length(data) <= {LARGEST_MESSAGE} LIMIT {BLOCK}"
            )
            self._patience.renew()
            try:
                found = dict(self._database.execute(query, [first, last]))
            except sqlite3.Error:  # they are asked for one by one then
                self._endless = self._patience.is_over()
        for number in numbers.tolist():
            if number not in found:
                query = "SELECT data FROM messages NOT INDEXED WHERE _rowid_ = ?"
                for (data,) in self._selected(query, number):
                    found[number] = data
        return found

    def _blocks(self, chosen: Any) -> Iterator[Any]:
        """Rows (n, 4) at the indices `chosen`, at most `BLOCK_SIZE` bytes of messages at a time."""
        while len(chosen):
            rows = self._rows[chosen[:BLOCK]]
            fitting = int(np.searchsorted(np.cumsum(rows[:, 3]), BLOCK_SIZE, "right"))
            count = max(1, fitting)
            yield rows[:count]
            chosen = chosen[count:]
