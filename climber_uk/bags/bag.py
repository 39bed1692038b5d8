"""Read rosbag2 directories, also damaged and hostile ones, and those of recorders that were killed.

Nothing is written, except for copies in a temporary directory. No size, count or name that stands
in a file is relied on: see `mcap_file` and `sqlite_file`.
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
from climber_uk.bags.connection import Connection, Logged, StorageFile, listed, one_line
from climber_uk.bags.definitions import LONGEST, defined, known
from climber_uk.bags.unpacking import LARGEST_MESSAGE, ZSTD_MAGIC, Allowance, unpack

# what reading a message can raise that has the name of a type, but not its fields
UNFIT = ValueError, AttributeError, TypeError
NO_TYPE = "without a name"
MOST_LOSSES = 20  # lines on what could not be read
MOST_DEFINITIONS = 4  # times `LONGEST`: the characters of all definitions together


@dataclass
class Bag:
    """An open bag: its topics, its messages, and what of it could not be read."""

    path: Path
    files: list[StorageFile] = field(default_factory=list)  # in the order of their first log times
    losses: list[str] = field(default_factory=list)  # a line each; more while messages are read

    def __post_init__(self) -> None:
        self._stores: dict[str, Typestore | None] = {}
        self._defined = 0

    @property
    def connections(self) -> list[Connection]:
        """Topic, type and number of messages, of each topic in each file."""
        return [connection for file in self.files for connection in file.connections]

    @property
    def types(self) -> dict[str, str]:
        """Type by topic; of two types of a topic, the one with more messages."""
        by_count = sorted(self.connections, key=attrgetter("msgcount"))
        return {connection.topic: connection.msgtype for connection in by_count}

    def lacks(self, topic: str, type_name: str, how: str = "") -> str:
        """Words on a topic that has no message: its other type, or which topics have that type.

        `how` says how to choose one of these.
        """
        types = self.types
        others = sorted(name for name, kind in types.items() if kind == type_name)
        if types.get(topic, type_name) != type_name:
            return f"no message on {topic} (it is {types[topic] or NO_TYPE}, not {type_name})"
        if not others or topic in others:
            return f"no message on {topic}"
        return f"no message on {topic} ({type_name} is on {listed(others)}{how and f': {how}'})"

    def count(self, topics: Collection[str]) -> int:
        """Return the number of messages of some topics, as the files state it."""
        return sum(c.msgcount for c in self.connections if c.topic in topics)

    def recorded(self, topics: Collection[str]) -> Iterator[Logged]:
        """Yield the serialised messages of some topics in the order of the log times."""
        parts = [self._of_file(file, topics) for file in self.files]
        ends = [(file.start, file.end) for file in self.files]
        is_split = all(end <= start for (_, end), (start, _) in pairwise(ends))
        yield from chain(*parts) if is_split else merge(*parts, key=lambda message: message[1])

    def messages(self, topics: Collection[str]) -> Iterator[tuple[Connection, int, int, Any]]:
        """Yield connection, log time, publishing time (0: unknown) [ns] and message."""
        for connection, log_time, publish_time, data in self.recorded(topics):
            store = self.store(connection)
            assert store is not None
            try:
                message = store.deserialize_cdr(data, connection.msgtype)
            except Exception as error:  # damaged bytes can make it raise anything
                self.lose_message(connection.topic, _words(error))
                continue
            yield connection, log_time, publish_time, message

    def lose(self, what: str) -> None:
        """Note in one line something that could not be read: once, and not too many of them."""
        what = one_line(what)
        if what not in self.losses and len(self.losses) <= MOST_LOSSES:
            too_many = len(self.losses) == MOST_LOSSES
            self.losses.append("and more, which are not listed" if too_many else what)

    def lose_message(self, topic: str, why: str) -> None:
        """Note that a message could not be read, once by topic."""
        line = f"{topic}: a message cannot be read"
        if not any(loss.startswith(line) for loss in self.losses):
            self.lose(f"{line} ({why})")

    def store(self, connection: Connection) -> Typestore | None:
        """Definition of a topic's type, as the bag gives it or as Jazzy has it; None if unknown."""
        name = connection.msgtype
        if name not in self._stores:
            self._stores[name] = self._read_definition(connection)
            if self._stores[name] is None:
                self.lose(f"{connection.topic}: type {name or NO_TYPE} is unknown")
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

    def _of_file(self, file: StorageFile, topics: Collection[str]) -> Iterator[Logged]:
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
                failures.append(f"{file.name}: {_words(error)}")
        if not bag.files:
            why = "; ".join(failures) or "no .mcap or .db3 file in it"
            raise ValueError(one_line(f"{path} is no readable bag: {why}{other_files(path)}"))
        for failure in failures:
            bag.lose(f"{failure}: not read")
        bag.files.sort(key=attrgetter("start"))
        yield bag


def _words(error: Exception) -> str:
    return str(error) or type(error).__name__
