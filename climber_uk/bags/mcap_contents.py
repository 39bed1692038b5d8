"""What is in an MCAP file: from its summary, or from all of its records as far as they are sound.

A file that was closed has a summary with a checksum, which says where all chunks are. In any other
file all records are visited, past what is damaged.
"""

import re
import zlib
from collections import Counter, defaultdict
from collections.abc import Collection
from dataclasses import dataclass, field

from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from climber_uk.bags.connection import CDR, Lose
from climber_uk.bags.mcap_records import (
    HEAD,
    MESSAGE_HEAD,
    DamagedError,
    Record,
    RecordFile,
    parsed,
    records_in,
)
from climber_uk.bags.unpacking import LARGEST_MESSAGE, PIECE, Allowance

FOOTER = HEAD.pack(Opcode.FOOTER, 20)  # how the last record begins
ENDING = len(FOOTER) + 20 + len(MCAP0_MAGIC)
CHUNK = bytes([Opcode.CHUNK])
MOST_DAMAGES = 1000  # places after which the rest of a file is left alone
MOST_PARTS = 10**6  # chunks, and rows of messages outside of chunks
LARGEST_SUMMARY = 2**26  # [bytes]
MOST_KEPT = 2**26  # [bytes] of what is damaged, in which topics are looked for
NOTHING = 2**63 - 1, 0  # start and end [ns] of no messages
# a channel and a schema of ROS 2, which are found even where the records around them are damaged
CHANNEL = re.compile(rb"\x04.{8}(..)(..)(..)\x00\x00(/[\w/]+)\x03\x00\x00\x00cdr", re.DOTALL)
SCHEMA = re.compile(rb"\x03.{8}(..)(..)\x00\x00([\w/]+)\x07\x00\x00\x00ros2(?:msg|idl)", re.DOTALL)


@dataclass(frozen=True)
class FilePart:
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
    parts: list[FilePart] = field(default_factory=list)
    counts: "Counter[int]" = field(default_factory=Counter)  # messages by channel

    def take(self, opcode: int, data: bytes) -> None:
        """Keep a schema, a channel, a chunk index or the statistics; other records do not count."""
        if opcode == Opcode.SCHEMA and (schema := parsed(Schema, data)):
            self.schemas.setdefault(schema.id, schema)
        elif opcode == Opcode.CHANNEL and (channel := parsed(Channel, data)):
            self.channels.setdefault(channel.id, channel)
        elif opcode == Opcode.CHUNK_INDEX and (index := parsed(ChunkIndex, data)):
            start = index.chunk_start_offset + HEAD.size
            place = Record(Opcode.CHUNK, start, start - HEAD.size + index.chunk_length)
            times = index.message_start_time, index.message_end_time
            self.parts.append(FilePart(*times, place, index.message_index_offsets))
        elif opcode == Opcode.STATISTICS and (statistics := parsed(Statistics, data)):
            self.counts.update(statistics.channel_message_counts)

    @property
    def is_complete(self) -> bool:
        """Whether these are all messages, where they come from a summary."""
        indexed = {channel for part in self.parts for channel in part.channels}
        counted = {channel for channel, count in self.counts.items() if count}
        return counted == indexed and indexed <= self.channels.keys()

    def rescue(self, damaged: bytearray) -> None:
        """Keep channels, and names of schemas, that are found among damaged bytes.

        Where two differ under one number, neither is kept.
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
        for number, pairs in channels.items():
            if len(set(pairs)) == 1:
                self.channels.setdefault(number, Channel(number, pairs[0][0], CDR, {}, pairs[0][1]))


def from_summary(file: RecordFile) -> Contents | None:
    """Contents by a file's summary, if its checksum is right and it is complete, else None."""
    ending = file.read(max(0, file.size - ENDING), file.size)
    if not ending.startswith(FOOTER) or not ending.endswith(MCAP0_MAGIC):
        return None
    start, crc = _int(ending[9:17]), _int(ending[25:29])
    end = file.size - ENDING
    if not (crc and 0 < start < end) or end - start > LARGEST_SUMMARY:
        return None
    summary = file.read(start, end)
    contents = Contents()
    try:
        for record in records_in(summary):
            contents.take(record.opcode, summary[record.start : record.end])
    except ValueError:
        return None
    is_sound = zlib.crc32(summary + ending[:25]) == crc
    return contents if is_sound and contents.is_complete else None


def from_records(file: RecordFile, lose: Lose) -> Contents:
    """Contents by all records of a file, past damage; raises `ValueError` if there are none."""
    return _Search(file, lose).contents


class _Search:
    """Goes through a file record by record."""

    def __init__(self, file: RecordFile, lose: Lose) -> None:
        self.contents = Contents()
        self._file, self._lose = file, lose
        self._allowance = Allowance(file.size)
        self._damaged = bytearray()
        self._has_chunks = False
        self._row: list[Record] = []  # messages that follow each other outside of chunks
        self._go_through()
        self.contents.rescue(self._damaged)
        nameless = self.contents.counts.keys() - self.contents.channels.keys()
        if count := sum(self.contents.counts[channel] for channel in nameless):
            lose(f"{count} messages are left out: their topic is unknown")

    def _go_through(self) -> None:
        file, magic = self._file, len(MCAP0_MAGIC)
        is_mcap = file.read(0, magic) == MCAP0_MAGIC
        place: int | None = magic if is_mcap else self._next(0)
        damages = 0
        while place is not None and place < file.size:
            if record := file.record(place):
                self._take(record)
                place = record.end if record.opcode != Opcode.FOOTER else None
                continue
            damages += 1
            found = self._next(place) if damages <= MOST_DAMAGES else None
            if found is None:
                if file.read(file.size - magic, file.size) == MCAP0_MAGIC:
                    self._lose(f"damaged at byte {place}, not read from there on")
                break
            self._keep(file.read(place, min(found, place + MOST_KEPT)))
            self._lose(f"damaged at byte {place}, read on from byte {found}")
            place = found
        self._end_row()
        if not is_mcap and not self.contents.parts:
            raise ValueError("no MCAP file" if file.size else "empty")
        if file.read(file.size - magic, file.size) != MCAP0_MAGIC:
            self._lose("cut off, read up to the last whole message")

    def _next(self, place: int) -> int | None:
        """The next sound place behind one that is not."""
        self._end_row()
        is_chunk = self._has_chunks or self._file.read(place, place + 1) == CHUNK
        return self._file.search(place + 1, chunks_only=is_chunk)

    def _take(self, record: Record) -> None:
        size = record.end - record.start
        if record.opcode == Opcode.MESSAGE and size <= LARGEST_MESSAGE:
            self._row.append(record)
            if record.end - self._row[0].start > PIECE:
                self._end_row()
            return
        self._end_row()
        if record.opcode == Opcode.CHUNK:
            self._has_chunks = True
            self._look_into(record)
        elif record.opcode in (Opcode.SCHEMA, Opcode.CHANNEL) and size <= LARGEST_MESSAGE:
            self.contents.take(record.opcode, self._file.read(record.start, record.end))

    def _end_row(self) -> None:
        if self._row:
            start, end = self._row[0].start - HEAD.size, self._row[-1].end
            self._look_into(Record(Opcode.MESSAGE, start, end))
            self._row.clear()

    def _look_into(self, place: Record) -> None:
        """Keep what is in a chunk, or in a row of messages."""
        if len(self.contents.parts) == MOST_PARTS:
            self._lose(f"more than {MOST_PARTS} chunks, of which the others are left out")
            return
        counts: Counter[int] = Counter()
        first, last = NOTHING
        try:
            data = self._file.unpacked(place, self._allowance)
            for opcode, start, end in records_in(data):
                if opcode == Opcode.MESSAGE:
                    channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(data, start)
                    counts[channel] += 1
                    first, last = min(first, log_time), max(last, log_time)
                elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self.contents.take(opcode, data[start:end])
        except ValueError as error:
            self._lose(f"a chunk is left out: {error}")
            if isinstance(error, DamagedError):
                self._keep(error.data)
            return
        if counts:
            self.contents.parts.append(FilePart(first, last, place, frozenset(counts)))
            self.contents.counts.update(counts)

    def _keep(self, damaged: bytes) -> None:
        self._damaged += damaged[: MOST_KEPT - len(self._damaged)]


def _int(data: bytes) -> int:
    return int.from_bytes(data, "little")
