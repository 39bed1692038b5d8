"""Time and memory of `campaign config/campaign.yaml`, by runs and processes.

With `--made-up` of the report alone, of results that were drawn from those of 4096 runs.
The largest sum, and the largest of one process, of proportional set sizes, five times a second.
"""

import argparse
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from climber_uk.campaign.campaign import Campaign, read
from climber_uk.campaign.parts import PART, Store, computed

ROOT = Path(__file__).parents[1]
MEBIBYTE = 1 << 10  # KiB


def main() -> None:
    """Print a row of the table for each campaign."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--file", type=Path, default=ROOT / "config" / "campaign.yaml")
    parser.add_argument("--runs", type=int, nargs="+", default=[10_000, 100_000])
    parser.add_argument("--jobs", type=int, nargs="+", default=[2])
    parser.add_argument("--made-up", action="store_true", help="results, of which to report")
    options = parser.parse_args()
    print("| runs | processes | time, s | runs a second | largest process, MiB | all, MiB |")
    print("|---|---|---|---|---|---|")
    for jobs in options.jobs:
        for runs in options.runs:
            taken, largest, together = measured(options, runs, jobs)
            each = f"{runs / taken:.0f} | {largest:.0f} | {together:.0f}"
            print(f"| {runs} | {jobs} | {taken:.0f} | {each} |", flush=True)


def measured(options: argparse.Namespace, runs: int, jobs: int) -> tuple[float, float, float]:
    """Time [s], peak memory [MiB] of a process and of all together."""
    largest = together = 0.0
    with TemporaryDirectory() as output:
        if options.made_up:
            make_up(read(options.file, runs), Path(output))
        command = [Path(sys.executable).parent / "campaign", options.file, "--output", output]
        begun = time.monotonic()
        with subprocess.Popen(
            [*map(str, command), "--runs", str(runs), "--jobs", str(jobs)],
            stdout=subprocess.DEVNULL,
        ) as process:
            while process.poll() is None:
                sizes = [memory(pid) for pid in family(process.pid)]
                largest, together = max(largest, *sizes), max(together, sum(sizes))
                time.sleep(0.2)
    if process.returncode:
        sys.exit(process.returncode)
    return time.monotonic() - begun, largest / MEBIBYTE, together / MEBIBYTE


def make_up(campaign: Campaign, output: Path) -> None:
    """Keep results of all runs that are those of some of the first ones, at random."""
    store = Store(output, campaign)
    some = computed(campaign, 0, min(PART, campaign.size.runs))
    for part in store.missing:
        rows = np.random.default_rng(part.number).integers(some.num_rows, size=part.runs)
        table = some.take(rows)
        store.keep(part, table.set_column(0, "run", [np.arange(part.runs) + part.first]))


def family(pid: int) -> Iterator[int]:
    """A process, its children, and theirs."""
    yield pid
    with suppress(OSError):
        for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            yield from family(int(child))


def memory(pid: int) -> float:
    """Proportional set size [KiB]; 0 if the process is no more."""
    with suppress(OSError):
        for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
            if line.startswith("Pss:"):
                return float(line.split()[1])
    return 0.0


if __name__ == "__main__":
    main()
