"""`localize BAG`: where the climber of a bag was, by the filter of `wall_odometry`.

Forwards, as the node would have told it with these parameters if no fix had come late, and
backwards, by all that the bag has. Writes two trajectories, numbers and a picture.
"""

import argparse
import json
from dataclasses import fields
from pathlib import Path
from typing import Any

from climber_uk.bags.bag import open_bag
from climber_uk.bags.topics import Topics
from climber_uk.closed_loop.node_parameters import NODES_ONLY, doubts
from climber_uk.localization.options import LocalizationOptions
from climber_uk.localization.sensor_frames import SensorFrames
from climber_uk.messages.names import Names
from climber_uk.messages.topics import LOCALIZATION
from climber_uk.parameters.parameter_file import Values, read_argument, read_file, refuse_unknown
from climber_uk.replay import localization_figure
from climber_uk.replay.localized import Localized, localized
from climber_uk.replay.recorded_sensors import RecordedSensors, read_sensors
from climber_uk.report.export_tum import lines
from climber_uk.report.outputs import failing_in_a_line, output, parser_for_bag
from climber_uk.system.command_line import printable

MOST_REMARKS = 10  # that are printed


def parameters_of(
    options: argparse.Namespace, namespace: str, remarks: list[str]
) -> dict[str, Any]:
    """Parameters of the node by name; raises `ValueError` naming one that it does not have.

    `remarks` gets a line on each value of the file that can hardly be meant.
    """
    name = Topics().full(LOCALIZATION, namespace)
    kinds = LocalizationOptions, SensorFrames, Names
    known = {field.name: field for kind in kinds for field in fields(kind)}
    parameters = {}
    if options.params:
        parameters = read_file(options.params, name, known.keys() | NODES_ONLY)
        remarks += doubts(options.params, parameters, known)
    changes = dict(map(read_argument, options.parameter))
    refuse_unknown(changes, known, LOCALIZATION)
    return {**parameters, **changes}


def localize(
    bag: Path, namespace: str, values: Values, remarks: list[str]
) -> tuple[RecordedSensors, Localized]:
    """Sensors of a bag, and what comes of them; raises as the parts do.

    `remarks` gets what of the bag could not be read.
    """
    names, frames = values.read(Names), values.read(SensorFrames)
    with open_bag(bag) as opened:
        sensors = read_sensors(opened, namespace, names, frames)
        remarks += [f"{bag}: {loss}" for loss in opened.losses]
    return sensors, localized(sensors, values.read(LocalizationOptions))


def table(sensors: RecordedSensors, found: Localized) -> str:
    """What comes of it, in lines."""
    numbers = found.numbers()
    width = max(map(len, numbers))
    told = [f"{name.ljust(width)}  {value:.4g}" for name, value in numbers.items()]
    told += [f"refused {count} times: {why}" for why, count in sensors.refused.most_common()]
    told += found.remarks[:MOST_REMARKS]
    if len(found.remarks) > MOST_REMARKS:
        told.append(f"and {len(found.remarks) - MOST_REMARKS} more")
    return "\n".join(told)


def main() -> None:
    """Localize the climber of a bag."""
    parser = parser_for_bag("localize", __doc__, "localization")
    parser.add_argument("--params", type=Path, help="parameter file with the node's parameters")
    parser.add_argument(
        *("--parameter", "-p"),
        action="append",
        default=[],
        metavar="NAME:=VALUE",
        help="a parameter of the node; may be repeated",
    )
    options = parser.arguments()
    namespace = options.namespace.strip("/")
    with (
        failing_in_a_line("localize") as remarks,
        output(options.bag, "localization", options.output) as directory,
    ):
        values = Values(parameters_of(options, namespace, remarks))
        sensors, found = localize(options.bag, namespace, values, remarks)
        print(printable(table(sensors, found)))
        for name, estimates in (("forward", found.forward), ("smoothed", found.smoothed)):
            (directory / f"{name}.tum").write_text(lines((found.stamps, estimates.mean[:, :3])))
        text = json.dumps(
            {"numbers": found.numbers(), "refused": sensors.refused, "remarks": found.remarks},
            indent=1,
            ensure_ascii=False,
        )
        (directory / "localization.json").write_text(text + "\n", encoding="utf-8")
        localization_figure.draw(sensors, found, directory / "localization.png")
        print(printable(str(directory)))
