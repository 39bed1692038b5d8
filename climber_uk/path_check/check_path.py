"""Tell whether a climber can drive a path, before it does: where what limits it, and what it takes.

The path is that of trajectory_publisher's parameters in a file, the climber that of
uk_torque_controller's. With `--posterior` it tells as well how probable it is that a climber falls
or slips that is known only as well as a bag told (`identify BAG --json FILE`). The status is 1 if
the path asks for more than there is, and 2 if that cannot be told.
"""

import argparse
import json
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

from climber_uk.closed_loop.node_parameters import read_parameters
from climber_uk.control.build import ControllerChoice
from climber_uk.mechanics.adhesion import ADHESION, Attachment, Grip
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.summary import summary
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.trajectory_parameters import TYPES, build_trajectory
from climber_uk.messages.topics import CONTROLLER, PLANNER
from climber_uk.parameters.parameter_file import Values, read_argument, refuse_unknown
from climber_uk.parameters.parameter_paths import located
from climber_uk.path_check.demands import Demands, demands
from climber_uk.path_check.fastest import fastest
from climber_uk.path_check.posterior import Chance, Posterior, chances, read_posterior
from climber_uk.report.outputs import failing_in_a_line, printable
from climber_uk.system.command_line import Parser, between

NAMES = {
    prefix + field.name
    for kind, prefix in TYPES
    for field in fields(kind)  # type: ignore[arg-type]
}
PATHS = {  # parameters that are files
    prefix + field.name
    for kind, prefix in TYPES
    for field in fields(kind)  # type: ignore[arg-type]
    if field.metadata.get("is_path")
}

MOST_CLIMBERS = 1_000_000


def read(
    file: Path, changes: dict[str, Any], remarks: list[str]
) -> tuple[Trajectory, Climber, Attachment]:
    """Path, climber and what holds it, by a parameter file and changes of the path's parameters.

    Raises `ValueError`, also for a name that no part of the path has. `remarks` gets a line on each
    value that can hardly be meant.
    """
    planner = {**read_parameters(file, f"/{PLANNER}", remarks), **changes}
    refuse_unknown(changes, NAMES, "a path")
    words = ["--ros-args", "--params-file", str(file)]
    for name in PATHS & planner.keys() - changes.keys():
        planner[name] = located(planner[name], name, f"/{PLANNER}", words)
    trajectory = build_trajectory(Values(planner).read)
    values = Values(read_parameters(file, f"/{CONTROLLER}", remarks))
    name = values.read(ControllerChoice).adhesion
    attachment = Attachment(
        adhesion=values.read(ADHESION[name], f"{name}."), grip=values.read(Grip)
    )
    return trajectory, values.read(Climber), attachment


def told(found: Demands, trajectory: Trajectory, half_track: float) -> dict[str, Any]:
    """What is found, as numbers by name."""
    about = summary(trajectory, half_track)
    limits: dict[str, Any] = {
        least.name: {"reserve": least.reserve, "at [s]": least.time, "place [m]": least.place}
        for least in found.least()
    }
    return {
        "feasible": all(limit["reserve"] >= 1 for limit in limits.values()),
        "length [m]": about.length,
        "duration [s]": about.duration,
        "fastest [m/s]": about.fastest_speed,
        "energy of the wheels [J]": found.energy,
        "limits": limits,
    }


def lines(numbers: dict[str, Any], is_whole: bool) -> list[str]:
    """The same in words."""
    part = "" if is_whole else ", once around"
    said = [
        f"{numbers['length [m]']:.4g} m, {numbers['duration [s]']:.4g} s, at most "
        f"{numbers['fastest [m/s]']:.3g} m/s, {numbers['energy of the wheels [J]']:.4g} J{part}"
    ]
    for name, limit in sorted(numbers["limits"].items(), key=lambda of: of[1]["reserve"]):
        x, y = limit["place [m]"]
        verdict = "" if limit["reserve"] >= 1 else ": TOO MUCH"
        said.append(
            f"{name}: {limit['reserve']:.3g} times what is asked for, at ({x:.3g}, {y:.3g}) m, "
            f"{limit['at [s]']:.4g} s{verdict}"
        )
    if "fastest rate" in numbers:
        rate = numbers["fastest rate"]
        said.append(
            f"highest rate: {rate:.4g}, in {numbers['fastest duration [s]']:.4g} s"
            if rate
            else "highest rate: none is slow enough"
        )
    said += _probable(numbers.get("posterior", {}))
    return [*said, "feasible" if numbers["feasible"] else "NOT feasible"]


def _count(text: str) -> int:
    """A number of climbers; `ValueError` if it is none."""
    if not (text.isdecimal() and 1 <= int(text) <= MOST_CLIMBERS):
        raise argparse.ArgumentTypeError(f"{text!r} must be an integer from 1 to {MOST_CLIMBERS}")
    return int(text)


def _probable(posterior: dict[str, Any]) -> list[str]:
    """What is drawn, and the probability of each event."""
    if not posterior:
        return []
    drawn = ", ".join(f"{name} {of}" for name, of in posterior["drawn"].items())
    said = [f"{posterior['climbers']} climbers drawn: {drawn}"]
    if posterior["not told"]:
        said.append(f"not told by the bag, so as in the parameter file: {posterior['not told']}")
    for event, of in posterior["events"].items():
        low, high = of["95 %"]
        said.append(f"{event}: {of['probability']:.2%} (95 %: {low:.2%} to {high:.2%})")
    return said


def _told(posterior: Posterior, events: dict[str, Chance], runs: int) -> dict[str, Any]:
    """What the posterior makes probable, as numbers by name."""
    return {
        "climbers": runs,
        "drawn": {name: str(of) for name, of in posterior.items() if of},
        "not told": ", ".join(name for name, of in posterior.items() if not of),
        "events": {event: chance.numbers for event, chance in events.items()},
    }


def main() -> None:
    """Check a path."""
    parser = Parser("check_path", __doc__)
    parser.add_argument("--params", type=Path, required=True, help="parameter file of the nodes")
    parser.add_argument(
        *("-p", "--param"),
        action="append",
        default=[],
        type=read_argument,
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
        "--fastest", action="store_true", help="tell the highest rate at which all limits hold, too"
    )
    parser.add_argument(
        "--posterior",
        type=Path,
        help="what `identify --json` wrote: tell how probable it is that such a climber falls",
    )
    parser.add_argument(
        "--climbers",
        type=_count,
        default=1000,
        help="that are drawn of the posterior (default: 1000)",
    )
    parser.add_argument(*("--output", "-o"), type=Path, help="directory for a picture and numbers")
    options = parser.arguments()
    with failing_in_a_line("check_path") as remarks:
        trajectory, climber, attachment = read(options.params, dict(options.param), remarks)
        posterior = read_posterior(options.posterior) if options.posterior else None
        found = demands(trajectory, climber, attachment, options.margin)
        numbers = told(found, trajectory, climber.half_track)
        if options.fastest:
            best = fastest(trajectory, climber, attachment, options.margin)
            numbers["fastest rate"] = best and best.law.rate
            numbers["fastest duration [s]"] = best and best.duration
        if posterior:
            runs = options.climbers
            events = chances(trajectory, climber, attachment, posterior, runs)
            numbers["posterior"] = _told(posterior, events, runs)
        print("\n".join(lines(numbers, found.is_whole)))
        if options.output:
            from climber_uk.path_check.figure import draw  # matplotlib, which takes a second

            options.output.mkdir(parents=True, exist_ok=True)
            (options.output / "check_path.json").write_text(json.dumps(numbers, indent=1) + "\n")
            print(printable(str(draw(found, options.output / "check_path.png"))))
    sys.exit(not numbers["feasible"])
