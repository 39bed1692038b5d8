"""What the storage files of bags have in common."""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

CDR = "cdr"
MOST_TOPICS = 65535  # of a file, as many as MCAP can have
LONGEST_NAME, LONGEST_LINE = 500, 1000  # characters of a topic or a type, and of a line to print


@dataclass(frozen=True)
class Connection:
    """A topic of a storage file."""

    id: int
    topic: str
    msgtype: str
    msgcount: int
    definition: str  # of its type, with those of the types it contains; '' if unknown


# connection, log time, publishing time (0: unknown) [ns] and serialised message
Logged = tuple[Connection, int, int, bytes]
Lose = Callable[[str], None]  # is called with a line on what could not be read


class StorageFile(Protocol):
    """A file of messages, open for reading; nothing is ever written to it or beside it."""

    size: int  # [bytes]
    connections: list[Connection]  # those whose messages are CDR
    start: int  # first log time [ns]
    end: int  # last log time [ns]

    def messages(self, connections: Collection[Connection]) -> Iterator[Logged]:
        """Yield what is sound of some topics, in the order of the log times."""

    def close(self) -> None:
        """Close the file."""


def readable(found: Iterable[tuple[Connection, str]], lose: Lose) -> Iterator[Connection]:
    """Yield those of a file's topics, each with its encoding, that can be read, by full names.

    `lose` gets a line on the others: an unprintable name, another encoding than CDR.
    """
    others: dict[str, list[str]] = defaultdict(list)
    for connection, encoding in found:
        topic = connection.topic
        if not (type(connection.id) is int and is_name(topic) and is_name(connection.msgtype)):
            lose(f"a topic that cannot be called so is left out: {topic!r:.60}")
        elif encoding != CDR:
            others[encoding].append(topic)
        else:  # recorders other than rosbag2's may leave out the slash
            yield replace(connection, topic=f"/{topic.removeprefix('/')}")
    for encoding, topics in others.items():
        lose(f"{listed(topics)} left out: encoded as {encoding or 'nothing'}, not {CDR}")


def listed(names: Sequence[str]) -> str:
    """At most three names, and how many more there are."""
    some = ", ".join(names[:3])
    return f"{some} and {len(names) - 3} more" if len(names) > 3 else some or "nothing"


def is_name(name: object) -> bool:
    """Whether it can be the name of a topic or of a type: printable, and not too long."""
    return isinstance(name, str) and len(name) <= LONGEST_NAME and name.isprintable()


def one_line(text: str) -> str:
    r"""Text of a file as one line that is safe to print: control characters become `\x1b`."""
    shown = "".join(
        character if character.isprintable() else character.encode("unicode_escape").decode()
        for character in " ".join(text[:LONGEST_LINE].split())
    )
    return shown + "…" * (len(text) > LONGEST_LINE)
