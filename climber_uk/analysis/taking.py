"""The numbers that are taken from the messages of each topic, and what is wrong with them."""

from collections.abc import Callable
from math import asin, degrees

import numpy as np
from numpy.typing import NDArray

from climber_uk.analysis.batches import Batch
from climber_uk.analysis.topics import FORCE, MARGINS, ODOMETRY, PRESSURE, REFERENCE_TIME, TRUTH
from climber_uk.mechanics import SECOND, Array
from climber_uk.messages.reading import LARGEST, MOST_TILT, NORM_TOLERANCE

Faults = NDArray[np.intp]  # (n,) places in FAULTS
FAULTS = (
    "",  # fit
    f"not finite, or above {LARGEST:g} in SI units",
    f"position not finite, or above {LARGEST:g} m",
    "orientation not finite",
    f"norm of the quaternion off 1 by more than {NORM_TOLERANCE:.0%}",
    f"not a turn about z: tilted by more than {degrees(2 * asin(MOST_TILT)):.1f}°",
    "stamp far off those around it",
)
STRAY = len(FAULTS) - 1


def heading(batch: Batch, path: str) -> tuple[Array, Faults]:
    """Headings (n,) [rad] of orientations at `path`, and what is wrong with them."""
    x, y, z, w = batch.columns(*(f"{path}.{axis}" for axis in "xyzw")).T
    with np.errstate(over="ignore", invalid="ignore"):
        tilted = np.hypot(x, y)
        norm = np.hypot(tilted, np.hypot(z, w))
        is_finite = np.isfinite(x) & np.isfinite(y) & np.isfinite(z) & np.isfinite(w)
        wrong = ~is_finite, ~(np.abs(norm - 1) <= NORM_TOLERANCE), ~(tilted < MOST_TILT * norm)
        return np.arctan2(2 * w * z, w * w - z * z), np.select(wrong, [3, 4, 5])


def are_sound(values: Array) -> NDArray[np.bool]:
    """Which of (n, …) numbers are finite, and not absurd."""
    return np.abs(values) <= LARGEST


def _odometry(batch: Batch) -> tuple[Array, Faults]:
    """Pose x, y, θ and twist forwards, to the left, about z, (n, 6).

    A twist that is not finite is none, and what says nothing about a climber on its wall (z, the
    other rates, covariances) may be anything.
    """
    position, twist = "pose.pose.position", "twist.twist"
    place = batch.columns(f"{position}.x", f"{position}.y")
    turn, faults = heading(batch, "pose.pose.orientation")
    rates = batch.columns(f"{twist}.linear.x", f"{twist}.linear.y", f"{twist}.angular.z")
    faults = np.where(are_sound(place).all(axis=1), faults, 2)
    return np.column_stack([place, turn, np.where(are_sound(rates), rates, np.nan)]), faults


def _behind(batch: Batch) -> tuple[Array, Faults]:
    """How much earlier the reference's time is than the stamp, (n, 1) [s]."""
    behind = (batch.stamps - batch.times("time_ref")) / SECOND
    return behind[:, None], np.where(are_sound(behind), 0, 1)


def _columns(*paths: str) -> Callable[[Batch], tuple[Array, Faults]]:
    def take(batch: Batch) -> tuple[Array, Faults]:
        values = batch.columns(*paths)
        return values, np.where(are_sound(values).all(axis=1), 0, 1)

    return take


WIDEST = 6  # values of a message
TAKEN: dict[str, Callable[[Batch], tuple[Array, Faults]]] = {
    ODOMETRY: _odometry,
    TRUTH: _odometry,
    REFERENCE_TIME: _behind,
    PRESSURE: _columns("fluid_pressure"),
    FORCE: _columns("wrench.force.x", "wrench.force.y", "wrench.torque.z"),
    **dict.fromkeys(MARGINS, _columns("vector.x", "vector.y", "vector.z")),
}
