"""The numbers that are taken from the messages of each topic."""

from collections.abc import Callable

import numpy as np

from climber_uk.analysis.batches import Batch
from climber_uk.analysis.topics import FORCE, JOINTS, MARGINS, ODOMETRY, PRESSURE, TORQUES
from climber_uk.mechanics import Array


def heading(batch: Batch, path: str) -> Array:
    """Headings (n,) [rad] of orientations at `path`; nan unless they are unit turns about z."""
    x, y, z, w = batch.columns(*(f"{path}.{axis}" for axis in "xyzw")).T
    is_planar = (np.abs(np.hypot(z, w) - 1) < 1e-3) & (np.hypot(x, y) < 0.1)
    return np.where(is_planar, np.arctan2(2 * w * z, w * w - z * z), np.nan)


def _odometry(batch: Batch) -> Array:
    """Pose x, y, θ and twist forwards, to the left, about z, (n, 6)."""
    position, twist = "pose.pose.position", "twist.twist"
    return np.column_stack(
        [
            batch.columns(f"{position}.x", f"{position}.y"),
            heading(batch, "pose.pose.orientation"),
            batch.columns(f"{twist}.linear.x", f"{twist}.linear.y", f"{twist}.angular.z"),
        ]
    )


def _torques(batch: Batch) -> Array:
    """Torques right, left (n, 2) [N m]."""
    return batch["effort"][:, _wheels(batch)]


def _joints(batch: Batch) -> Array:
    """Rates right, left [rad/s] and torques right, left [N m], (n, 4)."""
    wheels = _wheels(batch)
    return np.column_stack([batch["velocity"][:, wheels], batch["effort"][:, wheels]])


def _wheels(batch: Batch) -> list[int]:
    """Places of the right and the left wheel: by their names, else left comes first."""
    names = [batch.strings[f"name.{i}"] for i in range(batch.lengths["name"])]
    wheels = [i for side in ("right", "left") for i, name in enumerate(names) if side in name]
    return wheels if len(wheels) == 2 else [1, 0]


def _vector(batch: Batch) -> Array:
    return batch.columns("vector.x", "vector.y", "vector.z")


def _wrench(batch: Batch) -> Array:
    return batch.columns("wrench.force.x", "wrench.force.y", "wrench.torque.z")


def _pressure(batch: Batch) -> Array:
    return batch.columns("fluid_pressure")


WIDEST = 6  # values of a message
TAKEN: dict[str, Callable[[Batch], Array]] = {
    ODOMETRY: _odometry,
    TORQUES: _torques,
    JOINTS: _joints,
    PRESSURE: _pressure,
    FORCE: _wrench,
    **dict.fromkeys(MARGINS, _vector),
}
