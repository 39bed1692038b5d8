"""A controller as parameter files say."""

from pathlib import Path

import numpy as np
import pytest

from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.approach import Approach
from climber_uk.control.build import build_controller
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.adhesion import ADHESION
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.ros import plant_parts
from climber_uk.simulation.options import SimulationOptions
from climber_uk.simulation.simulated_robot import SimulatedRobot

CONFIG = Path(__file__).parents[2] / "config"


def driven(file, duration, **common):
    """Torques (n, 2) and disturbances (n, 2) of a file's nodes, with some parameters in common."""
    ours, plants, plan = (
        Values(read_file(CONFIG / file, f"/{node}"))
        for node in ("uk_torque_controller", "plant_simulator", "trajectory_publisher")
    )
    plants = Values({**plants.by_name, **common})
    options, trajectory = plants.read(SimulationOptions), build_trajectory(plan.read)
    robot = SimulatedRobot(plant_parts.parts(plants), options.initial_state, options.control_period)
    controller = build_controller(Values({**ours.by_name, **common}), pressure=None)
    controller.on_reference(SECOND, sampled(trajectory, duration))
    torques, disturbances = [], []
    for period in range(round(duration / options.control_period)):
        stamp = SECOND + round(period * options.control_period * SECOND)
        answer = controller.on_odometry(stamp, stamp, robot.odometer.latest()[1].motion)
        torques.append(answer.torques)
        disturbances.append(controller.estimator.disturbance)
        for _ in range(options.steps):
            robot.advance(answer.torques)
        robot.measure()
    return np.array(torques), np.array(disturbances)


@pytest.mark.parametrize(
    "common",
    [{}, {"adhesion": "none", "inclination": 30.0}, {"magnetic.gap": 5e-4}],
    ids=["magnetic", "none", "paint"],
)
def test_without_suction_no_seal_is_driven_against(common):
    torques, disturbances = driven("magnetic.yaml", 1.0, **common)
    assert (torques > 0).all()  # the weight, uphill, from the first moment on
    assert np.abs(np.diff(torques, axis=0)).max() < 0.1
    assert np.abs(disturbances).max() < 1.0


@pytest.mark.parametrize("adhesion", ADHESION)
def test_plant_and_controller_have_the_same_friction(adhesion):
    values = Values({"adhesion": adhesion})
    plant = plant_parts.parts(values).plant
    believed = build_controller(values, pressure=None).law.climber
    assert believed.seal_friction == plant.contact.seal_friction(plant.climber)
    assert (believed.seal_friction > 0) is (adhesion == "suction")


@pytest.mark.parametrize("file", ["climber.yaml", "four_climbers.yaml", "magnetic.yaml"])
def test_our_crawlers_turn_and_drive_back_before_they_go_on(file):
    """One that turned by less than the default while nothing answered left its path by 12 cm."""
    approach = Values(read_file(CONFIG / file, "/climber_1/uk_torque_controller")).read(Approach)
    assert approach.max_heading <= 0.3
    assert approach.max_distance <= 0.1
