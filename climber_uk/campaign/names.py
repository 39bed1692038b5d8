"""Parameters of the nodes in a campaign: those that can be drawn, or are fixed."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from climber_uk.closed_loop.node_parameters import PARAMETERS, fields_of
from climber_uk.control.constraints import CONSTRAINTS, FORCE_LAWS
from climber_uk.control.stops import StopOptions
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.wall import WALLS
from climber_uk.messages.topics import CONTROLLER, PLANT
from climber_uk.parameters.declaration import TYPE_WORDS
from climber_uk.simulation.sensors import Sensors

SEED, PRESSURE = f"{PLANT}.seed", f"{PLANT}.suction_pressure"
MEASURED = f"{CONTROLLER}.suction_pressure"
# parameters that choose one of several kinds with parameters of their own
VARIANTS: dict[str, Mapping[str, Any]] = {
    f"{CONTROLLER}.constraints": CONSTRAINTS,
    f"{CONTROLLER}.controller": FORCE_LAWS,
    **{f"{node}.wall": WALLS for node in (CONTROLLER, PLANT)},
}
ON_WALL = [(kind, f"{name}.") for name, kind in WALLS.items()]
LOSS_TIME = f"{PLANT}.pressure_loss_time"
LAWS: dict[str, Any] = {**CONSTRAINTS, **FORCE_LAWS}
# Parameters that may differ from run to run
VARIED = {
    *fields_of(PLANT, [(Climber, ""), *ON_WALL]),
    *(f"{PLANT}.{error.name}" for error in Sensors.errors()),
    *(f"{PLANT}.{n}" for n in ("wheel_friction_coefficient", "centre_height", "wheelbase")),
    *(f"{PLANT}.initial_{n}" for n in ("x", "y", "heading", "speed", "yaw_rate")),
    *(LOSS_TIME, f"{PLANT}.pressure_loss_level"),
    *fields_of(CONTROLLER, [(Climber, ""), *ON_WALL]),
    *fields_of(CONTROLLER, [(kind, f"{name}.") for name, kind in LAWS.items()]),
    *(f"{CONTROLLER}.{n}" for n in ("friction_speed", "observer.bandwidth")),
}
VARIED -= {MEASURED}
# Values that all campaigns have: batches of closed loops have no others
REQUIRED = {
    f"{CONTROLLER}.pacing.catch_up": 0.0,
    f"{CONTROLLER}.least_pressure": 0.0,
    **{f"{CONTROLLER}.stops.{f.name}": f.default for f in dataclasses.fields(StopOptions)},
    f"{CONTROLLER}.adhesion": "suction",
    f"{CONTROLLER}.least_suction.enabled": False,
    f"{CONTROLLER}.motors": "torque",
    f"{CONTROLLER}.observer.velocity_source": "odometry",
    f"{CONTROLLER}.observer.side_slip_source": "pose",
    f"{PLANT}.friction": "coulomb",
    f"{PLANT}.adhesion": "suction",
    f"{PLANT}.locomotion": "wheeled",
    f"{PLANT}.slip": False,
    f"{PLANT}.creep": 0.0,
    f"{PLANT}.publish_odometry": True,
    f"{PLANT}.publish_twist": True,
    f"{PLANT}.odometry_loss": 0.0,
    f"{PLANT}.seal_radius": 0.0,
    f"{PLANT}.suction.pump_time": 0.0,
    f"{PLANT}.setpoint_timeout": 0.0,
    f"{PLANT}.motors": "torque",
    f"{PLANT}.torque_lag": 0.0,
    f"{PLANT}.torque_resolution": 0.0,
    f"{PLANT}.odometry_source": "truth",
    f"{PLANT}.odometry_delay": 0.0,
}
# Values that batches have in place of the defaults: neither a timing nor a side slip of their own
WITHOUT = {
    f"{CONTROLLER}.learn_delay": False,
    f"{CONTROLLER}.observer.twist": "instantaneous",
    f"{CONTROLLER}.observer.side_slip_bandwidth": 0.0,
}


def check_drawn(name: str, shared: Mapping[str, Any]) -> None:
    """Raise `ValueError` unless a parameter may differ from run to run; all share `shared`."""
    _check_known(name)
    if name not in VARIED:
        raise ValueError(f"{name} cannot be drawn: all runs share one value")
    node, part, *_ = name.split(".")
    for choice, kinds in VARIANTS.items():
        chosen = shared.get(choice, PARAMETERS[choice].default)
        if choice.startswith(f"{node}.") and part in kinds and part != chosen:
            raise ValueError(f"{name} has no effect with {choice.split('.')[1]}={chosen!r}")


def fixed(name: str, value: Any) -> Any:
    """Value of a parameter that all runs share; `ValueError` if it is unknown or unfit."""
    _check_known(name)
    return typed(name, value, PARAMETERS[name].default)


def typed(name: str, value: Any, default: Any) -> Any:
    """`value` in the type of `default`, an integer as a float; `ValueError` if it is another."""
    if isinstance(default, float) and type(value) is int:
        return float(value)
    if type(value) is not type(default):
        raise ValueError(f"{name}={value!r} must be {TYPE_WORDS[type(default)]}")
    return value


def _check_known(name: str) -> None:
    if name == SEED:
        raise ValueError(f"{name}: each run has one of its own, which `seed` begins")
    if name == MEASURED:
        raise ValueError(f"{name} is measured: set {PRESSURE}")
    if name not in PARAMETERS:
        raise ValueError(f"{name} is not a parameter of a campaign")
