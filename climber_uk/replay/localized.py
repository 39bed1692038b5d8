"""A recording gone through by the filter, forwards and backwards, as arrays and as numbers."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from climber_uk.localization.kalman import Estimate
from climber_uk.localization.localizer import Counts, Localizer
from climber_uk.localization.models import (
    BIAS,
    CREEP,
    DRAG_SLIP,
    FORWARD_BIAS,
    HEADING,
    LEFT_BIAS,
    PIVOT,
    SCALE,
    SCRUB,
    WEIGHT_SLIP,
)
from climber_uk.localization.options import LocalizationOptions
from climber_uk.localization.smoother import smoothed
from climber_uk.mechanics import Array, Stamps
from climber_uk.mechanics.elementary import wrapped
from climber_uk.replay.recorded_sensors import RecordedSensors

FOREVER = 1e9  # [s] for which all estimates are kept
TOLD = {
    BIAS: "bias of the gyro [rad/s]",
    FORWARD_BIAS: "bias of the accelerometer, forwards [m/s²]",
    LEFT_BIAS: "bias of the accelerometer, left [m/s²]",
    SCALE: "scale error of the encoders, at the end",
    CREEP: "creep",
    SCRUB: "scrub [m]",
    PIVOT: "pivot [m]",
    DRAG_SLIP: "slip by drag",
    WEIGHT_SLIP: "slip by weight",
}


@dataclass(frozen=True)
class Estimates:
    """Estimates at n times."""

    mean: Array  # (n, 12) as in `localization.models`
    covariance: Array  # (n, 12, 12)

    @classmethod
    def of(cls, estimates: Sequence[Estimate]) -> "Estimates":
        """Arrays of some estimates."""
        return cls(
            np.array([estimate.mean for estimate in estimates]),
            np.array([estimate.covariance for estimate in estimates]),
        )

    @property
    def deviation(self) -> Array:
        """Standard deviations (n, 12)."""
        variances = np.diagonal(self.covariance, axis1=1, axis2=2)
        return np.sqrt(np.maximum(variances, 0.0))

    def off(self, true: Array) -> tuple[float, float, float]:
        """RMS distance [m] and heading error [rad] from true poses (n, 3), and mean NEES."""
        known = np.isfinite(true).all(axis=1)
        if not known.any():
            return math.nan, math.nan, math.nan
        off = self.mean[known, :3] - true[known]
        off[:, 2] = wrapped(off[:, 2])
        nees = np.einsum("ni,nij,nj->n", off, np.linalg.inv(self.covariance[known, :3, :3]), off)
        distance = math.sqrt(float(np.mean(off[:, 0] ** 2 + off[:, 1] ** 2)))
        return distance, math.sqrt(float(np.mean(off[:, 2] ** 2))), float(nees.mean())


@dataclass(frozen=True)
class Localized:
    """A recording by the filter as it goes on, and by all of it."""

    stamps: Stamps  # (n,) [ns] of the encoders, from where heading and position are known
    forward: Estimates
    smoothed: Estimates
    true: Array  # (n, 3); nan where nobody knows
    counts: Counts
    remarks: list[str]

    def numbers(self) -> dict[str, float]:
        """What comes of it, by what it is."""
        taken, refused, believed = self.counts
        found = {"samples of the encoders": float(len(self.stamps)), "fixes taken": float(taken)}
        found |= {"fixes refused": float(refused), "fixes believed": float(believed)}
        last, deviation = self.smoothed.mean[-1], self.smoothed.deviation[-1]
        for part, name in TOLD.items():
            found |= {name: float(last[part]), f"{name}, deviation": float(deviation[part])}
        for name, estimates in (("forwards", self.forward), ("smoothed", self.smoothed)):
            mean = np.sqrt(np.mean(estimates.deviation**2, axis=0))
            found[f"position, {name}, deviation [m]"] = float(max(mean[0], mean[1]))
            found[f"heading, {name}, deviation [rad]"] = float(mean[HEADING])
            distance, heading, nees = estimates.off(self.true)
            found[f"distance from the truth, {name}, RMS [m]"] = distance
            found[f"heading error, {name}, RMS [rad]"] = heading
            found[f"NEES of the pose, {name} (3 is right)"] = nees
        return {name: value for name, value in found.items() if math.isfinite(value)}


def localized(sensors: RecordedSensors, options: LocalizationOptions) -> Localized:
    """Go through a recording; raises `ValueError` if it never tells where the climber is."""
    localizer = Localizer(replace(options, longest_delay=FOREVER))
    sensors.tell(localizer)
    entries = localizer.history.entries
    known = [
        entry.estimate.deviation(HEADING) <= options.initial_heading_limit
        and max(entry.estimate.deviation(part) for part in (0, 1)) <= options.initial_position_limit
        for entry in entries
    ]
    if True not in known:
        missing = [] if localizer.knows_heading else ["heading"]
        missing += [] if localizer.knows_position else ["position"]
        untold = " and ".join(missing) or "place"
        loose = [
            f"initial_{name}_deviation {deviation:.3g} is above initial_{name}_limit {limit:.3g}"
            for name in ("position", "heading")
            if (deviation := getattr(options, f"initial_{name}_deviation"))
            > (limit := getattr(options, f"initial_{name}_limit"))
        ]
        why = ", and ".join(["no fix tells it", *loose])
        raise ValueError(f"{untold} never known: {why} (-p NAME:=VALUE changes them)")
    entries = entries[known.index(True) :]
    stamps = np.array([entry.stamp for entry in entries], dtype=np.int64)
    return Localized(
        stamps,
        Estimates.of([entry.estimate for entry in entries]),
        Estimates.of(smoothed(entries, options)),
        sensors.truth(stamps),
        localizer.counts,
        localizer.remarks,
    )
