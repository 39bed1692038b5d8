"""Parameters of the nodes as closed loops by the thousand have them, or do not.

A name is that of a node and of its parameter, as in `plant_simulator.mass`.
"""

import dataclasses
from typing import Any

from climber_uk.control.build import KINDS as CONTROLLER_KINDS
from climber_uk.control.constraints import CONSTRAINTS
from climber_uk.mechanics.adhesion import ADHESION, Alarm, Grip
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.trajectory_parameters import KINDS as PLAN_KINDS
from climber_uk.messages.topics import CONTROLLER, PLANNER, PLANT
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
    **_names(PLANNER, *PLAN_KINDS),
    **_names(CONTROLLER, *CONTROLLER_KINDS, *ON_WALL),
    **_names(
        PLANT, *((kind, "") for kind in (SimulationOptions, Climber, Physics, Motors, Sensors))
    ),
    **_names(PLANT, *((k, f"{name}.") for group in VARIANTS.values() for name, k in group.items())),
    **_names(PLANT, *ON_WALL),
}
# Parameters of the nodes that nothing in lock-step depends on: who is told what, and how often
NODES_ONLY = {
    *("use_sim_time", "autostart", "start_delay", "preview", "point_period", "publish_period"),
    *("stop_time", "effort_commands", "effort_order", "odom_frame", "base_frame"),
    *("left_wheel_joint", "right_wheel_joint", "prefix_frames", "qos_overrides"),
}
# What each run may have its own of
VARIED = {
    *_names(PLANT, (Climber, ""), (Sensors, "")),
    *(f"{PLANT}.{n}" for n in ("wheel_friction_coefficient", "centre_height", "wheelbase")),
    *(f"{PLANT}.initial_{n}" for n in ("x", "y", "heading", "speed", "yaw_rate")),
    *(LOSS_TIME, f"{PLANT}.pressure_loss_level"),
    *_names(CONTROLLER, (Climber, ""), *((kind, f"{n}.") for n, kind in CONSTRAINTS.items())),
    *(f"{CONTROLLER}.{n}" for n in ("friction_speed", "observer.bandwidth")),
}
VARIED -= {SEED, MEASURED}
VARIED -= {f"{PLANT}.{n}" for n in ("odometry_source", "odometry_delay", "encoder_resolution")}
# What closed loops by the thousand have one kind of only
REQUIRED = {
    f"{CONTROLLER}.pacing.catch_up": 0.0,
    f"{CONTROLLER}.least_pressure": 0.0,
    f"{CONTROLLER}.adhesion": "suction",
    f"{CONTROLLER}.observer.velocity_source": "odometry",
    f"{PLANT}.friction": "coulomb",
    f"{PLANT}.adhesion": "suction",
    f"{PLANT}.locomotion": "wheeled",
    f"{PLANT}.wall": "plane",
    f"{PLANT}.plane.tilt": 0.0,
    f"{PLANT}.slip": False,
    f"{PLANT}.seal_radius": 0.0,
    f"{PLANT}.suction.pump_time": 0.0,
    f"{PLANT}.torque_lag": 0.0,
    f"{PLANT}.torque_resolution": 0.0,
    f"{PLANT}.odometry_source": "truth",
    f"{PLANT}.odometry_delay": 0.0,
}
# What they do without: each controller would have a timing of its own
WITHOUT = {
    f"{CONTROLLER}.learn_delay": False,
    f"{CONTROLLER}.observer.twist": "instantaneous",
}


def check_drawn(name: str, constraints: str) -> None:
    """Raise `ValueError` unless each run may have its own value of a parameter."""
    _check_known(name)
    if name not in VARIED:
        raise ValueError(f"{name} cannot be drawn: all runs share one value")
    part = name.split(".")[1]
    if part in CONSTRAINTS and part != constraints:
        raise ValueError(f"{name} has no effect with constraints={constraints!r}")


def fixed(name: str, value: Any) -> Any:
    """Value of a parameter that all runs share; `ValueError` if it cannot be that."""
    _check_known(name)
    return typed(name, value, PARAMETERS[name].default)


def typed(name: str, value: Any, default: Any) -> Any:
    """Value of the type of `default`, integers for floats as well; `ValueError` if it is not."""
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
        raise ValueError(f"{name} is not a parameter that a campaign knows")
