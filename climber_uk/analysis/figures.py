"""A run in pictures."""

from collections.abc import Callable
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from climber_uk.analysis.recorded_run import RecordedRun


def draw(run: RecordedRun, directory: Path) -> list[Path]:
    """Write the figures of a run into `directory` as PNG; return their paths."""
    directory.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, (rows, draw_on) in FIGURES.items():
        figure, axes = plt.subplots(rows, figsize=(8, 6), sharex=True, layout="constrained")
        draw_on(run, axes)
        paths.append(directory / f"{name}.png")
        figure.savefig(paths[-1], dpi=120)
        plt.close(figure)
    return paths


def _path(run: RecordedRun, axes: Axes) -> None:
    axes.plot(*run.reference[:, :2].T, color="0.7", linewidth=4, label="reference")
    axes.plot(*run.pose[:, :2].T, color="tab:blue", linewidth=1.5, label="climber")
    axes.plot(*run.pose[0, :2], "o", color="tab:green", label="start")
    axes.plot(*run.pose[-1, :2], "s", color="tab:red", label="end")
    axes.set(xlabel="x [m]", ylabel="y [m]", title="Path on the wall")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend()


def _errors(run: RecordedRun, axes: "list[Axes]") -> None:
    axes[0].set_title("Tracking errors")
    for axis, values, label in zip(
        axes,
        (1e3 * run.error).T,
        ("along-track [mm]", "cross-track [mm]", "heading [mrad]"),
        strict=True,
    ):
        axis.plot(run.time, values, linewidth=1)
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
    axes[-1].set_xlabel("time [s]")


def _torques(run: RecordedRun, axes: Axes) -> None:
    for values, label in zip(run.torques.T, ("right wheel", "left wheel"), strict=True):
        axes.plot(run.torque_time, values, label=label, linewidth=1)
    axes.set(xlabel="time [s]", ylabel="torque [N m]", title="Wheel torques")
    axes.grid(alpha=0.3)
    axes.legend()


def _constraint_force(run: RecordedRun, axes: "list[Axes]") -> None:
    axes[0].set_title("Udwadia-Kalaba constraint force, in the climber's frame")
    for axis, values, label in zip(
        axes,
        run.constraint_force.T,
        ("drive [N]", "lateral [N]", "about z [N m]"),
        strict=True,
    ):
        axis.plot(run.force_time, values, linewidth=1)
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
    axes[-1].set_xlabel("time [s]")


FIGURES: dict[str, tuple[int, Callable[..., None]]] = {
    "path": (1, _path),
    "errors": (3, _errors),
    "torques": (1, _torques),
    "constraint_force": (3, _constraint_force),
}
