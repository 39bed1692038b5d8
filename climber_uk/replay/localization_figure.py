"""Picture of a recording gone through by the filter: way, deviations, and what was learnt."""

from pathlib import Path
from typing import Any

import numpy as np

from climber_uk.localization.models import BIAS, CREEP, HEADING, SCALE, X, Y
from climber_uk.mechanics.elementary import wrapped
from climber_uk.replay.localized import Localized
from climber_uk.replay.recorded_sensors import RecordedSensors, seconds
from climber_uk.report.plotting import plt, saved

FORWARD, SMOOTHED = "tab:orange", "tab:blue"


def draw(sensors: RecordedSensors, found: Localized, path: Path) -> Path:
    """Write the picture as PNG; return its path."""
    figure, axes = plt.subplots(2, 2, figsize=(11, 8), layout="constrained")
    _way(axes[0, 0], sensors, found)
    _deviations(axes[0, 1], found, (X, Y), 1e3, "position [mm]")
    _deviations(axes[1, 0], found, (HEADING,), np.degrees(1.0), "heading [°]")
    time = seconds(found.stamps)
    for part, label in ((SCALE, "scale error"), (CREEP, "creep"), (BIAS, "gyro's bias [rad/s]")):
        line = axes[1, 1].plot(time, found.smoothed.mean[:, part], label=label)[0]
        axes[1, 1].plot(time, found.forward.mean[:, part], ":", color=line.get_color())
    axes[1, 1].set(xlabel="time [s]", ylabel="dotted: forwards")
    for axis in axes.flat:
        axis.grid(alpha=0.3)
        axis.legend(loc="upper right", fontsize="small")
    return saved(figure, path, 110)


def _way(axis: Any, sensors: RecordedSensors, found: Localized) -> None:
    fixes = np.array([fix.values[:2] for fix in sensors.fixes if fix.parts[:2] == (X, Y)])
    if len(fixes):
        axis.plot(*fixes.T, ".", color="0.7", markersize=3, label="fixes")
    for estimates, colour, label in (
        (found.forward, FORWARD, "forwards"),
        (found.smoothed, SMOOTHED, "smoothed"),
    ):
        axis.plot(*estimates.mean[:, :2].T, color=colour, linewidth=1, label=label)
    if np.isfinite(found.true).any():
        axis.plot(*found.true[:, :2].T, "k--", linewidth=0.8, label="truth")
    axis.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")


def _deviations(
    axis: Any, found: Localized, parts: tuple[int, ...], factor: float, label: str
) -> None:
    """Two deviations to both sides; within, what is off: from the truth, else from the smoothed."""
    time, is_known = seconds(found.stamps), bool(np.isfinite(found.true).any())
    true = found.true if is_known else found.smoothed.mean[:, :3]
    for estimates, colour, name in (
        (found.forward, FORWARD, "forwards"),
        (found.smoothed, SMOOTHED, "smoothed"),
    ):
        band = 2 * factor * estimates.deviation[:, list(parts)].max(axis=1)
        axis.fill_between(time, -band, band, color=colour, alpha=0.15)
        for number, part in enumerate(parts):
            off = estimates.mean[:, part] - true[:, part]
            off = wrapped(off) if part == HEADING else off
            label_once = name if number == 0 else None
            axis.plot(time, factor * off, color=colour, linewidth=0.7, label=label_once)
    whose = "the truth" if is_known else "the smoothed"
    axis.set(xlabel="time [s]", ylabel=f"{label} off {whose}, ± 2 deviations")
