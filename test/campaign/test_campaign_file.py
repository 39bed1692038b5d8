import re
from pathlib import Path

import numpy as np
import pytest

from climber_uk.campaign import names
from climber_uk.campaign.campaign import read
from climber_uk.campaign.names import LOSS_TIME, SEED
from climber_uk.closed_loop.node_parameters import NODES_ONLY, PARAMETERS
from climber_uk.messages.topics import NODES

DOCS = Path(__file__).parents[2] / "docs"
PLANT, CONTROLLER = "plant_simulator.", "uk_torque_controller."
WIDE = {"uniform": [0.1, 0.2]}


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({PLANT + "mass": {"uniform": [-1.0, 6.0]}}, "plant_simulator.mass=-1.0 must be > 0 [kg]"),
        ({PLANT + "mass": {"normal": [5.0, 1.0]}}, "must be > 0 [kg]"),  # -3.4 can be drawn
        ({PLANT + "wheel_load_share": {"choice": [0.5, 1.2]}}, "must be <= 1"),
        ({PLANT + "weight": WIDE}, "plant_simulator.weight is not a parameter"),
        ({PLANT + "mass": {"uniform": [6.0, 4.0]}}, "plant_simulator.mass: highest=4.0 must be"),
        ({PLANT + "mass": "heavy"}, "plant_simulator.mass='heavy' must be a number"),
        ({PLANT + "slip": 1}, "plant_simulator.slip=1 must be true or false"),
        ({PLANT + "integration_step": 0.003}, "must be a multiple of integration_step=0.003"),
        ({PLANT + "seed": 3}, "each run has one of its own"),
        ({CONTROLLER + "suction_pressure": 9000.0}, "is measured: set plant_simulator"),
        ({CONTROLLER + "exact.hidden_rate": WIDE}, "no effect with constraints='guidance'"),
        # what closed loops by the thousand have one kind of only
        ({CONTROLLER + "pacing.catch_up": 0.1}, "pacing.catch_up=0.1 must be 0.0"),
        ({CONTROLLER + "least_pressure": 10.0}, "least_pressure=10.0 must be 0.0"),
        ({PLANT + "friction": "lugre"}, "friction='lugre' must be 'coulomb'"),
        ({PLANT + "slip": True}, "slip=True must be False"),
        ({PLANT + "suction.pump_time": 1.0}, "suction.pump_time=1.0 must be 0.0"),
        ({PLANT + "tank.radius": WIDE}, "tank.radius has no effect with wall='plane'"),
        ({PLANT + "odometry_delay": {"choice": [0.0, 0.005]}}, "odometry_delay cannot be drawn"),
        ({CONTROLLER + "transport_delay": WIDE}, "transport_delay cannot be drawn"),
        ({"trajectory_publisher.ellipse.semi_axis_x": WIDE}, "semi_axis_x cannot be drawn"),
    ],
)
def test_a_bad_parameter_is_refused_by_name_value_and_bound(campaign_file, parameters, said):
    refusal(campaign_file(parameters), said)


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        ({"runs": 0}, "runs=0 must be >= 1"),
        ({"runs": 1.5}, "runs=1.5 must be an integer"),
        ({"seed": -1}, "seed=-1 must be >= 0"),
        ({"duration": 0.0}, "duration=0.0 must be > 0 [s]"),
        ({"base": None}, "base"),
        ({"base": "nothing.yaml"}, "nothing.yaml"),
        ({"limits": []}, "limits a list with one at least"),
        ({"limits": ["max_distance"]}, "'max_distance' must be a metric, one of <= >= "),
        ({"limits": ["width < 1"]}, "'width < 1': width is none of rms_distance"),
        ({"limits": ["fell =< 0"]}, "must be a metric, one of <= >="),
        ({"limits": ["fell < nan"]}, "nan must be a finite number"),
        ({"run": 3}, "run is not one of base, runs"),
        ({"backend": "abacus"}, "backend='abacus' must be one of numpy, numba, jax"),
        ({"backend": 3}, "backend=3 must be a text"),
    ],
)
def test_a_bad_entry_is_refused(campaign_file, entries, said):
    refusal(campaign_file(**entries), said)


def refusal(path, said):
    with pytest.raises((ValueError, OSError), match=r".") as refused:
        read(path)
    assert said in str(refused.value)
    assert len(str(refused.value).splitlines()) == 1


@pytest.mark.parametrize(
    "text",
    [
        *("a: [", "- 1", "", "base: 3", "[" * 5000, '"\\UFFFFFFFF"', "!!bool maybe", "!!int ''"),
        *("a: &b [1]\nc: *b", "runs: 1\nruns: 2", "\udcff".encode(errors="surrogateescape")),
    ],
)
def test_what_is_no_campaign_is_refused(tmp_path, text):
    path = tmp_path / "bad.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    refusal(path, f"{path}: ")


def test_a_base_file_with_a_parameter_that_no_node_has_is_refused(campaign_file, tmp_path):
    base = tmp_path / "base.yaml"
    paper = (names_file := Path(read(campaign_file()).base)).read_text()
    assert names_file.name == "paper.yaml"
    base.write_text(paper.replace("initial_y:", "initial_why:"))
    refusal(
        campaign_file(base=str(base)),
        "initial_why is no parameter of /plant_simulator (did you mean initial_y?)",
    )


def test_every_parameter_of_the_nodes_is_known_or_without_effect():
    """docs/parameters.md is made from the nodes, and tested against them."""
    node, known = "", set(PARAMETERS)
    for line in (DOCS / "parameters.md").read_text().splitlines():
        if line.startswith("## "):
            node = line[3:]
        elif (found := re.match(r"\| `([\w.]+)` \|", line)) and node in NODES:
            assert f"{node}.{found[1]}" in known or found[1] in NODES_ONLY
            known.discard(f"{node}.{found[1]}")
    assert not known
    assert set(names.REQUIRED) | names.VARIED <= set(PARAMETERS)


def test_what_is_fixed_holds_for_all_and_what_is_drawn_for_each(campaign):
    found = campaign({PLANT + "yaw_inertia": 1, CONTROLLER + "mass": {"fixed": 5.5}})
    own = found.columns(0, 4)
    loops = found.scenario.loops(own)
    assert loops.climber.yaw_inertia == 1.0
    assert loops.law.climber.mass == 5.5
    np.testing.assert_array_equal(loops.climber.mass, own[PLANT + "mass"])
    assert len(set(own[PLANT + "mass"])) == len(set(own[SEED])) == 4
    assert loops.start.y.tolist() == [6.0] * 4  # as paper.yaml says
    assert loops.start.speed.tolist() == [10.0] * 4


def test_a_fault_begins_with_a_control_period(campaign):
    found = campaign({LOSS_TIME: {"uniform": [0.0, 1.0]}})
    times = found.columns(0, 100)[LOSS_TIME]
    np.testing.assert_allclose(times / 0.005, np.round(times / 0.005), rtol=1e-12)
    assert (times > 0).all()
