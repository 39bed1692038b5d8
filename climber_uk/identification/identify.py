"""`identify BAG`: mass, inertia, friction and geometry of the climber that a bag was recorded of.

`identify --plan FILE` writes a parameter file with a trajectory that shows them well. The status is
1 if a parameter is not determined, and 2 if the bag or an argument is no good.
"""

import argparse
import json
import sys
from collections import Counter
from dataclasses import fields, replace
from os.path import realpath
from pathlib import Path
from typing import Any

from climber_uk.bags.run_reader import RunReader
from climber_uk.bags.topics import Topics
from climber_uk.closed_loop.node_parameters import names_of, read_parameters
from climber_uk.control.timing import Timing
from climber_uk.identification import excitation
from climber_uk.identification import figure as identification_figure
from climber_uk.identification.estimation import identify
from climber_uk.identification.identified import NAMES
from climber_uk.identification.integral_equations import Cut
from climber_uk.identification.recorded_motion import TOPICS, read_motion
from climber_uk.identification.recorded_site import assumed_away, differences, site_of
from climber_uk.identification.report import changes, label_of, missing, remarks, rows, table
from climber_uk.mechanics.climber import Climber
from climber_uk.messages.topics import CONTROLLER, ODOMETRY, PLANNER, PLANT
from climber_uk.parameters.changed_parameters import write_changed
from climber_uk.parameters.parameter_file import Values, given, read_sections
from climber_uk.parameters.text_file import write_whole
from climber_uk.report.outputs import check_writable, failing_in_a_line
from climber_uk.system.command_line import Parser, between

AT_REST = {"initial_speed": 0.0, "initial_yaw_rate": 0.0}


def identify_bag(options: argparse.Namespace, doubtful: list[str]) -> list[str]:
    """Print and write the parameters; return a sentence on each that is not determined.

    `doubtful` gets what of the bag could not be read, and what can hardly be meant in the file.
    Raises `OSError` or `ValueError`.
    """
    cut = Values(vars(options)).read(Cut)
    file = parameters_of(CONTROLLER, options, doubtful)
    plant = plant_of(options, doubtful)
    names = Topics({ODOMETRY: options.odometry})
    reader, climber = RunReader.read(options.bag, names, options.namespace.strip("/"), TOPICS)
    recorded = climber.first_parameters
    parameters = {**recorded, **file}
    assumed, site = Values(parameters).read(Climber), site_of(parameters, plant)
    reader.check_one_run(climber)
    then = {**file, **recorded}
    delay = Values(then).read(Timing).transport_delay if options.delay is None else options.delay
    motion, unfit = read_motion(reader, climber, then, assumed.suction_pressure, delay)
    doubtful += [f"{options.bag}: {loss}" for loss in reader.bag.losses]
    found = identify(motion, assumed, cut, site)
    print(table(found, assumed), end="")
    print(*remarks(found), sep="\n")
    for warning in (*differences(file, recorded, site), *assumed_away(parameters, plant)):
        print(warning)
    if unfit:
        print(f"{unfit} unfit messages were left out")
    if options.json:
        text = json.dumps(list(rows(found, assumed)), indent=2)
        write_whole(options.json, text + "\n")
    if options.output:
        write_changed(options.params, changes(found, assumed), options.output)
    if options.figure:
        identification_figure.draw(motion, assumed, found, options.figure)
    return list(missing(found))


def plan(options: argparse.Namespace, doubtful: list[str]) -> None:
    """Write a trajectory, with all that is in the parameter file; raises `ValueError`."""
    parameters = parameters_of(PLANNER, options, doubtful)
    origin = parameters.get("origin_x", 0.0), parameters.get("origin_y", 0.0)
    controller = parameters_of(CONTROLLER, options, doubtful)
    site = site_of(controller, plant_of(options, doubtful))
    assumed = Values(controller).read(Climber)
    if not site.has_seal:
        assumed = replace(assumed, seal_friction_coefficient=0.0)
    limits = Values(vars(options)).read(excitation.ExcitationLimits)
    best = excitation.plan(assumed, limits, origin, site)
    x, y, heading = best.trajectory.at(0.0).pose.tolist()
    changed = {
        PLANNER: best.parameters,
        PLANT: {"initial_x": x, "initial_y": y, "initial_heading": heading, **AT_REST},
        "run_demo": {"duration": best.trajectory.duration},
    }
    write_changed(options.params, changed, options.plan)
    print(
        f"{best.name}, {best.trajectory.duration:.1f} s, from ({x:.3f}, {y:.3f}) {heading:.3f} rad"
    )
    for name, share, sought in zip(
        NAMES, best.expected.uncertainty, excitation.SOUGHT, strict=True
    ):
        if sought:
            print(f"{label_of(name, site)[0]} ± {share:.2%}")


def parameters_of(node: str, options: argparse.Namespace, doubtful: list[str]) -> dict[str, Any]:
    """Parameters of a node in the parameter file, by name; empty without a file."""
    name = Topics().full(node, options.namespace.strip("/"))
    return read_parameters(options.params, name, doubtful) if options.params else {}


def plant_of(options: argparse.Namespace, doubtful: list[str]) -> dict[str, Any]:
    """Parameters of the simulator in the parameter file, by name; empty if it has none."""
    name = Topics().full(PLANT, options.namespace.strip("/"))
    its = given(read_sections(options.params), name) if options.params else {}
    return parameters_of(PLANT, options, doubtful) if its.keys() & names_of(PLANT) else {}


def parse() -> argparse.Namespace:
    """Options of the command line."""
    parser = Parser("identify", __doc__)
    parser.add_argument("bag", type=Path, nargs="?", help="rosbag2 directory, MCAP or sqlite3")
    parser.add_argument("--params", type=Path, help="parameter file of the nodes as they are")
    parser.add_argument("--namespace", default="", help="of the climber (default: none)")
    parser.add_argument("--odometry", default=ODOMETRY, help=f"topic (default: {ODOMETRY})")
    parser.add_argument(
        "--delay", type=between(0.0, 10.0), help="[s] of torques, unless joint_states has them"
    )
    parser.add_argument("--output", "-o", type=Path, help="write a parameter file for the nodes")
    parser.add_argument("--json", type=Path, help="write the table as JSON")
    parser.add_argument("--figure", type=Path, help="write a picture of the fit, PNG")
    parser.add_argument(
        "--plan", type=Path, help="write a parameter file with a trajectory instead"
    )
    for kind, of in (Cut, "of a bag"), (excitation.ExcitationLimits, "of a plan"):
        for field in fields(kind):
            rule, name = field.metadata, "--" + field.name.replace("_", "-")
            meaning = f"{of}: {rule['description']} [{rule['unit']}] (default: {field.default:g})"
            parser.add_argument(name, type=float, default=field.default, help=meaning)
    options = parser.arguments()
    if (options.bag is None) == (options.plan is None):
        parser.error("want a bag, or --plan")
    return options


def main() -> None:
    """Identify, or plan."""
    options = parse()
    untold: list[str] = []
    written = list(filter(None, (options.output, options.json, options.figure, options.plan)))
    with failing_in_a_line("identify") as doubtful:
        places = Counter(map(realpath, filter(None, (*written, options.bag, options.params))))
        for file in written:
            if places[realpath(file)] > 1:
                raise ValueError(f"{file} is given twice, and would be written over")
            if file.is_dir():
                raise ValueError(f"{file} is a directory, and would be a file")
            check_writable(file.parent)
        if options.plan:
            plan(options, doubtful)
        else:
            untold = identify_bag(options, doubtful)
    if untold:
        sys.exit(f"identify: {'; '.join(untold)}")
