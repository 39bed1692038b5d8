"""All that is sound is read, whatever lies before it or beside it; one line says what is not."""

import shutil
import sqlite3
from contextlib import closing, suppress

import numpy as np
import pytest
import zstandard
from hostile_bags import base, coded, harm, mcap, sqlite, victims
from made_bag import BEGAN, ODOMETRY, a_run, write
from mcap.writer import CompressionType, IndexType

from climber_uk.bags.bag import open_bag
from climber_uk.bags.bag_writer import BagWriter

NO_METADATA = "metadata.yaml: missing or damaged, not needed"
BY_FLUSH = 20
RUN = 100


def contents(bag):
    """Log time, topic and data of all that is read, and what was said."""
    with open_bag(bag) as opened:
        read = [(at, c.topic, data) for c, at, _, data in opened.recorded(opened.types)]
        return read, "; ".join(loss for loss in opened.losses if loss != NO_METADATA)


def in_order(messages):
    return sorted((at, topic, data) for topic, _, at, data in messages)


def killed(bag):
    """A recording that was never closed; its messages."""
    writer = BagWriter(bag, "mcap")
    messages = sorted(base(RUN), key=lambda message: message[2])
    for i, (topic, kind, at, data) in enumerate(messages):
        if topic not in writer:
            writer.add_topic(topic, kind, [])
        writer.write(topic, at, at, data)
        if i % BY_FLUSH == 0:
            writer.flush()
    writer.flush()
    return in_order(messages)


def is_part(read, whole):
    """How many are missing; all others are as they were, in their order."""
    assert sorted(read) == [message for message in whole if message in set(read)]
    assert [at for at, *_ in read] == sorted(at for at, *_ in read)
    return len(whole) - len(read)


@pytest.fixture(scope="module")
def killed_mcap(tmp_path_factory):
    bag = tmp_path_factory.mktemp("killed") / "bag"
    whole = killed(bag)
    return bag, (bag / "bag_0.mcap").read_bytes(), whole


def changed(bag, data, place, value):
    wrong = bytearray(data)
    wrong[place] ^= value
    (bag / "bag_0.mcap").write_bytes(wrong)


def test_a_wrong_byte_in_a_killed_recording_costs_one_chunk_at_most(killed_mcap):
    bag, data, whole = killed_mcap
    rng = np.random.default_rng(1)
    topics_told = data.rindex(b"topic_type_hash")  # before that, see below
    for place in rng.integers(topics_told, len(data), 60).tolist():
        changed(bag, data, place, int(rng.integers(1, 256)))
        read, said = contents(bag)
        missing = is_part(read, whole)
        assert missing <= BY_FLUSH, (place, said)
        assert not missing or "bag_0.mcap: " in said


def test_one_in_the_name_or_number_of_a_topic_costs_that_topic_at_most(killed_mcap):
    bag, data, whole = killed_mcap
    first = data.index(b"/reference") - 30
    for place in range(first, first + 50):
        changed(bag, data, place, 77)
        read, said = contents(bag)
        others = [message for message in whole if message[1] != "/reference"]
        assert len(set(others) - set(read)) <= BY_FLUSH, (place, said)


def test_many_wrong_bytes_cost_no_more_than_their_chunks(killed_mcap):
    bag, data, whole = killed_mcap
    wrong = bytearray(data)
    begin = len(data) // 2
    wrong[begin : begin + 1000] = bytes(1000)
    (bag / "bag_0.mcap").write_bytes(wrong)
    read, said = contents(bag)
    assert is_part(read, whole) <= 3 * BY_FLUSH
    assert "bag_0.mcap: damaged at byte" in said or "a chunk is left out" in said


@pytest.mark.parametrize("compression", CompressionType)
@pytest.mark.parametrize("index_types", [IndexType.ALL, IndexType.NONE])
def test_a_damaged_chunk_of_a_closed_file_costs_no_other(tmp_path, compression, index_types):
    how = {"compression": compression, "chunk_size": 5000, "index_types": index_types}
    file = mcap(tmp_path / "bag", base(RUN), **how) / "bag_0.mcap"
    wrong = bytearray(file.read_bytes())
    wrong[len(wrong) // 2] ^= 1
    file.write_bytes(wrong)
    read, said = contents(tmp_path / "bag")
    assert 0 < is_part(read, in_order(base(RUN))) < RUN / 4
    assert "bag_0.mcap: a chunk is left out" in said


def test_damage_outside_of_chunks_costs_the_messages_that_it_hits(tmp_path):
    how = {"use_chunking": False, "index_types": IndexType.NONE}
    file = mcap(tmp_path / "bag", base(RUN), **how) / "bag_0.mcap"
    wrong = bytearray(file.read_bytes())
    begin = len(wrong) // 2
    wrong[begin : begin + 3000] = b"\xff" * 3000
    file.write_bytes(wrong)
    read, said = contents(tmp_path / "bag")
    whole = in_order(base(RUN))
    assert len(set(whole) - set(read)) <= 8
    assert "bag_0.mcap: damaged at byte" in said


def test_rows_behind_a_damaged_page_are_read(tmp_path):
    file = sqlite(tmp_path / "bag", base(RUN)) / "bag_0.db3"
    data = bytearray(file.read_bytes())
    page = 4096 * (len(data) // 8192)
    data[page : page + 4096] = b"\xff" * 4096
    file.write_bytes(data)
    read, said = contents(tmp_path / "bag")
    assert len(set(in_order(base(RUN))) - set(read)) < 30
    assert max(at for at, *_ in read) == max(at for at, *_ in in_order(base(RUN)))
    assert "bag_0.db3: damaged, read in part" in said


@pytest.mark.parametrize(
    "name", ["run#3", "50%25 torque", "what?", "ünï 中", "a;b&c=d", 'it\'s "x"']
)
@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_bag_may_be_called_anything(tmp_path, storage, name):
    bag = a_run(30).write(tmp_path / name, storage)
    assert contents(bag) == (contents(a_run(30).write(tmp_path / "bag", storage))[0], "")


INNER = "rosbag2_bagfile_information:\n  relative_file_paths: "


@pytest.mark.parametrize("make", [mcap, sqlite])
@pytest.mark.parametrize(
    ("listed", "said"),
    [
        ("[other_0.mcap]", "names other_0.mcap, not there: {file} read instead"),
        ("[{file}.zstd]", "names {file}.zstd, not there: {file} read instead"),
        ("\n  - 'other_0.mcap'\n  - a\n", "names other_0.mcap, a, not there: {file} read instead"),
        ("[]", "names no file: {file} read instead"),
        ('["\\UFFFFFFFF"]', "names \\UFFFFFFFF, not there: {file} read instead"),
        ("[..]", "names .., not there: {file} read instead"),
    ],
)
def test_what_is_there_is_read_whatever_the_metadata_name(tmp_path, make, listed, said):
    bag = make(tmp_path / "bag")
    (file,) = (file.name for file in bag.iterdir())
    (bag / "metadata.yaml").write_text(INNER + listed.format(file=file))
    read, losses = contents(bag)
    assert is_part(read, in_order(base())) == 0
    assert losses == f"metadata.yaml {said.format(file=file)}"


def test_a_file_that_the_metadata_do_not_name_is_said_and_not_read(tmp_path):
    bag = a_run(30).write(tmp_path / "bag")
    shutil.copy(bag / "bag_0.mcap", bag / "copy.mcap")
    read, losses = contents(bag)
    assert is_part(read, in_order(base())) == 0
    assert losses == "metadata.yaml does not name copy.mcap: not read"


def test_a_part_of_a_bag_may_have_another_name(tmp_path):
    bag = mcap(tmp_path / "bag", base()[:40])
    (bag / "bag_0.mcap").rename(bag / "b.mcap")
    mcap(bag, base()[40:])
    (bag / "metadata.yaml").write_text(INNER + "[bag_0.mcap, a.mcap]")
    read, losses = contents(bag)
    assert is_part(read, in_order(base())) == 0
    assert losses == "metadata.yaml names a.mcap, not there: b.mcap read instead"


def test_a_file_that_is_there_packed_as_well_is_read_once(tmp_path):
    bag = mcap(tmp_path / "bag")
    packed = zstandard.compress((bag / "bag_0.mcap").read_bytes())
    (bag / "bag_0.mcap.zstd").write_bytes(packed)
    assert contents(bag) == (in_order(base()), "")


@pytest.mark.parametrize("make", [mcap, sqlite])
@pytest.mark.parametrize("name", ["bag_0", "bag_0.bin", "bag_0.mcap.zstd", "bag_0.db3.zst"])
def test_a_storage_file_is_known_by_how_it_begins(tmp_path, make, name):
    bag = make(tmp_path / "bag")
    (file,) = bag.iterdir()
    target = tmp_path / name
    data = file.read_bytes()
    target.write_bytes(zstandard.compress(data) if ".z" in name else data)
    assert is_part(contents(target)[0], in_order(base())) == 0


@pytest.mark.parametrize("encoding", ["json", "protobuf", "flatbuffer", "ros1", "cbor", ""])
def test_a_topic_of_another_encoding_costs_no_other_one(tmp_path, encoding):
    more = [("/other", "my_msgs/msg/Own", BEGAN, b"{}")]
    encodings, schemas = {"/other": encoding}, {"my_msgs/msg/Own": "nothing of ROS {}"}
    bag = mcap(tmp_path / "bag", [*base(), *more], encodings=encodings, schemas=schemas)
    read, losses = contents(bag)
    assert is_part(read, in_order(base())) == 0
    assert losses == f"bag_0.mcap: /other left out: encoded as {encoding or 'nothing'}, not cdr"


@pytest.mark.parametrize("encoding", ["jsonschema", "protobuf", "flatbuffer", "ros1msg", "own", ""])
def test_nor_does_one_whose_type_is_told_otherwise(tmp_path, encoding):
    def add(writer):
        schema = writer.register_schema("foxglove.Log", encoding, b"\xff\0{}")
        channel = writer.register_channel("/log", "protobuf", schema)
        writer.add_message(channel, BEGAN, b"\x0a", BEGAN)

    read, losses = contents(mcap(tmp_path / "bag", extra=add))
    assert is_part(read, in_order(base())) == 0
    assert losses == "bag_0.mcap: /log left out: encoded as protobuf, not cdr"


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"#ROSBAG V2.0\n", "a ROS 1 bag; `rosbags-convert"),
        (b"PK\3\4..", "a zip archive; unpack it"),
        (b"\x1f\x8b..", "packed with gzip; unpack it"),
        (b"\x89PNG\r\n", "a PNG picture"),
        (b"\x89HDF\r\n", "an HDF5 file"),
        (b"time,x,y\n0,1,2\n", "a text"),
        (b"\0\1\2\3", "of no known kind"),
        (b"", "empty"),
    ],
)
@pytest.mark.parametrize("name", ["run.bag", "run.mcap", "run.db3", "run"])
def test_what_is_no_bag_is_called_by_its_name(tmp_path, name, data, said):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(ValueError, match=r"^[^\n]+$") as report:
        contents(tmp_path / name)
    assert f"{tmp_path / name} is no readable bag: " in str(report.value)
    assert said in str(report.value)


def test_a_directory_says_what_it_has_instead(tmp_path):
    (tmp_path / "run.bag").write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(ValueError, match=r"no .mcap or .db3 file in it; run.bag is a ROS 1 bag"):
        contents(tmp_path)


def test_a_directory_of_bags_says_so(tmp_path):
    write(tmp_path / "morning", [])
    with pytest.raises(ValueError, match="there is a bag morning in it"):
        contents(tmp_path)


@pytest.mark.parametrize("ending", ["-wal", "-journal"])
def test_an_empty_log_beside_a_database_is_not_a_word_worth(tmp_path, ending):
    bag = a_run(30).write(tmp_path / "bag", "sqlite3")
    (bag / f"bag_0.db3{ending}").write_bytes(b"")
    assert contents(bag)[1] == ""


def test_the_log_of_a_killed_recorder_is_read_and_left_as_it_is(tmp_path):
    bag, copy = sqlite(tmp_path / "bag"), tmp_path / "copy"
    with closing(sqlite3.connect(bag / "bag_0.db3")) as database:
        database.execute("PRAGMA journal_mode = WAL")
        database.execute("INSERT INTO messages VALUES (NULL, 1, 9, x'00')")
        database.commit()
        shutil.copytree(bag, copy)
    before = {file.name: file.read_bytes() for file in copy.iterdir()}
    read, losses = contents(copy)
    assert (9, "/odom", b"\0") in read
    assert losses.endswith("its recorder was killed, read together with bag_0.db3-wal")
    assert {file.name: file.read_bytes() for file in copy.iterdir()} == before


@pytest.mark.parametrize("number", range(14))
def test_no_statement_of_a_database_is_run(tmp_path, monkeypatch, number):
    monkeypatch.chdir(tmp_path)
    victims(tmp_path)
    sqlite(tmp_path / "bag", change="CREATE TABLE a_first (x);")
    with closing(sqlite3.connect(tmp_path / "bag" / "bag_0.db3")) as database:
        database.execute("PRAGMA writable_schema = ON")
        database.execute(
            "UPDATE sqlite_master SET sql = ? WHERE name = 'a_first'", [harm()[number]]
        )
        database.commit()
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    with suppress(ValueError):
        assert is_part(contents(tmp_path / "bag")[0], in_order(base())) == 0
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before


def test_an_odometry_of_odd_bytes_is_one_line(tmp_path):
    odd = coded(ODOMETRY, a_run(1).messages[0][3])[:-9]
    bag = mcap(
        tmp_path / "bag", [*base(), *[("/odom", ODOMETRY, BEGAN, odd + bytes(i)) for i in range(5)]]
    )
    with open_bag(bag) as opened:
        assert len(list(opened.messages(["/odom"]))) == 30
        assert len(opened.losses) == 2, opened.losses
