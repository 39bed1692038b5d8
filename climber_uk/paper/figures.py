"""Figures 2 to 13 of the paper for a pair of motions, by (26) and by (30), and the drift study's.

In the paper's order and with its legends: -num integrated by (26), -num-M by (30), -the of (21).
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from climber_uk.paper.consistent import PAPER_PATH
from climber_uk.paper.drift import Drift
from climber_uk.paper.motion import PaperMotion
from climber_uk.report.plotting import plt, saved

AXES = ("x", "y")


COLUMNS, ROWS = 4, 3
PANEL_DPI = 120  # of the sheet half of it: to draw it again takes as long as the first time


def draw(name: str, plain: PaperMotion, corrected: PaperMotion, directory: Path) -> list[Path]:
    """Write figure_02_`name`.png to figure_13, and all on one sheet, figures_`name`.png."""
    figure = plt.figure(figsize=(16, 11))
    for place, (number, draw_on) in enumerate(FIGURES.items()):
        row, column = divmod(place, COLUMNS)
        left, bottom = (column + 0.2) / COLUMNS, (ROWS - 1 - row + 0.15) / ROWS
        axes = figure.add_axes((left, bottom, 0.76 / COLUMNS, 0.68 / ROWS))
        draw_on(axes, plain, corrected)
        axes.set_title(f"Fig. {number}, {name.replace('_', ' ')}", fontsize="medium", pad=24)
    # drawn once and cut up: twelve figures of their own take several times as long
    figure.set_dpi(PANEL_DPI)
    figure.canvas.draw()
    sheet = np.asarray(figure.canvas.buffer_rgba())
    height, width = sheet.shape[0] // ROWS, sheet.shape[1] // COLUMNS
    paths = []
    for place, number in enumerate(FIGURES):
        row, column = divmod(place, COLUMNS)
        panel = sheet[row * height : (row + 1) * height, column * width : (column + 1) * width]
        paths.append(directory / f"figure_{number:02}_{name}.png")
        plt.imsave(paths[-1], panel)
    plt.close(figure)
    paths.append(directory / f"figures_{name}.png")
    halves = sheet.reshape(sheet.shape[0] // 2, 2, sheet.shape[1] // 2, 2, -1)
    plt.imsave(paths[-1], halves.mean(axis=(1, 3)).astype(np.uint8))
    return paths


def _coordinate(
    index: int, modified: bool, axes: Axes, plain: PaperMotion, corrected: PaperMotion
) -> None:
    motion = corrected if modified else plain
    name, ending = AXES[index], "-num-M" if modified else "-num"
    desired = PAPER_PATH.at(motion.time).pose[:, index]
    axes.plot(motion.time, motion.pose[:, index], label=name + ending)
    axes.plot(motion.time, desired, "--", label=f"{name}-the")
    _label(axes, "t [s]", f"{name} [m]")


def _error(
    index: int, compared: bool, axes: Axes, plain: PaperMotion, corrected: PaperMotion
) -> None:
    name = AXES[index]
    axes.plot(plain.time, plain.error[:, index], label=f"{name}-error")
    if compared:
        axes.plot(corrected.time, corrected.error[:, index], label=f"{name}-error-M")
    axes.ticklabel_format(axis="y", scilimits=(-2, 2))  # longer ones leave the label no place
    _label(axes, "t [s]", f"{name} error [m]")


def _trajectory(modified: bool, axes: Axes, plain: PaperMotion, corrected: PaperMotion) -> None:
    if modified:
        axes.plot(*corrected.pose[:, :2].T, label="modified numerical")
        axes.plot(*plain.pose[:, :2].T, "--", label="numerical")
    else:
        axes.plot(*plain.pose[:, :2].T, label="numerical")
        desired = PAPER_PATH.at(plain.time).pose
        axes.plot(*desired[:, :2].T, "--", label="theoretical")
    axes.set_aspect("equal", adjustable="datalim")
    _label(axes, "x [m]", "y [m]")


def _torques(of_wheels: bool, axes: Axes, _: PaperMotion, corrected: PaperMotion) -> None:
    values = corrected.torques if of_wheels else corrected.drive_torques
    for torque, label in zip(values.T, ("TR", "TL") if of_wheels else ("Qc1", "Qc2"), strict=True):
        axes.plot(corrected.time, torque, label=label, linewidth=1)
    _label(axes, "t [s]", "torque [N m]")


FIGURES = {
    2: partial(_coordinate, 0, False),
    3: partial(_coordinate, 1, False),
    4: partial(_error, 0, False),
    5: partial(_error, 1, False),
    6: partial(_trajectory, False),
    7: partial(_coordinate, 0, True),
    8: partial(_coordinate, 1, True),
    9: partial(_error, 0, True),
    10: partial(_error, 1, True),
    11: partial(_trajectory, True),
    12: partial(_torques, False),
    13: partial(_torques, True),
}


def draw_drift(
    by_step: Mapping[tuple[str, float], Drift],
    by_tolerance: Mapping[tuple[str, float], Drift],
    shown_step: float,
    directory: Path,
) -> Path:
    """Write drift.png: error against step, against tolerance, and against time."""
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.6), layout="constrained")
    for panel, runs in zip(axes, (by_step, by_tolerance), strict=False):
        for method in dict.fromkeys(method for method, _ in runs):
            points = sorted((x, run.largest) for (name, x), run in runs.items() if name == method)
            panel.loglog(*zip(*points, strict=True), "o-", label=method)
    for (method, step), run in by_step.items():
        if step == shown_step:
            axes[2].loglog(run.time[1:], run.error[1:], label=method, linewidth=1)
    _label(axes[0], "Runge-Kutta, step [s]", "largest position error [m]")
    _label(axes[1], "Dormand-Prince, tolerance", "largest position error [m]")
    _label(axes[2], "t [s]", f"position error [m], step {1e3 * shown_step:g} ms")
    return saved(figure, directory / "drift.png", 80)


def draw_starts(runs: Mapping[str, Drift], directory: Path) -> Path:
    """Write off_constraint.png: what becomes of an error at the start."""
    figure, axes = plt.subplots(figsize=(7, 4.6), layout="constrained")
    for method, run in runs.items():
        axes.semilogy(run.time, run.error, label=method)
    figure.suptitle("Start 0.1 m and 0.05 rad off the constraint")
    _label(axes, "t [s]", "position error [m]")
    return saved(figure, directory / "off_constraint.png", 80)


def _label(axes: Axes, x: str, y: str) -> None:
    axes.set(xlabel=x, ylabel=y)
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small", loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2)
