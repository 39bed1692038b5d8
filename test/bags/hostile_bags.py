"""Bags that were made to do harm, or that only look like one, each by a function of its own.

`KINDS` has them by name. Each writes into a directory that is not there yet, and takes what it
chooses from a random generator. The victims are files that nobody may touch.
"""

import json
import os
import socket
import sqlite3
import struct
import zlib
from contextlib import closing, suppress
from functools import lru_cache
from pathlib import Path

import lz4.frame
import numpy as np
import zstandard
from made_bag import BEGAN, JOINTS, ODOMETRY, SECOND, START, STORE, a_run, message, turn
from mcap.writer import CompressionType, IndexType, Writer

MIB = 2**20
N = 30
VICTIMS = Path("victims")  # beside the bag
DATABASE, TEXT = VICTIMS / "notes.db", VICTIMS / "notes.txt"
KINDS = {}
HEAVY = []  # those of them that take seconds


def kind(make):
    KINDS[make.__name__] = make
    return make


def heavy(make):
    HEAVY.append(make.__name__)
    return kind(make)


def victims(directory):
    """Files that a bag may try to touch."""
    (directory / VICTIMS).mkdir()
    (directory / TEXT).write_text("notes")
    with closing(sqlite3.connect(directory / DATABASE)) as database:
        database.execute("CREATE TABLE notes (note)")
        database.commit()


def coded(type_name, made):
    return bytes(STORE.serialize_cdr(made, type_name))


def odometry(i=0, stamp=None, **values):
    stamp = START + i * SECOND // 100 if stamp is None else stamp
    values = {"child_frame_id": "base_link", "pose__pose__orientation": turn(0.0), **values}
    made = message(ODOMETRY, stamp, **values)
    return coded(ODOMETRY, made)


@lru_cache
def base(n=N):
    """Topic, type, log time and data of a run."""
    return tuple(
        (topic, kind, at, coded(kind, made)) for topic, kind, at, made in a_run(n).messages
    )


@lru_cache
def packed_zeros(mebibytes):
    """Zeros, packed with zstd."""
    return zstandard.ZstdCompressor().compress(bytes(mebibytes * MIB))


@kind
def a_run_of_mcap(bag, rng):
    how = {"compression": CompressionType(int(rng.integers(1, 4)))} if rng.random() < 0.5 else {}
    chunked = bool(rng.random() < 0.8)
    index = IndexType.ALL if rng.random() < 0.5 else IndexType.NONE
    mcap(bag, use_chunking=chunked, chunk_size=20_000, index_types=index, **how)


@kind
def a_run_of_sqlite(bag, _):
    sqlite(bag)


# ---- MCAP


def mcap(bag, messages=None, extra=None, schemas=None, encodings=None, **how):
    """An MCAP file in a bag without metadata; `extra` adds to it before it is closed."""
    bag.mkdir(exist_ok=True)
    with (bag / "bag_0.mcap").open("wb") as stream:
        writer = Writer(stream, compression=how.pop("compression", CompressionType.NONE), **how)
        writer.start("ros2", "made")
        made, channels = {}, {}
        for topic, type_name, at, data in base() if messages is None else messages:
            if topic not in channels:
                if type_name not in made:
                    text = (schemas or {}).get(type_name)
                    text = (
                        STORE.generate_msgdef(type_name, ros_version=2)[0] if text is None else text
                    )
                    made[type_name] = writer.register_schema(type_name, "ros2msg", text.encode())
                encoding = (encodings or {}).get(topic, "cdr")
                channels[topic] = writer.register_channel(topic, encoding, made[type_name])
            writer.add_message(channels[topic], at, data, at)
        if extra:
            extra(writer)
        writer.finish()
    return bag


def raw_mcap(bag, *records):
    """An MCAP file of records, which may be as wrong as they like."""
    bag.mkdir(exist_ok=True)
    header = b"\4\0\0\0ros2\0\0\0\0"
    parts = [(1, header), *records, (15, bytes(4)), (2, bytes(20))]
    magic = b"\x89MCAP0\r\n"
    data = b"".join(struct.pack("<BQ", opcode, len(part)) + part for opcode, part in parts)
    (bag / "bag_0.mcap").write_bytes(magic + data + magic)
    return bag


def text(value):
    return struct.pack("<I", len(value)) + value


def schema_and_channel(type_name=ODOMETRY, topic="/odom"):
    definition = STORE.generate_msgdef(type_name, ros_version=2)[0].encode()
    schema = struct.pack("<H", 1) + text(type_name.encode()) + text(b"ros2msg") + text(definition)
    channel = struct.pack("<HH", 1, 1) + text(topic.encode()) + text(b"cdr") + text(b"")
    return [(3, schema), (4, channel)]


def record(data, at=BEGAN, channel=1):
    return struct.pack("<BQHIQQ", 5, 22 + len(data), channel, 0, at, at) + data


def chunk(packed, size, compression, at=(BEGAN, BEGAN)):
    head = struct.pack("<QQQI", *at, size, 0) + text(compression)
    return 6, head + struct.pack("<Q", len(packed)) + packed


def many_odometries(size):
    """Valid odometry, over and over again, of `size` bytes together."""
    one = record(odometry())
    return one * (size // len(one))


@heavy
def mcap_zstd_bomb(bag, rng):
    count = int(rng.choice([1, 5, 30]))
    size, packed = count * 64 * MIB, packed_zeros(64) * count
    told = int(rng.choice([size, 100, 2**40, 2**63]))
    raw_mcap(bag, *schema_and_channel(), chunk(packed, told, b"zstd"))


@heavy
def mcap_zstd_bomb_of_odometry(bag, _):
    data = many_odometries(50 * MIB)
    packed = zstandard.ZstdCompressor(level=3).compress(data)
    raw_mcap(bag, *schema_and_channel(), *[chunk(packed, len(data), b"zstd")] * 30)


@heavy
def mcap_lz4_bomb(bag, rng):
    data = bytes(int(rng.choice([64, 300])) * MIB)
    packed = lz4.frame.compress(data)
    told = int(rng.choice([len(data), 2**40]))
    raw_mcap(bag, *schema_and_channel(), *[chunk(packed, told, b"lz4")] * 3)


@heavy
def mcap_message_bomb(bag, rng):
    packed = packed_zeros(int(rng.choice([10, 17, 600])))
    mcap(bag, [*base(), *[("/odom", ODOMETRY, BEGAN + i, packed) for i in range(100)]])


@heavy
def file_bomb(bag, rng):
    bag.mkdir()
    start = mcap(bag, index_types=IndexType.NONE) / "bag_0.mcap"
    data, name = start.read_bytes(), "bag_0.mcap.zstd"
    if rng.random() < 0.5:
        start.unlink()
        sqlite(bag)
        data, name = (bag / "bag_0.db3").read_bytes(), "bag_0.db3.zstd"
    for file in bag.iterdir():
        file.unlink()
    (bag / name).write_bytes(zstandard.compress(data) + packed_zeros(64) * 100)


@heavy
def mcap_of_many_fields(bag, rng):
    count = int(rng.choice([1000, 100_000, 1_000_000]))
    fields = "\n".join(f"float64 field_{i}" for i in range(count))
    mcap(bag, schemas={ODOMETRY: fields})


@kind
def mcap_of_nested_types(bag, rng):
    depth, each = (int(n) for n in rng.choice([(40, 2), (2000, 1), (15, 9)]))
    first = "\n".join(f"a/B0 x{i}" for i in range(each))
    nested = [
        f"{'=' * 80}\nMSG: a/B{k}\n" + "\n".join(f"a/B{k + 1} x{i}" for i in range(each))
        for k in range(depth)
    ]
    last = f"{'=' * 80}\nMSG: a/B{depth}\n" + ("" if rng.random() < 0.5 else "uint8 x")
    mcap(bag, schemas={ODOMETRY: "\n".join([first, *nested, last])})


@kind
def mcap_of_types_in_themselves(bag, rng):
    array = rng.choice(["", "[]", "[1000000000]"])
    mcap(bag, schemas={ODOMETRY: f"A{array} a\n{'=' * 80}\nMSG: nav_msgs/A\nA{array} a\nuint8 b"})


@kind
def mcap_of_huge_arrays(bag, rng):
    fields = rng.choice(
        [
            "float64[4000000000] a",
            "string[4000000000] a",
            "std_msgs/Empty[] a",
            "std_msgs/Empty[1000000000] a",
            "string<=5 a\nfloat64[<=3] b",
            "wstring a",
            "builtin_interfaces/Time[][] a",
        ]
    )
    empty = f"{'=' * 80}\nMSG: std_msgs/Empty\n"
    mcap(bag, schemas={ODOMETRY: f"{fields}\n{empty}"})


@kind
def huge_lengths_in_cdr(bag, rng):
    names = bytearray(coded(JOINTS, message(JOINTS, START, name=["l", "r"], effort=np.ones(2))))
    at = int(rng.integers(4, len(names) - 4))
    names[at : at + 4] = struct.pack("<I", int(rng.choice([2**32 - 1, 2**31, 10**6, 0])))
    mcap(bag, [*base(), *[("/wheel_torques", JOINTS, BEGAN + 3, bytes(names))] * 10])


@heavy
def many_names_in_cdr(bag, rng):
    count = int(rng.choice([10**4, 10**6]))
    data = coded(JOINTS, message(JOINTS, START, name=["x"] * count, effort=np.ones(2)))
    mcap(bag, [*base(), *[("/joint_states", JOINTS, BEGAN + i, data) for i in range(3)]])


@heavy
def each_message_another_name(bag, _):
    other = [
        coded(JOINTS, message(JOINTS, START + i, name=[f"{i}", "r"], effort=np.ones(2)))
        for i in range(2000)
    ]
    mcap(bag, [*base(), *[("/joint_states", JOINTS, BEGAN + i, d) for i, d in enumerate(other)]])


@kind
def strings_that_are_not_utf_8(bag, _):
    data = coded(JOINTS, message(JOINTS, START, name=["left", "right"], effort=np.ones(2)))
    spoilt = data.replace(b"left", b"\xff\xfe\x1b[")
    mcap(bag, [*base(), ("/wheel_torques", JOINTS, BEGAN, spoilt), ("/odom", ODOMETRY, 5, spoilt)])


@heavy
def many_climbers(bag, rng):
    count = int(rng.choice([99, 500, 20_000]))
    data = odometry()
    mcap(bag, [(f"/c{i}/odom", ODOMETRY, BEGAN, data) for i in range(count)])


@heavy
def as_many_channels_as_there_can_be(bag, _):
    mcap(bag, [*base(), *[(f"/t{i}", ODOMETRY, BEGAN, b"") for i in range(65_000)]])


@kind
def names_that_command_terminals(bag, rng):
    name = str(
        rng.choice(["\x1b[31m", "\x1b]0;x\x07", "\r\n", "\u202e", "x" * 10**6, "\0", "\x9b2J"])
    )
    where = [(f"/{name}/odom", ODOMETRY, BEGAN, odometry()), ("/odom", f"a/msg/{name}", 5, b"")]
    mcap(bag, [*base(), where[int(rng.integers(2))]], schemas={f"a/msg/{name}": "uint8 x"})


@kind
def other_encodings(bag, rng):
    encodings = ["json", "protobuf", "flatbuffer", "ros1", "cbor", "", "\x1b[2J", "x" * 10**5]
    topics = {"/odom": 0, "/reference": 1, "/wheel_torques": 2}

    def add(writer):
        for i, name in enumerate(["jsonschema", "protobuf", "flatbuffer", "ros1msg", "\x1b", ""]):
            schema = writer.register_schema(f"foxglove.{i}", name, b"\xff\0" * i)
            channel = writer.register_channel(f"/c/odom{i}", str(rng.choice(encodings)), schema)
            writer.add_message(channel, BEGAN + 9, b'{"a": 1}', 0)

    some = {topic: str(rng.choice(encodings)) for topic in topics if rng.random() < 0.3}
    mcap(bag, extra=add, encodings=some)


@kind
def log_times_that_cannot_be(bag, rng):
    times = [BEGAN, 0, 1, 2**63 - 1, 2**63, 2**64 - 1]
    mcap(bag, [(topic, of, times[rng.integers(6)], data) for topic, of, _, data in base()])


@heavy
def overlapping_chunks(bag, _):
    all_time = 0, 2**64 - 1
    data = many_odometries(100_000)
    many = [chunk(data, len(data), b"", all_time)] * 200
    raw_mcap(bag, *schema_and_channel(), *many)


@heavy
def many_tiny_chunks(bag, _):
    raw_mcap(bag, *schema_and_channel(), *[chunk(record(b""), 31, b"")] * 50_000)


@kind
def chunks_in_chunks(bag, _):
    inner = record(odometry())
    for _ in range(100):
        opcode, inner = chunk(inner, len(inner), b"")
        inner = struct.pack("<BQ", opcode, len(inner)) + inner
    raw_mcap(bag, *schema_and_channel(), (6, chunk(inner, len(inner), b"")[1]))


@kind
def records_that_are_not_what_they_are(bag, rng):
    opcodes = rng.integers(0, 256, 200).tolist()
    sizes = rng.integers(0, 80, 200).tolist()
    raw_mcap(bag, *[(op, rng.bytes(size)) for op, size in zip(opcodes, sizes, strict=True)])


@kind
def summaries_that_lie(bag, rng):
    """The checksum is right, the places and sizes are not."""
    file = mcap(bag) / "bag_0.mcap"
    data = bytearray(file.read_bytes())
    (start,) = struct.unpack_from("<Q", data, len(data) - 28)
    for _ in range(int(rng.integers(1, 20))):
        data[int(rng.integers(start, len(data) - 37))] = int(rng.integers(256))
    crc = zlib.crc32(data[start : len(data) - 12])
    data[len(data) - 12 : len(data) - 8] = struct.pack("<I", crc)
    file.write_bytes(data)


@heavy
def mostly_nothing(bag, rng):
    """A file of 200 GB that takes no room."""
    file = mcap(bag, index_types=IndexType.NONE) / "bag_0.mcap"
    if rng.random() < 0.5:
        (bag / "bag_0.mcap").unlink()
        sqlite(bag)
        file = bag / "bag_0.db3"
    os.truncate(file, int(rng.choice([200 * 2**30, 2 * 2**30])))


# ---- SQLite


def sqlite(bag, messages=None, change="", **edits):
    """A database of rosbag2, with some SQL after all is in it."""
    bag.mkdir(exist_ok=True)
    with closing(sqlite3.connect(bag / "bag_0.db3")) as database:
        database.executescript(
            "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
            " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
            " timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
            "CREATE INDEX timestamp_idx ON messages (timestamp ASC);"
            "INSERT INTO schema VALUES (3, 'iron');"
        )
        ids = {}
        for topic, type_name, at, data in base() if messages is None else messages:
            if topic not in ids:
                ids[topic] = len(ids) + 1
                database.execute(
                    "INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", (ids[topic], topic, type_name)
                )
            database.execute("INSERT INTO messages VALUES (NULL, ?, ?, ?)", (ids[topic], at, data))
        database.commit()
        database.executescript(change)
        database.commit()
    return bag


def harm():
    here = os.getcwd()
    return [
        f"ATTACH '{here}/{DATABASE}' AS x",
        f"ATTACH '{here}/{VICTIMS}/created.db' AS x",
        f"VACUUM INTO '{here}/{VICTIMS}/created.db'",
        f"CREATE TABLE a AS SELECT load_extension('{here}/x.so')",
        f"CREATE VIRTUAL TABLE topics USING csv(filename='{here}/{TEXT}')",
        "CREATE VIRTUAL TABLE messages USING fts5(data)",
        "CREATE/**/VIRTUAL TABLE messages USING dbstat",
        "CREATE TABLE x(y DEFAULT (load_extension('x')), CHECK (writefile('x', 'y')))",
        "CREATE VIEW messages AS WITH RECURSIVE r(x) AS (SELECT 1 UNION ALL SELECT x FROM r)"
        " SELECT x AS id, 1 AS topic_id, x AS timestamp, zeroblob(1000000) AS data FROM r",
        "DROP TABLE notes",
        "PRAGMA journal_mode = WAL",
        "",
        "CREATE TABLE messages(" + "(" * 5000,
        "CREATE TABLE " + "x" * 10**6 + " (y)",
    ]


@kind
def sql_in_the_definitions(bag, rng):
    """After the public report: what defines a table is another statement; a page is missing."""
    sqlite(bag, change="CREATE TABLE a_first (x);")
    with closing(sqlite3.connect(bag / "bag_0.db3", isolation_level=None)) as database:
        database.execute("PRAGMA writable_schema = ON")
        name = str(rng.choice(["a_first", "messages", "topics", "timestamp_idx"]))
        sql = str(rng.choice(harm()))
        database.execute("UPDATE sqlite_master SET sql = ? WHERE name = ?", (sql, name))
    data = bytearray((bag / "bag_0.db3").read_bytes())
    if rng.random() < 0.5:
        data[28:32] = (int.from_bytes(data[28:32]) + 1).to_bytes(4)
    (bag / "bag_0.db3").write_bytes(data)


@kind
def views_in_the_place_of_tables(bag, rng):
    table = str(rng.choice(["messages", "topics"]))
    view = str(
        rng.choice(
            [
                f"WITH RECURSIVE r(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM r) SELECT i AS id,"
                f" 1 AS topic_id, i AS timestamp, x'00' AS data, '/odom' AS name, '{ODOMETRY}' AS"
                " type, 'cdr' AS serialization_format, '' AS offered_qos_profiles FROM r",
                f"SELECT * FROM was_{table}",
                f"SELECT * FROM was_{table}, was_{table} AS b, was_{table} AS c",
            ]
        )
    )
    sqlite(bag, change=f"ALTER TABLE {table} RENAME TO was_{table}; CREATE VIEW {table} AS {view};")


@kind
def computed_columns(bag, rng):
    table = (
        "DROP TABLE messages; CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER,"
        " timestamp INTEGER, d BLOB, data BLOB AS ({}) {});"
        "INSERT INTO messages(topic_id, timestamp, d) VALUES (1, 5, x'00');"
    )
    computed = str(rng.choice(["zeroblob(900000000)", "hex(zeroblob(1000000))"]))
    sqlite(bag, change=table.format(computed, "VIRTUAL"))


@kind
def triggers_and_indexes(bag, _):
    sqlite(
        bag,
        change="CREATE TRIGGER t AFTER INSERT ON messages BEGIN DELETE FROM messages; END;"
        "CREATE INDEX i ON messages (length(hex(data)) + topic_id) WHERE timestamp > 3;"
        "CREATE VIEW v AS SELECT * FROM messages; ",
    )


@kind
def tables_of_other_forms(bag, rng):
    forms = [
        "CREATE TABLE messages(id, topic_id, timestamp, data, PRIMARY KEY (id)) WITHOUT ROWID",
        "CREATE TABLE messages(id, timestamp, data)",
        "CREATE TABLE messages(topic_id, timestamp, data, _rowid_, rowid, oid)",
        "CREATE TABLE messages(_ROWID_ AS (topic_id), topic_id, timestamp, data)",
        "CREATE TABLE x(y)",
        "CREATE VIRTUAL TABLE messages USING rtree(id, a, b)",
    ]
    sqlite(bag, change=f"DROP TABLE messages; {rng.choice(forms)};")


def sqlite_file(bag):
    return (bag if bag.exists() else sqlite(bag)) / "bag_0.db3"


@kind
def cells_of_other_types(bag, rng):
    values = [
        "'text'",
        "NULL",
        "1e999",
        "-1e999",
        "1.5",
        "-5",
        "9223372036854775807",
        "x'00'",
        "-9223372036854775808",
        "'\x1b[2J'",
        "CAST(x'ff' AS TEXT)",
        "'nan'",
        "zeroblob(9)",
    ]
    columns = [
        "messages.timestamp",
        "messages.topic_id",
        "messages.data",
        "topics.name",
        "topics.type",
        "topics.serialization_format",
        "topics.id",
        "messages.id",
    ]
    for _ in range(int(rng.integers(1, 5))):
        table, column = str(rng.choice(columns)).split(".")
        change = f"UPDATE {table} SET {column} = {rng.choice(values)} WHERE rowid % 3 = 1"
        with closing(sqlite3.connect(sqlite_file(bag))) as database, suppress(sqlite3.Error):
            database.execute(change)
            database.commit()


@kind
def large_blobs(bag, rng):
    size = int(rng.choice([16, 17, 60])) * 10**6
    size = int(rng.choice([16, 17, 60])) * 10**6
    sqlite(bag, change=f"INSERT INTO messages VALUES (NULL, 1, 5, zeroblob({size}))")


@heavy
def sqlite_message_bomb(bag, rng):
    packed = packed_zeros(int(rng.choice([10, 17, 600])))
    sqlite(bag, [*base(), *[("/odom", ODOMETRY, BEGAN + i, packed) for i in range(100)]])


@heavy
def many_rows_of_topics(bag, _):
    sqlite(
        bag,
        change="WITH RECURSIVE r(i) AS (SELECT 100 UNION ALL SELECT i + 1 FROM r LIMIT 100000)"
        f" INSERT INTO topics SELECT i, '/c' || i || '/odom', '{ODOMETRY}', 'cdr', '' FROM r",
    )


@kind
def pages_that_refer_to_the_same(bag, rng):
    """Of the tree of the messages all branches are the same one."""
    sqlite(bag, base(600))
    file = bag / "bag_0.db3"
    with closing(sqlite3.connect(file)) as database:
        sql = "SELECT rootpage FROM sqlite_master WHERE name = 'messages'"
        (root,) = database.execute(sql).fetchone()
        (size,) = database.execute("PRAGMA page_size").fetchone()
    data = bytearray(file.read_bytes())
    page = (root - 1) * size
    if data[page] == 5:  # an inner one
        (count,) = struct.unpack_from(">H", data, page + 3)
        for k in range(count):
            (cell,) = struct.unpack_from(">H", data, page + 12 + 2 * k)
            child = root if rng.random() < 0.1 else int.from_bytes(data[page + 8 : page + 12])
            data[page + cell : page + cell + 4] = child.to_bytes(4)
    file.write_bytes(data)


@kind
def journals_that_name_a_file(bag, rng):
    """SQLite removes the file that a journal names, where it plays it."""
    database = sqlite(bag) / "bag_0.db3"
    data = database.read_bytes()
    page = int.from_bytes(data[16:18])
    magic = bytes.fromhex("d9d505f920a163d7")
    count = int(rng.choice([0, 1, 2**32 - 1]))
    head = magic + struct.pack(">IIIII", count, 0x1234, len(data) // page, 512, page)
    victim = str(Path.cwd() / rng.choice([str(TEXT), str(DATABASE)])).encode()
    tail = struct.pack(">I", 0x40000000 // page + 1) + victim
    tail += struct.pack(">II", len(victim), sum(victim) & 0xFFFFFFFF) + magic
    (bag / "bag_0.db3-journal").write_bytes(head.ljust(512, b"\0") + tail)


@kind
def what_lies_beside(bag, rng):
    """Logs and journals that are none, or of another database."""
    sqlite(bag)
    for ending in ("-wal", "-journal", "-shm"):
        how = int(rng.integers(5))
        file = bag / f"bag_0.db3{ending}"
        if how == 0:
            file.write_bytes(b"")
        elif how == 1:
            file.write_bytes(rng.bytes(5000))
        elif how == 2:
            head = struct.pack(">IIII", 0x377F0682, 3007000, 65536, 0)
            file.write_bytes(head + rng.bytes(8000))
        elif how == 3:
            file.symlink_to(Path.cwd() / TEXT)


# ---- directories


@kind
def metadata_to_choke_on(bag, rng):
    laughs = "a0: &a0 [x]\n" + "".join(
        f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 30)
    )
    merges = "a0: &a0 {x: 1}\n" + "".join(
        f"a{i}: &a{i} {{<<: [{', '.join([f'*a{i - 1}'] * 9)}]}}\n" for i in range(1, 30)
    )
    inner = "rosbag2_bagfile_information:\n  relative_file_paths: "
    told = [
        "[" * 10**5,
        "{a: " * 10**5,
        "- " * 10**5,
        "a: " * 10**4,
        "? " * 10**5,
        laughs,
        merges,
        inner + "[]",
        inner + "5",
        inner + "{a: b}",
        inner + "[[bag_0.mcap]]",
        inner + "[*a]",
        inner + "&a [*a]",
        inner + "[../../etc/passwd, /etc/passwd, '', ., ..]",
        inner + "[other.mcap]",
        inner + "[bag_0.mcap, bag_0.mcap]",
        inner + "[!!python/none a]",
        inner + "[bag_0.mcap]\n  starting_time: text\n  message_count: .nan",
        inner + "['\\x1b[31m.mcap', \"\\e[31m.mcap\"]",
        inner + "[" + "a," * 10**5 + "]",
        "\xff\xfe",
        "%YAML 9.9\n---\n",
        "x" * 20_000_000,
        inner + '["\\0.mcap"]',
    ]
    (mcap if rng.random() < 0.7 else sqlite)(bag)
    (bag / "metadata.yaml").write_text(str(told[int(rng.integers(len(told)))]), encoding="latin-1")


def special(path, rng):
    """What is no regular file, or is elsewhere."""
    match int(rng.integers(7)):
        case 0:
            os.mkfifo(path)
        case 1:
            path.symlink_to("/dev/zero")
        case 2:
            path.symlink_to("/dev/tty")
        case 3:
            with closing(socket.socket(socket.AF_UNIX)) as server:
                here = os.getcwd()
                os.chdir(path.parent)
                server.bind(path.name)
                os.chdir(here)
        case 4:
            path.symlink_to(Path.cwd() / TEXT)
        case 5:
            path.symlink_to(path.name)
        case 6:
            path.mkdir()


@kind
def files_that_are_none(bag, rng):
    (mcap if rng.random() < 0.5 else sqlite)(bag)
    names = [
        "metadata.yaml",
        "bag_0.mcap",
        "bag_0.db3",
        "bag_0.db3-wal",
        "bag_0.db3-journal",
        "bag_1.mcap",
        "bag_0.mcap.zstd",
        "analysis",
        "notes",
    ]
    for name in rng.choice(names, 2, replace=False).tolist():
        (bag / name).unlink(missing_ok=True)
        special(bag / name, rng)


@kind
def what_is_no_bag(bag, rng):
    contents = [
        b"#ROSBAG V2.0\n" + bytes(100),
        b"PK\3\4" + rng.bytes(99),
        b"\x89PNG\r\n\x1a\n",
        b"\x89HDF\r\n\x1a\n",
        b"a,b\n1,2\n",
        b"\x1f\x8b\x08",
        b"\x04\x22\x4d\x18aa",
        b"",
        b"\x28\xb5\x2f\xfd",
        b"\x28\xb5\x2f\xfd" + rng.bytes(50),
        rng.bytes(300),
        b"text",
        zstandard.compress(b"#ROSBAG V2.0"),
        json.dumps({"a": 1}).encode(),
        b"\x1b[31mred",
    ]
    names = ["run.bag", "run.mcap", "run.db3", "run.zip", "run.mcap.zstd", "run", "run.db3.zst"]
    bag.mkdir()
    for _ in range(int(rng.integers(1, 4))):
        (bag / str(rng.choice(names))).write_bytes(contents[int(rng.integers(len(contents)))])


@heavy
def very_many_files(bag, _):
    mcap(bag)
    for i in range(2000):
        (bag / f"f{i}.mcap").write_bytes(b"")


# ---- runs


@kind
def numbers_that_cannot_be(bag, rng):
    strange = [np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 1e20, 0.0]
    stamps = [0, 2**31 * SECOND - 1, -(2**31) * SECOND, 1]
    fields = ["pose__pose__position__x", "twist__twist__linear__x", "twist__twist__angular__z"]
    made = list(base())
    for i in range(40):
        value = {str(rng.choice(fields)): float(rng.choice(strange))}
        stamp = int(rng.choice(stamps)) if rng.random() < 0.2 else None
        made.append(("/odom", ODOMETRY, BEGAN + i, odometry(i, stamp=stamp, **value)))
    (mcap if rng.random() < 0.5 else sqlite)(bag, made)


def damage(bag, rng):
    """Change some bytes of a bag's files, or cut them off."""
    for file in sorted(bag.rglob("*")):
        if file.is_symlink() or not file.is_file() or not 0 < file.stat().st_size < 10 * MIB:
            continue
        data = bytearray(file.read_bytes())
        match int(rng.integers(5)):
            case 0:
                del data[int(rng.integers(len(data))) :]
            case 1:
                for place in rng.integers(0, len(data), int(rng.integers(1, 8))).tolist():
                    data[place] = int(rng.integers(256))
            case 2:
                at = int(rng.integers(len(data)))
                data[at : at + 8] = struct.pack("<q", int(rng.choice([-1, 0, 2**62, 10**6])))
            case 3:
                at, size = (int(n) for n in rng.integers(0, len(data), 2))
                del data[at : at + size % 1000]
        file.write_bytes(data)
