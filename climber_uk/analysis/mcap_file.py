"""Read MCAP files, as far as they are sound: past damage, with or without their indexes.

A file that was closed has a summary with a checksum, which tells where all chunks are. Of any
other file all chunks are looked into first.
"""

import re
import zlib
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from heapq import merge
from itertools import chain, pairwise
from operator import attrgetter
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from climber_uk.analysis.connection import CDR, Connection, Logged, Lose, is_name, tell_encodings
from climber_uk.analysis.mcap_records import (
    HEAD,
    MESSAGE_HEAD,
    Record,
    RecordFile,
    parsed,
    records_in,
)
from climber_uk.analysis.unpacking import LARGEST_CHUNK, LARGEST_MESSAGE, PIECE, Allowance, unpack

FOOTER = HEAD.pack(Opcode.FOOTER, 20)  # how the last record begins
ENDING = len(FOOTER) + 20 + len(MCAP0_MAGIC)
CHUNK = bytes([Opcode.CHUNK])
MOST_DAMAGES = 1000  # places after which the rest of a file is left alone
NOTHING = 2**63 - 1, 0  # start and end [ns] of no messages
# a channel and a schema of ROS 2, which are found even where the records around them are damaged
CHANNEL = re.compile(rb"\x04.{8}(..)(..)(..)\x00\x00(/[\w/]+)\x03\x00\x00\x00cdr", re.DOTALL)
SCHEMA = re.compile(rb"\x03.{8}(..)(..)\x00\x00([\w/]+)\x07\x00\x00\x00ros2(?:msg|idl)", re.DOTALL)


@dataclass(frozen=True)
class Part:
    """Messages that lie together: a chunk, or some of those outside of chunks."""

    start: int  # log times of first and last [ns]
    end: int
    place: Record
    channels: Collection[int]  # that have messages in it


@dataclass
class Contents:
    """What is in an MCAP file."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    parts: list[Part] = field(default_factory=list)
    counts: "Counter[int]" = field(default_factory=Counter)  # messages by channel

    def take(self, opcode: int, data: bytes) -> None:
        """Keep what a schema, channel, chunk index or the statistics tell, all else not."""
        if opcode == Opcode.SCHEMA and (schema := parsed(Schema, data)):
            self.schemas.setdefault(schema.id, schema)
        elif opcode == Opcode.CHANNEL and (channel := parsed(Channel, data)):
            self.channels.setdefault(channel.id, channel)
        elif opcode == Opcode.CHUNK_INDEX and (index := parsed(ChunkIndex, data)):
            start = index.chunk_start_offset + HEAD.size
            place = Record(Opcode.CHUNK, start, start - HEAD.size + index.chunk_length)
            times = index.message_start_time, index.message_end_time
            self.parts.append(Part(*times, place, index.message_index_offsets))
        elif opcode == Opcode.STATISTICS and (statistics := parsed(Statistics, data)):
            self.counts.update(statistics.channel_message_counts)

    @property
    def is_complete(self) -> bool:
        """Whether these are all messages, where they come from a summary."""
        indexed = {channel for part in self.parts for channel in part.channels}
        counted = {channel for channel, count in self.counts.items() if count}
        return counted == indexed and indexed <= self.channels.keys()

    def rescue(self, damaged: bytes) -> None:
        """Keep channels, and names of schemas, that can be told from damaged bytes.

        Of two with one number nobody knows which is right.
        """
        schemas: dict[int, list[str]] = defaultdict(list)
        for number, size, name in SCHEMA.findall(damaged):
            if len(name) == _int(size):
                schemas[_int(number)].append(name.decode())
        for number, names in schemas.items():
            if len(set(names)) == 1:
                self.schemas.setdefault(number, Schema(number, b"", "", names[0]))
        channels: dict[int, list[tuple[str, int]]] = defaultdict(list)
        for number, schema, size, topic in CHANNEL.findall(damaged):
            if len(topic) == _int(size):
                channels[_int(number)].append((topic.decode(), _int(schema)))
        for number, told in channels.items():
            if len(set(told)) == 1:
                self.channels.setdefault(number, Channel(number, told[0][0], CDR, {}, told[0][1]))


class McapFile:
    """An MCAP file, open for reading; raises `ValueError` if it is none."""

    def __init__(self, path: Path, _: Path, lose: Lose) -> None:
        self.name, self._lose = path.name, lose
        self._file = RecordFile(path)
        self.size = self._file.size
        try:
            self._contents = self._summary() or _Search(self, self._file).contents
        except BaseException:
            self.close()
            raise
        self._contents.parts.sort(key=attrgetter("start"))
        self.connections = list(self._connections())
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

    def unpacked(self, place: Record, allowance: Allowance) -> bytes:
        """Records of a part; raises `ValueError` if they are damaged, or too many."""
        if place.opcode == Opcode.MESSAGE:
            return self._file.read(place.start, place.end)
        record = self._file.record(place.start - HEAD.size)
        head = self._file.chunk_head(record) if record else None
        if head is None:
            raise ValueError("it is not where it should be")
        if head.size > LARGEST_CHUNK or head.packed[1] - head.packed[0] > LARGEST_CHUNK:
            raise ValueError(f"it is larger than {LARGEST_CHUNK >> 20} MiB")
        if head.compression:
            allowance.take(head.size)
        data = unpack(self._file.read(*head.packed), head.compression, head.size)
        if len(data) != head.size or (head.crc and zlib.crc32(data) != head.crc):
            raise DamagedError("its checksum is wrong", data)
        return data

    def _summary(self) -> Contents | None:
        """What a summary tells, if its checksum is right."""
        ending = self._file.read(max(0, self._file.size - ENDING), self._file.size)
        if not ending.startswith(FOOTER) or not ending.endswith(MCAP0_MAGIC):
            return None
        start, crc = _int(ending[9:17]), _int(ending[25:29])
        end = self._file.size - ENDING
        if not (crc and 0 < start < end) or end - start > LARGEST_CHUNK:
            return None
        summary = self._file.read(start, end)
        if zlib.crc32(summary + ending[:25]) != crc:
            return None
        contents = Contents()
        for record in records_in(summary):
            contents.take(record.opcode, summary[record.start : record.end])
        return contents if contents.is_complete else None

    def _connections(self) -> Iterator[Connection]:
        others: dict[str, list[str]] = defaultdict(list)
        for channel in self._contents.channels.values():
            schema = self._contents.schemas.get(channel.schema_id, Schema(0, b"", "", ""))
            if not (is_name(channel.topic) and is_name(schema.name)):
                self.lose(f"a topic that cannot be called so is left out: {channel.topic!r:.60}")
                continue
            if channel.message_encoding != CDR:
                others[channel.message_encoding].append(channel.topic)
                continue
            told = schema.data.decode("utf-8", "replace") if schema.encoding == "ros2msg" else ""
            count = self._contents.counts[channel.id]
            yield Connection(channel.id, channel.topic, schema.name, count, told)
        tell_encodings(self.name, others, self._lose)

    def _messages(
        self, number: int, part: Part, wanted: Mapping[int, Any], allowance: Allowance
    ) -> Iterator[tuple[int, int, int, int, int, bytes]]:
        """Yield log time, number of the part and in it, channel, publishing time and data.

        The first one is none, at the part's start: nothing is unpacked until its turn comes.
        """
        yield part.start, number, -1, 0, 0, b""
        found: list[tuple[int, int, int, int, int, bytes]] = []
        try:
            data = self.unpacked(part.place, allowance)
            for opcode, start, end in records_in(data):
                if opcode == Opcode.MESSAGE:
                    channel, _, log_time, publish_time = MESSAGE_HEAD.unpack_from(data, start)
                    if channel in wanted and end - start <= LARGEST_MESSAGE:
                        told = channel, publish_time, data[start + MESSAGE_HEAD.size : end]
                        found.append((log_time, number, len(found), *told))
                    elif channel in wanted:
                        self.lose(f"a message larger than {LARGEST_MESSAGE >> 20} MiB is left out")
        except ValueError as error:
            self.lose(f"a chunk is left out: {error}")
        yield from sorted(found)


class DamagedError(ValueError):
    """Wrong bytes, of which some may be told all the same."""

    def __init__(self, what: str, data: bytes) -> None:
        super().__init__(what)
        self.data = data


class _Search:
    """Goes through a file whose summary is missing or damaged, record by record."""

    def __init__(self, mcap: McapFile, file: RecordFile) -> None:
        self.contents = Contents()
        self._mcap, self._file = mcap, file
        self._allowance = Allowance(file.size)
        self._damaged: list[bytes] = []
        self._chunks = 0
        self._loose: list[Record] = []
        has_magic = file.read(0, len(MCAP0_MAGIC)) == MCAP0_MAGIC
        place, damages = len(MCAP0_MAGIC) if has_magic else -1, 0
        closed = False
        while not closed and place < file.size:
            record = file.record(place) if place >= 0 else None
            if record is None:
                self._end_row()
                is_chunk = self._chunks > 0 or file.read(max(0, place), place + 1) == CHUNK
                found = file.search(place + 1, chunks_only=is_chunk)
                damages += 1
                if found is None or damages > MOST_DAMAGES:
                    break
                self._damaged.append(file.read(max(0, place), min(found, place + LARGEST_CHUNK)))
                mcap.lose(f"damaged at byte {max(0, place)}, read on from byte {found}")
                place = found
                continue
            self._take(record)
            place = record.end
            closed = record.opcode == Opcode.FOOTER
        self._end_row()
        if not has_magic and not self.contents.parts:
            raise ValueError("no MCAP file" if file.size else "empty")
        if file.read(file.size - len(MCAP0_MAGIC), file.size) != MCAP0_MAGIC:
            mcap.lose("cut off, read up to the last whole message")
        elif not closed:
            mcap.lose(f"damaged at byte {max(0, place)}, not read from there on")
        self.contents.rescue(b"".join(self._damaged))
        nameless = self.contents.counts.keys() - self.contents.channels.keys()
        if count := sum(self.contents.counts[channel] for channel in nameless):
            mcap.lose(f"{count} messages are left out: their topic is not told")

    def _take(self, record: Record) -> None:
        if record.opcode == Opcode.MESSAGE:
            self._loose.append(record)
            if record.end - self._loose[0].start > PIECE:
                self._end_row()
            return
        self._end_row()
        if record.opcode == Opcode.CHUNK:
            self._chunks += 1
            self._look_into(record)
        elif record.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self.contents.take(record.opcode, self._file.read(record.start, record.end))

    def _end_row(self) -> None:
        """Make a part of the messages that follow each other outside of chunks."""
        if self._loose:
            start, end = self._loose[0].start - HEAD.size, self._loose[-1].end
            self._look_into(Record(Opcode.MESSAGE, start, end))
            self._loose.clear()

    def _look_into(self, place: Record) -> None:
        try:
            data = self._mcap.unpacked(place, self._allowance)
            counts: Counter[int] = Counter()
            first, last = NOTHING
            for opcode, start, end in records_in(data):
                if opcode == Opcode.MESSAGE:
                    channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(data, start)
                    counts[channel] += 1
                    first, last = min(first, log_time), max(last, log_time)
                elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self.contents.take(opcode, data[start:end])
        except ValueError as error:
            self._mcap.lose(f"a chunk is left out: {error}")
            if isinstance(error, DamagedError):
                self._damaged.append(error.data)
            return
        if counts:
            self.contents.parts.append(Part(first, last, place, counts))
            self.contents.counts += counts


def _int(data: bytes) -> int:
    return int.from_bytes(data, "little")
