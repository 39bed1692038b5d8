"""From a plan to a bag of the real nodes, to parameters, and back into the nodes."""

import json
import subprocess

import pytest
from rcl_interfaces.srv import GetParameters
from world import CONFIG, executable

from climber_uk.parameters.changed_parameters import write_changed
from climber_uk.parameters.parameter_file import read_file

pytestmark = pytest.mark.nodes

BELIEVED = CONFIG / "climber.yaml"
TRUTH = {"mass": 5.0 * 1.3, "yaw_inertia": 0.33 * 0.7, "seal_friction_coefficient": 0.6 * 1.3}
NOISE = {"position_noise": 1e-3, "heading_noise": 1e-3, "speed_noise": 1e-2, "yaw_rate_noise": 1e-2}


def run(world, name, *arguments):
    done = subprocess.run(
        [executable(name), *map(str, arguments)],
        env=world.environment,
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.soak  # without nodes: test/identification
def test_a_planned_run_tells_what_is_30_percent_off_and_the_nodes_load_it(world, tmp_path):
    plan, true, found = (tmp_path / f"{name}.yaml" for name in ("plan", "true", "found"))
    limits = "--duration", 8, "--size", 1, "--speed", 0.3
    run(world, "identify", "--plan", plan, "--params", BELIEVED, *limits)
    slow = {"control_period": 0.01}
    changed = {"plant_simulator": {**TRUTH, **NOISE, **slow}, "uk_torque_controller": slow}
    write_changed(plan, changed, true)
    run(world, "run_demo", "--config", true, "--output", tmp_path / "run")

    wanted = "--output", found, "--json", tmp_path / "found.json"
    said = run(world, "identify", tmp_path / "run" / "bag", "--params", BELIEVED, *wanted)
    assert "cannot be told" not in said
    rows = {row["parameter"]: row for row in json.loads((tmp_path / "found.json").read_text())}
    for name, value in TRUTH.items():
        assert rows[name]["estimate"] == pytest.approx(value, rel=0.02)
    for name, value in (("wheel_radius", 0.027), ("half_track", 0.3)):
        assert rows[name]["estimate"] == pytest.approx(value, rel=0.005)

    for node in ("uk_torque_controller", "plant_simulator"):
        world.start_node(node, config=found)
        names = [*TRUTH, "wheel_radius", "half_track", "max_wheel_torque"]
        answer = world.call(
            GetParameters, f"{node}/get_parameters", GetParameters.Request(names=names)
        )
        written = read_file(found, f"/{node}")
        assert [value.double_value for value in answer.values] == [written[name] for name in names]
        assert written["max_wheel_torque"] == 4.0
        assert written["mass"] == pytest.approx(TRUTH["mass"], rel=0.02)
