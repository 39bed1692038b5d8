"""Read rosbag2 directories, damaged and hostile ones and those of killed recorders included.

Nothing is written but copies in a temporary directory, and nothing is believed: see the readers of
the two kinds of files.
"""

from collections.abc import Collection, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from heapq import merge
from itertools import chain, pairwise
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rosbags.typesys.store import Typestore

from climber_uk.bags.bag_files import open_file, other_files, storage_files
from climber_uk.bags.connection import Connection, Logged, StorageFile, one_line
from climber_uk.bags.definitions import LONGEST, defined, known
from climber_uk.bags.unpacking import LARGEST_MESSAGE, ZSTD_MAGIC, Allowance, unpack

MOST_LOSSES = 20  # that are told
MOST_DEFINITIONS = 4  # of the longest that are read


@dataclass
class Bag:
    """An open bag: its topics, its messages, and what of it could not be read."""

    path: Path
    files: list[StorageFile] = field(default_factory=list)  # in the order of their first log times
    losses: list[str] = field(default_factory=list)  # in words, more while messages are read

    def __post_init__(self) -> None:
        self._stores: dict[str, Typestore | None] = {}
        self._defined = 0

    @property
    def connections(self) -> list[Connection]:
        """Topic, type and number of messages, of each topic in each file."""
        return [connection for file in self.files for connection in file.connections]

    @property
    def types(self) -> dict[str, str]:
        """Type of every topic; of two the one with more messages."""
        by_count = sorted(self.connections, key=attrgetter("msgcount"))
        return {connection.topic: connection.msgtype for connection in by_count}

    def count(self, topics: Collection[str]) -> int:
        """Return how many messages of some topics there should be."""
        return sum(c.msgcount for c in self.connections if c.topic in topics)

    def recorded(self, topics: Collection[str]) -> Iterator[Logged]:
        """Yield the serialised messages of some topics in the order of the log times."""
        parts = [self._of(file, topics) for file in self.files]
        ends = [(file.start, file.end) for file in self.files]
        is_split = all(end <= start for (_, end), (start, _) in pairwise(ends))
        yield from chain(*parts) if is_split else merge(*parts, key=lambda message: message[1])

    def messages(self, topics: Collection[str]) -> Iterator[tuple[Connection, int, int, Any]]:
        """Yield connection, log time, publishing time (0: not told) [ns] and message."""
        for connection, log_time, publish_time, data in self.recorded(topics):
            store = self.store(connection)
            assert store is not None
            try:
                message = store.deserialize_cdr(data, connection.msgtype)
            except Exception as error:  # there is no telling what damaged bytes do to it
                self.lose_message(connection.topic, _said(error))
                continue
            yield connection, log_time, publish_time, message

    def lose(self, what: str) -> None:
        """Note in one line something that could not be read: once, and not too many of them."""
        what = one_line(what)
        if what not in self.losses and len(self.losses) <= MOST_LOSSES:
            too_many = len(self.losses) == MOST_LOSSES
            self.losses.append("and more, which are not told" if too_many else what)

    def lose_message(self, topic: str, why: str) -> None:
        """Note that a message could not be read, once by topic."""
        said = f"{topic}: a message cannot be read"
        if not any(loss.startswith(said) for loss in self.losses):
            self.lose(f"{said} ({why})")

    def store(self, connection: Connection) -> Typestore | None:
        """Definition of a topic's type, as the bag gives it or as Jazzy has it; None if unknown."""
        name = connection.msgtype
        if name not in self._stores:
            self._stores[name] = self._read_definition(connection)
            if self._stores[name] is None:
                self.lose(f"{connection.topic}: type {name} is unknown")
        return self._stores[name]

    def _read_definition(self, connection: Connection) -> Typestore | None:
        name, definition = connection.msgtype, connection.definition
        if not definition:
            return known(name)
        self._defined += len(definition)
        try:
            if max(len(definition), self._defined / MOST_DEFINITIONS) > LONGEST:
                raise ValueError("too long")
            return defined(name, definition)
        except ValueError as error:
            self.lose(f"{connection.topic}: definition of {name} is not used: {error}")
            return known(name)

    def _of(self, file: StorageFile, topics: Collection[str]) -> Iterator[Logged]:
        wanted = [c for c in file.connections if c.topic in topics and self.store(c)]
        allowance = Allowance(file.size)
        for connection, log_time, publish_time, data in file.messages(wanted):
            if data[:4] == ZSTD_MAGIC:
                try:
                    data = unpack(data, "zstd", min(LARGEST_MESSAGE, allowance.left))
                    allowance.take(len(data))
                except ValueError as error:
                    self.lose_message(connection.topic, str(error))
                    continue
            yield connection, log_time, publish_time, data


@contextmanager
def open_bag(path: str | Path) -> Iterator[Bag]:
    """Open a rosbag2 directory or one storage file, with or without its metadata.

    Damaged files are read as far as they are sound. Raises `FileNotFoundError` if there is nothing
    at `path`, `ValueError` if that is no readable bag.
    """
    path = Path(path)
    if not path.exists():
        raise FileNotFoundError(f"there is no bag {one_line(str(path))}")
    bag, failures = Bag(path), []
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(TemporaryDirectory(prefix="climber_bag_")))
        for number, file in enumerate(storage_files(path, bag.lose)):
            own = scratch / str(number)
            own.mkdir()
            try:
                opened = open_file(file, own, bag.lose)
                bag.files.append(stack.enter_context(closing(opened)))
            except (ValueError, OSError) as error:
                failures.append(f"{file.name}: {_said(error)}")
        if not bag.files:
            why = "; ".join(failures) or "neither metadata.yaml nor an .mcap or .db3 file in it"
            raise ValueError(one_line(f"{path} is no readable bag: {why}{other_files(path)}"))
        for failure in failures:
            bag.lose(f"{failure}: not read")
        bag.files.sort(key=attrgetter("start"))
        yield bag


def read_messages(
    path: str | Path, topics: Collection[str] | None = None
) -> Iterator[tuple[str, int, Any]]:
    """Yield topic, log time [ns] and deserialised message in the order of the log times.

    `topics` selects by full names (default: all). Raises as `open_bag` does; what cannot be read,
    or is of an unknown type, is left out.
    """
    with open_bag(path) as bag:
        for connection, log_time, _, message in bag.messages(
            bag.types if topics is None else topics
        ):
            yield connection.topic, log_time, message


def _said(error: Exception) -> str:
    return str(error) or type(error).__name__
