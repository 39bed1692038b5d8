"""`replay_controller BAG`: what the controller would answer to a recorded run, beside what it did.

With other parameters this is what they would change; with the same ones there is no difference.
"""

import argparse
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from climber_uk.bags.bag import open_bag
from climber_uk.bags.joints import WHEELS
from climber_uk.bags.publishing_order import has_publishing_times
from climber_uk.bags.topics import Topics
from climber_uk.closed_loop.node_parameters import read_parameters
from climber_uk.messages.topics import CLOCK, CONTROLLER, PARAMETERS
from climber_uk.parameters.parameter_file import read_argument, refuse_unknown
from climber_uk.replay.recorded_controller import TOPICS, RecordedController
from climber_uk.replay.replay import DEFAULTS, Replay
from climber_uk.replay.torque_comparison import Comparison, compare, summary, table, write_csv
from climber_uk.report.outputs import failing_in_a_line, output, parser_for_bag
from climber_uk.report.plotting import plt, saved
from climber_uk.system.command_line import between, printable


def replayed(options: argparse.Namespace, remarks: list[str]) -> Comparison:
    """Replay a bag; raises `OSError` or `ValueError`, of one line, if that cannot be.

    `remarks` gets what of the bag could not be read, or is not in it, and doubtful parameters.
    """
    namespace = "/" + options.namespace.strip("/") if options.namespace.strip("/") else ""
    file = None
    if options.params:
        file = read_parameters(options.params, f"{namespace}/{CONTROLLER}", remarks)
    given = dict(map(read_argument, options.parameter))
    refuse_unknown(given, DEFAULTS, "the control law")

    def choose(recorded: Mapping[str, Any]) -> dict[str, Any]:
        return {**(recorded if file is None else file), **given}

    topics = [Topics().full(name, namespace) for name in (*TOPICS, CLOCK)]
    with open_bag(options.bag) as bag:
        by_publishing = has_publishing_times(bag, topics)
        recorded = RecordedController(bag, namespace, by_publishing, file)
        if recorded.parameters is None and file is None:
            raise ValueError(
                f"{options.bag} has no message on {namespace}/{PARAMETERS}: give --params FILE"
            )
        remarks += [f"{options.bag}: {loss}" for loss in bag.losses]
        if not by_publishing:
            remarks.append(
                f"{options.bag} does not tell when messages were published: "
                "they are taken in the order of their arrival at the recorder"
            )
        replay = Replay(recorded, namespace, choose)
        replay.run(bag, namespace, by_publishing)
    return compare(recorded, replay)


def draw(found: Comparison, path: Path) -> None:
    """Write both torques of each wheel, and the differences, as a figure."""
    figure, axes = plt.subplots(3, figsize=(8, 8), sharex=True, layout="constrained")
    for number, wheel in enumerate(WHEELS):
        axis = axes[number]
        axis.plot(found.time, found.recorded[:, number], color="0.7", linewidth=4, label="recorded")
        axis.plot(found.time, found.replayed[:, number], linewidth=1, label="replayed")
        axis.set_ylabel(f"{wheel} wheel [N m]")
        axes[2].plot(found.time, found.difference[:, number], linewidth=1, label=wheel)
    axes[2].set(xlabel="time [s]", ylabel="replayed - recorded [N m]")
    for axis in axes:
        axis.grid(alpha=0.3)
        axis.legend(loc="upper right")
    saved(figure, path, 120)


def main() -> None:
    """Print the comparison and write its files."""
    parser = parser_for_bag("replay_controller", __doc__, "replay")
    parser.add_argument("--params", type=Path, help="parameter file (default: as recorded)")
    parser.add_argument(
        *("-p", "--parameter"),
        action="append",
        default=[],
        metavar="NAME:=VALUE",
        help="change one",
    )
    parser.add_argument(
        "--fail-above",
        type=between(0.0, 1e6),
        metavar="TORQUE",
        help="status 1 if a torque differs more [N m]",
    )
    options = parser.arguments()
    with (
        failing_in_a_line("replay_controller") as remarks,
        output(options.bag, "replay", options.output) as directory,
    ):
        found = replayed(options, remarks)
        numbers = summary(found)
        (directory / "replay.json").write_text(json.dumps(numbers, indent=2) + "\n")
        write_csv(found, directory / "torques.csv")
        draw(found, directory / "torques.png")
    print(table(numbers))
    print(printable(f"written: {directory}/replay.json, torques.csv, torques.png"))
    if options.fail_above is not None and found.largest > options.fail_above:
        sys.exit(f"replay_controller: differs by {found.largest:.6g} N m > {options.fail_above:g}")
