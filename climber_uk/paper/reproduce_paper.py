"""`reproduce_paper --output DIR`: every figure and number of Xu & Liu (2017), and what they miss.

Writes the figures as printed and consistent, comparison.md, attempts.md and drift.md (each also as
CSV), drift.png and off_constraint.png. All that takes long runs in processes of its own.
"""

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from climber_uk.paper import attempts, figures, motion, table
from climber_uk.paper.study import (
    BOTH,
    CONSISTENT,
    FULL,
    OFF_DURATION,
    OFF_STEP,
    QUICK,
    Results,
    StudyExtent,
    compute,
    jobs,
)
from climber_uk.report.outputs import check_writable, failing_in_a_line
from climber_uk.report.tables import markdown
from climber_uk.system.command_line import Parser
from climber_uk.system.workers import workers

LEFT_OUT = "left out by --quick"
DRIFT_COLUMNS = (
    *("method", "integrator", "0 to end [m]", "first tenth [m]", "last tenth [m]"),
    "side slip of v, 20 s [m/s]",
)


def comparison(results: Results, extent: StudyExtent) -> list[tuple[str, ...]]:
    """Rows of the comparison's table, the climber under the torques (25) included, as text."""
    tight = f"tolerance {extent.tolerance[0]:g}"
    named = {
        "as printed": f"as printed, {tight}",
        "default": "as printed, default tolerance 1e-3",
        "euler": "as printed, semi-implicit Euler 10 ms",
    }
    rows = [
        table.row(f"{said}, {name}", results.get((key, name), LEFT_OUT))
        for key, said in named.items()
        for name in BOTH
    ]
    driven = motion.driven_by(CONSISTENT, results["as printed", "(30)"], extent.step)
    rows += [
        table.row("torques of (25) fed to the climber", driven),
        table.row("consistent, uncorrected (26)", results["consistent", "(26)"]),
        table.row("consistent, corrected (30)", results["consistent", "(30)"]),
        table.row("consistent τ(t), plant open-loop, RK4 5 ms", results["open loop",]),
        table.row("closed loop through the nodes", results.get(("nodes",), LEFT_OUT)),
    ]
    return [table.PRINTED_UNCORRECTED, table.PRINTED_CORRECTED, *rows]


def drift_cells(results: Results, extent: StudyExtent) -> list[tuple[str, ...]]:
    """Rows of the drift study's table, as text."""
    integrators = {"step": "RK4 {:g} s", "variant": "RK4 {:g} s", "tolerance": "RK45 {:g}"}
    end = extent.drift_time
    cells = []
    for key in jobs(extent):
        kind, *rest = key
        if kind in integrators:
            method, fineness = rest
            name, spans = integrators[kind].format(fineness), ((0, end), (0, end / 10))
        elif kind == "start":
            (method,) = rest
            name, end_of_run = f"off the constraint, RK4 {OFF_STEP:g} s", OFF_DURATION
            spans = ((0, end_of_run), (0, end_of_run / 10))
        else:
            continue
        last = 0.9 * spans[0][1], spans[0][1]
        run = results[key]
        numbers = (*(run.window(*span) for span in (*spans, last)), run.slip_at(OFF_DURATION))
        cells.append((method, name, *(f"{number:.3g}" for number in numbers)))
    return cells


def write(
    pool: ProcessPoolExecutor, results: Results, extent: StudyExtent, directory: Path
) -> list[Path]:
    """Write all tables and figures, and print the tables."""
    sets = {"as_printed": "as printed", "as_printed_euler": "euler", "consistent": "consistent"}
    drawn = [
        pool.submit(figures.draw, name, results[key, "(26)"], results[key, "(30)"], directory)
        for name, key in sets.items()
    ]
    tried = [results["attempt", name] for name in extent.attempts]
    drifted = drift_cells(results, extent)
    paths = []
    for name, columns, cells in (
        ("comparison", table.COLUMNS, comparison(results, extent)),
        ("attempts", attempts.COLUMNS, tried),
        ("drift", DRIFT_COLUMNS, drifted),
    ):
        print(f"\n{name}\n{markdown(columns, cells)}")
        paths += table.write(directory, name, columns, cells)
    runs = {
        kind: {key[1:]: results[key] for key in jobs(extent) if key[0] == kind}
        for kind in ("step", "tolerance", "start")
    }
    paths.append(
        figures.draw_drift(runs["step"], runs["tolerance"], extent.drift_steps[-1], directory)
    )
    starts = {method: run for (method,), run in runs["start"].items()}
    paths.append(figures.draw_starts(starts, directory))
    return [*paths, *(path for future in drawn for path in future.result())]


def main() -> None:
    """Compute, print and write everything."""
    parser = Parser("reproduce_paper", __doc__)
    parser.add_argument("--output", "-o", type=Path, default=Path("paper_output"), help="directory")
    parser.add_argument("--quick", action="store_true", help="coarser, shorter, in part")
    options = parser.arguments()
    extent = QUICK if options.quick else FULL
    # matrices of 3 by 3 gain nothing from threads
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        with failing_in_a_line("reproduce_paper"):
            check_writable(options.output)
            with workers(os.cpu_count()) as pool:
                results = compute(pool, jobs(extent))
                paths = write(pool, results, extent, options.output)
    except KeyboardInterrupt:
        sys.exit("reproduce_paper: interrupted")
    print(f"{len(paths)} files in {options.output}")


if __name__ == "__main__":
    main()
