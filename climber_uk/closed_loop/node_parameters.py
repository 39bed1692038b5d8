"""Parameters of the three nodes by name, for tools that read a file as these nodes would.

A name is that of a node and of its parameter, as in `plant_simulator.mass`.
"""

import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from climber_uk.control.build import KINDS as CONTROLLER_TYPES
from climber_uk.control.least_suction import SuctionOptions
from climber_uk.mechanics.adhesion import ADHESION, Alarm, Grip
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.trajectory_parameters import TYPES as TRAJECTORY_TYPES
from climber_uk.messages.topics import CONTROLLER, PLANNER, PLANT
from climber_uk.parameters.parameter_file import read_file
from climber_uk.parameters.parameter_paths import located
from climber_uk.parameters.plausibility import doubt
from climber_uk.simulation.field_sensors import FIELD_SENSORS
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.options import SimulationOptions
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import VARIANTS, Physics


def fields_of(node: str, kinds: Iterable[tuple[type, str]]) -> "dict[str, dataclasses.Field[Any]]":
    """Fields of types of parameters by name, present and former, each type with its prefix."""
    return {
        f"{node}.{prefix}{name}": field
        for kind, prefix in kinds
        for field in dataclasses.fields(kind)  # type: ignore[arg-type]
        for name in (field.name, field.metadata.get("formerly"))
        if name
    }


ON_WALL = [(Grip, ""), (Alarm, ""), *((kind, f"{name}.") for name, kind in ADHESION.items())]
PARAMETERS = {
    **fields_of(PLANNER, TRAJECTORY_TYPES),
    **fields_of(CONTROLLER, [*CONTROLLER_TYPES, *ON_WALL, (SuctionOptions, "least_suction.")]),
    **fields_of(PLANT, ((k, "") for k in (SimulationOptions, Climber, Physics, Motors, Sensors))),
    **fields_of(PLANT, ((k, f"{n}.") for group in VARIANTS.values() for n, k in group.items())),
    **fields_of(PLANT, ON_WALL),
}
PATHS = {  # parameters of a path that are files
    prefix + field.name
    for kind, prefix in TRAJECTORY_TYPES
    for field in dataclasses.fields(kind)  # type: ignore[arg-type]
    if field.metadata.get("is_path")
}
# Those that have no effect in lock-step, of any node: names, topics, rates of publishing, and
# sensors that no odometry comes from
NODES_ONLY = {
    *("use_sim_time", "autostart", "start_delay", "preview", "point_period", "publish_period"),
    *("stop_time", "reaction", "speed", "exclusive", "goal_patience"),
    *(f"by_hand.{name}" for name in ("input", "speed", "yaw_rate", "ramp_time", "timeout", "lock")),
    *("effort_commands", "effort_order", "publish_cmd_vel", "odom_frame", "base_frame"),
    *("left_wheel_joint", "right_wheel_joint", "prefix_frames"),
    *(at + field.name for at, kind in FIELD_SENSORS.items() for field in dataclasses.fields(kind)),
}


def read_parameters(path: Path, node: str, remarks: list[str] | None = None) -> dict[str, Any]:
    """Values of a parameter file for one of the three nodes, by its full name.

    Raises as `read_file` does, also for a name that the node does not have. `remarks` gets a line
    on each value that can hardly be meant.
    """
    own = node.rpartition("/")[2]
    values = read_file(path, node, names_of(own))
    if remarks is not None:
        remarks += doubts(path, values, PARAMETERS, f"{own}.")
    return values


def read_planner(
    path: Path,
    node: str,
    changes: Mapping[str, Any] | None = None,
    remarks: list[str] | None = None,
) -> dict[str, Any]:
    """The same for a trajectory_publisher, but for `changes`, which are by name.

    Names of files are relative to the working directory then.
    """
    changes = changes or {}
    planner = {**read_parameters(path, node, remarks), **changes}
    words = ["--ros-args", "--params-file", str(path)]
    for name in PATHS & planner.keys() - changes.keys():
        if isinstance(planner[name], str):  # else what reads it says so
            planner[name] = located(planner[name], name, node, words)
    return planner


def doubts(
    path: Path,
    values: Mapping[str, Any],
    fields: "Mapping[str, dataclasses.Field[Any]]",
    own: str = "",
) -> list[str]:
    """A line on each value that can hardly be meant, as the nodes say it in their logs.

    `fields` are by name, with `own` before it.
    """
    numbers = {name: of for name, of in values.items() if isinstance(of, int | float)}
    return [
        f"{path}: {name.removesuffix(field.name)}{said}"
        for name, value in numbers.items()
        if (field := fields.get(own + name)) and (said := doubt(field, value))
    ]


def names_of(node: str) -> set[str]:
    """Names of all parameters of one of the three nodes."""
    own = f"{node}."
    return NODES_ONLY | {name.removeprefix(own) for name in PARAMETERS if name.startswith(own)}
