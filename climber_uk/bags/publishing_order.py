"""A bag's messages in the order in which they were published.

A recorder that is behind, or has to be sent a message again, receives a topic's messages in their
order, but late: beside those of another topic, their log times say little. MCAP has the time of
publishing as well. Where there is none, as in sqlite3, or where a middleware or a converter left
it 0, it is the log time.
"""

from collections.abc import Collection, Iterator, Mapping
from heapq import merge
from typing import Any

from climber_uk.bags.bag import Bag


def read_published(
    bag: Bag, types: Mapping[str, str], by_publishing: bool
) -> Iterator[tuple[str, int, Any]]:
    """Yield topic, time [ns] and message, in the order of these times.

    They are times of publishing, or log times unless `by_publishing`. `types` has the topics that
    are read, with their types: messages of another type are left out.
    """
    streams = [_published(bag, *pair, by_publishing) for pair in types.items()]
    yield from merge(*streams, key=lambda message: message[1])


def has_publishing_times(bag: Bag, topics: Collection[str]) -> bool:
    """Whether a bag has the times of publishing of all messages of some topics."""
    return all(publish_time for _, _, publish_time, _ in bag.recorded(topics))


def _published(
    bag: Bag, topic: str, type_name: str, by_publishing: bool
) -> Iterator[tuple[str, int, Any]]:
    for connection, log_time, publish_time, message in bag.messages([topic]):
        if connection.msgtype == type_name:
            yield topic, publish_time if by_publishing else log_time, message
