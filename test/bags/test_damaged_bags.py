"""What could be read of a damaged bag is used, what could not is said; never a traceback."""

import math
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_bag import Made, a_run, blank, message, write

from climber_uk.bags.recorded_run import read_runs
from climber_uk.bags.topics import Topics
from climber_uk.report.metrics import Case, evaluate

STORAGES = ["mcap", "sqlite3"]
N = 60
FUZZ = settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck))


def read(bag):
    (run,), losses = read_runs(bag, Topics())
    return run, "; ".join(losses)


def read_or_refuse(bag):
    """Run, or None, and what was said; nothing but one line with the bag's name is raised."""
    try:
        run, said = read(bag)
    except ValueError as refusal:
        run, said = None, str(refusal)
    assert "\n" not in said
    if run is None:
        assert str(bag) in said
    else:
        evaluate(Case(run))
    return run, said


def storage_file(bag):
    (file,) = (file for file in bag.iterdir() if file.suffix in (".mcap", ".db3"))
    return file


@pytest.fixture(scope="module", params=STORAGES)
def whole(request, tmp_path_factory):
    """A bag with a flush by message, which the test damages, its file's contents, and its run."""
    bag = a_run(N).write(tmp_path_factory.mktemp("whole") / "bag", request.param, flush=True)
    return bag, storage_file(bag).read_bytes(), read(bag)[0]


def is_part_of(run, whole):
    found = np.searchsorted(whole.odometry.stamps, run.odometry.stamps)
    np.testing.assert_array_equal(run.odometry.stamps, whole.odometry.stamps[found])
    np.testing.assert_array_equal(run.pose, whole.pose[found])


@pytest.mark.slow
@FUZZ
@given(kept=st.floats(0, 1, exclude_max=True))
def test_a_bag_cut_anywhere_gives_what_comes_before_the_cut_or_one_line(whole, kept):
    bag, data, run = whole
    storage_file(bag).write_bytes(data[: int(kept * len(data))])
    found, said = read_or_refuse(bag)
    if found is not None:
        assert "cut off" in said
        is_part_of(found, run)


def test_most_of_a_bag_is_read_up_to_the_cut(whole):
    bag, data, _ = whole
    storage_file(bag).write_bytes(data[: int(0.7 * len(data))])
    run, losses = read(bag)
    assert f"{storage_file(bag).name}: cut off, read up to the last whole message" in losses
    assert len(run.time) > N / 3


@pytest.mark.slow
@FUZZ
@given(
    places=st.lists(st.floats(0, 1, exclude_max=True), min_size=1, max_size=5),
    mask=st.binary(min_size=1, max_size=1),
)
def test_wrong_bytes_anywhere_are_survived(whole, places, mask):
    bag, data, _ = whole
    wrong = bytearray(data)
    for place in places:
        wrong[int(place * len(data))] ^= mask[0]
    storage_file(bag).write_bytes(wrong)
    read_or_refuse(bag)


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("metadata", [None, "", "nonsense", "a: [", "\0"])
def test_metadata_are_not_needed(tmp_path, storage, metadata):
    bag = a_run(N).write(tmp_path / "bag", storage)
    (bag / "metadata.yaml").unlink()
    if metadata is not None:
        (bag / "metadata.yaml").write_text(metadata)
    run, losses = read(bag)
    assert len(run.time) == N
    assert losses == "metadata.yaml: missing or damaged, not needed"


def test_a_file_that_is_not_there_is_said(tmp_path):
    bag = a_run(N).write(tmp_path / "bag")
    metadata = bag / "metadata.yaml"
    metadata.write_text(
        metadata.read_text().replace("- bag_0.mcap\n", "- bag_0.mcap\n  - bag_1.mcap\n", 1)
    )
    run, losses = read(bag)
    assert len(run.time) == N
    assert losses == "bag_1.mcap: not there"


@pytest.mark.parametrize("storage", STORAGES)
def test_an_empty_bag_is_one_line(tmp_path, storage):
    write(tmp_path / "bag", [], storage)
    with pytest.raises(ValueError, match=r"/bag: no odometry: no message on odom$"):
        read(tmp_path / "bag")


def test_a_topic_without_a_message_is_one_line(tmp_path):
    (odometry, kind, *_), *_ = a_run(1).messages
    write(
        tmp_path / "bag",
        [("/other", "std_msgs/msg/Int64", 5, blank("std_msgs/msg/Int64"))],
        topics={odometry: kind},
    )
    with pytest.raises(ValueError, match=r"/bag: no odometry: no message on /odom$"):
        read(tmp_path / "bag")


def test_odometry_that_is_not_finite_is_left_out_and_counted(tmp_path):
    made = Made(N)
    made.pose[10:15, 1] = math.nan
    made.add_odometry()
    made.add_reference()
    run, said = read(made.write(tmp_path / "bag"))
    assert len(run.time) == N - 5
    assert said == "/odom: 5 of 60 messages left out: position not finite, or above 1e+06 m (5)"
    assert np.nanmax(run.distance) < 1e-9


def test_odometry_without_a_finite_message_is_one_line(tmp_path):
    made = Made(N)
    made.pose[:] = math.nan
    made.add_odometry()
    said = r"/bag: /odom: 60 of 60 messages left out: position not finite.* no message of use$"
    with pytest.raises(ValueError, match=said):
        read(made.write(tmp_path / "bag"))


def test_a_topic_of_another_type_than_it_should_have_is_said_and_left_out(tmp_path):
    made = a_run(N)
    made.messages = [m for m in made.messages if m[0] != "/wheel_torques"]
    made.add("wheel_torques", "std_msgs/msg/String", 5, message("std_msgs/msg/String", data="x"))
    run, losses = read(made.write(tmp_path / "bag"))
    assert len(run.time) == N
    assert len(run.torques) == 0
    assert losses.startswith("/wheel_torques: messages are not what they should be")


def test_a_type_that_nobody_knows_costs_no_other_topic(tmp_path):
    bag = a_run(N).write(tmp_path / "bag", "sqlite3")
    with closing(sqlite3.connect(storage_file(bag))) as database:
        database.execute("UPDATE topics SET type = 'my_msgs/msg/Own' WHERE name = '/wheel_torques'")
        database.commit()
    run, losses = read(bag)
    assert len(run.time) == N
    assert losses == "/wheel_torques: type my_msgs/msg/Own is unknown"
