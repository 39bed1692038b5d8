"""Read MCAP files, as far as they are sound: past damage, with or without their indexes."""

from collections.abc import Collection, Iterator, Mapping
from heapq import merge
from itertools import chain, pairwise
from operator import attrgetter
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.records import Schema

from climber_uk.bags.connection import Connection, Logged, Lose, readable
from climber_uk.bags.mcap_contents import NOTHING, FilePart, from_records, from_summary
from climber_uk.bags.mcap_records import MESSAGE_HEAD, RecordFile, records_in
from climber_uk.bags.unpacking import LARGEST_MESSAGE, Allowance


class McapFile:
    """An MCAP file, open for reading; raises `ValueError` if it is none."""

    def __init__(self, path: Path, _: Path, lose: Lose) -> None:
        self.name, self._lose = path.name, lose
        self._file = RecordFile(path)
        self.size = self._file.size
        try:
            self._contents = from_summary(self._file) or from_records(self._file, self.lose)
        except BaseException:
            self.close()
            raise
        self._contents.parts.sort(key=attrgetter("start"))
        self.connections = list(readable(self._connections(), self.lose))
        self.start = min((part.start for part in self._contents.parts), default=NOTHING[0])
        self.end = max((part.end for part in self._contents.parts), default=NOTHING[1])

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def messages(self, connections: Collection[Connection]) -> Iterator[Logged]:
        """Yield what is sound of some topics, in the order of the log times."""
        wanted = {connection.id: connection for connection in connections}
        parts = [
            part for part in self._contents.parts if not wanted.keys().isdisjoint(part.channels)
        ]
        allowance = Allowance(self._file.size)
        opened = [self._messages(i, part, wanted, allowance) for i, part in enumerate(parts)]
        is_split = all(one.end <= next_one.start for one, next_one in pairwise(parts))
        for log_time, _, index, channel, publish_time, data in (
            chain(*opened) if is_split else merge(*opened)
        ):
            if index >= 0:
                yield wanted[channel], log_time, publish_time, data

    def lose(self, what: str) -> None:
        """Say what could not be read."""
        self._lose(f"{self.name}: {what}")

    def _connections(self) -> Iterator[tuple[Connection, str]]:
        """All topics, with their encodings."""
        for channel in self._contents.channels.values():
            schema = self._contents.schemas.get(channel.schema_id, Schema(0, b"", "", ""))
            text = schema.data.decode("utf-8", "replace") if schema.encoding == "ros2msg" else ""
            count = self._contents.counts[channel.id]
            found = Connection(channel.id, channel.topic, schema.name, count, text)
            yield found, channel.message_encoding

    def _messages(
        self, number: int, part: FilePart, wanted: Mapping[int, Any], allowance: Allowance
    ) -> Iterator[tuple[int, int, int, int, int, bytes]]:
        """Yield log time, number of the part and in it, channel, publishing time and data.

        The first one is none, at the part's start: nothing is unpacked until its turn comes.
        """
        yield part.start, number, -1, 0, 0, b""
        found: list[tuple[int, int, int, int, int, bytes]] = []
        try:
            data = self._file.unpacked(part.place, allowance)
            for opcode, start, end in records_in(data):
                if opcode == Opcode.MESSAGE:
                    channel, _, log_time, publish_time = MESSAGE_HEAD.unpack_from(data, start)
                    if channel in wanted and end - start <= LARGEST_MESSAGE:
                        message = data[start + MESSAGE_HEAD.size : end]
                        found.append((log_time, number, len(found), channel, publish_time, message))
                    elif channel in wanted:
                        self.lose(f"a message larger than {LARGEST_MESSAGE >> 20} MiB is left out")
        except ValueError as error:
            self.lose(f"a chunk is left out: {error}")
        yield from sorted(found)
