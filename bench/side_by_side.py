"""Measured in turns, A B C A B C …, in one process: times and their ratios, with quartiles."""

import platform
import time
from collections.abc import Callable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from climber_uk.mechanics import Array

PACKAGES = "numpy", "scipy", "mujoco", "pin", "cffi"


def timed(
    function: Callable[[], object], clock: Callable[[], float] = time.process_time
) -> Callable[[], float]:
    """The function, giving the time that it takes [s].

    It is the processor's, that of all threads, which other processes disturb least; for what
    threads are good for, take `time.perf_counter`.
    """

    def run() -> float:
        start = clock()
        function()
        return clock() - start

    return run


def in_turns(
    ways: Mapping[str, Callable[[], float]], rounds: int, warm: int = 0
) -> dict[str, Array]:
    """Times (rounds,) that each way gives, after one round, and `warm` runs, that do not count."""
    times = [
        [[run() for _ in range(warm + 1)][-1] for run in ways.values()] for _ in range(rounds + 1)
    ]
    return dict(zip(ways, np.array(times[1:]).T, strict=True))


def table(
    title: str, times: Mapping[str, Array], unit: str, number: Callable[[Array], Array]
) -> None:
    """Print median and quartiles of the `number` in `unit` that times [s] mean, and of ratios.

    A ratio is how many times as long a way takes as the first one does in the same round.
    """
    first = next(iter(times.values()))
    print(f"\n{title:<54}{unit:>10}{'quartiles':>20}{'ratio':>9}{'quartiles':>18}")
    for name, of_each in times.items():
        print(f"{name:<54}{_spread(number(of_each), 10, 20)}{_spread(of_each / first, 9, 18)}")


def rate(time: Array) -> Array:
    """Climber-steps a second, in millions, of the time for one."""
    return 1e-6 / time


def _spread(values: Array, median_width: int, quartiles_width: int) -> str:
    low, median, high = np.quantile(values, [0.25, 0.5, 0.75])
    quartiles = f"{low:.4g} … {high:.4g}"
    return f"{median:>{median_width}.4g}{quartiles:>{quartiles_width}}"


def robot() -> str:
    """What all this ran on."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    here = f"{names[0] if names else platform.robot()}, {len(names)} cores"
    return f"{here}; Python {platform.python_version()}, {', '.join(map(_versioned, PACKAGES))}"


def _versioned(package: str) -> str:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:
        return f"no {package}"
