"""Odd bags and odd words on the command lines: the right result, or a line that says why not."""

import os
import re
import resource
import sqlite3
import subprocess
import sys
from collections import Counter
from contextlib import closing
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
from hostile_bags import coded, mcap, sqlite
from made_bag import BEGAN, SECOND, STORE, Made, a_run, blank, message, write

from climber_uk.bags.bag import open_bag
from climber_uk.bags.recorded_run import read_runs
from climber_uk.bags.topics import Topics
from climber_uk.identification import figure, identify
from climber_uk.parameters.parameter_file import read_sections
from climber_uk.replay import localization_figure, localize, replay_controller
from climber_uk.report import analyze_bag, animate_bag, compare_bags, export_tum, figures

TOOLS = {
    "analyze_bag": analyze_bag,
    "export_tum": export_tum,
    "replay_controller": replay_controller,
    "identify": identify,
}
ALL_TOOLS = {
    **TOOLS,
    "animate_bag": animate_bag,
    "compare_bags": compare_bags,
    "localize": localize,
}
POSE, STRING = "geometry_msgs/msg/PoseStamped", "std_msgs/msg/String"


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run a tool without its figures; return whether it failed and what it said of that."""
    monkeypatch.setattr(figures, "draw", lambda *_: {})
    monkeypatch.setattr(replay_controller, "draw", lambda *_: None)
    monkeypatch.setattr(localization_figure, "draw", lambda *_: None)
    monkeypatch.setattr(figure, "draw", lambda *_: None)
    monkeypatch.setattr(animate_bag, "write", lambda *_: 0)
    monkeypatch.chdir(tmp_path)

    def run(tool, *arguments):
        monkeypatch.setattr(sys, "argv", [tool, *map(str, arguments)])
        status = None
        try:
            ALL_TOOLS[tool].main()
        except SystemExit as ended:
            status = ended.code
        out, said = capsys.readouterr()
        said += status if isinstance(status, str) else ""
        assert status in (None, 0, 1, 2) or isinstance(status, str)
        assert not status or len(said.strip().splitlines()) == 1
        assert all(line.isprintable() for line in (out + said).split("\n"))
        assert "Warning" not in said
        return bool(status), said

    return run


def a_whole_run():
    """A run that all tools read but identify, which wants a longer one."""
    made = a_run(100)
    made.add_parameters(left_wheel_joint="left", right_wheel_joint="right")
    for stamp in made.stamps:
        clock = blank("rosgraph_msgs/msg/Clock")
        clock.clock.sec, clock.clock.nanosec = divmod(int(stamp), SECOND)
        made.add("/clock", "rosgraph_msgs/msg/Clock", made.arrival(stamp) - 1, clock)
    return made


def raw(made):
    return [(topic, kind, log, coded(kind, sent)) for topic, kind, log, sent in made.messages]


def with_others_on_every_topic(kind, at=BEGAN + 1, frame=None):
    """A second type on the name of each topic."""

    def make(bag):
        made = a_whole_run()
        odd = message(POSE, BEGAN) if kind == POSE else blank(kind)
        if frame:
            odd.header.frame_id = frame
        names = {topic for topic, *_ in made.messages}
        others = [(topic, kind, at, coded(kind, odd)) for topic in sorted(names)]
        sqlite(bag, raw(made))
        with closing(sqlite3.connect(bag / "bag_0.db3")) as database:
            for number, (topic, kind_, log, data) in enumerate(others, start=90):
                row = (number, topic, kind_)
                database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", row)
                row = (number, log, data)
                database.execute("INSERT INTO messages VALUES (NULL, ?, ?, ?)", row)
            database.commit()

    return make


def of_wrong_types(bag):
    """On the names of topics is nothing but poses."""
    made, pose = a_whole_run(), message(POSE, BEGAN)
    write(bag, [(topic, POSE, log, pose) for topic, _, log, _ in made.messages])


def after_years(bag):
    """The recorder's clock is set forward by 30 years in the middle."""
    late = BEGAN + SECOND // 4
    write(
        bag,
        [(*m[:2], m[2] + (m[2] > late) * 10**9 * SECOND, m[3]) for m in a_whole_run().messages],
    )


def of_two_frames(bag):
    made = a_whole_run()
    for topic, _, log, sent in made.messages:
        if topic == "/odom" and log > BEGAN + SECOND // 4:
            sent.header.frame_id = "map"
    made.write(bag)


def without_a_topic(bag):
    sqlite(bag, raw(a_whole_run()), change="DELETE FROM topics WHERE name = '/odom'")


def with_negative_rows(bag):
    sqlite(bag, raw(a_whole_run()), change="UPDATE messages SET id = id - 10000")


def in_utf_16(bag):
    bag.mkdir()
    with closing(sqlite3.connect(bag / "bag_0.db3")) as database:
        database.execute("PRAGMA encoding = 'UTF-16'")
        database.execute("CREATE TABLE other (x)")
    sqlite(bag, raw(a_whole_run()))


def spoilt_bytes(change):
    """The file of a run, changed."""

    def make(bag):
        file = mcap(bag, raw(a_whole_run())) / "bag_0.mcap"
        file.write_bytes(change(file.read_bytes()))

    return make


def spoilt_messages(change):
    """A run whose messages are changed: topic, type, log time and message of each."""

    def make(bag):
        write(bag, [change(number, *m) for number, m in enumerate(a_whole_run().messages)])

    return make


def only(*topics, most=10**9):
    """Some topics of a run, the first messages of each."""

    def make(bag):
        kept = [m for m in a_whole_run().messages if not topics or m[0] in topics]
        count = Counter()
        few = []
        for m in kept:
            count[m[0]] += 1
            few += [m] * (count[m[0]] <= most)
        write(bag, few)

    return make


def numbers(value):
    """In every message every number that is a float is another."""

    def spoil(made):
        for name, of in vars(made).items():
            if isinstance(of, float):
                setattr(made, name, value)
            elif isinstance(of, np.ndarray) and of.dtype.kind == "f":
                of[:] = value
            elif hasattr(of, "__dict__"):
                spoil(of)

    def change(_, topic, kind, log, sent):
        spoil(sent := deepcopy(sent))
        return topic, kind, log, sent

    return spoilt_messages(change)


def times(stamp_of):
    """Stamps of a run are others: `stamp_of` a message's number and its stamp [ns]."""

    def change(number, topic, kind, log, sent):
        if header := getattr(sent := deepcopy(sent), "header", None):
            stamp = header.stamp.sec * SECOND + header.stamp.nanosec
            header.stamp.sec, header.stamp.nanosec = divmod(stamp_of(number, stamp), SECOND)
        return topic, kind, log, sent

    return spoilt_messages(change)


def names(text):
    """All texts of a run, in messages, are another."""

    def change(_, topic, kind, log, sent):
        sent = deepcopy(sent)
        for holder, name in ((sent, "child_frame_id"), (getattr(sent, "header", 0), "frame_id")):
            if hasattr(holder, name):
                setattr(holder, name, text)
        if hasattr(sent, "name"):
            sent.name = [text] * len(sent.name)
        return topic, kind, log, sent

    return spoilt_messages(change)


def without_metadata(bag):
    a_whole_run().write(bag)
    (bag / "metadata.yaml").unlink()


def of_other_sensors(bag):
    """On the names of sensors are messages of other types."""
    made = a_whole_run()
    for topic in "/imu", "/pose", "/ground_truth":
        made.add(topic, POSE, BEGAN, message(POSE, BEGAN))
    made.add_joint_states(["left_wheel_joint", "right_wheel_joint"], [1, 1], [1, 1])
    made.write(bag)


def of_other_fields(bag):
    """The types of a run have their names, but are a text."""
    messages, text = raw(a_whole_run()), coded(STRING, STORE.types[STRING]("x" * 100))
    other = dict.fromkeys((kind for _, kind, *_ in messages), "string data")
    mcap(bag, [(topic, kind, at, text) for topic, kind, at, _ in messages], schemas=other)


def with_other_parameters(bag):
    made = a_whole_run()
    made.add_parameters(transport_delay="late")
    made.write(bag)


def not_to_be_read(bag):
    """A file of somebody else; who is root reads it all the same."""
    mcap(bag, raw(a_whole_run()))
    (bag / "bag_0.mcap").chmod(0)


SPOILT = {
    "cut in the middle": spoilt_bytes(lambda data: data[: len(data) // 2]),
    "cut in its head": spoilt_bytes(lambda data: data[:20]),
    "empty": spoilt_bytes(lambda data: b""),
    "zeros": spoilt_bytes(lambda data: bytes(5000)),
    "zeros at the end": spoilt_bytes(lambda data: data[: len(data) // 2] + bytes(5000)),
    "a text": spoilt_bytes(lambda data: b"t,x,y\n0,1,2\n" * 100),
    "a page": spoilt_bytes(lambda data: b"<!DOCTYPE html><html>404</html>"),
    "the file twice": spoilt_bytes(lambda data: data * 2),
    "without metadata": without_metadata,
    "not to be read": not_to_be_read,
    "other parameters": with_other_parameters,
    "other sensors": of_other_sensors,
    "other fields": of_other_fields,
    "a directory in the place of the file": lambda bag: (bag / "bag_0.mcap").mkdir(parents=True),
    "a directory without anything": lambda bag: bag.mkdir(),
    "without odometry": only("/reference", "/wheel_torques", "/joint_states"),
    "odometry only": only("/odom"),
    "torques only": only("/wheel_torques"),
    "one message of each": only(most=1),
    "two messages of each": only(most=2),
    "no message": only("/nothing"),
    "no number": numbers(np.nan),
    "infinite numbers": numbers(np.inf),
    "huge numbers": numbers(1e300),
    "tiny numbers": numbers(5e-324),
    "zeros for numbers": numbers(0.0),
    "one stamp": times(lambda number, stamp: 5 * SECOND),
    "stamps of zero": times(lambda number, stamp: 0),
    "stamps that go back": times(lambda number, stamp: 10 * SECOND - stamp),
    "stamps to and fro": times(lambda number, stamp: stamp + (-1) ** number * 3 * SECOND),
    "stamps before 1970": times(lambda number, stamp: stamp - 10 * SECOND),
    "the last stamps": times(lambda number, stamp: (2**31 - 1) * SECOND + stamp % SECOND),
    "names with quotes": names("a'b\"c`d $(e)"),
    "names that command terminals": names("\x1b[2J\x1b]0;x\x07\r\n\x9b"),
    "names that markup is made of": names("<script>alert(1)</script>&amp;"),
    "no names": names(""),
    "long names": names("x" * 5000),
}


GOOD = ""
BAGS = {
    "a second type, string": (with_others_on_every_topic(STRING), GOOD),
    "a second type, pose": (with_others_on_every_topic(POSE), GOOD),
    "a second type, of another frame, first": (
        with_others_on_every_topic(POSE, at=BEGAN - 1, frame="map"),
        GOOD,
    ),
    "big endian": (
        lambda bag: mcap(bag, [(*m[:3], swapped(m)) for m in a_whole_run().messages]),
        GOOD,
    ),
    "UTF-16": (in_utf_16, GOOD),
    "wrong types": (of_wrong_types, "no message on|are not what they should be"),
    "the clock set by years": (after_years, GOOD),
    "two frames": (of_two_frames, "frame_id='map', others have 'odom'"),
    "a topic without a name": (without_a_topic, "no message on"),
    "negative rows": (with_negative_rows, "with numbers below 1 are left out|has no message on"),
}


def swapped(of):
    _, kind, _, sent = of
    return bytes(STORE.serialize_cdr(sent, kind, little_endian=False))


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize(("make", "said"), BAGS.values(), ids=BAGS)
def test_an_odd_bag_is_read_or_refused_in_words(tmp_path, run, tool, make, said):
    make(tmp_path / "bag")
    failed, err = run(tool, tmp_path / "bag")
    if said:
        assert any(part in err for part in said.split("|")), err
    else:
        assert failed == (tool == "identify"), err
        assert not failed or "windows of 1.0 s in motion must be >= 5" in err


@pytest.mark.parametrize("make", SPOILT.values(), ids=SPOILT)
def test_a_spoilt_bag_is_read_or_refused_in_one_line_by_every_tool(tmp_path, run, make):
    """What `run` looks at: status, one line where it failed, and nothing that is not printable."""
    make(tmp_path / "bag")
    for tool in ALL_TOOLS:
        bags = ["bag", "bag"] if tool == "compare_bags" else ["bag"]
        failed, said = run(tool, *bags)
        assert not failed or said.startswith(f"{tool}: "), said


def test_a_topic_of_another_type_is_said_with_it(tmp_path, run):
    of_wrong_types(tmp_path / "bag")
    for tool in "export_tum", "replay_controller", "identify":
        assert f"(it is {POSE}, not " in run(tool, "bag")[1]


@pytest.mark.parametrize("name", ["a'b\"c $(d)`e`", "a\x1b[2Jb\r\nc", "a\udcffb", "<b>&amp;"])
def test_a_bag_of_any_name_is_read_by_every_tool(tmp_path, run, name):
    mcap(tmp_path / name, raw(a_whole_run()))
    for tool in ALL_TOOLS:
        bags = [name, name] if tool == "compare_bags" else [name]
        failed, said = run(tool, *bags)
        assert failed == (tool in ("identify", "localize")), said
        assert not failed or "windows of 1.0 s" in said or "has no message on" in said, said


def test_of_a_bag_of_another_robot_every_tool_tells_which_topics_there_are(tmp_path, run):
    others = {"/odom": "/robot/filtered", "/wheel_torques": "/motors"}
    write(tmp_path / "bag", [(others.get(m[0], m[0]), *m[1:]) for m in a_whole_run().messages])
    for tool in ALL_TOOLS:
        bags = ["bag", "bag"] if tool == "compare_bags" else ["bag"]
        _, said = run(tool, *bags)
        of_joints = "no message on /.* (sensor_msgs/msg/JointState is on /motors)"
        how = "" if tool == "identify" else ": --remap odom:=TOPIC"
        of_odometry = f"no message on /?odom (nav_msgs/msg/Odometry is on /robot/filtered{how})"
        wanted = of_joints if tool in ("localize", "replay_controller") else of_odometry
        assert re.search(wanted.replace("(", r"\(").replace(")", r"\)"), said), said
    remapped = [f"--remap={name[1:]}:={other}" for name, other in others.items()]
    for tool in ("analyze_bag", "export_tum"):
        assert run(tool, "bag", *remapped) == (False, "")
    assert run("animate_bag", "bag", *remapped, "--seconds=0.2") == (False, "")


def test_a_reference_of_no_climber_is_said(tmp_path, run):
    """An odometry of another namespace was taken, and no word said of why nothing is compared."""
    others = {"/odom": "/wheel/odom"}
    write(tmp_path / "bag", [(others.get(m[0], m[0]), *m[1:]) for m in a_whole_run().messages])
    _, said = run("analyze_bag", "bag")
    assert "no message on /wheel/reference (trajectory_msgs/msg/MultiDOF" in said
    assert "is on /reference: --remap reference:=TOPIC)" in said


@pytest.mark.parametrize("tool", ALL_TOOLS)
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["a\nb"], "there is no bag a b"),
        (["a\x1b[2Jb"], r"there is no bag a\x1b[2Jb"),
        (["x" * 5000], "File name too long|there is no bag"),
        (["/dev/null"], "/dev/null is no readable bag: null: no regular file"),
        (["~/run"], "there is no bag {home}/run"),
        (["~nobody-of-this-name/x"], "~nobody-of-this-name/x: there is no such user"),
        (["bag", "--output=~nobody-of-this-name/x"], "there is no such user"),
        (["bag", "--output=/proc/x"], "cannot write into /proc"),
        (["bag", "--output=file/x"], "cannot write into file"),
    ],
)
def test_odd_paths_are_told_in_one_line(tmp_path, run, monkeypatch, tool, words, said):
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "file").write_text("kept")
    (tmp_path / "bag").mkdir()
    failed, err = run(tool, *words, *["bag"] * (tool == "compare_bags"))
    assert failed
    assert any(part.format(home=tmp_path / "home") in err for part in said.split("|")), err
    assert len(err.strip().splitlines()) == 1
    assert (tmp_path / "file").read_text() == "kept"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        *(
            (["analyze_bag", "bag", "--settled", value], "must be a number from 0 to 1e+06")
            for value in ("nan", "-1", "inf", "x", "1e999")
        ),
        *(
            (["replay_controller", "bag", "--fail-above", value], "must be a number from 0 to")
            for value in ("nan", "-1", "inf", "")
        ),
        *(
            (["identify", "bag", "--delay", value], "must be a number from 0 to 10")
            for value in ("nan", "-1", "inf", "1e300")
        ),
        (["identify", "--plan", "p", "--duration", "1e300"], "duration=1e+300 must be <= 3600"),
        (["identify", "bag", "--json", "x", "--figure", "./x"], "x is given twice"),
        (["identify", "bag/bag_0.mcap", "--json", "bag/bag_0.mcap"], "bag_0.mcap is given twice"),
        (["identify", "--plan", "/proc/x"], "cannot write into /proc"),
        (
            ["identify", "bag", "--odometry", "joint_states"],
            "has no message on /joint_states",
        ),
    ],
)
def test_odd_values_are_refused_in_one_line(tmp_path, run, words, said):
    a_whole_run().write(tmp_path / "bag")
    failed, err = run(*words)
    assert failed
    assert said in err
    assert len(err.strip().splitlines()) == 1


def test_a_replay_with_a_timeout_of_no_time_ends(tmp_path, run):
    a_whole_run().write(tmp_path / "bag")
    run("replay_controller", tmp_path / "bag", "-p", "odometry_timeout:=1e-9")


@pytest.mark.parametrize(("content", "line"), [(b"\xff\xfea\0", 1), (b"a:\n  # Gr\xf6\xdfe\n", 2)])
def test_what_is_no_text_is_no_parameter_file(tmp_path, content, line):
    (tmp_path / "x.yaml").write_bytes(content)
    why = f"/x.yaml is no parameter file: line {line}: not a text in UTF-8"
    with pytest.raises(ValueError, match=why):
        read_sections(tmp_path / "x.yaml")


def test_a_parameter_file_without_end_is_refused():
    with (
        open("/dev/zero", "rb") as endless,  # as a process gets it that is given <(…)
        pytest.raises(ValueError, match="larger than 16 MiB"),
    ):
        read_sections(Path(f"/dev/fd/{endless.fileno()}"))


def test_a_pipe_into_which_nobody_writes_is_an_empty_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert not read_sections(tmp_path / "pipe")


def test_an_odd_number_in_a_few_odometries_costs_these_at_most(tmp_path):
    for number, odd in enumerate([np.inf, -np.inf, np.nan, 1e308, 1e9]):
        made = Made(100)
        made.pose[::20, 0] = odd
        made.add_odometry()
        (one,), said = read_runs(made.write(tmp_path / str(number)), Topics())
        assert len(one.time) == 95
        assert len(said) == 1
        with open_bag(tmp_path / str(number)) as bag:
            assert bag.types["/odom"] == "nav_msgs/msg/Odometry"


def test_an_output_that_cannot_be_written_is_said(tmp_path):
    bag = a_whole_run().write(tmp_path / "bag")
    command = [sys.executable, "-c", "from climber_uk.report.export_tum import main; main()"]
    with open("/dev/full", "w") as full:
        ran = subprocess.run([*command, bag], stdout=full, stderr=subprocess.PIPE, text=True)
    assert (ran.returncode, ran.stderr) == (
        0,
        "the output is not written: No space left on device\n",
    )
    assert (bag / "tum" / "odom.tum").exists()


def test_a_full_disk_is_said_with_its_place(tmp_path, run):
    bag = a_whole_run().write(tmp_path / "bag")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
    try:
        failed, said = run("export_tum", bag, "-o", "tum")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert failed
    assert said.startswith("export_tum: File too large: in tum, or ")
