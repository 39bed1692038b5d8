"""A bag's messages in the order in which they were published.

A recorder that is behind, or has to be sent a message again, receives a topic's messages in their
order, but late: beside those of another topic, their log times say little. MCAP has the time of
publishing as well. Where there is none, as in sqlite3, or where a middleware or a converter left
it 0, it is the log time.
"""

from collections.abc import Collection, Iterator, Mapping
from heapq import merge
from pathlib import Path
from typing import Any

from climber_uk.analysis.bag import Bag, open_bag


def read_published(path: Path, topics: Mapping[str, str]) -> Iterator[tuple[str, int, Any]]:
    """Yield topic, publishing time [ns] and message; raises as `open_bag` does.

    Messages are those of some topics that have the type which `topics` tells.
    """
    with open_bag(path) as bag:
        known = _are_known(bag, topics)
        streams = [_published(bag, topic, of, known) for topic, of in topics.items()]
        yield from merge(*streams, key=lambda message: message[1])


def are_known(path: Path, topics: Collection[str]) -> bool:
    """Whether a bag tells when the messages of some topics were published."""
    with open_bag(path) as bag:
        return _are_known(bag, topics)


def _are_known(bag: Bag, topics: Collection[str]) -> bool:
    return all(publish_time for _, _, publish_time, _ in bag.recorded(topics))


def _published(bag: Bag, topic: str, of: str, known: bool) -> Iterator[tuple[str, int, Any]]:
    for connection, log_time, publish_time, message in bag.messages([topic]):
        if connection.msgtype == of:
            yield topic, publish_time if known else log_time, message
