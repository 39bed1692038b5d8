"""How probable it is that climbers within identify's intervals fall or slip on a path."""

import json
import math
from dataclasses import replace
from statistics import NormalDist

import numpy as np
import pytest
from test_check_path import CLIMBER, CONFIG, FRICTION, HELD, run

from climber_uk.closed_loop.batch import Loops
from climber_uk.closed_loop.period import BatchRun
from climber_uk.control.control_law import ControlLaw
from climber_uk.control.guidance import Guidance
from climber_uk.identification.identified import NAMES
from climber_uk.identification.integral_equations import Site
from climber_uk.identification.report import EFFECTIVE, label_of
from climber_uk.mechanics.adhesion import Grip, Magnetic
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.quantities import Motion
from climber_uk.mechanics.shapes import Circle, Line
from climber_uk.mechanics.time_laws import ConstantRate, RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.path_check import check_path
from climber_uk.path_check.posterior import Interval, chances, read_posterior
from climber_uk.report.proportion import wilson

UP = Trajectory(Line(0.5, direction=math.pi / 2), RestToRest(rate=0.2, ramp_time=1.0))
RAMP = 15 / 8 * 0.2  # [m/s²] in the middle of it
TRACTION = Grip().wheel_friction_coefficient * 0.8 * 8000 * 0.06
# by hand: the mass that the wheels can just carry up
LIMIT = (TRACTION - FRICTION) / (9.81 + RAMP)


def slips(mass, half_width, climbers=1000, **others):
    posterior = {"mass": Interval(mass, half_width, "kg"), **others}
    return chances(UP, CLIMBER, HELD, posterior, climbers)["slips"].numbers["probability"]


def test_a_safe_climber_never_slips_and_one_beyond_the_limit_always_does():
    assert slips(5.0, 0.5) == 0.0
    assert slips(LIMIT + 1.0, 0.5) == 1.0


@pytest.mark.parametrize("deviations", [-2.0, -0.5, 0.0, 1.0])
def test_between_it_is_the_share_of_the_interval_that_is_beyond_the_limit(deviations):
    width = 1.0
    found = slips(LIMIT + deviations * width / 1.96, width, climbers=4000)
    assert found == pytest.approx(NormalDist().cdf(deviations), abs=0.03)  # 4 of its own deviations


def test_the_wider_the_interval_of_a_climber_that_holds_the_more_probably_it_slips():
    found = [slips(LIMIT - 1.0, width) for width in (0.2, 1.0, 2.0, 4.0, 8.0)]
    assert found[0] == 0.0
    assert all(np.diff(found) > 0)


def test_it_falls_where_the_adhesion_does_not_carry_what_it_may_weigh():
    """By hand, upside down: magnets of 60 N and a mass whose median they can just hold."""
    ceiling = replace(CLIMBER, inclination=180.0)
    magnets = Contact(adhesion=Magnetic(force_at_contact=60.0), grip=Grip())
    posterior = {"mass": Interval(60 / 9.81, 0.5, "kg")}
    circle = Trajectory(Circle(1.0), ConstantRate(0.2))
    found = chances(circle, ceiling, magnets, posterior, 4000)["falls"].numbers
    assert found["probability"] == pytest.approx(0.5, abs=0.03)
    low, high = found["95 %"]
    assert (low, high) == pytest.approx(wilson(round(found["probability"] * 4000), 4000))


@pytest.mark.parametrize(
    ("name", "estimate"),
    [
        ("rolling_friction", TRACTION),
        ("viscous_friction", TRACTION / 0.2),
        ("turning_friction", 0.3 * TRACTION),
        ("turning_resistance", 0.3 * TRACTION / 0.2),
    ],
)
def test_whatever_resists_counts(name, estimate):
    circle = Trajectory(Circle(1.0), ConstantRate(0.2))
    found = [
        chances(circle, CLIMBER, HELD, {name: Interval(of, 0.0, "")}, 10)["slips"].count
        for of in (0.0, estimate)
    ]
    assert found == [0, 10]


def test_closed_loops_of_such_climbers_slip_where_those_on_the_path_do():
    """A campaign's: the controller believes in the file, and drives what is drawn."""
    number, nothing = 100, np.zeros(100)
    start = Motion.at(nothing, nothing, nothing + math.pi / 2, nothing, nothing)
    believed = replace(CLIMBER, mass=LIMIT - 1, max_wheel_torque=20.0)
    mass = np.random.default_rng(1).normal(LIMIT - 1, 2.0, number)
    loops = Loops(start, replace(believed, mass=mass), ControlLaw(believed, Guidance()))
    slipped = loops.run(BatchRun(UP, UP.duration)).slip_margin < 1
    assert np.mean(slipped != (mass > LIMIT)) <= 0.02


ROWS = [
    {"parameter": "mass", "estimate": 5.0, "half_width": 0.1, "unit": "kg", "known": True},
    {"parameter": "yaw_inertia", "estimate": None, "half_width": None, "known": False},
    {"parameter": "effective_half_track", "estimate": 0.4, "half_width": 0.1, "known": True},
]


def test_the_command_tells_what_is_drawn_and_the_probabilities(monkeypatch, capsys, tmp_path):
    file = tmp_path / "told.json"
    file.write_text(json.dumps(ROWS))
    words = "--params", CONFIG / "climber.yaml", "--posterior", file, "--climbers", 50
    status, said = run(monkeypatch, capsys, *words, "--output", tmp_path)
    assert status == 0
    assert "50 climbers drawn: mass 5 ± 0.1 kg\n" in said
    assert "not told by the bag, so as in the parameter file: yaw_inertia\n" in said
    assert "falls: 0.00% (95 %: 0.00% to 7.13%)\n" in said  # Wilson's, of 0 in 50
    assert "slips: 0.00% " in said
    told = json.loads((tmp_path / "check_path.json").read_text())["posterior"]
    assert told["events"]["slips"]["probability"] == 0


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        ("", "Expecting value"),
        ("mass: 5.0", "Expecting value"),
        ("{}", "no list of parameters"),
        ("[1]", "no list of parameters"),
        ("[]", "it tells no parameter"),
        ("[" * 100_000, ""),
        ([ROWS[1]], "it tells no parameter"),
        ([{**ROWS[0], "parameter": "weight"}], "parameter='weight' is none of identify's"),
        ([{**ROWS[0], "parameter": ["mass"]}], "is none of identify's"),
        ([{**ROWS[0], "estimate": None}], "estimate=None of mass must be a finite number"),
        ([{**ROWS[0], "estimate": math.nan}], "estimate=nan of mass must be a finite number"),
        ([{**ROWS[0], "half_width": True}], "half_width=True of mass must be a finite number"),
        ([{**ROWS[0], "half_width": -0.1}], "half_width=-0.1 of mass must be >= 0"),
        ([{**ROWS[0], "estimate": -5}], "mass=-5.0 ± 0.1 must be > 0"),
        ([{**ROWS[0], "half_width": 6}], "mass=5.0 ± 6.0 must be > 0"),
    ],
)
def test_a_file_that_identify_did_not_write_is_refused_in_a_line(tmp_path, content, fault):
    file = tmp_path / "told.json"
    file.write_text(content if isinstance(content, str) else json.dumps(content))
    with pytest.raises(ValueError, match="is not what identify --json writes: ") as refused:
        read_posterior(file)
    assert fault in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


@pytest.mark.parametrize("file", ["told.json", ".", "params.yaml"])
def test_the_command_refuses_it_with_status_2(monkeypatch, capsys, tmp_path, file):
    (tmp_path / "params.yaml").write_bytes(b"\xff\x00")
    words = ["--params", CONFIG / "climber.yaml", "--posterior", tmp_path / file]
    monkeypatch.setattr("sys.argv", ["check_path", *map(str, words)])
    with pytest.raises(SystemExit) as ended:
        check_path.main()
    said = capsys.readouterr()
    assert (ended.value.code, said.out, len(said.err.splitlines())) == (2, "", 1)


@pytest.mark.parametrize("has_seal", [True, False])
def test_whatever_identify_may_tell_is_known(tmp_path, has_seal):
    site = Site(has_seal=has_seal)
    names = [label_of(name, site)[0] for name in NAMES] + [EFFECTIVE]
    file = tmp_path / "told.json"
    file.write_text(json.dumps([{**ROWS[0], "parameter": name} for name in names]))
    told = read_posterior(file)
    assert {*told} == {*names} - {EFFECTIVE}
    circle = Trajectory(Circle(1.0), ConstantRate(0.2))
    assert chances(circle, CLIMBER, HELD, told, 3)["falls"].runs == 3
