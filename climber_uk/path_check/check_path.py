"""Tell whether a climber can drive a path, before it does: where what limits it, and what it takes.

The path is that of trajectory_publisher's parameters in a file, the climber that of
uk_torque_controller's. With `--posterior` it tells as well how probable it is that a climber falls
or slips that is known only as well as a bag tells, by `identify`. The status is 1 if
the path asks for more than there is, and 2 if that cannot be told.
"""

import argparse
import json
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

from climber_uk.closed_loop.node_parameters import PATHS, read_parameters, read_planner
from climber_uk.closed_loop.start import begun_there, other_climber, start_elsewhere
from climber_uk.control.build import KINDS as CONTROLLER_TYPES
from climber_uk.control.build import ControllerChoice
from climber_uk.mechanics.adhesion import ADHESION, Grip
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import LOCOMOTION, Contact
from climber_uk.mechanics.fastest_law import DEGREE
from climber_uk.mechanics.lanes import Lanes
from climber_uk.mechanics.summary import summary
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.trajectory_parameters import TYPES, build_trajectory
from climber_uk.mechanics.wall import WALLS, Wall
from climber_uk.messages.topics import CONTROLLER, PLANNER, PLANT
from climber_uk.parameters.parameter_file import (
    Values,
    given,
    read_argument,
    read_sections,
    refuse_unknown,
)
from climber_uk.parameters.text_file import write_whole
from climber_uk.path_check.demands import demands
from climber_uk.path_check.fastest import fastest, write_fastest
from climber_uk.path_check.findings import lines, told, told_of
from climber_uk.path_check.path_limits import Limits
from climber_uk.path_check.posterior import chances, posterior_of
from climber_uk.path_check.time_optimal import PERIOD, time_optimal
from climber_uk.report.outputs import failing_in_a_line
from climber_uk.simulation.options import SimulationOptions
from climber_uk.simulation.simulated_robot import Physics
from climber_uk.system.command_line import Parser, between, printable, whole

NAMES = {
    prefix + field.name
    for kind, prefix in TYPES
    for field in fields(kind)  # type: ignore[arg-type]
}
MOST_CLIMBERS = 1_000_000


def read(
    file: Path, changes: dict[str, Any], remarks: list[str]
) -> tuple[Trajectory, Climber, Contact, Wall]:
    """Path, climber, what holds it and its wall, by a file and changes of the path's parameters.

    What resists a turn is that of plant_simulator's `locomotion`, if the file has one: a robot of
    one's own needs none. Raises `ValueError`, also for a name that no part of the path has.
    `remarks` gets a line on each value that can hardly be meant.
    """
    refuse_unknown(changes, NAMES, "a path")
    planner = read_planner(file, f"/{PLANNER}", changes, remarks)
    trajectory = build_trajectory(Values(planner).read)
    values = Values(read_parameters(file, f"/{CONTROLLER}", remarks))
    for kind, prefix in CONTROLLER_TYPES:  # with a number that is refused no node would start
        values.read(kind, prefix)
    choice = values.read(ControllerChoice)
    name, wall = choice.adhesion, choice.wall
    plant = Values({})
    if given(read_sections(file), f"/{PLANT}"):
        plant = Values(read_parameters(file, f"/{PLANT}"))
        trajectory = begun_there(trajectory, plant.read(SimulationOptions))
        elsewhere, _ = start_elsewhere(trajectory, values, plant)
        said = other_climber(values, plant), "" if changes else elsewhere
        remarks += [f"{file}: {line}" for line in said if line]
    else:
        remarks.append(f"{file}: without a {PLANT}'s locomotion, nothing is taken to resist turns")
    runs_on = plant.read(Physics).locomotion
    contact = Contact(
        adhesion=values.read(ADHESION[name], f"{name}."),
        grip=values.read(Grip),
        locomotion=plant.read(LOCOMOTION[runs_on], f"{runs_on}."),
    )
    return trajectory, values.read(Climber), contact, values.read(WALLS[wall], f"{wall}.")


def _fastest_law(
    options: argparse.Namespace,
    trajectory: Trajectory,
    climber: Climber,
    contact: Contact,
    wall: Wall,
) -> tuple[Trajectory | None, dict[str, Any]]:
    """The path by the fastest law, and what that takes; or None, and the reason."""
    given = {
        name: value
        for name in ("speed", "yaw_rate", "acceleration")
        if (value := getattr(options, name)) is not None
    }
    limits, period = Limits(options.margin, **given), options.smoothing / (DEGREE + 1)
    try:
        law = time_optimal(trajectory, climber, contact, limits, period, wall).trajectory
    except ValueError as error:
        return None, {"reason": str(error)}
    found = demands(law, climber, contact, options.margin, wall)
    least = min(found.least(), key=lambda of: of.reserve)
    return law, {
        "duration [s]": law.duration,
        "fastest [m/s]": summary(law, climber.half_track).fastest_speed,
        "least reserve": least.reserve,
        "limit": least.name,
    }


def parse() -> argparse.Namespace:
    """Options of the command line."""
    parser = Parser("check_path", __doc__)
    parser.add_argument("--params", type=Path, required=True, help="parameter file of the nodes")
    parser.add_argument(
        *("-p", "--param"),
        action="append",
        default=[],
        metavar="NAME:=VALUE",
        help="of the path, in place of the file's",
    )
    parser.add_argument(
        "--margin",
        type=between(0.1, 100.0),
        default=1.5,
        help="of slipping that is to be kept (default: 1.5, as the alarm's)",
    )
    parser.add_argument(
        "--fastest",
        action="store_true",
        help="tell the highest rate at which all limits hold, and the fastest time law, too; "
        "with --output, write fastest.yaml, by which the nodes drive it",
    )
    for name, unit in (("speed", "m/s"), ("yaw-rate", "rad/s"), ("acceleration", "m/s²")):
        parser.add_argument(
            f"--{name}",
            type=between(1e-3, 1e3),
            default=None,
            help=f"[{unit}] of the fastest law, at most (default: what the rest allows)",
        )
    parser.add_argument(
        "--smoothing",
        type=between(0.006, 6.0),
        default=(DEGREE + 1) * PERIOD,
        help="[s] in which the fastest law changes its acceleration "
        f"(default: {(DEGREE + 1) * PERIOD:g})",
    )
    parser.add_argument(
        "--posterior",
        type=Path,
        help="a bag, or what `identify --json` wrote of one: tell how probable it is that such a "
        "climber falls",
    )
    parser.add_argument(
        "--climbers",
        type=whole(1, MOST_CLIMBERS),
        default=1000,
        help="that are drawn of the posterior (default: 1000)",
    )
    parser.add_argument(*("--output", "-o"), type=Path, help="directory for a picture and numbers")
    return parser.arguments()


def main() -> None:
    """Check a path."""
    options = parse()
    with failing_in_a_line("check_path") as remarks:
        changes = dict(map(read_argument, options.param))
        trajectory, climber, contact, wall = read(options.params, changes, remarks)
        posterior = (
            posterior_of(options.posterior, options.params, remarks) if options.posterior else None
        )
        asked, law = (climber, contact), None
        found = demands(trajectory, *asked, options.margin, wall)
        numbers = told(found, trajectory, climber.half_track, remarks)
        if options.fastest and trajectory.law.rate > 0:
            best = fastest(trajectory, *asked, options.margin, wall)
            numbers["fastest rate"] = best and best.law.rate
            numbers["fastest duration [s]"] = best and best.duration
        if options.fastest:
            law, numbers["fastest law"] = _fastest_law(options, trajectory, *asked, wall)
        if posterior:
            runs = options.climbers
            events = chances(trajectory, *asked, posterior, runs, wall=wall)
            numbers["posterior"] = told_of(posterior, events, runs)
        print(printable("\n".join(lines(numbers, found.is_whole))))
        if options.output:
            from climber_uk.path_check.figure import draw  # matplotlib, which takes a second

            options.output.mkdir(parents=True, exist_ok=True)
            write_whole(options.output / "check_path.json", json.dumps(numbers, indent=1) + "\n")
            print(printable(str(draw(found, options.output / "check_path.png"))))
            if law:
                planner = read_planner(options.params, f"/{PLANNER}", changes)
                files = {name: str(Path(planner[name]).absolute()) for name in PATHS & {*planner}}
                changes |= files
                if isinstance(trajectory.shape, Lanes):  # the table is of lanes that begin there
                    begin = trajectory.shape.start_x, trajectory.shape.start_y
                    changes |= dict(zip(("lanes.start_x", "lanes.start_y"), begin, strict=True))
                print(printable(str(write_fastest(law, options.params, changes, options.output))))
    sys.exit(not numbers["feasible"])
