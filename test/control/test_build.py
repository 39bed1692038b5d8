"""A controller as parameter files say."""

from pathlib import Path

import numpy as np
import pytest

from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.build import new_follower
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.adhesion import ADHESION
from climber_uk.mechanics.trajectory_parameters import planned
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.ros import plant_parts
from climber_uk.simulation.options import Options
from climber_uk.simulation.simulated_robot import Machine

CONFIG = Path(__file__).parents[2] / "config"


def driven(file, duration, **common):
    """Torques (n, 2) and disturbances (n, 2) of a file's nodes, with some parameters in common."""
    ours, plants, plan = (
        Values(read_file(CONFIG / file, f"/{node}"))
        for node in ("uk_torque_controller", "plant_simulator", "trajectory_publisher")
    )
    plants = Values({**plants.by_name, **common})
    options, trajectory = plants.read(Options), planned(plan.read)
    machine = Machine(plant_parts.parts(plants), options.initial_state, options.control_period)
    follower = new_follower(Values({**ours.by_name, **common}), pressure=None)
    follower.on_reference(SECOND, sampled(trajectory, duration))
    torques, disturbances = [], []
    for period in range(round(duration / options.control_period)):
        stamp = SECOND + round(period * options.control_period * SECOND)
        answer = follower.on_odometry(stamp, stamp, machine.odometer.latest()[1])
        torques.append(answer.torques)
        disturbances.append(follower.tracker.disturbance)
        for _ in range(options.steps):
            machine.advance(answer.torques)
        machine.measure()
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
    believed = new_follower(values, pressure=None).tracker.controller.climber
    assert believed.seal_friction == plant.contact.seal_friction(plant.climber)
    assert (believed.seal_friction > 0) is (adhesion == "suction")
