"""The package of docs/extending.md, installed and run through the real nodes, in lock-step."""

import shlex
import sys

import numpy as np
import pytest
import yaml
from bag_contents import read_messages
from extension import block, install
from world import CONFIG, TIMEOUT, executable

from climber_uk.bags.recorded_run import read_run

pytestmark = pytest.mark.nodes

OWN = "ros__parameters"
PATH = {"origin_y": 3.0, "parabola.length": 0.3, "one_go.rate": 0.3}
PERIOD = {"control_period": 0.02}
START = {"initial_x": 0.0, "initial_y": 3.0, "initial_heading": 0.0, **PERIOD}
ELECTRIC = {"adhesion": "electroadhesion", "electroadhesion.film_pressure": 6000.0}
SECTIONS = {  # the first climber is that of the document
    "/**/trajectory_publisher": PATH,
    "/**/plant_simulator": START,
    "/**/uk_torque_controller": PERIOD,
    "/climber_2/uk_torque_controller": {
        "constraints": "springs",
        "springs.across": 20.0,
        **ELECTRIC,
        "controller": "udwadia_kalaba",
    },
    "/climber_2/plant_simulator": {"friction": "dahl", **ELECTRIC, "odometry_source": "truth"},
}


@pytest.fixture
def parameter_file(tmp_path):
    """Those of climber.yaml, over them the document's, and over them those of the two climbers."""
    tree = yaml.safe_load((CONFIG / "climber.yaml").read_text())
    documented = {name: s[OWN] for name, s in yaml.safe_load(block("yaml")).items()}
    for name, values in [*documented.items(), *SECTIONS.items()]:
        tree.setdefault(name, {OWN: {}})[OWN].update(values)
    file = tmp_path / "toys.yaml"
    file.write_text(yaml.safe_dump(tree, sort_keys=False))
    return file


def test_the_document_s_package_drives_two_climbers(world, tmp_path, parameter_file):
    install(tmp_path / "packages")
    world.environment["PYTHONPATH"] = str(tmp_path / "packages")
    output = tmp_path / "run"
    options = ["--config", parameter_file, "--output", output, "--climbers", "2"]
    demo = world.run("run_demo", executable("run_demo"), *options, "--duration", "3.2")
    assert demo.wait(300) == 0, world.log("run_demo")

    def log(node):
        return (output / f"{node}.log").read_text()

    plants = log("plant_simulator")
    assert "fading friction, suction of" in plants
    assert "dahl friction, electroadhesion of 300 N" in plants
    assert "controller pd" in log("climber_1.uk_torque_controller")
    told = log("climber_2.uk_torque_controller")
    assert "electroadhesion of 300 N, constraints springs" in told

    bag = output / "bag"
    for climber in ("/climber_1", "/climber_2"):
        run = read_run(bag, climber)
        np.testing.assert_allclose(run.pose[-1, :2], [0.3, 3.0 + 0.4 * 0.09], atol=0.01)
        assert run.distance.max() < 0.02
        assert np.abs(run.reference[:, 1] - 3.0 - 0.4 * run.reference[:, 0] ** 2).max() < 1e-6

    def places(topic):
        messages = read_messages(bag, [topic])
        return np.array([(m.pose.pose.position.x, m.pose.pose.position.y) for _, _, m in messages])

    seen, true = places("/climber_1/odom"), places("/climber_1/ground_truth")
    assert np.abs(seen - 1e-3 * np.round(seen / 1e-3)).max() < 1e-12  # whole pixels
    assert np.abs(true - 1e-3 * np.round(true / 1e-3)).max() > 1e-4


@pytest.mark.soak
def test_a_controller_of_somebody_else_s_takes_ours_place(world, tmp_path):
    own = shlex.join([sys.executable, str(CONFIG.parent / "examples" / "own_controller.py")])
    options = ["--config", CONFIG / "climber.yaml", "--output", tmp_path / "run"]
    words = [*options, "--duration", "2", "--controller", own]
    demo = world.run("run_demo", executable("run_demo"), *words)
    assert demo.wait(TIMEOUT) == 0, world.log("run_demo")
    assert "The path was not finished: 5" in world.log("run_demo")  # of 55 s
    run = read_run(tmp_path / "run" / "bag")
    assert run.travelled > 0.02
    assert run.distance.max() < 0.01
    assert not run.parameters  # it is not ours


def test_a_name_that_two_parts_have_is_refused_in_one_line(world, tmp_path):
    install(tmp_path, {"climber_uk.walls": {"fading": "my_climber:Fading"}})
    world.environment["PYTHONPATH"] = str(tmp_path)
    assert world.start_node("plant_simulator").wait(TIMEOUT) != 0
    (line,) = world.log("plant_simulator").splitlines()
    assert "fading.surplus is a parameter of two parts" in line
