"""How probable it is that a climber falls, or slips, on a path: by what `identify` told of it.

Climbers are drawn at random: each parameter from the normal distribution of which identify's
interval is the 95 %, each by itself; what a bag did not tell is as in the parameter file. Each is
asked for what it takes to be exactly on the path (`demands`).
"""

import json
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact, is_pulled_off
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.wall import PLANE, Wall
from climber_uk.parameters.text_file import text_of
from climber_uk.path_check.demands import Resistance, looked_at, reserves
from climber_uk.report.proportion import wilson
from climber_uk.system.processes import dies_with_me

HALF_WIDTH = 1.959963984540054  # standard deviations, of a 95 % interval
OF_CLIMBER = (
    *("mass", "seal_friction_coefficient", "rotor_inertia", "yaw_inertia"),
    *("wheel_radius", "half_track"),
)
RESISTING = {  # parameters of identify by those of `Resistance`
    "rolling": "rolling_friction",
    "viscous": "viscous_friction",
    "turning": "turning_friction",
    "turning_viscous": "turning_resistance",
}
OF_ODOMETRY = ("effective_half_track",)
POSITIVE = {field.name for field in fields(Climber) if field.metadata["above"] == 0}
LEAST = 1e-3  # of the estimate, which is drawn
BAG = re.compile(r"\.(mcap|db3)(\.\w+)?$")  # names of files that are one
# a tool is no library of another
IDENTIFY = "from climber_uk.executables import identification; identification.identify()"
AT_ONCE = 2_000_000  # numbers: climbers by times


class Interval(NamedTuple):
    """What is told of a parameter."""

    estimate: float
    half_width: float  # of the 95 % interval
    unit: str

    def __str__(self) -> str:
        return f"{self.estimate:.5g} ± {self.half_width:.2g} {self.unit}".rstrip()

    def drawn(self, random: np.random.Generator, number: int) -> Array:
        """Values (number, 1), none of them negative."""
        deviation = self.half_width / HALF_WIDTH
        return np.maximum(
            random.normal(self.estimate, deviation, (number, 1)), LEAST * max(self.estimate, 0.0)
        )


Posterior = Mapping[str, Interval | None]  # by the parameter's name; None: not told


@dataclass(frozen=True)
class Chance:
    """An event in `count` of `runs` climbers."""

    count: int
    runs: int

    @property
    def numbers(self) -> dict[str, Any]:
        """Probability, and the 95 % interval of it that the number of climbers leaves."""
        low, high = wilson(self.count, self.runs)
        return {"probability": self.count / self.runs, "95 %": [low, high]}


def posterior_of(path: Path, params: Path, remarks: list[str]) -> Posterior:
    """The same of a bag, of which `identify` tells it by a parameter file; or of what it wrote.

    Raises as `read_posterior` does, with the words of `identify` where that tells nothing.
    """
    if not (path.is_dir() or BAG.search(path.name)):
        return read_posterior(path)
    with TemporaryDirectory() as directory:
        told = Path(directory, "told.json")
        words = [str(path), "--params", str(params), "--json", str(told)]
        command = [sys.executable, "-c", IDENTIFY, *words]
        done = subprocess.run(command, capture_output=True, text=True, preexec_fn=dies_with_me())
        said = done.stderr.splitlines()
        if not told.exists():
            raise ValueError(said[-1] if said else f"identify ended with status {done.returncode}")
        remarks += said
        return read_posterior(told)


def read_posterior(path: Path) -> Posterior:
    """What `identify --json` wrote; raises `OSError`, or `ValueError` naming file and fault."""
    try:
        rows = json.loads(text_of(path))
        found = dict(_intervals(rows))
    except (ValueError, RecursionError, OverflowError) as error:
        said = " ".join(str(error).split())
        raise ValueError(f"{path} is not what identify --json writes: {said}") from None
    return {name: of for name, of in found.items() if name not in OF_ODOMETRY}


def _intervals(rows: Any) -> Iterator[tuple[str, Interval | None]]:
    """Name and interval of each row; raises `ValueError`, also if none is told."""
    if not (isinstance(rows, list) and all(isinstance(row, dict) for row in rows)):
        raise ValueError("no list of parameters")
    found = [_interval(row) for row in rows]
    if not any(of for _, of in found):
        raise ValueError("it tells no parameter")
    yield from found


def _interval(row: Mapping[str, Any]) -> tuple[str, Interval | None]:
    """Name and interval of a row; raises `ValueError`."""
    name = row.get("parameter")
    if name not in (*OF_CLIMBER, *RESISTING.values(), *OF_ODOMETRY):
        raise ValueError(f"parameter={name!r} is none of identify's")
    if row.get("known") is False:
        return name, None
    numbers = []
    for what in ("estimate", "half_width"):
        value = row.get(what)
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise ValueError(f"{what}={value!r} of {name} must be a finite number")
        numbers.append(float(value))
    estimate, half_width = numbers
    if half_width < 0:
        raise ValueError(f"half_width={half_width} of {name} must be >= 0")
    if name in POSITIVE and estimate <= half_width:
        raise ValueError(f"{name}={estimate} ± {half_width} must be > 0")
    return name, Interval(estimate, half_width, str(row.get("unit", "")))


def chances(
    trajectory: Trajectory,
    climber: Climber,
    contact: Contact,
    posterior: Posterior,
    runs: int,
    seed: int = 0,
    wall: Wall = PLANE,
) -> dict[str, Chance]:
    """By event, in how many of `runs` climbers it happens somewhere on the path."""
    random = np.random.default_rng(seed)
    own = {name: of.drawn(random, runs) for name, of in posterior.items() if of}
    time, reference, _ = looked_at(trajectory)
    counts = {"falls": 0, "slips": 0, "asks for more torque than there is": 0}
    block = max(AT_ONCE // len(time), 1)
    for first in range(0, runs, block):
        drawn = {name: values[first : first + block] for name, values in own.items()}
        changes: dict[str, Any] = {name: drawn[name] for name in OF_CLIMBER if name in drawn}
        these = replace(climber, **changes)
        resists = {of: drawn[name] for of, name in RESISTING.items() if name in drawn}
        left = reserves(reference, these, contact, Resistance(**resists), wall)
        happens = is_pulled_off(these, left.normal) | (left.tip < 1), left.slip < 1, left.torque < 1
        number = min(block, runs - first)
        for event, where in zip(counts, happens, strict=True):
            every = np.broadcast_to(where, (number, len(time))).any(axis=-1)
            counts[event] += int(np.count_nonzero(every))
    return {event: Chance(count, runs) for event, count in counts.items()}
