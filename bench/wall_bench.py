"""`python bench/wall_bench.py [--controller COMMAND]`: a controller of anybody's, row by row.

The rows are in wall_bench.yaml. Each is run through the nodes in lock-step, so it comes out the
same to the last bit, however busy the machine is: the last column is a digest of the true way.
"""

import argparse
import hashlib
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from climber_uk.bags.recorded_run import read_run
from climber_uk.bags.run import RecordedRun
from climber_uk.messages.topics import CONTROLLER, PLANT, TRUTH
from climber_uk.parameters.changed_parameters import write_changed
from climber_uk.parameters.parameter_file import load

HERE = Path(__file__).parent
CONFIGS = HERE.parent / "config"
DURATION, UNTIL = 20.0, 19.5  # [s] of a run, and of it that counts: the end of a bag is anywhere
HEAD = "RMS [mm]", "max [mm]", "at the end", "torque change", "way"


def drive(changes: dict[str, Any], controller: str, folder: Path) -> RecordedRun:
    """Drive a row's wall; raises `CalledProcessError` if a process ends."""
    config = folder / "row.yaml"
    wall = {name: value for name, value in changes.items() if name not in ("config", "told")}
    told = {k: v for k, v in wall.items() if k == "control_period"} | changes.get("told", {})
    base = CONFIGS / changes.get("config", "climber.yaml")
    write_changed(base, {PLANT: wall, CONTROLLER: told}, config)
    words = ["--config", config, "--output", folder / "run", "--duration", str(DURATION)]
    words += ["--controller", controller] if controller else []
    subprocess.run(
        [Path(sys.executable).parent / "run_demo", *words], check=True, stdout=subprocess.DEVNULL
    )
    return read_run(folder / "run" / "bag")


def numbers(run: RecordedRun) -> list[str]:
    """The columns of `HEAD`, of the part of a run that counts."""
    truth = run.recorded[TRUTH]
    counts = run.seconds(truth) <= UNTIL
    distance = 1e3 * run.truth_distance[counts]
    torques = run.torques[run.seconds(run.commands) <= UNTIL]
    way = hashlib.sha256(truth.values[counts, :3].tobytes()).hexdigest()[:8]
    rms = np.sqrt(np.nanmean(distance**2))
    change = np.sqrt(np.mean(np.diff(torques, axis=0) ** 2))
    sizes = rms, np.nanmax(distance), distance[-1], change
    return [*(f"{size:.3g}" for size in sizes), way]


def main() -> None:
    """Print a line for each row."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--controller", default="", help="its command (default: ours)")
    parser.add_argument("--only", nargs="+", help="of the rows, those that begin so")
    options = parser.parse_args()
    rows = load((HERE / "wall_bench.yaml").read_text())
    if options.only:
        rows = {name: row for name, row in rows.items() if name.startswith(tuple(options.only))}
    if not rows:
        parser.error(f"no row begins with {' or '.join(options.only)}")
    print(f"{'':36}" + "".join(f"{name:>15}" for name in HEAD))
    for name, changes in rows.items():
        with TemporaryDirectory() as folder:
            try:
                run = drive(changes, options.controller, Path(folder))
            except subprocess.CalledProcessError as error:  # run_demo has said why
                sys.exit(f"wall_bench: {name}: run_demo ended with status {error.returncode}")
        print(f"{name:36}" + "".join(f"{text:>15}" for text in numbers(run)), flush=True)


if __name__ == "__main__":
    main()
