"""`python bench/convergence.py DIRECTORY`: figures of how both constraint sets find the path.

From starts off the paper's ellipse, whole: out of rest with a reference that ramps up in 3 s, and
at the speed of one that runs already. Torques are limited to 4 N m a wheel.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import product
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from robustness import ELLIPSE, IN_MOTION, PAPER, RAMPED, ours

from climber_uk.closed_loop.simulate import Run, simulate
from climber_uk.control.constraints import CONSTRAINTS
from climber_uk.mechanics.quantities import State

WEAK = replace(PAPER, max_wheel_torque=4.0)
CASES = {"from rest, ramped up in 3 s": RAMPED, "at the reference's speed": ELLIPSE}
DISTANCES = (0.1, 0.25, 0.5, 1.0, 2.0, 3.0, 4.0)  # [m]
TURNS = (0, 30, 60, 90, 120, 150, 180)  # [deg]
DIRECTIONS = np.radians([0, 60, 120, 180, 240, 300])
NEAR, SOON = 0.01, 3.0  # [m], [s]


def start(case: str, offset: np.ndarray) -> State:
    """State away from the start of a case by an offset (3,)."""
    if case == "at the reference's speed":
        return State.rolling(IN_MOTION.pose + offset, 10.0, -0.6)
    return State(RAMPED.at(0.0).pose + offset, np.zeros(3))


def run(case: str, constraints: str, offset: np.ndarray, duration: float = 4.0) -> Run:
    """Run of a case from an offset."""
    controller = ours(WEAK, CONSTRAINTS[constraints]())
    return simulate(CASES[case], start(case, offset), duration, controller, WEAK)


def share_back(case: str, constraints: str, distance: float, turn: float) -> float:
    """Share of directions of the offset, and of the turn, that are within 1 cm 3 s later."""
    back = []
    for direction, sign in product(DIRECTIONS, (1, -1)):
        x, y = distance * np.cos(direction), distance * np.sin(direction)
        there = run(case, constraints, np.array([x, y, sign * np.radians(turn)]))
        back.append(there.distance[there.time >= SOON].max() < NEAR)
    return float(np.mean(back))


def shares(case: str, constraints: str) -> list[list[float]]:
    """Shares over `TURNS` and `DISTANCES`."""
    return [[share_back(case, constraints, d, turn) for d in DISTANCES] for turn in TURNS]


def draw_runs(path: Path) -> None:
    """Distance from the reference over time, from twelve random starts."""
    figure, axes = plt.subplots(
        2, 2, figsize=(9, 6), sharex=True, sharey=True, layout="constrained"
    )
    for (case, constraints), axis in zip(product(CASES, CONSTRAINTS), axes.flat, strict=True):
        for seed in range(12):
            random = np.random.default_rng(seed)
            offset = np.array([*random.uniform(-0.5, 0.5, 2), random.uniform(-1, 1)])
            there = run(case, constraints, offset)
            axis.semilogy(there.time, 1e3 * there.distance, linewidth=1)
        axis.set_title(f"{constraints}, {case}", fontsize=10)
        axis.grid(alpha=0.3)
    figure.supylabel("distance from the reference [mm]")
    figure.supxlabel("time [s]")
    figure.savefig(path, dpi=110)


def draw_regions(path: Path) -> None:
    """Share of starts that are back, over distance and turn."""
    figure, axes = plt.subplots(2, 2, figsize=(9, 7), layout="constrained")
    cases = list(product(CASES, CONSTRAINTS))
    with ProcessPoolExecutor() as pool:
        tables = list(pool.map(shares, *zip(*cases, strict=True)))
    for (case, constraints), table, axis in zip(cases, tables, axes.flat, strict=True):
        image = axis.imshow(table, vmin=0, vmax=1, origin="lower", cmap="RdYlGn", aspect="auto")
        axis.set_xticks(range(len(DISTANCES)), DISTANCES)
        axis.set_yticks(range(len(TURNS)), TURNS)
        axis.set_title(f"{constraints}, {case}", fontsize=10)
        for (row, column), share in np.ndenumerate(np.array(table)):
            axis.text(column, row, f"{100 * share:.0f}", ha="center", va="center", fontsize=8)
    figure.supxlabel("distance of the start from the reference's [m], in 6 directions")
    figure.supylabel("heading error at the start [°], both ways")
    figure.colorbar(image, ax=axes, label="share within 1 cm after 3 s", shrink=0.6)
    figure.savefig(path, dpi=110)


def main() -> None:
    """Draw both figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("directory", type=Path, help="for the figures")
    options = parser.parse_args()
    options.directory.mkdir(parents=True, exist_ok=True)
    np.seterr(all="ignore")  # the exact set may diverge
    draw_runs(options.directory / "control_convergence.png")
    draw_regions(options.directory / "control_regions.png")


if __name__ == "__main__":
    main()
