"""The reference at any number of times, from all previews of it in a bag."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from climber_uk.bags.batches import Batch
from climber_uk.bags.extraction import heading
from climber_uk.mechanics import Array, Stamps
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.preview import quintic

AT_ONCE = 65536  # times


@dataclass(frozen=True)
class Previews:
    """n previews of the reference, with k points each."""

    arrivals: Stamps  # (n,) log times [ns]
    times: Stamps  # (n, k) [ns]
    motion: Array  # (n, k, 3, 3): pose, velocity and acceleration in x, y and θ

    @classmethod
    def of(cls, batch: Batch) -> "Previews":
        """Previews of a batch of messages, without those that have an unfit point.

        Raises `KeyError` if a field is missing.
        """
        places = [f"points.{i}" for i in range(batch.lengths["points"])]
        if not places:
            raise KeyError("points")
        since = np.stack([batch.times(f"{place}.time_from_start") for place in places], axis=1)
        motion = np.stack([_motion(batch, place) for place in places], axis=1)
        fit = np.isfinite(motion).all(axis=(1, 2, 3)) & (np.diff(since) > 0).all(axis=1)
        times = batch.stamps[:, None] + since
        return cls(batch.log_times, times, motion).where(fit)

    def where(self, chosen: Any) -> "Previews":
        """Those that a mask (n,) chooses."""
        return Previews(self.arrivals[chosen], self.times[chosen], self.motion[chosen])


def _motion(batch: Batch, place: str) -> Array:
    pose = f"{place}.transforms.0"
    angle, faults = heading(batch, f"{pose}.rotation")
    position = batch.columns(f"{pose}.translation.x", f"{pose}.translation.y")
    rows = [np.column_stack([position, np.where(faults == 0, angle, np.nan)])]
    for of in ("velocities", "accelerations"):
        planar = f"{place}.{of}.0"
        rows.append(
            batch.columns(f"{planar}.linear.x", f"{planar}.linear.y", f"{planar}.angular.z")
        )
    return np.stack(rows, axis=1)


def poses_at(parts: Sequence[Previews], stamps: Stamps) -> Array:
    """Poses (n, 3) at stamps (n,) [ns]; nan where no preview covers them.

    Where two previews have a point at the same time the later one's holds. Between points by
    quintic Hermite interpolation, as `climber_uk.mechanics.preview` has it.
    """
    poses = np.full((len(stamps), 3), np.nan)
    parts = [part for part in parts if len(part.arrivals)]
    if not parts:
        return poses
    begins = np.concatenate([part.times[:, 0] for part in parts])
    ends = np.concatenate([part.times[:, -1] for part in parts])
    order = np.argsort(begins)
    begins, ends = begins[order], np.maximum.accumulate(ends[order])
    started = np.searchsorted(begins, stamps, "right") - 1
    covered = np.flatnonzero((started >= 0) & (stamps <= ends[started]))

    times, motion = _joined(parts)
    for some in np.array_split(covered, len(covered) // AT_ONCE + 1):
        poses[some] = _interpolated(times, motion, stamps[some])
    return poses


def _joined(parts: Sequence[Previews]) -> tuple[Stamps, Array]:
    """Times (m,) [ns] and motions (m, 3, 3) of all points; of two at one time the later one's."""
    arrivals = np.concatenate([np.repeat(part.arrivals, part.times.shape[1]) for part in parts])
    times = np.concatenate([part.times.ravel() for part in parts])
    motion = np.concatenate([part.motion.reshape(-1, 3, 3) for part in parts])
    order = np.argsort(-arrivals, kind="stable")
    times, latest = np.unique(times[order], return_index=True)
    return times, motion[order[latest]]


def _interpolated(times: Stamps, motion: Array, stamps: Stamps) -> Array:
    i = np.clip(np.searchsorted(times, stamps, "right") - 1, 0, len(times) - 2)
    h = (times[i + 1] - times[i])[:, None] * 1e-9
    u = (stamps - times[i])[:, None] * 1e-9 / h
    (p, v, a), (p_end, v_end, a_end) = (
        (at[:, 0], at[:, 1] * h, at[:, 2] * h * h) for at in (motion[i], motion[i + 1])
    )
    step = p_end - p
    step[:, 2] = wrapped(step[:, 2])
    c_3, c_4, c_5 = quintic(step, v, a, v_end, a_end)
    return p + u * (v + u * (a / 2 + u * (c_3 + u * (c_4 + u * c_5))))
