"""Write a rosbag2 directory whose recorder may be killed: storage file and metadata.yaml."""

from collections.abc import Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any, Self

from climber_uk.bags.storage import STORAGES, Message, Qos, Topic, to_yaml

NEVER = 2**63 - 1  # [ns] what rosbag2 writes as the start of a bag without messages


class BagWriter:
    """A new rosbag2 directory (version 9, as on Jazzy), which opens as of its last `flush`.

    `distro` is the distribution of ROS whose messages it takes. Raises `ValueError` for an unknown
    storage, and `FileExistsError` if the directory exists.
    """

    def __init__(self, path: Path, storage: str = "mcap", distro: str = "unknown") -> None:
        if storage not in STORAGES:
            raise ValueError(f"storage={storage!r} must be one of {', '.join(STORAGES)}")
        if path.exists():
            raise FileExistsError(f"output directory {path} exists already")
        path.mkdir(parents=True)
        self.path = path
        self._topics: dict[str, Topic] = {}
        self._counts: dict[int, int] = {}
        self._identifier = storage
        self._distro = distro
        self._storage = STORAGES[storage](path / f"{path.absolute().name}_0", distro)
        self.custom_data: dict[str, str] = {}  # more entries of the metadata, by name
        self._pending: list[Message] = []
        self._start, self._end = NEVER, 0
        self.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __contains__(self, topic: str) -> bool:
        return topic in self._topics

    @property
    def message_count(self) -> int:
        """How many messages were taken."""
        return sum(self._counts.values())

    def count(self, topic: str) -> int:
        """Return how many messages of a topic were taken."""
        return self._counts[self._topics[topic].id] if topic in self._topics else 0

    def add_topic(self, name: str, type_name: str, offered_qos: Sequence[Qos]) -> None:
        """Add a topic, whose type has to be one that `storage.is_known`."""
        topic = Topic(len(self._topics) + 1, name, type_name, offered_qos)
        self._storage.add_topic(topic)
        self._topics[name], self._counts[topic.id] = topic, 0

    def write(self, topic: str, log_time: int, publish_time: int, data: bytes) -> None:
        """Take a serialised message, which the next flush stores; both times in ns."""
        topic_id = self._topics[topic].id
        self._pending.append((log_time, publish_time, topic_id, data))
        self._counts[topic_id] += 1

    def flush(self) -> None:
        """Store all messages taken."""
        messages, self._pending = self._in_order(self._pending), []
        # The metadata go first: rosbags does not read a topic they do not name, while a count
        # that is too high by the messages of one flush does no harm.
        self._write_metadata()
        try:
            self._storage.write(messages)
        except OSError:
            for _, _, topic_id, _ in messages:
                self._counts[topic_id] -= 1
            raise

    def close(self) -> None:
        """Store all messages taken and finish the bag."""
        try:
            self.flush()
        finally:
            self._storage.close(to_yaml(self._metadata()).strip())

    def _in_order(self, messages: list[Message]) -> list[Message]:
        # Nor may log times fall from one flush to the next: readers that have to scan the file of
        # a killed recorder yield its messages as they stand.
        ordered = []
        for log_time, publish_time, topic_id, data in sorted(messages, key=itemgetter(0)):
            self._start = min(self._start, log_time)
            self._end = max(self._end, log_time)
            ordered.append((self._end, publish_time, topic_id, data))
        return ordered

    def _write_metadata(self) -> None:
        temporary = self.path / "metadata.yaml.tmp"
        temporary.write_text(to_yaml({"rosbag2_bagfile_information": self._metadata()}))
        temporary.replace(self.path / "metadata.yaml")

    def _metadata(self) -> dict[str, Any]:
        file_name = self._storage.path.name
        extent = {
            "starting_time": {"nanoseconds_since_epoch": self._start},
            "duration": {"nanoseconds": max(0, self._end - self._start)},
            "message_count": self.message_count,
        }
        return {
            "version": 9,
            "storage_identifier": self._identifier,
            "relative_file_paths": [file_name],
            **extent,
            "topics_with_message_count": [
                {"topic_metadata": topic.metadata, "message_count": self._counts[topic.id]}
                for topic in self._topics.values()
            ],
            "compression_format": "",
            "compression_mode": "",
            "files": [{"path": file_name, **extent}],
            "custom_data": dict(self.custom_data) or None,
            "ros_distro": self._distro,
        }
