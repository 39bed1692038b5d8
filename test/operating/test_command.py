"""What the command line of `climber` takes."""

import pytest

from climber_uk.operating.command import parse


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
