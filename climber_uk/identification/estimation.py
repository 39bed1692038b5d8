"""Mass, inertia, friction and geometry of a climber from how it moved and what drove it.

The coefficients of `integral_equations` are fitted (`window_fit`), each equation in windows of its
own, and give the parameters (`coefficients`). For those that the data do not determine there is a
reason in place of a value (`verdict`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from climber_uk.identification.coefficients import (
    LATE,
    VISCOUS,
    WEIGHTLESS,
    parameters,
    resisted,
    with_scrub,
)
from climber_uk.identification.fit_test import lacks
from climber_uk.identification.identified import (
    DRIVE,
    HEADING,
    IN_TIME,
    WAY,
    YAW,
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
    heading_equations,
    way_equations,
    yaw_equations,
)
from climber_uk.identification.lateness import DELAYS, Columns, lateness
from climber_uk.identification.recorded_motion import Indices, RecordedMotion
from climber_uk.identification.verdict import reasons
from climber_uk.identification.window_fit import FEW, WindowFit
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber

CUT, SITE, LEAST_WINDOWS = Cut(), Site(), 5
SPREAD = 0.05  # of the speed: least difference of speeds that shows viscous friction
REJECTIONS = 3  # times that windows are left out
SURE = 4.0  # standard deviations, above which rotors are significant
LEAST_ROTORS = 0.03  # of the inertia: a wall that is not as steep as assumed shows as much
EXPLAINED = 0.05  # of what is lacking, that rotors may leave
# [SI] of speed, way; yaw rate, heading; way; heading: noise to begin with, and a tenth of it is the
# least that is assumed of a sensor.
NOISE = {DRIVE: (1e-2, 1e-3), YAW: (1e-2, 1e-3), WAY: (1e-3,), HEADING: (1e-3,)}
Windows = Mapping[str, list[Indices]]


def identify(
    motion: RecordedMotion, climber: Climber, cut: Cut = CUT, site: Site = SITE
) -> Identified:
    """Parameters of a climber, of which `climber` is assumed beforehand.

    Used of it are suction, inclination, and, without wheel angles, the geometry. Raises
    `ValueError` if there are too few windows in motion.
    """
    task = Task(motion, climber, site, _windows(motion, cut))
    if (count := len(task.windows[DRIVE])) < LEAST_WINDOWS:
        raise ValueError(f"{count} windows of {cut.window} s in motion must be >= {LEAST_WINDOWS}")
    columns = _columns(task.extent)
    first = task.with_delay(columns)
    usual, fits = task.fitted(first)
    if task.shows_rotors(columns[DRIVE], fits[DRIVE]):
        columns = {**columns, DRIVE: (*columns[DRIVE], WEIGHTLESS)}
        first = task.with_delay(columns)
        usual, fits = task.fitted(first)
    late = lateness(fits, columns, lambda delay, lag: usual.acting(delay, lag).equations)
    if late != IN_TIME:  # and the coefficient by which that may still be wrong
        task, columns = task.acting(*late), {**columns, **first}
    kept, fits = task.fitted({kind: columns[kind] for kind in task.kinds})
    left_out = sum(len(task.windows[kind]) - len(kept.windows[kind]) for kind in (DRIVE, YAW))
    values = parameters(fits, columns, climber)
    found = Identified(*values, fits, task.extent, kept.windows, site, left_out, late)
    slips = any(lack.kind == WAY and not lack.fits for lack in lacks(found, motion, climber))
    if YAW in fits:
        pushing = climber if slips else replace(climber, wheel_radius=found["wheel_radius"])
        of_kept = replace(task, windows=kept.windows).equations(YAW)
        found = replace(found, resisted=resisted(of_kept, pushing, task.noise(YAW)))
    found = with_scrub(found, columns, climber, slips)
    found = replace(found, lacks=tuple(lacks(found, motion, climber)))
    return replace(found, reasons=reasons(found, motion, climber, cut))


def predicted(
    motion: RecordedMotion, climber: Climber, cut: Cut = CUT, site: Site = SITE
) -> Identified:
    """What would be found of `climber` if it moved like this, with noise of `NOISE`."""
    task = Task(motion, climber, site, _windows(motion, cut))
    columns = _columns(task.extent)
    fits = {
        kind: WindowFit.standardised(task.equations(kind), columns[kind], task.noise(kind))
        for kind in task.kinds
    }
    values, widths, sought = parameters(fits, columns, climber)
    none = np.zeros_like(widths.white)
    white = Widths(none, widths.white, none)
    return Identified(values, white, sought, fits, task.extent, task.windows, site)


@dataclass(frozen=True)
class Task:
    """The equations that are fitted: a motion, cut into windows, of a climber on its site."""

    motion: RecordedMotion
    climber: Climber
    site: Site
    windows: Windows  # by kind of equation

    @property
    def kinds(self) -> list[str]:
        """Kinds of equations with enough windows."""
        yawing = [YAW] if len(self.windows[YAW]) >= LEAST_WINDOWS else []
        return [DRIVE, *yawing, *([] if self.motion.wheel_angles is None else [WAY, HEADING])]

    def equations(self, kind: str) -> list[Equations]:
        """Equations of one kind in each of its windows."""
        motion, windows = self.motion, self.windows[kind]
        if kind == DRIVE:
            return drive_equations(motion, self.climber, self.site, windows)
        made_of = {YAW: yaw_equations, WAY: way_equations, HEADING: heading_equations}
        return made_of[kind](motion, windows)

    @property
    def extent(self) -> Extent:
        """What drove the climber, and how it moved."""
        load = friction_load(self.motion, self.climber, self.site)
        time, impulse, _, distance, _ = self._changes(DRIVE)
        yaw_time, _, angular_impulse, _, angle = self._changes(YAW)
        speed, yaw_rate = distance / time, angle / yaw_time
        each = impulse / time, angular_impulse / yaw_time, load, speed, yaw_rate
        rms = [float(np.sqrt(np.mean(values**2))) if len(values) else 0.0 for values in each]
        spreads = [float(np.std(np.abs(rate))) if len(rate) else 0.0 for rate in (speed, yaw_rate)]
        return Extent(*rms, *spreads)

    def noise(self, kind: str) -> Array:
        """Standard deviations (q,) that are assumed at first of what is measured."""
        return np.array(NOISE[kind][-1:] if self.motion.rates is None else NOISE[kind])

    def acting(self, delay: float, lag: float) -> "Task":
        """The same, if torques act `delay` [s] later and with a `lag` of first order [s]."""
        return replace(self, motion=self.motion.acting(delay, lag))

    def fitted(self, columns: Columns) -> tuple["Task", dict[str, WindowFit]]:
        """The task with the windows that were kept (see `Misfit.strange`), and fits by kind."""
        windows, fits = dict(self.windows), {}
        for kind, own in columns.items():
            fits[kind], kept = _fitted(self.equations(kind), own, self.noise(kind))
            windows[kind] = [self.windows[kind][number] for number in kept]
        return replace(self, windows=windows), fits

    def with_delay(self, columns: Columns) -> Columns:
        """The columns of what torques drive, and that of a delay."""
        return {kind: (*columns[kind], LATE) for kind in self.kinds if kind in (DRIVE, YAW)}

    def shows_rotors(self, columns: tuple[int, ...], without: WindowFit) -> bool:
        """Whether (11) shows rotors: inertia that has no weight.

        Where none are assumed, they must explain what the fit `without` them does not.
        """
        assumed, (lacking, *_) = self.climber.rotor_inertia > 0, without.misfit.excess
        if not (assumed or lacking > 0):
            return False
        fit = self.fitted({DRIVE: (*columns, WEIGHTLESS, LATE)})[1][DRIVE]
        share, error = -float(fit.coefficients[-2]), SURE * fit.deviation(-2)
        if assumed:
            return error < 1.0
        is_all = bool(fit.misfit.excess[0] < EXPLAINED * lacking)
        return is_all and max(LEAST_ROTORS, error) < share < 1.0

    def _changes(self, kind: str) -> Array:
        """Time [s], impulse [N s], angular impulse [N m s], way [m], angle [rad] (5, n windows)."""
        motion = self.motion
        impulses: Any = self.climber.force_and_moment(motion.impulse)
        all_of_it = np.stack([motion.time, *impulses, motion.way, motion.pose[:, 2]])
        ends = np.array([window[[0, -1]] for window in self.windows[kind]], np.intp).reshape(-1, 2)
        return all_of_it[:, ends[:, 1]] - all_of_it[:, ends[:, 0]]


def _windows(motion: RecordedMotion, cut: Cut) -> Windows:
    """Windows by kind, where torques are known even if they act later than assumed."""
    known = motion.time >= motion.time[0] + DELAYS[-1]
    inner = replace(motion, stretch=np.where(known, motion.stretch, -1))
    driving, yawing = cut.windows(inner), cut.yaw_windows(inner)
    return {DRIVE: driving, YAW: yawing, WAY: driving, HEADING: driving}


def _columns(extent: Extent) -> dict[str, tuple[int, ...]]:
    """Columns of the coefficients that are fitted, by kind of equation."""
    # else noise would pass for a difference of speeds, which makes none in friction
    spreads = {
        DRIVE: extent.speed_spread >= SPREAD * extent.speed,
        YAW: extent.yaw_rate_spread >= SPREAD * extent.yaw_rate,
    }
    both = {kind: (0, 1, VISCOUS) if differs else (0, 1) for kind, differs in spreads.items()}
    return {**both, WAY: (0,), HEADING: (0,)}


def _fitted(
    equations: list[Equations], columns: tuple[int, ...], noise: Array
) -> tuple[WindowFit, list[int]]:
    """Fit to the windows, without those that fit much worse, and indices of those kept."""
    kept, fit = list(range(len(equations))), WindowFit.of(equations, columns, noise)
    least = max(LEAST_WINDOWS, int((1 - FEW) * len(equations)))
    for _ in range(REJECTIONS):
        strange = fit.misfit.strange
        if not strange.any() or len(kept) - strange.sum() < least:
            break
        kept = [number for number, odd in zip(kept, strange, strict=True) if not odd]
        fit = WindowFit.of([equations[number] for number in kept], columns, noise)
    return fit, kept
