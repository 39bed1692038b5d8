"""Figure of an identification: force and moment in each window, those of models, residuals."""

from pathlib import Path

import numpy as np

from climber_uk.identification.identified import DRIVE, NAMES, YAW, Identified
from climber_uk.identification.integral_equations import Site, friction_load, gravity_ahead
from climber_uk.identification.recorded_motion import Indices, RecordedMotion
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.report.plotting import plt, saved


def draw(motion: RecordedMotion, assumed: Climber, found: Identified, path: Path) -> Path:
    """Write the figure as PNG; return its path."""
    figure, axes = plt.subplots(2, 2, figsize=(10, 6), sharex=True, layout="constrained")
    time = motion.time - motion.time[0]
    now = np.array([getattr(assumed, name, 0.0) for name in NAMES])
    values = np.where(np.isfinite(found.values), found.values, now)
    columns = (DRIVE, "drive [N]", "way [mm]"), (YAW, "moment [N m]", "heading [mrad]")
    for column, (kind, driven, measured) in enumerate(columns):
        windows, (above, below) = found.windows[kind], axes[:, column]
        middles = [time[window].mean() for window in windows]
        for model, style, label in ((now, "0.6", "nodes now"), (values, "tab:blue", "identified")):
            wrenches = [model_wrench(motion, assumed, found.site, model, w) for w in windows]
            above.plot(middles, [wrench[column] for wrench in wrenches], color=style, label=label)
        wrenches = [motors_wrench(motion, values, w) for w in windows]
        above.plot(middles, [wrench[column] for wrench in wrenches], "k.", label="motors")
        above.set(ylabel=driven)
        if kind in found.fits:
            fit = found.fits[kind]
            last = len(fit.noise) - 1  # of way and heading; speeds are before them
            left = 1e3 * fit.noise[last] * fit.residuals[fit.quantity == last]
            below.plot(time[np.concatenate(windows)], left, ",", color="tab:blue")
        else:
            middle = {"x": 0.5, "y": 0.5, "ha": "center", "transform": below.transAxes}
            below.text(s="not fitted: it moved so in too few windows", **middle)
        below.set(xlabel="time [s]", ylabel=f"left of {measured}")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    for axis in axes.flat:
        axis.grid(alpha=0.3)
    return saved(figure, path, 120)


def motors_wrench(motion: RecordedMotion, values: Array, window: Indices) -> Array:
    """Force [N] and moment [N m] (2,) of the motors, weighted means over a window."""
    radius, half_track = values[-2:]
    torques = weak_mean(motion.time[window], motion.impulse[window], order=1) / radius
    return np.array([torques.sum(), half_track * (torques[0] - torques[1])])


def model_wrench(
    motion: RecordedMotion, climber: Climber, site: Site, values: Array, window: Indices
) -> Array:
    """Force [N] and moment [N m] (2,) that the motion in a window takes with parameters (9,)."""
    mass, coefficient, viscous, rotor, inertia, coulomb, resistance, radius, half_track = values
    rotors = 2 * rotor / radius**2
    time, heading = motion.time[window], motion.pose[window, 2]
    gone = np.column_stack([motion.way[window], heading])
    gone = gone - gone.mean(axis=0)
    (speed, yaw_rate), (speed_1, yaw_rate_1) = (weak_mean(time, gone, order) for order in (1, 2))
    pulled = weak_mean(time, gravity_ahead(motion, climber, site)[window], 0)
    load = weak_mean(time, friction_load(motion, climber, site)[window], 0)
    drive = (
        (mass + rotors) * speed_1
        - mass * pulled
        + coefficient * load * np.sign(speed)
        + viscous * speed
    )
    moment = (
        (inertia + rotors * half_track**2) * yaw_rate_1
        + coulomb * np.sign(yaw_rate)
        + resistance * yaw_rate
    )
    return np.array([drive, moment])


def weak_mean(time: Array, values: Array, order: int) -> Array:
    """Mean of a derivative of `values` (n, ...), weighed by u² (1 - u)² along the window (...).

    By parts it is the weight that is differentiated.
    """
    weight = np.polynomial.Polynomial([0, 0, 1, -2, 1], time[[0, -1]], (0, 1))
    share = (-1) ** order * weight.deriv(order)(time) if order else weight(time)
    return np.trapezoid(share * values.T, time) / np.trapezoid(weight(time), time)
