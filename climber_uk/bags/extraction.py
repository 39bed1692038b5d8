"""The numbers that are extracted from the messages of each topic, and what is wrong with them."""

from collections.abc import Callable, Sequence
from functools import partial
from math import asin, degrees

import numpy as np
from numpy.typing import NDArray

from climber_uk.bags.batches import Batch
from climber_uk.mechanics import SECOND, Array
from climber_uk.messages.reading import LARGEST, MOST_TILT, NORM_TOLERANCE, rotation_about_z
from climber_uk.messages.topics import (
    FORCE,
    MARGINS,
    ODOMETRY,
    PRESSURE,
    REFERENCE_TIME,
    SETPOINT,
    TRUTH,
)

Faults = NDArray[np.intp]  # (n,) places in FAULTS
FAULTS = (
    "",  # fit
    f"not finite, or above {LARGEST:g} in SI units",
    f"position not finite, or above {LARGEST:g} m",
    "orientation not finite",
    f"norm of the quaternion off 1 by more than {NORM_TOLERANCE:.0%}",
    f"no turn about z: tilted by more than {degrees(2 * asin(MOST_TILT)):.1f}°",
    "stamp far off those around it",
)
STRAY = len(FAULTS) - 1


def heading(batch: Batch, path: str) -> tuple[Array, Faults]:
    """Headings (n,) [rad] of orientations at `path`, and what is wrong with them."""
    x, y, z, w = batch.columns(*(f"{path}.{axis}" for axis in "xyzw")).T
    with np.errstate(over="ignore", invalid="ignore"):
        angle, _, _, is_unit, is_planar = rotation_about_z(x, y, z, w)
        is_finite = np.isfinite(x) & np.isfinite(y) & np.isfinite(z) & np.isfinite(w)
        return angle, np.select([~is_finite, ~is_unit, ~is_planar], [3, 4, 5])


def are_sound(values: Array) -> NDArray[np.bool]:
    """Which of (n, …) numbers are finite, and not absurd."""
    return np.abs(values) <= LARGEST


def _odometry(batch: Batch) -> tuple[Array, Faults]:
    """Pose x, y, θ and twist forwards, to the left, about z, (n, 6).

    A twist that is not finite becomes nan. What does not concern a climber on its wall (z, the
    other rates, covariances) is not looked at.
    """
    position, twist = "pose.pose.position", "twist.twist"
    place = batch.columns(f"{position}.x", f"{position}.y")
    angle, faults = heading(batch, "pose.pose.orientation")
    rates = batch.columns(f"{twist}.linear.x", f"{twist}.linear.y", f"{twist}.angular.z")
    faults = np.where(are_sound(place).all(axis=1), faults, 2)
    return np.column_stack([place, angle, np.where(are_sound(rates), rates, np.nan)]), faults


def _behind(batch: Batch) -> tuple[Array, Faults]:
    """How much earlier the reference's time is than the stamp, (n, 1) [s]."""
    behind = (batch.stamps - batch.times("time_ref")) / SECOND
    return behind[:, None], np.where(are_sound(behind), 0, 1)


def _columns(paths: Sequence[str], batch: Batch) -> tuple[Array, Faults]:
    values = batch.columns(*paths)
    return values, np.where(are_sound(values).all(axis=1), 0, 1)


WIDEST = 6  # values of a message
EXTRACTORS: dict[str, Callable[[Batch], tuple[Array, Faults]]] = {
    ODOMETRY: _odometry,
    TRUTH: _odometry,
    REFERENCE_TIME: _behind,
    **dict.fromkeys((PRESSURE, SETPOINT), partial(_columns, ["fluid_pressure"])),
    FORCE: partial(_columns, ["wrench.force.x", "wrench.force.y", "wrench.torque.z"]),
    **dict.fromkeys(MARGINS, partial(_columns, ["vector.x", "vector.y", "vector.z"])),
}
