"""A bag's messages in the order in which they were published.

A recorder that is behind, or has to be sent a message again, receives a topic's messages in their
order, but late: beside those of another topic, their log times say little. MCAP has the time of
publishing as well. Where there is none, as in sqlite3, or where a middleware or a converter left
it 0, it is the log time.
"""

import struct
from array import array
from collections import defaultdict
from collections.abc import Collection, Iterator
from contextlib import suppress
from heapq import merge
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader

from climber_uk.analysis.bag import read_messages


def read_published(bag: Path, topics: Collection[str]) -> Iterator[tuple[str, int, Any]]:
    """Yield topic, publishing time [ns] and message; raises as `read_messages` does."""
    logged = _times(bag, topics)
    streams = [_published(bag, topic, logged[topic]) for topic in topics]
    yield from merge(*streams, key=lambda message: message[1])


def are_known(bag: Path, topics: Collection[str]) -> bool:
    """Whether a bag tells when the messages of some topics were published."""
    return bool(_times(bag, topics))


def _published(bag: Path, topic: str, times: "array[int]") -> Iterator[tuple[str, int, Any]]:
    number = 0
    for _, logged, message in read_messages(bag, [topic]):
        while number < len(times) and times[number] < logged:
            number += 2
        if number < len(times) and times[number] == logged:
            yield topic, times[number + 1], message
            number += 2
        else:
            yield topic, logged, message


def _times(bag: Path, topics: Collection[str]) -> "dict[str, array[int]]":
    """Log and publishing time [ns] in turn, by topic; none at all if they are not all known."""
    times: dict[str, array[int]] = defaultdict(lambda: array("q"))
    for file in sorted(bag.glob("*.mcap")) if bag.is_dir() else [bag]:
        names: dict[int, str] = {}
        with file.open("rb") as stream, suppress(McapError, ValueError, struct.error):
            for record in StreamReader(stream).records:
                if isinstance(record, Channel):
                    names[record.id] = record.topic
                elif isinstance(record, Message) and names[record.channel_id] in topics:
                    if record.publish_time == 0:
                        return defaultdict(lambda: array("q"))
                    times[names[record.channel_id]].extend((record.log_time, record.publish_time))
    return times
