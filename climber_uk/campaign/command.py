"""`campaign FILE`: in how many of many runs does the climber fall, or break another limit?

Runs are drawn as FILE says. What was finished is kept: the same command goes on where it ended.
"""

import argparse
import os
import sys
from concurrent.futures import BrokenExecutor, CancelledError
from importlib.util import find_spec
from pathlib import Path

from climber_uk.campaign.campaign import Campaign, read
from climber_uk.report.outputs import failing_in_a_line
from climber_uk.system.command_line import Parser, whole

EXTRA = ["pyarrow", "matplotlib", "tqdm"]  # packages that no node needs


def main() -> None:
    """Run what is missing of a campaign and report its results, or run one run again."""
    options = _options()
    _check_installed(EXTRA + ["distributed"] * bool(options.scheduler))
    output = options.output or Path("campaign_output") / options.file.stem
    try:
        with failing_in_a_line("campaign"):
            campaign = read(options.file, options.runs)
            if options.rerun is None:
                _run(campaign, options, output)
            else:
                from climber_uk.campaign.rerun import rerun

                place = options.output or Path(f"run_{options.rerun}")
                sys.exit(rerun(campaign, options.rerun, place))
    except KeyboardInterrupt:
        sys.exit(f"\ncampaign: interrupted; what was finished is kept in {output}")
    except (BrokenExecutor, CancelledError) as error:
        sys.exit(f"\ncampaign: lost its workers ({error}); what was finished is kept in {output}")


def _options() -> argparse.Namespace:
    parser = Parser("campaign", __doc__)
    parser.add_argument(
        "file", type=Path, help="what is drawn, and the limits: config/campaign.yaml"
    )
    parser.add_argument("--output", "-o", type=Path, help="(default: campaign_output/FILE)")
    parser.add_argument("--runs", type=int, help="how many (default: what the file says)")
    parser.add_argument(
        "--jobs", type=whole(1, 10_000), help="processes (default: one for each core)"
    )
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster to run it on")
    parser.add_argument(
        "--rerun",
        type=whole(0, 2**62),
        metavar="RUN",
        help="run this one again, through the nodes, into a bag (default output: run_RUN)",
    )
    return parser.arguments()


def _check_installed(packages: list[str]) -> None:
    missing = " ".join(name for name in packages if find_spec(name) is None)
    if missing:
        print(f"campaign: not installed: {missing} (pip install {missing})", file=sys.stderr)
        sys.exit(2)


def _run(campaign: Campaign, options: argparse.Namespace, output: Path) -> None:
    from climber_uk.campaign import running
    from climber_uk.campaign.parts import Store

    store = Store(output, campaign)
    if any(store.missing):
        jobs = options.jobs or len(os.sched_getaffinity(0))
        workers = (
            running.cluster(options.scheduler) if options.scheduler else running.processes(jobs)
        )
        with workers as ready:
            running.run_missing(campaign, store, ready)
    # what takes a second to import, and no worker needs
    from climber_uk.campaign import figures, results

    report = results.report(campaign, store, f"{sys.argv[0]} {options.file} --rerun {{}}")
    (output / "report.txt").write_text(report + "\n", encoding="utf-8")
    print(report)
    print("\n".join(str(path) for path in figures.draw(campaign, store, output)))
