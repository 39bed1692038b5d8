"""Records of an MCAP file, distinguished from damage by how they follow each other.

A record is its opcode, its length and its contents. One is sound if its own lengths agree and
what comes behind it may be a record, or the end.
"""

import re
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from struct import Struct, error
from typing import NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from climber_uk.bags.unpacking import LARGEST_CHUNK, PIECE, Allowance, unpack

HEAD = Struct("<BQ")  # of a record: opcode and length
CHUNK_HEAD = Struct("<QQQII")  # log times of first and last, size, CRC, length of the compression
MESSAGE_HEAD = Struct("<HIQQ")  # channel, sequence, log time, publishing time
LARGEST_RECORD = 2**40  # [bytes]
MOST_SEARCHED = 2**30  # [bytes] of damage that are searched for sound records
MOST_CANDIDATES = 100_000  # that are looked at on that search
IN_A_ROW = 3  # messages that make a start outside of chunks
# What these begin with; a chunk's lengths have to agree as well
CHUNK = re.compile(rb"\x06(?=.{7}\x00.{28}(?:\x00{4}|\x03\x00{3}lz4|\x04\x00{3}zstd))", re.DOTALL)
MESSAGE = re.compile(rb"\x05(?=.{4}\x00{4})", re.DOTALL)
LONGEST_MATCH = 64
T = TypeVar("T", Schema, Channel, ChunkIndex, Statistics)


class Record(NamedTuple):
    """Where a record is."""

    opcode: int
    start: int  # of its contents
    end: int


class ChunkHead(NamedTuple):
    """Head of a chunk."""

    size: int  # [bytes] unpacked
    crc: int
    compression: str
    packed: tuple[int, int]  # where its messages begin and end in the file


class DamagedError(ValueError):
    """Bytes with a wrong checksum; some of what is in them may be right."""

    def __init__(self, what: str, data: bytes) -> None:
        super().__init__(what)
        self.data = data


class RecordFile:
    """An MCAP file, from which any part can be read."""

    def __init__(self, path: Path) -> None:
        self._stream = path.open("rb", buffering=2**16)
        self.size = self._stream.seek(0, 2)
        self._searched = self._candidates = 0

    def read(self, start: int, end: int) -> bytes:
        """Bytes from `start` to `end`, fewer at the end of the file."""
        self._stream.seek(start)
        return self._stream.read(min(end, self.size) - start)

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    def record(self, place: int) -> Record | None:
        """Return the record at `place`, if there is a sound one."""
        head = self.read(place, place + HEAD.size)
        if len(head) < HEAD.size or not _may_begin(head):
            return None
        opcode, length = HEAD.unpack(head)
        found = Record(opcode, place + HEAD.size, place + HEAD.size + length)
        if found.end > self.size or (opcode == Opcode.CHUNK and self.chunk_head(found) is None):
            return None
        if opcode == Opcode.MESSAGE and length < MESSAGE_HEAD.size:
            return None
        behind = self.read(found.end, found.end + HEAD.size)
        is_end = behind[: len(MCAP0_MAGIC)] == MCAP0_MAGIC or len(behind) < HEAD.size
        return found if is_end or _may_begin(behind) else None

    def chunk_head(self, record: Record) -> ChunkHead | None:
        """Return the head of a chunk, if its lengths agree, else None."""
        head = self.read(record.start, record.start + CHUNK_HEAD.size + 16)
        if record.opcode != Opcode.CHUNK or len(head) < CHUNK_HEAD.size + 8:
            return None
        _, _, size, crc, length = CHUNK_HEAD.unpack_from(head)
        behind = CHUNK_HEAD.size + length + 8
        if length > 4 or record.start + behind > record.end:
            return None
        compression = head[CHUNK_HEAD.size : behind - 8]
        packed = record.start + behind, record.end
        if int.from_bytes(head[behind - 8 : behind], "little") != packed[1] - packed[0]:
            return None
        return ChunkHead(size, crc, compression.decode("ascii", "replace"), packed)

    def unpacked(self, place: Record, allowance: Allowance) -> bytes:
        """Messages of a chunk, or of a row of them; raises `ValueError` if they cannot be read."""
        if place.opcode == Opcode.MESSAGE:
            return self.read(place.start, place.end)
        record = self.record(place.start - HEAD.size)
        head = self.chunk_head(record) if record else None
        if head is None:
            raise ValueError("it is not where it should be")
        if head.size > LARGEST_CHUNK or head.packed[1] - head.packed[0] > LARGEST_CHUNK:
            raise ValueError(f"it is larger than {LARGEST_CHUNK >> 20} MiB")
        if head.compression:
            allowance.take(head.size)
        data = unpack(self.read(*head.packed), head.compression, head.size)
        if len(data) != head.size or (head.crc and zlib.crc32(data) != head.crc):
            raise DamagedError("its checksum is wrong", data)
        return data

    def search(self, place: int, chunks_only: bool) -> int | None:
        """Return the next place from which on there is a sound chunk, or some sound messages."""
        for found in self._matches(CHUNK, place):
            if self.record(found):
                return found
        for found in [] if chunks_only else self._matches(MESSAGE, place):
            at, count = found, 0
            while (message := self.record(at)) and message.opcode == Opcode.MESSAGE:
                at, count = message.end, count + 1
                if count == IN_A_ROW:
                    return found
        return None

    def _matches(self, pattern: "re.Pattern[bytes]", place: int) -> Iterator[int]:
        while place < self.size and self._searched < MOST_SEARCHED:
            piece = self.read(place, place + PIECE + LONGEST_MATCH)
            for match in pattern.finditer(piece):
                self._candidates += 1
                if self._candidates > MOST_CANDIDATES:
                    return
                if match.start() < PIECE:
                    yield place + match.start()
            place += PIECE
            self._searched += PIECE


def _may_begin(head: bytes) -> bool:
    opcode, length = HEAD.unpack(head)
    return 0 < opcode <= Opcode.DATA_END and length < LARGEST_RECORD


def records_in(data: bytes) -> Iterator[Record]:
    """Records that follow each other; raises `ValueError` where they do not."""
    place = 0
    while place < len(data):
        if place + HEAD.size > len(data):
            raise ValueError("records do not follow each other")
        opcode, length = HEAD.unpack_from(data, place)
        record = Record(opcode, place + HEAD.size, place + HEAD.size + length)
        if record.end > len(data) or (opcode == Opcode.MESSAGE and length < MESSAGE_HEAD.size):
            raise ValueError("records do not follow each other")
        yield record
        place = record.end


def parsed(kind: type[T], data: bytes) -> T | None:
    """Return a record with its contents, if these are what they should be."""
    try:
        return kind.read(ReadDataStream(BytesIO(data)))  # type: ignore[return-value]
    except (McapError, ValueError, error):
        return None
