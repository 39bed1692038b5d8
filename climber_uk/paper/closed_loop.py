"""The paper's scenario through the three nodes: `run_demo` in lock-step, and its bag read."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from climber_uk.bags.recorded_run import read_run
from climber_uk.bags.run import RecordedRun
from climber_uk.system.processes import dies_with_me

CONFIG = "config/paper.yaml"
TIMEOUT = 100.0  # [s]


def record() -> RecordedRun | str:
    """The recorded run, or a message why there is none."""
    if importlib.util.find_spec("rclpy") is None:
        return "rclpy is not installed"
    run_demo = Path(sys.argv[0]).parent / "run_demo"
    config = find_config()
    for file, what in ((run_demo, f"{run_demo}"), (config, CONFIG)):
        if file is None or not file.is_file():
            return f"{what} is not there"
    with TemporaryDirectory(prefix="climber_paper_") as scratch:
        output = Path(scratch) / "demo"
        command = [str(run_demo), "--config", str(config), "--output", str(output)]
        try:
            subprocess.run(
                command, check=True, capture_output=True, timeout=TIMEOUT, preexec_fn=dies_with_me()
            )
            return read_run(output / "bag")
        except subprocess.CalledProcessError as error:
            return f"run_demo: {error.stderr.decode(errors='replace').strip()}"
        except (subprocess.TimeoutExpired, OSError, ValueError) as error:
            return f"run_demo: {error}"


def find_config() -> Path | None:
    """Path of the scenario's file, installed or in the source tree; None if there is none."""
    installed = [*os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep), sys.prefix]
    shares = [Path(prefix) / "share" / "climber_uk" for prefix in installed if prefix]
    candidates = [share / CONFIG for share in (*shares, Path(__file__).parents[2])]
    return next((file for file in candidates if file.is_file()), None)
