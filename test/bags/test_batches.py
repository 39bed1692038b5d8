"""Batches hold what rosbags' own deserialiser finds, message by message."""

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from climber_uk.bags.bag import open_bag
from climber_uk.bags.bag_writer import BagWriter
from climber_uk.bags.batches import CHUNK, decode, read_batches

STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(
    get_types_from_msg(
        "bool flag\nint8 small\nfloat32 single\nstring word\nuint64 large\nint16[3] three\n"
        "float64[] many\nstring[] words\ngeometry_msgs/Vector3[] vectors\nbyte last\n",
        "test_msgs/msg/Mixture",
    )
)


def make(type_name, **fields):
    return STORE.types[f"{type_name}"](**fields)


def header(stamp, frame="odom"):
    time = make("builtin_interfaces/msg/Time", sec=stamp // 10**9, nanosec=stamp % 10**9)
    return make("std_msgs/msg/Header", stamp=time, frame_id=frame)


def joint_state(stamp, names, efforts):
    return make(
        "sensor_msgs/msg/JointState",
        header=header(stamp),
        name=names,
        position=np.array([]),
        velocity=np.array([]),
        effort=np.array(efforts, float),
    )


def mixture(word, many, words, vectors, number):
    return make(
        "test_msgs/msg/Mixture",
        flag=bool(number % 2),
        small=number % 100 - 50,
        single=number / 3,
        word=word,
        large=number + 2**40,
        three=np.array([number % 7, -1, 2], np.int16),
        many=np.array(many, float),
        words=words,
        vectors=[make("geometry_msgs/msg/Vector3", x=x, y=-x, z=0.5) for x in vectors],
        last=number % 128,
    )


def coded(message, little_endian=True):
    return bytes(STORE.serialize_cdr(message, message.__msgtype__, little_endian=little_endian))


@pytest.mark.parametrize("little_endian", [True, False])
def test_every_kind_of_field_is_found_where_it_is(little_endian):
    random = np.random.default_rng(3)
    messages = [
        mixture(
            "x" * random.integers(0, 9),
            random.normal(size=random.integers(0, 3)),
            ["ab", "c"][: random.integers(0, 3)],
            random.normal(size=random.integers(0, 3)).tolist(),
            number,
        )
        for number in range(300)
    ]
    recorded = [(i, coded(message, little_endian)) for i, message in enumerate(messages)]
    batches, spoilt = decode(recorded, "test_msgs/msg/Mixture", STORE)
    assert spoilt == ""
    assert sum(map(len, batches)) == 300
    assert max(map(len, batches)) > 1
    for batch in batches:
        for i, log_time in enumerate(batch.log_times):
            m = messages[log_time]
            assert batch["flag"][i] == m.flag
            assert batch["small"][i] == m.small
            assert batch["single"][i] == np.float32(m.single)
            assert batch.strings["word"] == m.word
            assert batch.rows["large"][i] == m.large
            assert batch["three"][i].tolist() == m.three.tolist()
            assert batch["many"][i].tolist() == m.many.tolist()
            assert [batch.strings[f"words.{k}"] for k in range(len(m.words))] == m.words
            assert batch.lengths["vectors"] == len(m.vectors)
            for k, vector in enumerate(m.vectors):
                at = [f"vectors.{k}.{axis}" for axis in "xyz"]
                assert batch.columns(*at)[i].tolist() == [vector.x, vector.y, vector.z]
            assert batch["last"][i] == m.last


def test_names_in_another_order_are_a_batch_of_their_own():
    orders = [["left", "right"], ["right", "left"]]
    recorded = [(i, coded(joint_state(i, orders[i % 2], [i, -i]))) for i in range(10)]
    batches, _ = decode(recorded, "sensor_msgs/msg/JointState", STORE)
    assert [[b.strings["name.0"], b.strings["name.1"]] for b in batches] == orders
    for offset, batch in enumerate(batches):
        assert batch.stamps.tolist() == [*range(offset, 10, 2)]
        assert batch["effort"][:, 0].tolist() == [*range(offset, 10, 2)]
        assert batch["position"].shape == (5, 0)


def test_messages_that_are_cut_off_or_absurd_are_left_out_and_told():
    whole = coded(joint_state(7, ["left", "right"], [1.0, 2.0]))
    absurd = whole[:12] + b"\xff\xff\xff\xff" + whole[16:]
    recorded = [
        *enumerate([whole, whole[:50], whole[:10], b"\0\7" + whole[2:], absurd, b"", whole])
    ]
    batches, spoilt = decode(recorded, "sensor_msgs/msg/JointState", STORE)
    assert spoilt
    assert [log_time for batch in batches for log_time in batch.log_times] == [0, 6]
    (batch,), _ = decode([(2**64 - 1, whole)], "sensor_msgs/msg/JointState", STORE)
    assert batch.log_times == [2**63 - 1]


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_topics_longer_than_a_chunk_come_whole(tmp_path, storage):
    with BagWriter(tmp_path / "bag", storage) as writer:
        for topic in ("/a", "/b"):
            writer.add_topic(topic, "sensor_msgs/msg/JointState", [])
        for i in range(CHUNK + 100):
            writer.write("/a", i, i, coded(joint_state(i, ["left"], [i])))
        writer.write("/b", 5, 5, coded(joint_state(5, ["left"], [5])))
    found = {"/a": [], "/b": []}
    with open_bag(tmp_path / "bag") as bag:
        for topic, batch in read_batches(bag, ["/a", "/b", "/c"]):
            found[topic] += batch["effort"][:, 0].tolist()
        assert bag.losses == []
    assert found == {"/a": [*range(CHUNK + 100)], "/b": [5]}
