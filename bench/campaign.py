"""Time and memory of `campaign config/campaign.yaml`, by runs and processes.

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

ROOT = Path(__file__).parents[1]
MEBIBYTE = 1 << 10  # KiB


def main() -> None:
    """Print a row of the table for each campaign."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--file", type=Path, default=ROOT / "config" / "campaign.yaml")
    parser.add_argument("--runs", type=int, nargs="+", default=[10_000, 100_000])
    parser.add_argument("--jobs", type=int, nargs="+", default=[2])
    options = parser.parse_args()
    print("| runs | processes | time, s | runs a second | largest process, MiB | all, MiB |")
    print("|---|---|---|---|---|---|")
    for jobs in options.jobs:
        for runs in options.runs:
            taken, largest, together = measured(options.file, runs, jobs)
            each = f"{runs / taken:.0f} | {largest:.0f} | {together:.0f}"
            print(f"| {runs} | {jobs} | {taken:.0f} | {each} |", flush=True)


def measured(file: Path, runs: int, jobs: int) -> tuple[float, float, float]:
    """Time [s], peak memory [MiB] of a process and of all together."""
    largest = together = 0.0
    with TemporaryDirectory() as output:
        command = [Path(sys.executable).parent / "campaign", file, "--output", output]
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
