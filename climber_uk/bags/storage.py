"""The storage files of a rosbag2 directory, of which a killed writer loses only the last write.

`rosbags` writes such files too, but those that were not closed do not open. These are complete
after every `write`.
"""

import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import IO, Any, cast

import yaml
from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

TYPESTORE = get_typestore(Stores.ROS2_JAZZY)

# log time [ns], publish time [ns], id of the topic, serialised message
Message = tuple[int, int, int, bytes]
Qos = Mapping[str, Any]  # a profile as metadata.yaml holds it


@dataclass(frozen=True)
class Topic:
    """A recorded topic, its type and the profiles its publishers offer."""

    id: int  # counted from 1
    name: str
    type_name: str
    offered_qos: Sequence[Qos]

    @cached_property
    def definition(self) -> str:
        """The message definition, with those of the types it contains."""
        return TYPESTORE.generate_msgdef(self.type_name, ros_version=2)[0]

    @cached_property
    def type_hash(self) -> str:
        """The RIHS01 hash of the type."""
        return TYPESTORE.hash_rihs01(self.type_name)

    @property
    def metadata(self) -> dict[str, Any]:
        """What metadata.yaml says of the topic."""
        return {
            "name": self.name,
            "type": self.type_name,
            "serialization_format": "cdr",
            "offered_qos_profiles": list(self.offered_qos),
            "type_description_hash": self.type_hash,
        }

    @property
    def qos_text(self) -> str:
        """The offered profiles as the storage files hold them."""
        return to_yaml(list(self.offered_qos)).strip()


class Mcap:
    """A new MCAP file of uncompressed chunks, with all its indexes once it is closed.

    `stem` is its path without the suffix. It opens after every `write`, whatever comes.
    """

    def __init__(self, stem: Path, _: str) -> None:
        self.path = stem.with_name(f"{stem.name}.mcap")
        self._stream = _EndedStream(self.path)
        self._writer = Writer(cast(IO[bytes], self._stream), compression=CompressionType.NONE)
        self._writer.start(profile="ros2", library="climber_uk")
        self._schemas: dict[str, int] = {}

    def add_topic(self, topic: Topic) -> None:
        """Store the topic as a channel and its type as a schema."""
        if topic.type_name not in self._schemas:
            self._schemas[topic.type_name] = self._writer.register_schema(
                topic.type_name, "ros2msg", topic.definition.encode()
            )
        # the writer counts channels from 1 too, so that a channel's id is the topic's
        self._writer.register_channel(
            topic.name,
            "cdr",
            self._schemas[topic.type_name],
            {"offered_qos_profiles": topic.qos_text, "topic_type_hash": topic.type_hash},
        )

    def write(self, messages: Sequence[Message]) -> None:
        """Append the messages as chunks."""
        for log_time, publish_time, topic_id, data in messages:
            self._writer.add_message(topic_id, log_time, data, publish_time)
        self._writer.flush()

    def close(self, metadata: str) -> None:
        """Append the bag's metadata, and a summary."""
        self._writer.add_metadata("rosbag2", {"serialized_metadata": metadata})
        self._writer.finish()
        self._stream.close()


class _EndedStream:
    """A file to which each flush appends, and after that an ending which the next one overwrites.

    Readers refuse an MCAP file without an ending. This one says "no summary: scan me" and stays
    50 bytes however long the recording gets, where a summary of all chunks would be rewritten,
    ever longer, with each flush. The gap left is a kill within one write to the page cache;
    `climber_uk.bags.bag` recovers that file.
    """

    def __init__(self, path: Path) -> None:
        builder = RecordBuilder()
        DataEnd(0).write(builder)
        Footer(0, 0, 0).write(builder)
        self._ending = cast(bytes, builder.end()) + MCAP0_MAGIC
        self._path = path
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        self._written = 0
        self._pending = bytearray()

    def write(self, data: bytes) -> int:
        self._pending += data
        return len(data)

    def tell(self) -> int:
        return self._written + len(self._pending)

    def flush(self) -> None:
        self._append(self._pending + self._ending)
        self._written += len(self._pending)
        self._pending.clear()

    def close(self) -> None:
        try:
            self._append(self._pending)  # which now brings its own, longer ending
        finally:
            os.close(self._file)

    def _append(self, data: bytearray) -> None:
        done = 0
        try:
            while done < len(data):
                done += os.pwrite(self._file, memoryview(data)[done:], self._written + done)
        except OSError as error:  # a full disk, but there is room where the last ending was
            os.ftruncate(self._file, self._written)
            os.pwrite(self._file, self._ending, self._written)
            error.filename = str(self._path)
            raise


class Sqlite3:
    """A new SQLite database with version 4 of rosbag2's schema; `stem` and the rest as of `Mcap`.

    `distro` is the name of the ROS distribution that is stored in it.
    """

    SCHEMA = """
        CREATE TABLE schema (schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
        CREATE TABLE metadata (
            id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
        CREATE TABLE topics (
            id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
            serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL,
            type_description_hash TEXT NOT NULL);
        CREATE TABLE message_definitions (
            id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
            encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
        CREATE TABLE messages (
            id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
            data BLOB NOT NULL);
        CREATE INDEX timestamp_idx ON messages (timestamp ASC);
    """

    def __init__(self, stem: Path, distro: str) -> None:
        self.path = stem.with_name(f"{stem.name}.db3")
        self._types: set[str] = set()
        self._database = sqlite3.connect(self.path)
        with ExitStack() as stack, self._transaction() as database:
            stack.callback(self._database.close)
            # Between two commits all rows have to be in the file itself: rosbags reads nothing
            # beside it, so no write-ahead log. Waiting for the disk, which is off in rosbag2 too,
            # would guard against power cuts, not against a kill.
            database.executescript("PRAGMA journal_mode = DELETE; PRAGMA synchronous = OFF;")
            database.executescript(f"BEGIN; {self.SCHEMA} COMMIT;")
            database.execute("INSERT INTO schema VALUES (4, ?)", (distro,))
            stack.pop_all()  # it stays open

    def add_topic(self, topic: Topic) -> None:
        """Store the topic, and its type where that is new."""
        of_topic = (topic.id, topic.name, topic.type_name, "cdr", topic.qos_text, topic.type_hash)
        of_type = (None, topic.type_name, "ros2msg", topic.definition, topic.type_hash)
        with self._transaction() as database:
            database.execute("INSERT INTO topics VALUES (?, ?, ?, ?, ?, ?)", of_topic)
            if topic.type_name not in self._types:
                database.execute("INSERT INTO message_definitions VALUES (?, ?, ?, ?, ?)", of_type)
        self._types.add(topic.type_name)

    def write(self, messages: Sequence[Message]) -> None:
        """Insert the messages in one transaction."""
        rows = [(topic_id, log_time, data) for log_time, _, topic_id, data in messages]
        with self._transaction() as database:
            database.executemany("INSERT INTO messages VALUES (NULL, ?, ?, ?)", rows)

    def close(self, metadata: str) -> None:
        """Insert the bag's metadata."""
        with closing(self._database), self._transaction() as database:
            database.execute("INSERT INTO metadata VALUES (NULL, 9, ?)", (metadata,))

    @contextmanager
    def _transaction(self) -> Iterator[sqlite3.Connection]:
        try:
            with self._database:
                yield self._database
        except sqlite3.Error as error:  # a full disk should look the same in each storage
            raise OSError(f"{self.path}: {error}") from error


STORAGES: dict[str, type[Mcap | Sqlite3]] = {"mcap": Mcap, "sqlite3": Sqlite3}


def is_known(type_name: str) -> bool:
    """Whether the definition of a message type is at hand; a bag has to contain it."""
    return type_name in TYPESTORE.fielddefs


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Writes equal parts out instead of referring from one to the other."""

    def ignore_aliases(self, data: object) -> bool:
        return True


def to_yaml(data: object) -> str:
    """Write YAML in block style, in the order given."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False)
