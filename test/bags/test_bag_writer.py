import errno
import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
import yaml
from bag_contents import read_messages
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from climber_uk.bags.bag_writer import BagWriter

ROOT = Path(__file__).parents[2]
STORE = get_typestore(Stores.ROS2_JAZZY)
STORAGES = ["mcap", "sqlite3"]
STRING, PATH = "std_msgs/msg/String", "nav_msgs/msg/Path"
FOREVER = {"sec": 9223372036, "nsec": 854775807}
LATCHED = {
    "history": "keep_last",
    "depth": 1,
    "reliability": "reliable",
    "durability": "transient_local",
    "deadline": FOREVER,
    "lifespan": FOREVER,
    "liveliness": "automatic",
    "liveliness_lease_duration": FOREVER,
    "avoid_ros_namespace_conventions": False,
}
LATCHED_OF_ROSBAGS = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    QosTime(**FOREVER),
    QosTime(**FOREVER),
    QosLiveliness.AUTOMATIC,
    QosTime(**FOREVER),
    False,
)


def text(data):
    return bytes(STORE.serialize_cdr(STORE.types[STRING](data), STRING))


def write_both(directory, storage):
    """The same bag by our writer and by the one of rosbags."""
    with BagWriter(directory / "ours", storage) as writer:
        writer.add_topic("/words", STRING, [LATCHED, LATCHED])
        writer.add_topic("/path", PATH, [])
        for time, word in [(7, "wall"), (9, "climber")]:
            writer.write("/words", time, time, text(word))
    plugin = StoragePlugin[storage.upper()]
    with Writer(directory / "theirs", version=9, storage_plugin=plugin) as rosbags:
        offered = [LATCHED_OF_ROSBAGS, LATCHED_OF_ROSBAGS]
        words = rosbags.add_connection(
            "/words", STRING, typestore=STORE, offered_qos_profiles=offered
        )
        rosbags.add_connection("/path", PATH, typestore=STORE)
        for time, word in [(7, "wall"), (9, "climber")]:
            rosbags.write(words, time, text(word))
    (ours,) = (directory / "ours").glob("ours_0.*")
    (theirs,) = (directory / "theirs").glob("theirs.*")
    return ours, theirs


def metadata(storage_file):
    """The metadata.yaml beside a file, but for what has to differ between two writers."""
    written = (storage_file.parent / "metadata.yaml").read_text()
    return _comparable(yaml.safe_load(written)["rosbag2_bagfile_information"], storage_file)


def _comparable(information, storage_file):
    assert information.pop("relative_file_paths") == [storage_file.name]
    assert information["files"][0].pop("path") == storage_file.name
    information.pop("ros_distro")
    return information


@pytest.mark.parametrize("storage", STORAGES)
def test_metadata_equal_those_that_rosbags_writes(tmp_path, storage):
    ours, theirs = write_both(tmp_path, storage)

    assert metadata(ours) == metadata(theirs)
    assert "&" not in (ours.parent / "metadata.yaml").read_text(), "equal parts are written out"


def test_a_database_equals_the_one_that_rosbags_writes(tmp_path):
    contents = []
    for file in write_both(tmp_path, "sqlite3"):
        with closing(sqlite3.connect(file)) as database:
            names = "SELECT name FROM sqlite_master WHERE type IN ('table', 'index') ORDER BY name"
            tables = [name for (name,) in database.execute(names)]
            columns = {t: database.execute(f"PRAGMA table_info({t})").fetchall() for t in tables}
            rows = {
                table: database.execute(f"SELECT * FROM {table} ORDER BY 1").fetchall()
                for table in ("topics", "message_definitions", "messages")
            }
            for topic_row, row in enumerate(rows["topics"]):  # YAML may be written in many ways
                rows["topics"][topic_row] = (*row[:4], yaml.safe_load(row[4]), row[5])
            [(version,)] = database.execute("SELECT schema_version FROM schema")
            [(number, copy)] = database.execute("SELECT metadata_version, metadata FROM metadata")
            information = _comparable(yaml.safe_load(copy), file)
        contents.append((tables, columns, rows, version, number, information))

    assert contents[0] == contents[1]


def test_an_mcap_file_says_what_the_one_of_rosbags_says(tmp_path):
    contents = []
    for file in write_both(tmp_path, "mcap"):
        with file.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            summary = reader.get_summary()
            schemas = {s.name: (s.encoding, s.data) for s in summary.schemas.values()}
            channels = {
                channel.topic: (
                    channel.id,
                    channel.message_encoding,
                    summary.schemas[channel.schema_id].name,
                    yaml.safe_load(channel.metadata["offered_qos_profiles"]),
                )
                for channel in summary.channels.values()
            }
            messages = [
                (channel.topic, message.log_time, message.publish_time, message.data)
                for _, channel, message in reader.iter_messages()
            ]
            (copy,) = (m.metadata for m in reader.iter_metadata() if m.name == "rosbag2")
            information = _comparable(yaml.safe_load(copy["serialized_metadata"]), file)
            counts = summary.statistics.message_count, summary.statistics.chunk_count
            profile = reader.get_header().profile
        contents.append((schemas, channels, messages, information, counts, profile))

    assert contents[0] == contents[1]


@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_opens_with_rosbags_after_every_flush(tmp_path, storage):
    writer = BagWriter(tmp_path / "bag", storage)
    written = []
    for flush in range(4):
        topic = f"/words{flush // 2}"
        if topic not in writer:
            writer.add_topic(topic, STRING, [LATCHED])
        for k in range(3):
            written.append((topic, 10 * flush + k, text(f"{flush} {k}" * 1000)))
            writer.write(topic, 10 * flush + k, 0, written[-1][2])
        writer.flush()

        with AnyReader([tmp_path / "bag"]) as reader:
            read = [(c.topic, time, bytes(data)) for c, time, data in reader.messages()]
            assert reader.message_count == len(written)

        assert read == written
    writer.close()


def test_an_mcap_file_does_not_grow_by_being_flushed(tmp_path):
    writer = BagWriter(tmp_path / "bag", "mcap")
    size = (tmp_path / "bag" / "bag_0.mcap").stat().st_size
    for _ in range(10):
        writer.flush()

    assert (tmp_path / "bag" / "bag_0.mcap").stat().st_size == size


@pytest.mark.parametrize("storage", STORAGES)
def test_log_times_do_not_fall_from_one_flush_to_the_next(tmp_path, storage):
    writer = BagWriter(tmp_path / "bag", storage)
    writer.add_topic("/words", STRING, [])
    for log_times in ([30, 10, 20], [25, 40]):  # 25 was overtaken by a flush
        for log_time in log_times:
            writer.write("/words", log_time, log_time, text(str(log_time)))
        writer.flush()

    read = [(log_time, message.data) for _, log_time, message in read_messages(tmp_path / "bag")]

    assert read == [(10, "10"), (20, "20"), (30, "30"), (30, "25"), (40, "40")]
    writer.close()


def test_publish_times_are_kept_in_an_mcap_file(tmp_path):
    with BagWriter(tmp_path / "bag", "mcap") as writer:
        writer.add_topic("/words", STRING, [])
        writer.write("/words", 30, 20, text("late"))

    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as stream:
        [(_, _, message)] = make_reader(stream).iter_messages()
    assert (message.log_time, message.publish_time) == (30, 20)


def test_a_full_disk_leaves_an_mcap_file_that_opens(tmp_path, monkeypatch):
    write = os.pwrite
    room = 5000

    def write_until_full(file, data, offset):
        if offset + len(data) <= room:
            return write(file, data, offset)
        if offset < room:
            return write(file, memoryview(data)[: room - offset], offset)
        raise OSError(errno.ENOSPC, "No space left on device")

    writer = BagWriter(tmp_path / "bag", "mcap")
    writer.add_topic("/words", STRING, [])
    writer.write("/words", 1, 1, text("kept"))
    writer.flush()
    monkeypatch.setattr(os, "pwrite", write_until_full)
    writer.write("/words", 2, 2, text("lost" * 2000))

    with pytest.raises(OSError, match=r"No space left on device: '.*/bag_0\.mcap'$"):
        writer.flush()
    with pytest.raises(OSError, match="No space left"):
        writer.close()

    assert writer.message_count == 1
    with AnyReader([tmp_path / "bag"]) as reader:
        assert [time for _, time, _ in reader.messages()] == [1]
        assert reader.message_count == 1


def test_a_full_disk_leaves_a_database_that_opens(tmp_path):
    script = """
import resource, sys
from pathlib import Path
from climber_uk.bags.bag_writer import BagWriter
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
with BagWriter(Path(sys.argv[1]), "sqlite3") as writer:
    writer.add_topic("/words", "std_msgs/msg/String", [])
    writer.write("/words", 1, 1, bytes.fromhex("00010000 02000000 6100"))
    writer.flush()
    writer.write("/words", 2, 2, bytes(200_000))
"""
    command = [sys.executable, "-c", script, str(tmp_path / "bag")]

    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)

    assert result.stderr.splitlines()[-1].startswith(f"OSError: {tmp_path}/bag/bag_0.db3: ")
    assert [message.data for _, _, message in read_messages(tmp_path / "bag")] == ["a"]


def test_an_existing_directory_is_refused(tmp_path):
    with pytest.raises(FileExistsError, match=f"^output directory {tmp_path} exists already$"):
        BagWriter(tmp_path)


def test_an_unknown_storage_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(ValueError, match=r"^storage='csv' must be one of mcap, sqlite3$"):
        BagWriter(tmp_path / "bag", "csv")

    assert not (tmp_path / "bag").exists()


def test_messages_are_counted_by_topic(tmp_path):
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic("/words", STRING, [])
        writer.add_topic("/path", PATH, [])
        writer.write("/words", 1, 1, text("one"))
        writer.write("/words", 2, 2, text("two"))

    assert (writer.count("/words"), writer.count("/path"), writer.count("/other")) == (2, 0, 0)
    assert writer.message_count == 2
