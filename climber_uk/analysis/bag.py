"""Read rosbag2 directories, those of killed recorders included, without a ROS installation."""

import shutil
import sqlite3
import struct
from collections.abc import Callable, Collection, Iterator
from contextlib import closing, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

from mcap.exceptions import McapError
from mcap.records import Channel, Header, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag2 import ReaderError

from climber_uk.analysis.storage import TYPESTORE


def read_messages(
    path: str | Path, topics: Collection[str] | None = None
) -> Iterator[tuple[str, int, Any]]:
    """Yield topic, log time [ns] and deserialised message in the order of the log times.

    `path` is a rosbag2 directory or one storage file, `topics` selects by full names (default:
    all). What a killed recorder left is read up to its last whole message, from a mended copy.
    Raises `FileNotFoundError` if there is nothing at `path`, `ValueError` if that is no bag.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"there is no bag {path}")
    try:
        with TemporaryDirectory(prefix="climber_bag_") as scratch:
            yield from _read(_readable(path, Path(scratch)), topics)
    except (AnyReaderError, ReaderError, McapError, sqlite3.Error) as error:
        raise ValueError(f"{path} is no readable bag: {error}") from error


def _read(paths: list[Path], topics: Collection[str] | None) -> Iterator[tuple[str, int, Any]]:
    # the type store serves old bags, which do not contain the definitions of their types
    with AnyReader(paths, default_typestore=TYPESTORE) as reader:
        wanted = [c for c in reader.connections if topics is None or c.topic in topics]
        if not wanted:
            return  # to rosbags, none means all
        for connection, log_time, data in reader.messages(wanted):
            yield connection.topic, log_time, reader.deserialize(data, connection.msgtype)


def _readable(bag: Path, scratch: Path) -> list[Path]:
    """Return what rosbags can open: the bag, or a mended copy of it in `scratch`."""
    inside = sorted(bag.iterdir()) if bag.is_dir() else [bag]
    files = [file for file in inside if file.suffix in MENDERS]
    described = bag / "metadata.yaml" in inside
    if not files and not described:
        raise ValueError(f"{bag} is no bag: neither metadata.yaml nor an .mcap or .db3 file")
    if not any(_is_torn(file) for file in files):
        return [bag] if described else files
    for file in files:
        mend = MENDERS[file.suffix] if _is_torn(file) else _link
        mend(file, scratch / file.name)
    if described:
        _link(bag / "metadata.yaml", scratch / "metadata.yaml")
        return [scratch]
    return [scratch / file.name for file in files]


def _is_torn(file: Path) -> bool:
    """Whether the recorder of this file was killed before, or while, it wrote the end."""
    if file.suffix == ".db3":
        return any(journal.exists() for journal in _journals(file))
    with file.open("rb") as stream:
        stream.seek(max(0, file.stat().st_size - len(MCAP0_MAGIC)))
        return stream.read() != MCAP0_MAGIC


def _link(file: Path, link: Path) -> None:
    link.symlink_to(file.absolute())


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
    with closing(sqlite3.connect(mended)) as database:
        database.execute("PRAGMA journal_mode = DELETE")  # rosbags reads nothing but the file
        database.execute("SELECT count(*) FROM sqlite_master").fetchone()


def _journals(database: Path) -> list[Path]:
    return [database.with_name(database.name + ending) for ending in ("-journal", "-wal")]


MENDERS: dict[str, Callable[[Path, Path], None]] = {".mcap": _mend_mcap, ".db3": _mend_sqlite3}
