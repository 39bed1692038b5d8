"""What the command line of `climber` takes."""

import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from geometry_msgs.msg import Vector3, Vector3Stamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterEvent, ParameterValue
from sensor_msgs.msg import JointState

from climber_uk.messages import writing
from climber_uk.operating import command, watching
from climber_uk.operating.command import parse
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


def test_a_signal_before_the_node_is_there_ends_it_without_a_traceback(monkeypatch, capsys):
    left = []
    monkeypatch.setattr("sys.argv", ["climber", "watch"])
    monkeypatch.setattr(command, "on_end", lambda handler: handler())
    monkeypatch.setattr(command, "leave", lambda *ended: left.append(ended))
    with pytest.raises(SystemExit) as ended:
        command.main()
    assert (ended.value.code, left) == (0, [(0, None)])
    assert not capsys.readouterr().err


@pytest.mark.parametrize("name", ["", "climber_1", "/climber_1", "a/b/"])
def test_namespaces_are_taken_with_and_without_slashes(monkeypatch, name):
    monkeypatch.setattr("sys.argv", ["climber", "status", "--namespace", name])
    assert parse().namespace == name.strip("/")


def test_a_climber_that_waits_tells_for_what():
    how_far = Progress("waiting", done=1.0, left=2.0, time_left=3.0, lap=1, segment=1)
    for mode, said in (
        ("too_fast", "waiting (the controller: too fast), 1.00 m"),
        ("", "waiting, 1.00 m"),
    ):
        message = writing.progress("planner", vars(replace(how_far, mode=mode)), 0)
        state, line = watching.progress(message)
        assert state == "waiting"
        assert line.startswith(said)
        assert line.endswith("1.00 m done, 2.00 m left, 3 s, lap 1, segment 1")
        assert ("climber enable" in watching.hint(message)) == bool(mode)


def heard():
    """Messages of a climber that drives, by topic."""
    how_far = Progress("following", done=1.0, left=2.0, time_left=3.0, lap=0, segment=1)
    odometry = Odometry()
    odometry.twist.twist.linear.x, odometry.twist.twist.angular.z = 0.25, -0.1
    limit = ParameterMessage(name="max_wheel_torque", value=ParameterValue(double_value=4.0))
    return {
        watching.PROGRESS: writing.progress("planner", vars(how_far), 0),
        watching.ODOMETRY: odometry,
        watching.ERROR: Vector3Stamped(vector=Vector3(x=1e-3, y=-2e-3, z=0.01)),
        watching.MARGINS[1]: Vector3Stamped(vector=Vector3(x=2.5, y=24.0, z=384.0)),
        watching.TORQUES: JointState(name=["left", "right"], effort=[2.0, -4.0]),
        watching.PARAMETERS: ParameterEvent(new_parameters=[limit]),
    }


def test_what_is_watched_is_told_in_numbers_and_bars():
    told = watching.lines(heard())
    assert told == [
        "following, 1.00 m done, 2.00 m left, 3 s",
        "speed      0.250 m/s, turning  -0.100 rad/s",
        "error        1.00 mm along the path,    -2.00 mm across, 0.0100 rad",
        "margins  slip   2.50, tip  24.00 (below 1 it slips, or tips over); load 384 N",
        f"torque  {' ' * 20}|{'█' * 10}{' ' * 10}   2.000 N m left",
        f"torque  {'█' * 20}|{' ' * 20}  -4.000 N m right",
        "",
    ]


@pytest.mark.parametrize("missing", list(watching.HEARD))
def test_what_nobody_tells_is_a_dash_and_bars_go_without_a_limit(missing):
    some = heard()
    del some[missing]
    told = watching.lines(some)
    assert sum(line.endswith("–") for line in told) == (missing != watching.PARAMETERS)
    if missing == watching.PARAMETERS:
        assert told[-3].count("█") == 10


@pytest.mark.parametrize("share", [-math.inf, -2.0, -1.0, -0.01, 0.0, 0.5, 1.0, 9.0, math.nan])
def test_a_bar_is_as_wide_whatever_it_shows(share):
    assert len(watching.bar(share)) == 2 * watching.HALF + 1


def test_a_shell_completes_it():
    """As bash asks argcomplete: what is typed in the environment, answers on descriptor 8."""
    typed = "climber re"
    asked = {"_ARGCOMPLETE": "1", "_ARGCOMPLETE_IFS": " ", "COMP_LINE": typed}
    asked |= {"COMP_POINT": str(len(typed)), "COMP_TYPE": "9"}
    climber = Path(sys.executable).parent / "climber"
    done = subprocess.run(
        ["bash", "-c", f"'{climber}' 8>&1 9>&2 >/dev/null"],
        env={**os.environ, **asked},
        capture_output=True,
        text=True,
    )
    assert sorted(done.stdout.split()) == ["resume", "retreat"], done.stderr
