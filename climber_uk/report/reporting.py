"""What `analyze_bag` and `compare_bags` share: their options, what they read, what they write."""

import sys
from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from climber_uk.bags.recorded_run import read_runs
from climber_uk.bags.topics import Topics
from climber_uk.closed_loop.node_parameters import read_parameters
from climber_uk.mechanics.climber import Climber
from climber_uk.messages.topics import CONTROLLER
from climber_uk.parameters.parameter_file import Values
from climber_uk.report import figures
from climber_uk.report.condition import Condition
from climber_uk.report.metrics import Case
from climber_uk.report.outputs import add_remap, check_writable, failing_in_a_line, output
from climber_uk.report.page import page
from climber_uk.report.tables import Column, to_csv, to_json
from climber_uk.system.command_line import Parser, between, printable

OUTPUTS = {"analyze_bag": "analysis", "compare_bags": "comparison"}
FAILED = 1  # exit status
OUTPUT_HELP = (
    "directory for report.html and metrics.* (default: a new one in the first bag, or beside it)"
)
EPILOG = (
    "exit status: 0, also if a part could not be read (a line says which); 1 if a --fail-if holds, "
    "or its metric is not known; 2 if a bag cannot be read or an argument is wrong"
)


def parser(name: str, description: str | None) -> Parser:
    """Parser of the options that both commands have."""
    made = Parser(name, description, EPILOG)
    made.add_argument("--output", "-o", type=Path, help=OUTPUT_HELP)
    made.add_argument(
        "--figures", type=Path, help="directory for the figures, as PNG (default: no)"
    )
    made.add_argument(
        "--namespace",
        action="append",
        default=[],
        help="of a climber, may be repeated (default: all that have odometry)",
    )
    add_remap(made)
    made.add_argument(
        "--params", type=Path, help="parameter file of the nodes (default: those in the bag)"
    )
    made.add_argument(
        "--settled",
        type=between(0.0, 1e6),
        default=0.01,
        metavar="METRES",
        help="distance from the reference below which a run has settled (default: %(default)s)",
    )
    made.add_argument(
        "--fail-if",
        type=_condition,
        action="append",
        default=[],
        metavar="CONDITION",
        help="as in 'rms_cross_track>0.01', in SI units; may be repeated",
    )
    return made


def _condition(text: str) -> Condition:
    try:
        return Condition.read(text)
    except ValueError as error:
        raise ArgumentTypeError(str(error)) from None


def report(
    command: str,
    title: str,
    bags: Sequence[Path],
    options: Namespace,
    text: Callable[[Sequence[Column]], str],
) -> int:
    """Print `text` of some bags and write their metrics; return the exit status."""
    with (
        failing_in_a_line(command) as remarks,
        output(bags[0], OUTPUTS[command], options.output) as directory,
    ):
        if options.figures:
            check_writable(options.figures)
        columns = _read(bags, options, remarks)
        remarks += dict.fromkeys(f"{c.bag}: {loss}" for c in columns for loss in c.losses)
        print(printable(text(columns)))
        for path in _write(title, columns, directory, options.figures):
            print(printable(str(path)))
    failures = [condition.failure(c) for condition in options.fail_if for c in columns]
    for failure in filter(None, failures):
        print(f"{command}: failed: {printable(failure)}", file=sys.stderr)
    return FAILED if any(failures) else 0


def _read(bags: Sequence[Path], options: Namespace, remarks: list[str]) -> list[Column]:
    names = Topics.parse(options.remap)
    columns: list[Column] = []
    for bag, label in zip(bags, _labels(bags), strict=True):
        runs, losses = read_runs(
            bag,
            names,
            options.namespace,
            parameters=partial(_parameters, options.params, remarks) if options.params else None,
            all_of_them=bool(options.fail_if),
        )
        for run in runs:
            parts = [part for part in (label, run.name, run.part) if part] or ["climber"]
            case = Case(run, settled=options.settled)
            base = columns[0] if columns and len(bags) > 1 else None
            columns.append(Column("/".join(parts), str(bag), case, losses, base))
    return columns


def _parameters(file: Path, remarks: list[str], namespace: str) -> dict[str, Any]:
    found = read_parameters(file, f"/{namespace}/{CONTROLLER}".replace("//", "/"), remarks)
    Values(found).read(Climber)  # which says what is wrong with them
    return found


def _labels(bags: Sequence[Path]) -> list[str]:
    """Labels of bags: the last parts of their paths, as many as it takes; '' for a single bag."""
    if len(bags) == 1:
        return [""]
    paths = [bag.absolute().parts for bag in bags]
    for count in range(1, max(map(len, paths))):
        names = ["/".join(parts[-count:]) for parts in paths]
        if len(set(names)) == len(names):
            return names
    return [f"{number}: {bag}" for number, bag in enumerate(bags, start=1)]


def _write(
    title: str, columns: Sequence[Column], directory: Path, pictures: Path | None
) -> list[Path]:
    images = figures.draw([(column.label, column.case.run) for column in columns])
    texts = {
        "report.html": page(title, columns, images),
        "metrics.csv": to_csv(columns),
        "metrics.json": to_json(columns),
    }
    coded = {name: text.encode("utf-8", "backslashreplace") for name, text in texts.items()}
    written = {directory / name: data for name, data in coded.items()}
    if pictures is not None:
        written |= {pictures / f"{name}.png": image for name, image in images.items()}
    for path, data in written.items():
        path.write_bytes(data)
    return list(written)
