import math
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from bag_contents import read_messages
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from climber_uk.bags.bag_writer import BagWriter

STORE = get_typestore(Stores.ROS2_JAZZY)
JOINT_STATE = "sensor_msgs/msg/JointState"
INT = "std_msgs/msg/Int64"
PLUGINS = [StoragePlugin.MCAP, StoragePlugin.SQLITE3]


def serialized(type_name, *fields):
    return bytes(STORE.serialize_cdr(STORE.types[type_name](*fields), type_name))


def joint_state(stamp, effort):
    time = STORE.types["builtin_interfaces/msg/Time"](*divmod(stamp, 10**9))
    header = STORE.types["std_msgs/msg/Header"](time, "wall")
    empty = np.array([])
    return serialized(JOINT_STATE, header, ["left", "right"], empty, empty, np.array(effort))


def write_with_rosbags(path, plugin, messages):
    """Write (topic, type, log time, bytes) with the independent writer."""
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        connections = {}
        for topic, type_name, log_time, data in messages:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, type_name, typestore=STORE)
            writer.write(connections[topic], log_time, data)
    return path


def killed_recording(path, storage, flushes=4):
    """Numbers on two topics, at log times 0, 1, 2, … ns, up to the last flush; never closed."""
    writer = BagWriter(path, storage)
    for topic in ("/even", "/odd"):
        writer.add_topic(topic, INT, [])
    for number in range(10 * flushes):
        writer.write(("/even", "/odd")[number % 2], number, number, serialized(INT, number))
        if number % 10 == 9:
            writer.flush()
    return writer


def storage_file(bag):
    (file,) = (file for file in bag.iterdir() if file.suffix in (".mcap", ".db3"))
    return file


def numbers(bag, topics=None):
    return [message.data for _, _, message in read_messages(bag, topics)]


@pytest.mark.parametrize("plugin", PLUGINS)
def test_messages_come_in_the_order_of_their_log_times(tmp_path, plugin):
    times = [30, 10, 20, 50, 40]
    topics = ["/x", "/y", "/x", "/y", "/x"]
    recorded = [(topic, INT, t, serialized(INT, t)) for topic, t in zip(topics, times, strict=True)]
    bag = write_with_rosbags(tmp_path / "bag", plugin, recorded)

    read = [(log_time, topic, message.data) for topic, log_time, message in read_messages(bag)]

    assert read == [(10, "/y", 10), (20, "/x", 20), (30, "/x", 30), (40, "/x", 40), (50, "/y", 50)]


@pytest.mark.parametrize("plugin", PLUGINS)
def test_a_message_has_its_fields_and_its_stamp(tmp_path, plugin):
    data = joint_state(12_000_000_034, [0.25, math.nan])
    bag = write_with_rosbags(tmp_path / "bag", plugin, [("/torques", JOINT_STATE, 5, data)])

    [(topic, log_time, message)] = read_messages(bag)

    assert (topic, log_time) == ("/torques", 5)
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (12, 34)
    assert message.header.frame_id == "wall"
    assert message.name == ["left", "right"]
    np.testing.assert_array_equal(message.effort, [0.25, math.nan])


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_topics_can_be_selected(tmp_path, storage):
    killed_recording(tmp_path / "bag", storage).close()

    assert numbers(tmp_path / "bag", ["/odd"]) == list(range(1, 40, 2))
    assert numbers(tmp_path / "bag", ["/odd", "/even"]) == list(range(40))


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_selection_of_no_topic_in_the_bag_gives_nothing(tmp_path, storage):
    killed_recording(tmp_path / "bag", storage).close()

    assert numbers(tmp_path / "bag", ["/other"]) == []
    assert numbers(tmp_path / "bag", []) == []


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_bag_without_messages_gives_nothing(tmp_path, storage):
    BagWriter(tmp_path / "bag", storage).close()

    assert numbers(tmp_path / "bag") == []


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_bag_is_read_without_its_metadata(tmp_path, storage):
    killed_recording(tmp_path / "bag", storage).close()
    (tmp_path / "bag" / "metadata.yaml").unlink()

    assert numbers(tmp_path / "bag") == list(range(40))
    assert numbers(storage_file(tmp_path / "bag")) == list(range(40))


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_killed_recording_is_read_up_to_its_last_flush(tmp_path, storage):
    writer = killed_recording(tmp_path / "bag", storage)
    writer.write("/odd", 40, 40, serialized(INT, 40))

    assert numbers(tmp_path / "bag") == list(range(40))
    writer.close()


@pytest.fixture(scope="module")
def torn_bag(tmp_path_factory):
    """A bag whose MCAP file the test cuts, and that file's contents."""
    bag = tmp_path_factory.mktemp("torn") / "bag"
    killed_recording(bag, "mcap").close()
    return bag, storage_file(bag).read_bytes()


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(kept=st.floats(0, 1, exclude_max=True))
def test_an_mcap_file_cut_anywhere_gives_the_chunks_before_the_cut(torn_bag, kept):
    bag, whole = torn_bag
    cut = 64 + int(kept * (len(whole) - 64))  # behind the header, without which it is no MCAP
    storage_file(bag).write_bytes(whole[:cut])

    read = numbers(bag)

    assert read == list(range(len(read)))
    assert len(read) % 10 == 0


def test_an_mcap_file_without_its_ending_loses_no_message(torn_bag):
    bag, whole = torn_bag
    storage_file(bag).write_bytes(whole[:-1])

    assert numbers(bag) == list(range(40))


def test_messages_of_a_torn_mcap_file_come_in_the_order_of_their_log_times(tmp_path):
    recorded = [("/x", INT, t, serialized(INT, t)) for t in (3, 1, 2, 5, 4)]
    bag = write_with_rosbags(tmp_path / "bag", StoragePlugin.MCAP, recorded)
    file = storage_file(bag)
    file.write_bytes(file.read_bytes()[:-8])

    assert numbers(bag) == [1, 2, 3, 4, 5]


def test_mending_leaves_the_bag_as_it_is(torn_bag):
    bag, whole = torn_bag
    storage_file(bag).write_bytes(whole[:-100])

    numbers(bag)

    assert storage_file(bag).read_bytes() == whole[:-100]
    assert {file.name for file in bag.iterdir()} == {"bag_0.mcap", "metadata.yaml"}


@pytest.mark.parametrize("journal", ["DELETE", "WAL"])
def test_a_database_torn_within_a_write_gives_what_was_committed(tmp_path, journal):
    killed_recording(tmp_path / "bag", "sqlite3", flushes=100).close()
    committed = list(range(1000))
    with closing(sqlite3.connect(storage_file(tmp_path / "bag"))) as database:
        database.execute(f"PRAGMA journal_mode = {journal}")
        if journal == "WAL":  # which keeps what is committed outside the file at first
            row = (1000, serialized(INT, 1000))
            database.execute("INSERT INTO messages VALUES (NULL, 1, ?, ?)", row)
            database.commit()
            committed.append(1000)
        # without waiting and with little memory, a transaction changes the file before its end
        database.execute("PRAGMA synchronous = OFF")
        database.execute("PRAGMA cache_size = 5")
        database.execute("UPDATE messages SET data = zeroblob(12)")
        shutil.copytree(tmp_path / "bag", tmp_path / "torn")
        database.rollback()

    assert len(list((tmp_path / "torn").iterdir())) > 2, "there should be a journal"
    assert numbers(tmp_path / "torn") == committed


def test_a_bag_that_is_not_there_is_reported_by_its_path(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"^there is no bag .*/nowhere$"):
        list(read_messages(tmp_path / "nowhere"))


@pytest.mark.parametrize("name", ["metadata.yaml", "bag_0.mcap", "bag_0.db3", "notes.txt"])
def test_what_is_no_bag_is_reported_in_one_line_with_its_path(tmp_path, name):
    (tmp_path / name).write_text("nothing of the kind")

    with pytest.raises(ValueError, match=r"is no readable bag: .+") as report:
        list(read_messages(tmp_path))

    assert str(tmp_path) in str(report.value)
    assert "\n" not in str(report.value)


def test_an_empty_directory_is_no_bag(tmp_path):
    with pytest.raises(ValueError, match="is no readable bag"):
        list(read_messages(str(tmp_path)))


def test_paths_may_be_strings(tmp_path):
    killed_recording(tmp_path / "bag", "mcap").close()

    assert len(list(read_messages(str(Path(tmp_path, "bag"))))) == 40
