"""The commands: what they print and write, and how they end."""

import csv
import json
import os
import re
import subprocess
import sys
from html.parser import HTMLParser

import numpy as np
import pytest
from made_bag import a_run, write

from climber_uk.bags.recorded_run import read_runs
from climber_uk.bags.topics import Topics
from climber_uk.control.safety import Mode
from climber_uk.report import analyze_bag, compare_bags, figures
from climber_uk.report.cards import WIDTH, text, verdict
from climber_uk.report.condition import Condition
from climber_uk.report.metrics import METRICS, Case
from climber_uk.report.page import page
from climber_uk.report.tables import Column, plain

pytestmark = pytest.mark.slow  # figures are

ALONG = 0.004


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    """Two runs, the second with twice the error along the track, and an empty bag."""
    directory = tmp_path_factory.mktemp("bags")
    for name, error in (("first", ALONG), ("second", 2 * ALONG)):
        made = a_run(200, errors=lambda time, e=error: time[:, None] * [0, 0, 0] + [e, 0, 0])
        made.add_mode(0.2, "no odometry", level=2)
        made.add_vectors("plant_simulator/margins", [[2.0, 3.0, 80.0]])
        made.write(directory / name)
    write(directory / "empty", [])
    return directory


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run a command; return its exit status and its lines on both outputs."""

    def run(*arguments, command=analyze_bag, output=tmp_path / "out"):
        monkeypatch.setattr(sys, "argv", ["command", *map(str, arguments), "-o", str(output)])
        with pytest.raises(SystemExit) as ended:
            command.main()
        said = capsys.readouterr()
        assert "Traceback" not in said.err
        return ended.value.code, said.out.splitlines(), said.err.splitlines()

    return run


@pytest.fixture
def few_figures(monkeypatch):
    """Those of curves over time take longest."""
    monkeypatch.setattr(figures, "CURVES", {})


few = pytest.mark.usefixtures("few_figures")


class Page(HTMLParser):
    """Tags that are open, and all that a browser would fetch."""

    def __init__(self, text):
        super().__init__()
        self.open, self.fetched, self.images = [], [], 0
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        if tag not in ("meta", "img", "br", "input"):
            self.open.append(tag)
        self.images += tag == "img"
        self.fetched += [v for k, v in attributes if k in ("src", "href") and v[:5] != "data:"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_a_table_a_page_csv_and_json_are_made(bags, run, tmp_path):
    status, out, err = run(bags / "first", "--all", "--figures", tmp_path / "figures")
    assert (status, err) == (0, [])
    assert "  rms_along_track            4  mm" in [re.sub(" {9,}", " " * 12, line) for line in out]
    assert out[-1] == str(tmp_path / "figures" / "modes.png")

    page = (tmp_path / "out" / "report.html").read_text()
    parsed = Page(page)
    assert parsed.open == parsed.fetched == []
    assert "http" not in re.sub('src="[^"]*"', "", page)
    assert parsed.images == len(list((tmp_path / "figures").glob("*.png"))) == 6
    assert "no odometry" in page
    assert "1 stop" in page

    told = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert told["units"].keys() == told["runs"][0]["metrics"].keys() == METRICS.keys()
    assert told["runs"][0]["metrics"]["max_along_track"] == pytest.approx(ALONG)
    assert told["runs"][0]["metrics"]["friction"] is None
    assert [event["text"] for event in told["runs"][0]["events"]] == ["no odometry"] * 2

    header, *lines = csv.reader((tmp_path / "out" / "metrics.csv").read_text().splitlines())
    assert header == ["metric", "unit", "climber"]
    assert [line[0] for line in lines] == list(METRICS)
    assert float({name: value for name, _, value in lines}["rms_along_track"]) == pytest.approx(
        ALONG
    )


@pytest.mark.parametrize(
    ("condition", "failure"),
    [
        ("rms_along_track>0.003", "rms_along_track is 0.004 > 0.003"),
        ("rms_along_track > 5e-3", ""),
        ("lowest_slip_margin<=2", "lowest_slip_margin is 2 <= 2"),
        ("odometry_lost!=0", ""),
        ("friction>1000", "friction is not known from what was recorded"),
    ],
)
def test_a_condition_says_what_failed(bags, condition, failure):
    (first,), _ = read_runs(bags / "first", Topics())
    said = Condition.read(condition).failure(Column("a", "bag", Case(first)))
    assert said == (failure and f"a: {failure}")


@few
def test_a_condition_that_holds_sets_the_exit_status(bags, run):
    conditions = "--fail-if", "duration<0", "--fail-if", "rms_along_track>0.003"
    status, _, err = run(bags / "first", *conditions)
    assert status == 1
    assert err == ["analyze_bag: failed: climber: rms_along_track is 0.004 > 0.003"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--fail-if", "speed>1"], "speed is none of duration, "),
        (["--fail-if", "rms_distance"], "must be a metric, one of"),
        (["--fail-if", "rms_distance>much"], "much must be a finite number"),
        (["--remap", "x:=y"], "remapping 'x:=y': x is none of"),
        (["--params", "nowhere.yaml"], "nowhere.yaml"),
        (["--namespace", "robot"], "no odometry: no message on /robot/odom"),
    ],
)
def test_a_wrong_argument_is_one_line(bags, run, arguments, said):
    status, _, err = run(bags / "first", *arguments)
    assert status == 2
    assert said in err[-1]


@pytest.mark.parametrize("name", ["nowhere", "empty"])
def test_a_bag_that_cannot_be_read_is_one_line(bags, run, name):
    status, out, err = run(bags / name)
    assert (status, out, len(err)) == (2, [], 1)
    assert err[0].startswith("analyze_bag: ")
    assert str(bags / name) in err[0]


@few
def test_what_was_lost_is_said_and_the_rest_is_told(bags, run, tmp_path):
    data = (bags / "first" / "first_0.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[:-40])
    status, out, err = run(tmp_path / "cut.mcap", "--all")
    assert status == 0
    assert err == [
        f"analyze_bag: {tmp_path}/cut.mcap: cut.mcap: cut off, read up to the last whole message"
    ]
    assert any("rms_along_track" in line for line in out)
    assert "cut off" in (tmp_path / "out" / "report.html").read_text()


@few
def test_parameters_come_from_the_file_of_the_nodes(bags, run, tmp_path):
    (tmp_path / "nodes.yaml").write_text(
        "/**/uk_torque_controller:\n  ros__parameters:\n    max_wheel_torque: 1.0\n"
    )
    _, out, _ = run(bags / "first", "--all", "--params", tmp_path / "nodes.yaml")
    assert ["saturation", "100", "%"] in [line.split() for line in out]


def test_bags_are_compared_side_by_side_with_ratios(bags, run, tmp_path):
    status, out, err = run(bags / "first", bags / "second", command=compare_bags)
    assert (status, err) == (0, [])
    assert out[0].split() == ["first", "second", "second", "/", "first"]
    assert ["rms_along_track", "4", "8", "mm", "2"] in [line.split() for line in out]
    page = (tmp_path / "out" / "report.html").read_text()
    assert Page(page).images == 6
    assert "second / first" in page


@few
@pytest.mark.parametrize("name", ["=1+1", pytest.param("@x", marks=pytest.mark.soak)])
def test_no_name_becomes_a_formula_in_a_spreadsheet_and_numbers_stay_numbers(run, tmp_path, name):
    made = a_run(200, torques=lambda time, _: np.full((len(time), 2), -2.0))
    made.add_joints(rates=[1.0, 1.0], torques=[-3.0, -3.0])
    bags = [made.write(tmp_path / name), made.write(tmp_path / "other")]
    status, _, _ = run(*bags, command=compare_bags)
    assert status == 0
    header, *lines = csv.reader((tmp_path / "out" / "metrics.csv").read_text().splitlines())
    assert header == ["metric", "unit", "'" + name, "other"]
    values = {name: [float(cell) for cell in cells] for name, _, *cells in lines}
    assert values["mean_power_right"] == [-3.0, -3.0]
    assert not any(cell[:1] in ("=", "+", "@", "\t") for line in lines for cell in line)


@pytest.mark.parametrize("name", ["=1", "+1", "-1", "@a", "\t=1", "\r=1", "\n=1"])
def test_what_begins_like_a_formula_is_marked_as_text(name):
    assert plain(name) == "'" + name
    assert plain("a" + name) == "a" + name


def test_the_verdict_on_a_climber_that_fell_is_that_it_fell(tmp_path):
    """Whatever else became of it before."""
    made = a_run(200)
    made.add_mode(0.5, Mode.LOW_PRESSURE.value, level=2)
    made.add_log(0.8, 30, "climber: fell off: tip margin 0.9997 is below 1")
    (fallen,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    said = verdict(Column("a", "bag", Case(fallen)))
    assert re.fullmatch(r"It fell off the wall at 0\.\d s: tip margin 0\.9997 is below 1\.", said)


@few
def test_the_true_distance_comes_first_on_the_page_and_in_the_table(run, tmp_path):
    made = a_run(200)
    made.add_truth(made.pose + np.array([0.3, 0, 0]))
    status, out, _ = run(made.write(tmp_path / "bag"), "--all")
    assert status == 0
    rows = [line.split() for line in out]
    tracking = rows.index(["Tracking"])
    assert rows[tracking + 1] == ["truth_rms_distance", "300", "mm"]
    page = (tmp_path / "out" / "report.html").read_text()
    assert "<b>300 mm RMS (true)</b>" in page
    assert "by the odometry" in page
    told = json.loads((tmp_path / "out" / "metrics.json").read_text())["runs"][0]["metrics"]
    assert told["truth_max_distance"] == pytest.approx(0.3)
    status, _, err = run(tmp_path / "bag", "--fail-if", "truth_max_distance>0.1")
    assert status == 1
    assert "truth_max_distance is 0.3 > 0.1" in err[-1]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({}, "It followed its path, at most 4 mm off."),
        ({"truth_max_distance": 0.3}, "It followed its path, at most 300 mm off."),
        ({"settling_time": np.nan}, "It did not settle on its path, at most 4 mm off."),
        ({"following": 0.0}, "It did not follow its reference at all."),
        ({"max_distance": np.nan}, "There is no reference in it"),
        ({"safety_stops": 1.0}, "It stopped for safety (1 stop)."),
        ({"safety_stops": 2.0}, "It stopped for safety (2 stops)."),
        ({"lowest_slip_margin": 0.5}, "on a real wall its wheels would slip"),
        ({"lowest_tip_margin": 0.5, "lowest_slip_margin": 0.5}, "on a real wall it would tip over"),
    ],
)
def test_the_verdict_says_what_became_of_the_run(bags, change, sentence):
    (first,), _ = read_runs(bags / "first", Topics())
    column = Column("a", "bag", Case(first))
    fine = {"safety_stops": 0.0, "following": 99.0}
    column.__dict__["values"] = {**column.values, **fine, **change}  # a cached property
    assert sentence in verdict(column)


@few
def test_at_a_glance_each_side_and_what_nodes_warned_of_are_in_few_lines(bags, run, tmp_path):
    status, out, err = run(bags / "first")
    assert (status, err) == (0, [])
    assert all(len(line) <= WIDTH + 8 for line in out)
    titles = [line[2:19].strip() for line in out]
    assert {"Tracking", "Hold on the wall", "Safety", "Timing"} <= set(titles)
    assert len([line for line in out if "no odometry" in line]) == 2
    assert out[-4] == "It did not follow its reference at all."
    assert out[-3] == str(tmp_path / "out" / "report.html")


@pytest.mark.parametrize("log", [-0.5, 0.01, 0.6])  # it has no stamp: it may have come late
@pytest.mark.parametrize("at", [-0.5, 0.5])
def test_at_a_glance_there_is_no_clock_that_was_waited_for_at_the_start(tmp_path, at, log):
    made, is_told = a_run(), max(at, log) > 0.1
    for time, mode in sorted([(at, Mode.NO_CLOCK), (0.0, Mode.FOLLOWING)]):
        made.add_mode(time, mode.value, level=2 if mode.is_fault else 0)
    made.add_log(log, 30, f"safe output: {Mode.NO_CLOCK.value}")
    (found,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    assert ("there is no clock" in text([Column("a", "bag", Case(found))])) == is_told


def test_comparing_one_bag_is_refused(bags, run):
    status, _, err = run(bags / "first", command=compare_bags)
    assert status == 2
    assert "required: others" in err[-1]


@pytest.mark.parametrize("command", [analyze_bag, compare_bags])
def test_help_says_what_the_exit_status_means(run, command):
    _, out, _ = run("--help", command=command)
    assert "exit status" in " ".join(out)


@pytest.mark.parametrize("unbuffered", ["", pytest.param("1", marks=pytest.mark.soak)])
def test_a_reader_that_leaves_takes_neither_files_nor_status_away(bags, tmp_path, unbuffered):
    command = f"{sys.executable} -m climber_uk.report.analyze_bag {bags}/first -o {tmp_path}"
    ran = subprocess.run(
        ["bash", "-c", f"{command} | true; exit ${{PIPESTATUS[0]}}"],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
    )
    assert (ran.returncode, ran.stderr) == (0, "")
    assert (tmp_path / "metrics.json").is_file()


def test_what_a_node_has_logged_is_text_on_the_page_and_no_more(tmp_path):
    made = a_run()
    made.add_log(0.5, 40, "<b>\x1b[2J\u202e&amp;")
    (found,), _ = read_runs(made.write(tmp_path / "bag"), Topics())
    text = page("a page", [Column("a run", "a bag", Case(found))], {})
    assert r"<td>&lt;b&gt;\x1b[2J\u202e&amp;amp;</td>" in text
    assert text.replace("\n", "").isprintable()
