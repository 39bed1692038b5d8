"""Read rosbag2 directories, damaged ones and those of killed recorders included, without ROS."""

from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from heapq import merge
from itertools import chain, pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml
import zstandard
from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from climber_uk.analysis.mending import MENDERS, is_torn
from climber_uk.analysis.storage import TYPESTORE

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"  # with which no serialised message begins


@dataclass
class Bag:
    """An open bag: its topics, its messages, and what of it could not be read."""

    path: Path
    readers: list[Reader]
    losses: list[str] = field(default_factory=list)  # in words, more while messages are read

    def __post_init__(self) -> None:
        self._stores: dict[str, Typestore | None] = {}

    @property
    def connections(self) -> list[Connection]:
        """Topic, type and number of messages, of each topic in each file."""
        return [connection for reader in self.readers for connection in reader.connections]

    @property
    def types(self) -> dict[str, str]:
        """Type of every topic."""
        return {connection.topic: connection.msgtype for connection in self.connections}

    def count(self, topics: Collection[str]) -> int:
        """Return how many messages of some topics there should be."""
        return sum(c.msgcount for c in self.connections if c.topic in topics)

    def raw_messages(self, topics: Collection[str]) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield connection, log time [ns] and serialised message in the order of the log times."""
        parts = [self._of(reader, topics) for reader in self.readers]
        ends = [(reader.start_time, reader.end_time) for reader in self.readers]
        is_split = all(end <= start for (_, end), (start, _) in pairwise(ends))
        yield from chain(*parts) if is_split else merge(*parts, key=lambda message: message[1])

    def messages(self, topics: Collection[str]) -> Iterator[tuple[Connection, int, Any]]:
        """Yield the same with deserialised messages."""
        for connection, log_time, data in self.raw_messages(topics):
            store = self.store(connection)
            assert store is not None
            try:
                message = store.deserialize_cdr(data, connection.msgtype)
            except Exception as error:  # as below
                self.lose(f"{connection.topic}: a message cannot be read ({_line(error)})")
                continue
            yield connection, log_time, message

    def lose(self, what: str) -> None:
        """Note something that could not be read, once."""
        if what not in self.losses:
            self.losses.append(what)

    def store(self, connection: Connection) -> Typestore | None:
        """Definition of a topic's type, as the bag gives it or as Jazzy has it; None if unknown."""
        name = connection.msgtype
        if name not in self._stores:
            self._stores[name] = _store(connection)
            if self._stores[name] is None:
                self.lose(f"{connection.topic}: type {name} is unknown")
        return self._stores[name]

    def _of(self, reader: Reader, topics: Collection[str]) -> Iterator[Any]:
        wanted = [c for c in reader.connections if c.topic in topics and self.store(c)]
        if not wanted:
            return  # to rosbags, none means all
        try:
            for connection, log_time, data in reader.messages(wanted):
                if data[:4] == ZSTD_MAGIC:
                    data = zstandard.decompress(data)
                yield connection, log_time, data
        except Exception as error:  # there is no telling what damaged bytes do to their readers
            self.lose(f"{Path(str(reader.path)).name}: damaged, read in part ({_line(error)})")


@contextmanager
def open_bag(path: str | Path) -> Iterator[Bag]:
    """Open a rosbag2 directory or one storage file, with or without its metadata.

    Torn files are read up to their last whole message, from mended copies. Raises
    `FileNotFoundError` if there is nothing at `path`, `ValueError` if that is no readable bag.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"there is no bag {path}")
    losses: list[str] = []
    failures: list[str] = []
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(TemporaryDirectory(prefix="climber_bag_")))
        readers = []
        for file in _files(path, losses):
            try:
                readers.append(stack.enter_context(Reader(_readable(file, scratch, losses))))
            except Exception as error:  # as above
                failures.append(f"{file.name}: {_line(error)}")
        if not readers:
            why = "; ".join(failures) or "neither metadata.yaml nor an .mcap or .db3 file in it"
            raise ValueError(f"{path} is no readable bag: {why}")
        losses += [f"{failure}: not read" for failure in failures]
        yield Bag(path, sorted(readers, key=lambda reader: reader.start_time), losses)


def read_messages(
    path: str | Path, topics: Collection[str] | None = None
) -> Iterator[tuple[str, int, Any]]:
    """Yield topic, log time [ns] and deserialised message in the order of the log times.

    `topics` selects by full names (default: all). Raises as `open_bag` does; what cannot be read,
    or is of an unknown type, is left out.
    """
    with open_bag(path) as bag:
        for connection, log_time, message in bag.messages(bag.types if topics is None else topics):
            yield connection.topic, log_time, message


def _files(bag: Path, losses: list[str]) -> list[Path]:
    """Storage files of a bag: those that metadata.yaml names, else those that are there."""
    if not bag.is_dir():
        return [bag]
    present = [file for file in sorted(bag.iterdir()) if _storage_suffix(file) in MENDERS]
    try:
        metadata = yaml.safe_load((bag / "metadata.yaml").read_text())
        named = metadata["rosbag2_bagfile_information"]["relative_file_paths"]
        listed = [bag / Path(name).name for name in named]
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError):
        losses.append("metadata.yaml: missing or damaged, not needed")
        return present
    losses += [f"{file.name}: not there" for file in listed if not file.exists()]
    return [file for file in listed if file.exists()]


def _readable(file: Path, scratch: Path, losses: list[str]) -> Path:
    """Return what rosbags can open: the file, or an unpacked or mended copy of it in `scratch`."""
    if file.suffix == ".zstd":
        packed, file = file, scratch / file.stem
        with packed.open("rb") as source, file.open("wb") as target:
            zstandard.ZstdDecompressor().copy_stream(source, target)
    if not is_torn(file):
        return file
    losses.append(f"{file.name}: cut off, read up to the last whole message")
    mended = scratch / f"mended_{file.name}"
    MENDERS[file.suffix](file, mended)
    return mended


def _storage_suffix(file: Path) -> str:
    return Path(file.stem).suffix if file.suffix == ".zstd" else file.suffix


def _store(connection: Connection) -> Typestore | None:
    name, definition = connection.msgtype, connection.msgdef
    if definition.format == MessageDefinitionFormat.MSG:
        try:
            store = get_typestore(Stores.EMPTY)
            store.register(get_types_from_msg(definition.data, name))
            store.get_msgdef(name)
            return store
        except Exception:  # as above
            pass
    return TYPESTORE if name in TYPESTORE.fielddefs else None


def _line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
