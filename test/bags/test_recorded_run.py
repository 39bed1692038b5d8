"""Runs from bags of every form: stored, packed, split, named and timed one way or another."""

import re
import shutil

import numpy as np
import pytest
from made_bag import ODOMETRY, SECOND, START, STORE, Made, a_run, on_circle, write
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from climber_uk.bags.recorded_run import read_run, read_runs
from climber_uk.bags.reference import Previews, poses_at
from climber_uk.bags.topics import Topics
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.preview import Preview, joined

N = 60


def packed(path, made, plugin, mode):
    """The messages as the independent writer stores and compresses them."""
    writer = Writer(path, version=9, storage_plugin=plugin)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    connections = {}
    with writer:
        for topic, kind, log_time, sent in sorted(made.messages, key=lambda m: m[2]):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(connections[topic], log_time, bytes(STORE.serialize_cdr(sent, kind)))
    return path


@pytest.mark.parametrize(
    "mode", [CompressionMode.MESSAGE, CompressionMode.FILE, CompressionMode.STORAGE]
)
@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_compressed_bags_are_read_with_and_without_their_metadata(tmp_path, plugin, mode):
    if plugin is StoragePlugin.SQLITE3 and mode is CompressionMode.STORAGE:
        pytest.skip("SQLite has no compression of its own")
    bag = packed(tmp_path / "bag", a_run(N), plugin, mode)
    for said in ([], ["metadata.yaml: missing or damaged, not needed"]):
        (run,), losses = read_runs(bag, Topics())
        assert losses == said
        assert len(run.time) == len(run.torques) == N
        assert run.distance.max() < 1e-9
        (bag / "metadata.yaml").unlink(missing_ok=True)


def test_the_parts_of_a_split_bag_are_one_run(tmp_path):
    made = a_run(N)
    half = made.arrival(made.stamps[N // 2])
    parts = [m for m in made.messages if m[2] < half], [m for m in made.messages if m[2] >= half]
    for number, part in enumerate(parts):
        write(tmp_path / str(number), part)
        shutil.copy(tmp_path / str(number) / f"{number}_0.mcap", tmp_path)
    shutil.rmtree(tmp_path / "0")
    shutil.rmtree(tmp_path / "1")
    run = read_run(tmp_path)
    assert len(run.time) == N
    assert np.isfinite(run.distance).all()


def test_every_climber_is_found_by_its_odometry(tmp_path):
    made = [a_run(N, namespace=f"/{name}") for name in ("a", "b/c")]
    bag = write(tmp_path / "bag", [message for one in made for message in one.messages])
    runs, _ = read_runs(bag, Topics())
    assert [run.name for run in runs] == ["a", "b/c"]
    assert [len(run.torques) for run in runs] == [N, N]
    assert read_run(bag, "/b/c").name == "b/c"
    with pytest.raises(ValueError, match="no odometry: no message on /d/odom"):
        read_run(bag, "d")


def test_what_one_node_tells_is_put_to_its_own_climber(tmp_path):
    made = [a_run(N, namespace=f"/{name}") for name in ("a", "b")]
    made[0].add_mode(0.1, "no odometry", level=2)
    bag = write(tmp_path / "bag", [message for one in made for message in one.messages])
    runs, _ = read_runs(bag, Topics())
    assert [len(run.events) for run in runs] == [2, 0]


@pytest.mark.parametrize("rule", ["odom:=/robot/odometry", "odom:=odometry"])
def test_topics_may_have_other_names(tmp_path, rule):
    made = a_run(N)
    other = "/robot/odometry" if "robot" in rule else "/odometry"
    bag = write(
        tmp_path / "bag", [(other if m[0] == "/odom" else m[0], *m[1:]) for m in made.messages]
    )
    (run,), _ = read_runs(bag, Topics.parse([rule]))
    assert len(run.time) == len(run.torques) == N


def test_topics_may_lack_the_slash_in_front(tmp_path):
    bag = write(tmp_path / "bag", [(m[0][1:], *m[1:]) for m in a_run(N).messages])
    (run,), said = read_runs(bag, Topics())
    assert len(run.time) == len(run.torques) == N
    assert not said


@pytest.mark.parametrize(
    ("rule", "said"),
    [("odom", "must be FROM:=TO"), (":=x", "must be FROM:=TO"), ("odometry:=x", "is none of")],
)
def test_a_wrong_rule_is_named(rule, said):
    with pytest.raises(ValueError, match=f"remapping '{rule}'.* {said}"):
        Topics.parse([rule])


def test_stamps_are_the_time_axis_whatever_the_order_of_arrival(tmp_path):
    made = a_run(N)
    topics = {"/odom", "/wheel_torques"}
    made.messages = [
        (topic, kind, (START - log_time if topic in topics else log_time) + 2**62, sent)
        for topic, kind, log_time, sent in made.messages
    ]
    run = read_run(made.write(tmp_path / "bag"))
    np.testing.assert_allclose(run.time, made.time, atol=1e-9)
    assert run.odometry.late == N - 1
    assert run.distance.max() < 1e-9


def test_of_odometry_sent_twice_the_first_counts(tmp_path):
    made = a_run(N)
    true = made.pose.copy()
    made.pose = made.pose + 1.0
    (topic, kind, log_time, _), *_ = (m for m in made.messages if m[0] == "/odom")
    again = Made(1)
    again.pose = made.pose
    again.add_odometry()
    made.messages.append((topic, kind, log_time + 1, again.messages[0][3]))
    run = read_run(made.write(tmp_path / "bag"))
    assert run.odometry.repeated == 1
    np.testing.assert_allclose(run.pose, true, atol=1e-12)


def test_the_reference_is_that_of_the_joined_previews():
    """The interpolation that the controller has, with the later of two points at one time."""
    random = np.random.default_rng(5)
    begins = np.arange(8) * SECOND // 10
    times = begins[:, None] + np.arange(5) * SECOND // 20
    motion = random.normal(size=(8, 5, 3, 3))
    previews = [Preview(t, *np.moveaxis(m, 1, 0)) for t, m in zip(times, motion, strict=True)]
    whole = joined(previews)
    stamps = random.integers(times[0, 0], times[-1, -1], 200)
    expected = [whole.at(int(stamp)).pose for stamp in stamps]
    shuffled = random.permutation(8)
    points = Previews(shuffled, times[shuffled], motion[shuffled])
    np.testing.assert_allclose(poses_at([points], stamps), expected, atol=1e-11)
    outside = poses_at([points], np.array([times[0, 0] - 1, times[-1, -1] + 1]))
    assert np.isnan(outside).all()
    assert np.isnan(poses_at([], stamps)).all()


def test_distances_are_from_where_the_reference_waited(tmp_path):
    made = Made(400)
    made.pose = on_circle(np.minimum(made.time, 0.5))[0]
    made.add_odometry()
    made.add_reference()
    made.add_reference_time(lambda time: min(time, 0.5))
    run = read_run(made.write(tmp_path / "bag"))
    assert run.distance.max() < 1e-6
    waited = run.recorded["reference_time"].values[-1, 0]
    assert waited == pytest.approx(made.time[-1] - 0.5, abs=0.06)


def test_wheels_are_told_apart_by_their_names(tmp_path):
    made = Made(N, torques=lambda time, _: np.tile([1.0, 2.0], (len(time), 1)))
    made.add_odometry()
    made.add_torques()
    for _, kind, _, sent in made.messages:
        if kind != ODOMETRY:
            sent.name = ["r_right", "l_left", "arm"]
            sent.effort = np.array([1.0, 2.0, 7.0])
    assert read_run(made.write(tmp_path / "bag")).torques[0].tolist() == [1.0, 2.0]


def test_parameters_are_those_that_the_controller_told_last(tmp_path):
    made = a_run(N)
    for time, mass in ((0.2, 6.0), (0.1, 4.0)):
        made.add_parameters(time, **vars(Climber()) | {"mass": mass, "adhesion": "magnetic"})
    run = read_run(made.write(tmp_path / "bag"))
    assert run.climber == Climber(mass=6.0)
    assert run.parameters["adhesion"] == "magnetic"


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("mass", -1.0, "must be > 0 [kg]"),
        ("max_wheel_torque", 1e300, "must be of a size from 1e-12 to 1e+12 [N m]"),
        ("adhesion", "glue", "must be one of suction, magnetic, none"),
        ("left_wheel_joint", 5, "must be a text"),
    ],
)
def test_parameters_that_cannot_be_are_said_and_not_used(tmp_path, name, value, said):
    made = a_run(N)
    made.add_parameters(**{name: value})
    (run,), losses = read_runs(made.write(tmp_path / "bag"), Topics())
    assert run.climber is None
    assert losses == [f"/uk_torque_controller/parameters: not used, {name}={value!r} {said}"]


def test_names_that_a_parameter_file_does_not_give_are_those_that_the_controller_told(tmp_path):
    made = a_run(N)
    made.add_parameters(left_wheel_joint="right", right_wheel_joint="left", mass=7.0)
    bag = made.write(tmp_path / "bag")
    (run,), _ = read_runs(bag, Topics(), parameters=lambda _: {"max_wheel_torque": 2.0})
    assert len(run.torques) == N
    assert run.climber == Climber(max_wheel_torque=2.0)
    (run,), (said,) = read_runs(bag, Topics(), parameters=lambda _: {"left_wheel_joint": "l"})
    assert "no l among the joints left, right" in said


def test_that_a_topic_has_another_clock_is_said(tmp_path):
    made = a_run(N)
    made.add_truth(made.pose)
    late = "ground_truth", "wheel_torques", "reference"
    for topic in late:
        made.edit(topic, lambda sent: setattr(sent.header.stamp, "sec", 99))
    (run,), said = read_runs(made.write(tmp_path / "bag"), Topics())
    assert len(run.torques) == len(run.truth_distance) == 0
    assert sorted(said) == [
        f"/{topic}: no message has a time of the odometry's" for topic in sorted(late)
    ]


def test_what_is_driven_without_a_reference_is_left_out_and_said(tmp_path):
    made = Made(400)
    made.add_odometry()
    made.add_reference(begin=0.5, end=0.5)
    stamps = [sent[3].header.stamp for sent in made.messages if sent[0] == "/odom"]
    for stamp in stamps[200:]:  # a clock that is set forward
        stamp.sec += 10
    (run,), said = read_runs(made.write(tmp_path / "bag"), Topics())
    assert len(run.time) < 200
    assert len(said) == 2
    for line, when in zip(said, ("before", "after"), strict=True):
        assert re.match(
            rf"/odom: \d+ of 400 messages left out, {when} .* it went 0\.\d+ m away", line
        )


def test_points_are_where_they_were_written(tmp_path):
    made = Made(N)
    made.add_odometry()
    made.add_reference()
    run = read_run(made.write(tmp_path / "bag"))
    np.testing.assert_allclose(run.reference, on_circle(run.time)[0], atol=1e-11)


def test_a_line_of_the_log_that_came_while_time_stood_still_is_before_what_came_then(tmp_path):
    made, stood = a_run(N), 3.0
    since, later = made.arrival(made.stamps[1]), round(stood * SECOND)
    made.messages = [
        (*topic_and_type, came + later * (came >= since), sent)
        for *topic_and_type, came, sent in made.messages
    ]
    made.add_log(made.time[1] + stood / 2, 30, "waits")
    (run,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    assert [(time, event.text) for time, event in run.events] == [
        (pytest.approx(made.time[1], abs=1e-9), "waits")
    ]
