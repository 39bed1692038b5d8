"""What the command line of `climber` takes."""

from dataclasses import replace

import pytest

from climber_uk.messages import writing
from climber_uk.operating.command import parse, told
from climber_uk.planning.progress import Progress


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["status", "--namespace", "bad name"], "'bad name' is no namespace"),
        (["status", "--namespace", "/a//b"], "is no namespace"),
        (["speed"], "speed takes 1 number(s), not 0"),
        (["push", "1"], "push takes 2 number(s), not 1"),
        (["pause", "1"], "pause takes 0 number(s), not 1"),
        (["speed", "nan"], "must be a number"),
        (["fly"], "invalid choice: 'fly'"),
    ],
)
def test_what_means_nothing_is_refused_in_one_line(monkeypatch, capsys, words, line):
    monkeypatch.setattr("sys.argv", ["climber", *words])
    with pytest.raises(SystemExit) as ended:
        parse()
    assert ended.value.code == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert line in said


@pytest.mark.parametrize("name", ["", "climber_1", "/climber_1", "a/b/"])
def test_namespaces_are_taken_with_and_without_slashes(monkeypatch, name):
    monkeypatch.setattr("sys.argv", ["climber", "status", "--namespace", name])
    assert parse().namespace == name.strip("/")


def test_a_climber_that_waits_tells_for_what():
    how_far = Progress("waiting", done=1.0, left=2.0, time_left=3.0, lap=1, segment=1)
    for mode, said in (
        ("too_fast", "waiting (the controller: too fast; "),
        ("", "waiting, 1.00 m"),
    ):
        message = writing.progress("planner", vars(replace(how_far, mode=mode)), 0)
        state, line = told(message)
        assert state == "waiting"
        assert line.startswith(said)
        assert line.endswith("1.00 m done, 2.00 m left, 3 s, lap 1, segment 1")
