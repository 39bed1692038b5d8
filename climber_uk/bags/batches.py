"""Messages that differ in their numbers only, decoded many at a time.

They are the rows of one table (see `Layout`), and a topic hardly ever has more than a few tables.
"""

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys.store import Typestore

from climber_uk.bags.bag import Bag
from climber_uk.mechanics import SECOND, Array
from climber_uk.messages.cdr_layout import Layout

LATEST = 2**63 - 1  # [ns]
CHUNK, CHUNK_SIZE = 4096, 2**24  # messages, and bytes, of a topic that are decoded at a time
MOST_ALONE = 32  # messages in a row that are like no other, after which no others are looked for


@dataclass(frozen=True)
class Batch:
    """n messages of one type, in the order in which they were recorded."""

    log_times: NDArray[np.int64]  # (n,) [ns]
    strings: dict[str, str]  # by path, as in `header.frame_id` and `name.0`
    lengths: dict[str, int]  # of sequences
    rows: NDArray[Any]  # (n,) of numbers, by path

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, path: str) -> Array:
        """Numbers (n,), of a sequence or an array (n, length); `KeyError` if there are none."""
        if self.lengths.get(path) == 0:
            return np.empty((len(self), 0))
        try:
            return self.rows[path].astype(float)
        except ValueError:
            raise KeyError(path) from None

    def columns(self, *paths: str) -> Array:
        """Numbers (n, k) at k paths."""
        return np.stack([self[path] for path in paths], axis=-1)

    @property
    def stamps(self) -> NDArray[np.int64]:
        """Stamps in the headers (n,) [ns]."""
        return self.times("header.stamp")

    def times(self, path: str) -> NDArray[np.int64]:
        """Times, or durations, at `path` (n,) [ns]."""
        seconds: NDArray[np.int64] = self.rows[f"{path}.sec"].astype(np.int64)
        return seconds * SECOND + self.rows[f"{path}.nanosec"]


def read_batches(
    bag: Bag, topics: Collection[str], by_publishing: bool = False
) -> Iterator[tuple[str, Batch]]:
    """Yield topic and batch; the messages of a topic are nearly in the order of their log times.

    `by_publishing` gives the time of publishing in place of the log time.
    """
    waiting: dict[Any, list[tuple[int, bytes]]] = defaultdict(list)
    sizes: dict[Any, int] = defaultdict(int)
    connections: dict[Any, Any] = {}

    def decoded(key: tuple[str, str]) -> Iterator[tuple[str, Batch]]:
        topic, type_name = key
        store = bag.store(connections[key])
        assert store is not None
        batches, spoilt = decode(waiting.pop(key), type_name, store)
        sizes[key] = 0
        if spoilt:
            bag.lose_message(topic, spoilt)
        for batch in batches:
            yield topic, batch

    for connection, log_time, publish_time, data in bag.recorded(topics):
        key = connection.topic, connection.msgtype
        connections[key] = connection
        waiting[key].append((publish_time if by_publishing else log_time, data))
        sizes[key] += len(data)
        if len(waiting[key]) == CHUNK or sizes[key] > CHUNK_SIZE:
            yield from decoded(key)
    for key in list(waiting):
        yield from decoded(key)


def decode(
    messages: Sequence[tuple[int, bytes]], type_name: str, store: Typestore
) -> tuple[list[Batch], str]:
    """Batches of some messages, and what is wrong with the last one that cannot be read."""
    batches, spoilt = [], ""

    def fields_of(name: str) -> Iterable[tuple[str, Any]]:
        return store.fielddefs[name][1]

    by_size = defaultdict(list)
    for log_time, data in messages:
        by_size[len(data)].append((log_time, data))
    if by_size.pop(0, None):
        spoilt = "it is empty"
    for size, alike in by_size.items():
        times = np.array([min(log_time, LATEST) for log_time, _ in alike], np.int64)
        rows = np.frombuffer(b"".join(data for _, data in alike), np.uint8).reshape(-1, size)
        alone = 0  # in a row, that have no others like them
        while len(rows):
            layout = Layout(rows[0].tobytes(), fields_of)
            same = np.arange(len(rows)) == 0
            try:
                layout.walk(type_name)
                numbers = rows.view(layout.numbers)[:, 0]
                if alone < MOST_ALONE:
                    same = layout.fits(rows)
                batches.append(Batch(times[same], layout.strings, layout.lengths, numbers[same]))
            except (ValueError, LookupError, TypeError, OverflowError, RecursionError) as error:
                spoilt = str(error)
            is_one = not same[1:].any()
            alone = alone + 1 if is_one else 0
            others = slice(1, None) if is_one else ~same
            times, rows = times[others], rows[others]
    return batches, spoilt
