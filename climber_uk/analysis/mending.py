"""Storage files whose end is missing, copied so far that they open.

What a killed recorder or an interrupted copy leaves: nothing is done to the file itself.
"""

import shutil
import sqlite3
import struct
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.records import Channel, Header, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer


def is_torn(file: Path) -> bool:
    """Whether the recorder of this file was killed before, or while, it wrote the end."""
    if file.suffix == ".db3":
        return any(journal.exists() for journal in _journals(file)) or _is_short(file)
    with file.open("rb") as stream:
        stream.seek(max(0, file.stat().st_size - len(MCAP0_MAGIC)))
        return stream.read() != MCAP0_MAGIC


def _is_short(database: Path) -> bool:
    """Whether a database has fewer pages than its header says."""
    with database.open("rb") as stream:
        header = stream.read(100)
    if len(header) < 100:
        return True
    page_size = int.from_bytes(header[16:18])
    page_size = 65536 if page_size == 1 else page_size
    return database.stat().st_size < page_size * int.from_bytes(header[28:32])


def _mend_mcap(torn: Path, mended: Path) -> None:
    """Copy the whole records, and add the indexes by which their order can be read."""
    with torn.open("rb") as source, mended.open("wb") as target:
        writer = Writer(target, compression=CompressionType.NONE)
        schemas: dict[int, int] = {}
        channels: dict[int, int] = {}
        for record in _whole_records(source):
            match record:
                case Header():
                    writer.start(record.profile)
                case Schema() if record.id not in schemas:
                    schemas[record.id] = writer.register_schema(
                        record.name, record.encoding, record.data
                    )
                case Channel() if record.id not in channels:
                    channels[record.id] = writer.register_channel(
                        record.topic,
                        record.message_encoding,
                        schemas.get(record.schema_id, 0),
                        record.metadata,
                    )
                case Message() if record.channel_id in channels:
                    writer.add_message(
                        channels[record.channel_id],
                        record.log_time,
                        record.data,
                        record.publish_time,
                        record.sequence,
                    )
        writer.finish()


def _whole_records(source: BinaryIO) -> Iterator[McapRecord]:
    with suppress(McapError, ValueError, struct.error):  # what the torn end gives
        yield from StreamReader(source, validate_crcs=True).records


def _mend_sqlite3(torn: Path, mended: Path) -> None:
    """Copy the database with its journal, and let SQLite finish or take back the last write."""
    shutil.copyfile(torn, mended)
    for journal, copy in zip(_journals(torn), _journals(mended), strict=True):
        if journal.exists():
            shutil.copyfile(journal, copy)
    with closing(_connect(mended)) as database:
        database.execute("PRAGMA journal_mode = DELETE")  # rosbags reads nothing but the file
        database.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if _is_short(mended):
        _copy_rows(mended)


def _connect(database: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(database)
    connection.execute("PRAGMA writable_schema = ON")  # else one with missing pages does not open
    return connection


def _copy_rows(short: Path) -> None:
    """Leave of a database the rows that come before its first missing page."""
    whole = short.with_name(f"{short.name}.whole")
    with closing(_connect(short)) as source, closing(_connect(whole)) as target:
        tables = source.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'")
        for name, definition in tables.fetchall():
            target.execute(definition)
            with suppress(sqlite3.DatabaseError):
                for row in source.execute(f'SELECT * FROM "{name}" NOT INDEXED'):
                    target.execute(f'INSERT INTO "{name}" VALUES ({",".join("?" * len(row))})', row)
        target.commit()
    whole.replace(short)


def _journals(database: Path) -> list[Path]:
    return [database.with_name(database.name + ending) for ending in ("-journal", "-wal")]


MENDERS: dict[str, Callable[[Path, Path], None]] = {".mcap": _mend_mcap, ".db3": _mend_sqlite3}
