"""One rule for where tools write: what was there stays, and whether they can is known first."""

import sys

import numpy as np
import pytest
from made_bag import BEGAN, SECOND, a_run, blank, write
from test_restarts import at_once, two_runs

from climber_uk.identification import identify
from climber_uk.replay import replay_controller
from climber_uk.report import analyze_bag, compare_bags, export_tum, figures
from climber_uk.report.outputs import output
from climber_uk.system.command_line import printable

TOOLS = {
    analyze_bag: ("analysis", "metrics.csv"),
    compare_bags: ("comparison", "metrics.csv"),
    export_tum: ("tum", "odom.tum"),
    replay_controller: ("replay", "torques.csv"),
}
pytestmark = pytest.mark.slow  # figures are


def by_name(tool):
    return tool.__name__.rpartition(".")[2]


each_tool = pytest.mark.parametrize("tool", TOOLS, ids=by_name)
each_reader = pytest.mark.parametrize("tool", [*TOOLS, identify], ids=by_name)


@pytest.fixture(autouse=True)
def few_figures(monkeypatch):
    """Those of curves over time take longest; test_analyze_bag.py has them all."""
    monkeypatch.setattr(figures, "CURVES", {})


@pytest.fixture
def run(monkeypatch, capsys):
    """Run a tool on a bag; return its exit status and what it said on both outputs."""

    def run(tool, *arguments):
        words = [arguments[0], *arguments] if tool is compare_bags else arguments
        monkeypatch.setattr(sys, "argv", ["command", *map(str, words)])
        status = None
        try:
            tool.main()
        except SystemExit as ended:
            status = ended.code
        said = capsys.readouterr()
        message = status if isinstance(status, str) else ""
        assert "Traceback" not in said.err
        return bool(status), said.out, said.err + message

    return run


def a_bag(path, *, as_file=False, storage="mcap"):
    made = a_run(100)
    made.add_parameters(left_wheel_joint="left", right_wheel_joint="right")
    for stamp in made.stamps:
        clock = blank("rosgraph_msgs/msg/Clock")
        clock.clock.sec, clock.clock.nanosec = divmod(int(stamp), SECOND)
        made.add("/clock", "rosgraph_msgs/msg/Clock", made.arrival(stamp) - 1, clock)
    made.write(path, storage)
    (file,) = [file for file in path.iterdir() if file.suffix in (".mcap", ".db3")]
    return file.rename(path.with_suffix(file.suffix)) if as_file else path


@pytest.mark.parametrize(
    ("tool", "as_file", "storage"),
    [
        (analyze_bag, False, "sqlite3"),
        (compare_bags, True, "mcap"),
        (export_tum, False, "mcap"),
        (export_tum, True, "sqlite3"),
        (replay_controller, True, "mcap"),
    ],
)
def test_each_run_of_a_tool_writes_into_a_new_directory(tmp_path, run, tool, as_file, storage):
    bag = a_bag(tmp_path / "run", as_file=as_file, storage=storage)
    name, file = TOOLS[tool]
    place = bag.with_name(f"run_{name}") if as_file else bag / name
    if as_file:  # of a run before
        place.mkdir()
        (place / file).write_text("kept")
    failed, out, err = run(tool, bag)
    assert not failed, err
    directory = place.with_name(f"{place.name}_2") if as_file else place
    assert f"{directory}/" in out
    assert (directory / file).stat().st_size > 10
    assert not as_file or (place / file).read_text() == "kept"


@each_tool
def test_what_output_names_is_made_and_written_into(tmp_path, run, tool):
    bag, given = a_bag(tmp_path / "run"), tmp_path / "some" / "where"
    before = sorted(bag.iterdir())
    assert not run(tool, bag, "--output", given)[0]
    assert (given / TOOLS[tool][1]).exists()
    assert sorted(bag.iterdir()) == before


@each_tool
def test_that_nothing_can_be_written_is_said_before_the_work(tmp_path, run, tool):
    """In place of a bag, which would be said if it were read."""
    (tmp_path / "bag").mkdir()
    (tmp_path / "file").write_text("kept")
    failed, out, err = run(tool, tmp_path / "bag", "--output", tmp_path / "file" / "x")
    assert failed
    assert out == ""
    (line,) = err.splitlines()
    assert f"cannot write into {tmp_path}/file/x (Not a directory): --output says where" in line
    assert (tmp_path / "file").read_text() == "kept"


@each_tool
@pytest.mark.parametrize("bag", ["nowhere", "empty"])
def test_a_tool_that_fails_leaves_nothing_behind(tmp_path, run, tool, bag):
    (tmp_path / "empty").mkdir()
    for more in ([], ["--output", tmp_path / "a" / "b"]):
        failed, _, err = run(tool, tmp_path / bag, *more)
        assert failed
        assert str(tmp_path / bag) in err
        assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == [tmp_path / "empty"]
    assert list((tmp_path / "empty").iterdir()) == []


def test_what_was_written_before_a_failure_is_kept(tmp_path):
    def fail_late():
        with output(tmp_path, "x", None) as directory:
            (directory / "part").write_text("some")
            raise ValueError("late")

    with pytest.raises(ValueError, match="late"):
        fail_late()
    assert (tmp_path / "x" / "part").read_text() == "some"


@each_reader
def test_runs_of_a_bag_in_which_time_starts_again_are_told_apart_or_refused(tmp_path, run, tool):
    bag = write(tmp_path / "bag", two_runs())
    failed, out, err = run(tool, bag)
    assert "time starts again, there are 2 runs" in err
    assert failed == (tool in (replay_controller, identify))
    if tool is export_tum:
        first, second = (bag / "tum" / f"run_{number}" for number in (1, 2))
        same = (first / "reference.tum").read_text() == (second / "reference.tum").read_text()
        assert same
        assert (first / "odom.tum").read_text() != (second / "odom.tum").read_text()
    elif not failed:
        assert "run 2 of 2" in out
    if tool is analyze_bag:
        assert len(out.splitlines()) <= 10  # a line of cards a run, and what became of it


def a_step_back(messages):
    """The clock is set back by four messages in the middle."""
    for topic, _, at, sent in messages:
        if topic in ("/odom", "/wheel_torques") and at >= BEGAN + SECOND // 4:
            sent.header.stamp.nanosec -= SECOND // 50
    return messages


def out_of_step(messages):
    """And those of a second plant, half a period off."""
    second = a_run(100, errors=lambda time: np.tile([0.0, 0.5, 0.0], (len(time), 1)))
    for topic, *_, sent in second.messages:
        if topic in ("/odom", "/wheel_torques"):
            sent.header.stamp.nanosec += SECOND // 400
    return [*messages, *second.messages]


SEVERAL = {
    "step back": (a_step_back, "/odom: time starts again, there are 2 runs"),
    "out of step": (out_of_step, "no run on /odom: it leaps to and fro"),
    "two clocks": (
        lambda made: [*made, *at_once(100, 100, by=9 * SECOND)],
        "its stamps leap to and fro",
    ),
    "in step": (lambda made: [*made, *at_once(100, 100)], "from another with the same stamp"),
}


def each_with_one():
    """Each tool with a way in which runs are several; for soak with all of them."""
    for number, tool in enumerate([*TOOLS, identify]):
        for turn, (name, (change, said)) in enumerate(SEVERAL.items()):
            marks = () if turn == number % len(SEVERAL) else pytest.mark.soak
            yield pytest.param(tool, change, said, id=f"{name}-{by_name(tool)}", marks=marks)


@pytest.mark.parametrize(("tool", "change", "said"), each_with_one())
def test_no_tool_takes_several_runs_for_one(tmp_path, run, tool, change, said):
    made = a_run(100)
    made.add_parameters(left_wheel_joint="left", right_wheel_joint="right")
    failed, out, err = run(tool, write(tmp_path / "bag", change(made.messages)))
    assert said in err
    assert failed or "runs" in said
    assert not (failed and out)


def test_a_second_run_cannot_pass_unseen(tmp_path, run):
    bag = write(tmp_path / "bag", two_runs())
    failed, _, err = run(analyze_bag, bag, "--fail-if", "max_distance>0.1")
    assert failed
    assert "failed: run 2 of 2: max_distance is 0.5 > 0.1" in err


def test_a_climber_without_a_run_cannot_pass_unseen(tmp_path, run):
    one, other = a_run(100), a_run(100, namespace="/other")
    for *_, sent in other.messages:
        if hasattr(sent, "pose"):
            sent.pose.pose.position.x = float("nan")
    bag = write(tmp_path / "bag", one.messages + other.messages)
    failed, out, err = run(analyze_bag, bag)
    assert not failed
    assert "It followed its path" in out
    assert "no run on /other/odom" in err
    assert run(analyze_bag, bag, "--fail-if", "max_distance>0.1")[0]
    assert run(analyze_bag, bag, "--namespace", "", "--namespace", "other")[0]
    assert not run(analyze_bag, bag, "--fail-if", "max_distance>0.1", "--namespace", "")[0]


@pytest.mark.parametrize("bound", ["nan", "-nan", "NaN", "inf", "-inf"])
def test_a_bound_that_nothing_exceeds_is_refused(tmp_path, run, bound):
    bag = a_bag(tmp_path / "run")
    failed, _, err = run(analyze_bag, bag, "--fail-if", f"max_distance>{bound}")
    assert failed
    assert f"{bound} must be a finite number" in err


@pytest.mark.parametrize(
    ("text", "printed"),
    [
        ("plain ä → 1", "plain ä → 1"),
        ("a\x1b[2Jb", "a\\x1b[2Jb"),
        ("a\rb\tc\x9bd\u202ee", "a\\rb\\tc\\x9bd\\u202ee"),
        ("two\nlines", "two\nlines"),
    ],
)
def test_nothing_that_is_printed_commands_a_terminal(text, printed):
    assert printable(text) == printed


def test_a_stamp_before_1970_is_a_negative_number():
    line = export_tum.lines((np.array([-SECOND // 2]), np.zeros((1, 3))))
    assert line.split()[0] == "-0.500000000"
