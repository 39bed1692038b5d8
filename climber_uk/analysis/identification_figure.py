"""What was identified, in a picture: what drove each window, what models ask for, what is left."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import numpy as np
from matplotlib import pyplot as plt

from climber_uk.analysis.identification import NAMES, Identified
from climber_uk.analysis.integral_equations import seal_load
from climber_uk.analysis.recorded_motion import Indices, RecordedMotion
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber


def draw(motion: RecordedMotion, believed: Climber, found: Identified, path: Path) -> Path:
    """Write the figure as PNG; return its path."""
    figure, axes = plt.subplots(2, 2, figsize=(10, 6), sharex=True, layout="constrained")
    windows, time = found.windows, motion.time - motion.time[0]
    now = np.array([getattr(believed, name, 0.0) for name in NAMES])
    for values, style, label in (
        (now, "0.6", "nodes now"),
        (found.values, "tab:blue", "identified"),
    ):
        asked = np.array([asked_of(motion, believed, values, window) for window in windows])
        for axis, column in zip(axes[0], asked.T, strict=True):
            axis.plot([time[window].mean() for window in windows], column, color=style, label=label)
    gave = np.array([given_in(motion, found, window) for window in windows])
    for axis, column, label in zip(axes[0], gave.T, ("drive [N]", "moment [N m]"), strict=True):
        axis.plot([time[window].mean() for window in windows], column, "k.", label="motors")
        axis.set(ylabel=label)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    every = np.concatenate(windows)
    of_way = 0 if motion.rates is None else 1  # speed and yaw rate are before way and heading
    for axis, quantity, label in zip(
        axes[1], (of_way, 2 * of_way + 1), ("way [mm]", "heading [mrad]"), strict=True
    ):
        left = 1e3 * found.noise[quantity] * found.residuals[quantity]
        axis.plot(time[every], left, ",", color="tab:blue")
        axis.set(xlabel="time [s]", ylabel=f"left of {label}")
    for axis in axes.flat:
        axis.grid(alpha=0.3)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=120, format="png")
    plt.close(figure)
    return path


def given_in(motion: RecordedMotion, found: Identified, window: Indices) -> Array:
    """Drive [N] and moment [N m] (2,) of the motors in a window."""
    torques = (
        weak_mean(motion.time[window], motion.impulse[window], order=1) / found["wheel_radius"]
    )
    return np.array([torques.sum(), found["half_track"] * (torques[0] - torques[1])])


def asked_of(motion: RecordedMotion, climber: Climber, values: Array, window: Indices) -> Array:
    """Drive [N] and moment [N m] (2,) that parameters (7,) ask for in a window."""
    mass, coefficient, viscous, inertia, turning, _, _ = values
    time, heading = motion.time[window], motion.pose[window, 2]
    gone = np.column_stack([motion.way[window], heading])
    gone = gone - gone.mean(axis=0)
    (speed, yaw_rate), (faster, turning_faster) = (weak_mean(time, gone, order) for order in (1, 2))
    pulled = climber.weight_along_wall / climber.mass * weak_mean(time, np.sin(heading), 0)
    load = weak_mean(time, seal_load(motion, climber)[window], 0)
    drive = mass * (faster + pulled) + coefficient * load * np.sign(speed) + viscous * speed
    return np.array([drive, inertia * turning_faster + turning * yaw_rate])


def weak_mean(time: Array, values: Array, order: int) -> Array:
    """Mean of a derivative of `values` (n, ...), weighed by u² (1 - u)² along the window (...).

    By parts it is the weight that is differentiated.
    """
    weight = np.polynomial.Polynomial([0, 0, 1, -2, 1], time[[0, -1]], (0, 1))
    share = (-1) ** order * weight.deriv(order)(time) if order else weight(time)
    mean: Array = np.trapezoid(share * values.T, time) / np.trapezoid(weight(time), time)
    return mean
