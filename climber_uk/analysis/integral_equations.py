"""The climber's equations in integral form, linear in their coefficients, window by window.

    v + g_t ∫ sinθ dt = v₀ + a₁ ∫ (τR + τL) dt - a₂ ∫ (1-k) P S σ dt - a₃ ∫ v dt          (11)
    ω                 = ω₀ + b₁ ∫ (τR - τL) dt - b₂ ∫ ω dt                                (15)

and integrated once more, for the way and the heading; where wheel angles are known, way and heading
as these tell them. Nothing is differentiated, and what is integrated are torques, which are known:
only the noise of heading and way gets into the regressors, where it hardly counts. v₀, ω₀ and the
like are different in each window, and projected out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.linalg import block_diag

from climber_uk.analysis.recorded_motion import Indices, RecordedMotion
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.parameter import check, parameter

GAP = 0.1  # [s] without odometry, over which nothing is integrated


class Equations(NamedTuple):
    """Of one window: target = start · unknowns + design · coefficients + noise.

    Rows are the times of what is measured first, then those of what is measured second.
    """

    start: Array  # (rows, unknowns)
    design: Array  # (rows, coefficients)
    target: Array  # (rows,)
    measured: int  # how many quantities


@dataclass(frozen=True)
class Cut:
    """How a motion is cut into windows, in which its direction does not change."""

    window: float = parameter(1.0, "s", "length of a window", above=0)
    least_speed: float = parameter(0.02, "m/s", "below which it may as well rest", above=0)

    def __post_init__(self) -> None:
        check(self)

    def windows(self, motion: RecordedMotion) -> list[Indices]:
        """Indices of the times in each window."""
        moving = np.abs(motion.speed) > self.least_speed
        direction = np.sign(motion.speed) * moving
        breaks = (np.diff(direction) != 0) | (np.diff(motion.stretch) != 0)
        breaks |= np.diff(motion.time) > GAP
        windows: list[Indices] = []
        for run in np.split(np.arange(len(motion.time)), np.flatnonzero(breaks) + 1):
            duration = motion.time[run[-1]] - motion.time[run[0]]
            count = int(duration / self.window + 1e-6) * int(moving[run[0]])
            windows += np.array_split(run, count) if count else []
        return windows


def equations(motion: RecordedMotion, climber: Climber, window: Indices) -> list[Equations]:
    """Those of drive and turn, and with wheel angles those of way and heading, in one window."""
    time, angles = motion.time[window], motion.wheel_angles
    heading = motion.pose[window, 2]
    way, turned = _since_start(motion.way[window]), _since_start(heading)
    right, left = _since_start(motion.impulse[window]).T
    direction = np.sign(motion.speed[window[len(window) // 2]])
    load = seal_load(motion, climber)[window]
    resisting = _integral(motion.smooth_rates[window], time).T
    driven = np.column_stack([right + left, -direction * _integral(load, time), -resisting[0]])
    turning = np.column_stack([right - left, -resisting[1]])
    weight = climber.weight_along_wall / climber.mass * _integral(np.sin(heading), time)
    speed, yaw_rate = (None, None) if motion.rates is None else motion.rates[window].T
    both = [
        _twice_integrated(time, speed, way, driven, weight),
        _twice_integrated(time, yaw_rate, turned, turning, 0 * way),
    ]
    if angles is None:
        return both
    right, left = _since_start(angles[window]).T
    one = np.ones((len(time), 1))
    return [
        *both,
        Equations(one, (right + left)[:, None] / 2, way, 1),
        Equations(one, (right - left)[:, None] / 2, turned, 1),
    ]


def seal_load(motion: RecordedMotion, climber: Climber) -> Array:
    """(1 - k) P S (n,) [N], of which the seal rubs with μ times as much."""
    return (1 - climber.wheel_load_share) * climber.suction_area * motion.pressure


def standardised(kinds: Sequence[Equations], noise: Array) -> tuple[Array, Array, Indices]:
    """Design (rows, c), target (rows,) and number of the quantity (rows,) of all kinds at once.

    In units of the `noise` (q,) of the quantities, with what each window starts with projected out.
    """
    numbers = np.split(np.arange(len(noise)), np.cumsum([kind.measured for kind in kinds])[:-1])
    quantity = np.concatenate(
        [
            np.repeat(number, len(kind.target) // kind.measured)
            for kind, number in zip(kinds, numbers, strict=True)
        ]
    )
    scale = noise[quantity][:, None]
    start, _ = np.linalg.qr(block_diag(*(kind.start for kind in kinds)) / scale)
    design = block_diag(*(kind.design for kind in kinds))
    whole = np.column_stack([design, np.concatenate([kind.target for kind in kinds])]) / scale
    whole -= start @ (start.T @ whole)
    return whole[:, :-1], whole[:, -1], quantity


def _twice_integrated(
    time: Array, rate: Array | None, gone: Array, impulses: Array, known: Array
) -> Equations:
    """Of a rate, if it is measured, and of how far it has `gone`."""
    one, since = np.ones_like(time), _since_start(time)
    start, design = np.column_stack([since, one]), _integral(impulses, time)
    target = gone + _integral(known, time)
    if rate is None:
        return Equations(start, design, target, 1)
    return Equations(
        np.concatenate([np.column_stack([one, 0 * one]), start]),
        np.concatenate([impulses, design]),
        np.concatenate([rate + known, target]),
        2,
    )


def _since_start(values: Array) -> Array:
    return values - values[0]


def _integral(values: Array, time: Array) -> Array:
    integral: Array = cumulative_trapezoid(values, time, axis=0, initial=0)
    return integral
