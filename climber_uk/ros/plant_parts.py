"""The parts of a simulated robot, made from its node's parameters."""

from typing import Any

from climber_uk.mechanics.adhesion import Alarm, Grip
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.ros.parameters import NodeParameters
from climber_uk.simulation.field_sensors import FIELD_SENSORS, FieldSensors
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.options import SimulationOptions
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import VARIANTS, Parts, Physics


def declare(parameters: NodeParameters) -> None:
    """Declare all parameters of a plant; raises as `NodeParameters.declare` does."""
    for kind in (SimulationOptions, Climber, Physics, Grip, Motors, Sensors, Alarm):
        parameters.declare(kind)
    for prefix, kind in FIELD_SENSORS.items():
        parameters.declare(kind, prefix)
    for variants in VARIANTS.values():
        for name, variant in variants.items():
            parameters.declare(variant, f"{name}.")


def parts(parameters: NodeParameters) -> Parts:
    """Parts by the present parameters; raises as `NodeParameters.read` does."""
    read = parameters.read
    physics, sensors, step = read(Physics), read(Sensors), read(SimulationOptions).integration_step
    chosen: dict[str, Any] = {}
    for group, variants in VARIANTS.items():
        name = getattr(sensors if group == "odometry_source" else physics, group)
        chosen[group] = read(variants[name], f"{name}.")
    wall, source = chosen.pop("wall"), chosen.pop("odometry_source")
    contact = Contact(**chosen, grip=read(Grip))
    plant = Plant(read(Climber), step, contact, wall, physics.slip)
    return Parts(plant, read(Motors), sensors, physics, source)


def field_sensors(parameters: NodeParameters) -> FieldSensors:
    """Encoders, IMU and fixes of a climber that begins anew."""
    options = parameters.read(SimulationOptions)
    imu, encoders, fixes = (parameters.read(kind, at) for at, kind in FIELD_SENSORS.items())
    return FieldSensors(imu, encoders, fixes, options.control_period, options.initial_state)
