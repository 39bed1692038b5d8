"""Mass, inertia, friction and geometry of a climber from how it moved and what drove it.

The coefficients of `integral_equations` are fitted (`window_fit`), each equation in windows of its
own, and give the parameters (`coefficients`). What the data do not determine is not told, but why
(`identification_verdict`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from climber_uk.identification.coefficients import LATE, VISCOUS, Columns, parameters, with_scrub
from climber_uk.identification.fit_test import lacks
from climber_uk.identification.identified import (
    DRIVE,
    HEADING,
    IN_TIME,
    TURN,
    WAY,
    Extent,
    Identified,
    Widths,
)
from climber_uk.identification.integral_equations import (
    Cut,
    Equations,
    Site,
    drive_equations,
    friction_load,
    turn_equations,
    wheel_equations,
)
from climber_uk.identification.lateness import DELAYS, lateness
from climber_uk.identification.recorded_motion import Indices, RecordedMotion
from climber_uk.identification.verdict import reasons
from climber_uk.identification.window_fit import FEW, WindowFit
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber

CUT, SITE, LEAST_WINDOWS = Cut(), Site(), 5
SPREAD = 0.05  # of the speed: least difference of speeds that shows viscous friction
REJECTIONS = 3  # times that windows are left out
# [SI] of speed, way; yaw rate, heading; way; heading: noise to begin with, and a tenth of it is the
# least that is believed of a sensor.
NOISE = {DRIVE: (1e-2, 1e-3), TURN: (1e-2, 1e-3), WAY: (1e-3,), HEADING: (1e-3,)}
Windows = Mapping[str, list[Indices]]


def identify(
    motion: RecordedMotion, climber: Climber, cut: Cut = CUT, site: Site = SITE
) -> Identified:
    """Parameters of a climber that is believed to be `climber`; raises `ValueError`.

    Believed are its geometry, without wheel angles, its suction, and the inclination.
    """
    task = Task(motion, climber, site, _windows(motion, cut))
    if (count := len(task.windows[DRIVE])) < LEAST_WINDOWS:
        raise ValueError(f"{count} windows of {cut.window} s in motion must be >= {LEAST_WINDOWS}")
    columns = _columns(task.extent)
    first = {kind: (*columns[kind], LATE) for kind in task.kinds if kind in (DRIVE, TURN)}
    usual, fits = task.fitted(first)
    late = lateness(fits, lambda delay, lag: usual.acting(delay, lag).equations)
    if late != IN_TIME:  # and the coefficient by which that may still be wrong
        task, columns = task.acting(*late), {**columns, **first}
    kept, fits = task.fitted({kind: columns[kind] for kind in task.kinds})
    left_out = sum(len(task.windows[kind]) - len(kept.windows[kind]) for kind in (DRIVE, TURN))
    values = parameters(fits, columns, climber)
    found = Identified(*values, fits, task.extent, kept.windows, site, left_out, late)
    found = with_scrub(found, columns, climber)
    found = replace(found, lacks=tuple(lacks(found, motion, climber)))
    return replace(found, reasons=reasons(found, motion, climber, cut))


def predicted(
    motion: RecordedMotion, climber: Climber, cut: Cut = CUT, site: Site = SITE
) -> Identified:
    """What would be found of `climber` if it moved like this, with the noise to begin with."""
    task = Task(motion, climber, site, _windows(motion, cut))
    columns = _columns(task.extent)
    fits = {
        kind: WindowFit.standardised(each, columns[kind], task.noise(kind))
        for kind, each in task.equations.items()
    }
    values, widths, sought = parameters(fits, columns, climber)
    none = np.zeros_like(widths.white)
    white = Widths(none, widths.white, none)
    return Identified(values, white, sought, fits, task.extent, task.windows, site)


@dataclass(frozen=True)
class Task:
    """What to fit."""

    motion: RecordedMotion
    climber: Climber
    site: Site
    windows: Windows  # by kind of equation

    @property
    def kinds(self) -> list[str]:
        """Those with windows enough."""
        turns = [TURN] if len(self.windows[TURN]) >= LEAST_WINDOWS else []
        return [DRIVE, *turns, *([] if self.motion.wheel_angles is None else [WAY, HEADING])]

    @property
    def equations(self) -> dict[str, list[Equations]]:
        """By kind."""
        found = {DRIVE: drive_equations(self.motion, self.climber, self.site, self.windows[DRIVE])}
        if TURN in self.kinds:
            found[TURN] = turn_equations(self.motion, self.windows[TURN])
        if WAY in self.kinds:
            found[WAY], found[HEADING] = wheel_equations(self.motion, self.windows[WAY])
        return found

    @property
    def extent(self) -> Extent:
        """How far it was driven."""
        load = friction_load(self.motion, self.climber, self.site)
        time, drive, _, way, _ = self._gone(DRIVE)
        turn_time, _, turn, _, turned = self._gone(TURN)
        speed, yaw_rate = way / time, turned / turn_time
        each = drive / time, turn / turn_time, load, speed, yaw_rate
        rms = [float(np.sqrt(np.mean(values**2))) if len(values) else 0.0 for values in each]
        spreads = [float(np.std(np.abs(rate))) if len(rate) else 0.0 for rate in (speed, yaw_rate)]
        return Extent(*rms, *spreads)

    def noise(self, kind: str) -> Array:
        """To begin with, of what is measured (q,)."""
        return np.array(NOISE[kind][-1:] if self.motion.rates is None else NOISE[kind])

    def acting(self, delay: float, lag: float) -> "Task":
        """The same, if torques act later."""
        return replace(self, motion=self.motion.acting(delay, lag))

    def fitted(self, columns: Columns) -> tuple["Task", dict[str, WindowFit]]:
        """Fits of some kinds, and what is left of the windows: see `Misfit.strange`."""
        equations, windows, fits = self.equations, dict(self.windows), {}
        for kind, own in columns.items():
            fits[kind], kept = _fitted(equations[kind], own, self.noise(kind))
            windows[kind] = [self.windows[kind][number] for number in kept]
        return replace(self, windows=windows), fits

    def _gone(self, kind: str) -> Array:
        """Time, impulses of drive and turn, way and turn (5, n) in each window."""
        motion = self.motion
        impulses: Any = self.climber.force_and_moment(motion.impulse)
        gone = np.stack([motion.time, *impulses, motion.way, motion.pose[:, 2]])
        ends = np.array([window[[0, -1]] for window in self.windows[kind]], np.intp).reshape(-1, 2)
        passed: Array = gone[:, ends[:, 1]] - gone[:, ends[:, 0]]
        return passed


def _windows(motion: RecordedMotion, cut: Cut) -> Windows:
    """By kind; wherever torques are known, even if they act later than assumed."""
    known = motion.time >= motion.time[0] + DELAYS[-1]
    inner = replace(motion, stretch=np.where(known, motion.stretch, -1))
    driving, turning = cut.windows(inner), cut.turning(inner)
    return {DRIVE: driving, TURN: turning, WAY: driving, HEADING: driving}


def _columns(extent: Extent) -> dict[str, tuple[int, ...]]:
    """Those of the coefficients that are sought."""
    # noise would look like a difference of speeds, and tell that it makes none in friction
    spreads = {
        DRIVE: extent.speed_spread >= SPREAD * extent.speed,
        TURN: extent.yaw_rate_spread >= SPREAD * extent.yaw_rate,
    }
    both = {kind: (0, 1, VISCOUS) if differs else (0, 1) for kind, differs in spreads.items()}
    return {**both, WAY: (0,), HEADING: (0,)}


def _fitted(
    equations: list[Equations], columns: tuple[int, ...], noise: Array
) -> tuple[WindowFit, list[int]]:
    """Fit to the windows, and numbers of those that were kept."""
    kept, fit = list(range(len(equations))), WindowFit.of(equations, columns, noise)
    least = max(LEAST_WINDOWS, int((1 - FEW) * len(equations)))
    for _ in range(REJECTIONS):
        strange = fit.misfit.strange
        if not strange.any() or len(kept) - strange.sum() < least:
            break
        kept = [number for number, odd in zip(kept, strange, strict=True) if not odd]
        fit = WindowFit.of([equations[number] for number in kept], columns, noise)
    return fit, kept
