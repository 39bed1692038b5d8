"""Parameters of the nodes in a campaign: those that can be drawn, are fixed, or have no effect.

A name is that of a node and of its parameter, as in `plant_simulator.mass`.
"""

import dataclasses
from typing import Any

from climber_uk.control.build import KINDS as CONTROLLER_TYPES
from climber_uk.control.constraints import CONSTRAINTS, UDWADIA_KALABA
from climber_uk.control.stops import StopOptions
from climber_uk.mechanics.adhesion import ADHESION, Alarm, Grip
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.trajectory_parameters import TYPES as TRAJECTORY_TYPES
from climber_uk.messages.topics import CONTROLLER, PLANNER, PLANT
from climber_uk.simulation.field_sensors import FIELD_SENSORS
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.options import SimulationOptions
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import VARIANTS, Physics

SEED, PRESSURE = f"{PLANT}.seed", f"{PLANT}.suction_pressure"
MEASURED = f"{CONTROLLER}.suction_pressure"
CONSTRAINT_SET = f"{CONTROLLER}.constraints"
LOSS_TIME = f"{PLANT}.pressure_loss_time"


def _names(node: str, *kinds: tuple[type, str]) -> dict[str, "dataclasses.Field[Any]"]:
    return {
        f"{node}.{prefix}{field.name}": field
        for kind, prefix in kinds
        for field in dataclasses.fields(kind)  # type: ignore[arg-type]
    }


ON_WALL = [(Grip, ""), (Alarm, ""), *((kind, f"{name}.") for name, kind in ADHESION.items())]
PARAMETERS = {
    **_names(PLANNER, *TRAJECTORY_TYPES),
    **_names(CONTROLLER, *CONTROLLER_TYPES, *ON_WALL),
    **_names(PLANT, *((k, "") for k in (SimulationOptions, Climber, Physics, Motors, Sensors))),
    **_names(PLANT, *((k, f"{name}.") for group in VARIANTS.values() for name, k in group.items())),
    **_names(PLANT, *ON_WALL),
}
# Parameters of the nodes that have no effect in lock-step: names, topics, rates of publishing, and
# sensors that no odometry comes from
NODES_ONLY = {
    *("use_sim_time", "autostart", "start_delay", "preview", "point_period", "publish_period"),
    *("stop_time", "reaction", "speed", "exclusive"),
    *(f"by_hand.{name}" for name in ("input", "speed", "yaw_rate", "ramp_time", "timeout")),
    *("effort_commands", "effort_order", "publish_cmd_vel", "odom_frame", "base_frame"),
    *("left_wheel_joint", "right_wheel_joint", "prefix_frames", "qos_overrides"),
    *(at + field.name for at, kind in FIELD_SENSORS.items() for field in dataclasses.fields(kind)),
}
# Parameters that may differ from run to run
VARIED = {
    *_names(PLANT, (Climber, "")),
    *(f"{PLANT}.{error.name}" for error in Sensors.errors()),
    *(f"{PLANT}.{n}" for n in ("wheel_friction_coefficient", "centre_height", "wheelbase")),
    *(f"{PLANT}.initial_{n}" for n in ("x", "y", "heading", "speed", "yaw_rate")),
    *(LOSS_TIME, f"{PLANT}.pressure_loss_level"),
    *_names(CONTROLLER, (Climber, ""), *((kind, f"{n}.") for n, kind in CONSTRAINTS.items())),
    *(f"{CONTROLLER}.{n}" for n in ("friction_speed", "observer.bandwidth")),
}
VARIED -= {MEASURED}
# Values that all campaigns have: batches of closed loops have no others
REQUIRED = {
    f"{CONTROLLER}.pacing.catch_up": 0.0,
    f"{CONTROLLER}.least_pressure": 0.0,
    **{f"{CONTROLLER}.stops.{f.name}": f.default for f in dataclasses.fields(StopOptions)},
    f"{CONTROLLER}.adhesion": "suction",
    f"{CONTROLLER}.controller": UDWADIA_KALABA,
    f"{CONTROLLER}.motors": "torque",
    f"{CONTROLLER}.observer.velocity_source": "odometry",
    f"{PLANT}.friction": "coulomb",
    f"{PLANT}.adhesion": "suction",
    f"{PLANT}.locomotion": "wheeled",
    f"{PLANT}.wall": "plane",
    f"{PLANT}.plane.tilt": 0.0,
    f"{PLANT}.slip": False,
    f"{PLANT}.creep": 0.0,
    f"{PLANT}.publish_odometry": True,
    f"{PLANT}.seal_radius": 0.0,
    f"{PLANT}.suction.pump_time": 0.0,
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


def check_drawn(name: str, constraints: str) -> None:
    """Raise `ValueError` unless a parameter may differ from run to run."""
    _check_known(name)
    if name not in VARIED:
        raise ValueError(f"{name} cannot be drawn: all runs share one value")
    part = name.split(".")[1]
    if part in CONSTRAINTS and part != constraints:
        raise ValueError(f"{name} has no effect with constraints={constraints!r}")


def fixed(name: str, value: Any) -> Any:
    """Value of a parameter that all runs share; `ValueError` if it is unknown or unfit."""
    _check_known(name)
    return typed(name, value, PARAMETERS[name].default)


def typed(name: str, value: Any, default: Any) -> Any:
    """`value` in the type of `default`, an integer as a float; `ValueError` if it is another."""
    if isinstance(default, float) and type(value) is int:
        return float(value)
    if type(value) is not type(default):
        raise ValueError(f"{name}={value!r} must be a {type(default).__name__}")
    return value


def _check_known(name: str) -> None:
    if name == SEED:
        raise ValueError(f"{name}: each run has one of its own, which `seed` begins")
    if name == MEASURED:
        raise ValueError(f"{name} is measured: set {PRESSURE}")
    if name not in PARAMETERS:
        raise ValueError(f"{name} is not a parameter of a campaign")
