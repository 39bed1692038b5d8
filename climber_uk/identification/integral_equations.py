"""The climber's equations in integral form, linear in their coefficients, window by window.

    v - ∫ (g·e + u ω) dt = v₀ + a₁ ∫ (τR + τL) dt - a₂ ∫ (1-k) P S σ dt - a₃ ∫ v dt
                           + a₄ ∫ g·e dt                                                  (11)
    ω                    = ω₀ + b₁ ∫ (τR - τL) dt - b₂ ∫ sgn ω dt - b₃ ∫ ω dt             (15)

and integrated once more, for the way and the heading; where wheel angles are known, way and heading
by these. g·e is gravity along the heading, u a side slip (0 of wheels that hold), and σ
the direction in which the seal slides. a₄ is of rotors, which have inertia and no weight. Nothing
is differentiated, and what is integrated are torques, which are known: only the noise of heading
and way gets into the regressors, where it hardly counts. v₀, ω₀ and the like are different in each
window, and projected out.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from climber_uk.identification.even_time import gaps
from climber_uk.identification.recorded_motion import SMOOTHING, Indices, RecordedMotion
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.wall import Plane, Wall
from climber_uk.parameters.declaration import parameter, parameters


class Equations(NamedTuple):
    """Equations of one window: target = start · unknowns + design · coefficients + noise.

    Rows are the times of the first measured quantity, then those of the second. `lacking` is what
    an acceleration that is missing in the equations would add (of wheels: a speed): a constant one
    of 1, and one that goes from -√3 to √3 in the window.
    """

    start: Array  # (rows, unknowns)
    design: Array  # (rows, coefficients)
    target: Array  # (rows,)
    lacking: Array  # (rows, 2)
    measured: int  # number of measured quantities


@dataclass(frozen=True)
class Site:
    """What a climber was driven on, and what rubs on it."""

    wall: Wall = field(default_factory=Plane)
    has_seal: bool = True
    scrubs: bool = False  # whether wheels or tracks do as it turns


FEWEST = 4  # odometry messages in a window


@parameters
class Cut:
    """How a motion is cut into windows, in which its direction does not change."""

    window: float = parameter(
        1.0, "s", "length of a window: longer ones are less noisy, but fewer", at_least=0.02
    )
    least_speed: float = parameter(
        0.02, "m/s", "speed that counts as motion: too low, and rest spoils the friction", above=0
    )
    least_yaw_rate: float = parameter(0.05, "rad/s", "yaw rate that counts as turning", above=0)

    def windows(self, motion: RecordedMotion) -> list[Indices]:
        """Indices of the times in each window in which it drives one way."""
        return self._cut(motion, motion.speed, self.least_speed)

    def yaw_windows(self, motion: RecordedMotion) -> list[Indices]:
        """Indices of the times in each window in which it turns one way."""
        return self._cut(motion, motion.smooth_rates[:, 1], self.least_yaw_rate)

    def _cut(self, motion: RecordedMotion, rate: Array, least: float) -> list[Indices]:
        moving = np.abs(rate) > least
        breaks = (np.diff(np.sign(rate) * moving) != 0) | (np.diff(motion.stretch) != 0)
        breaks |= gaps(motion.time)
        windows: list[Indices] = []
        for run in np.split(np.arange(len(motion.time)), np.flatnonzero(breaks) + 1):
            time = motion.time[run]
            # smoothed rates do not show rest, without friction, so close to a change of direction
            inner = run[(time >= time[0] + SMOOTHING) & (time <= time[-1] - SMOOTHING)]
            duration = np.ptp(motion.time[inner]) if len(inner) else 0.0
            count = min(int(duration / self.window + 1e-6), len(inner) // FEWEST)
            count *= int(moving[run[0]])
            windows += np.array_split(inner, count) if count else []
        return windows


def drive_equations(
    motion: RecordedMotion, climber: Climber, site: Site, windows: Sequence[Indices]
) -> list[Equations]:
    """(11) in each window: a₁, a₂, a₃, a₁ times how much later torques act than assumed, and a₄."""
    gravity, load = gravity_ahead(motion, climber, site), friction_load(motion, climber, site)
    speed, yaw_rate = motion.smooth_rates.T
    sliding = np.hypot(speed, motion.side_slip)
    share = speed / np.maximum(sliding, 1e-9)  # of the seal's friction that is along the heading
    resisted = np.column_stack([load * share, speed])
    known = gravity + motion.side_slip * yaw_rate
    found = []
    for window in windows:
        pulled = integral(gravity[window], motion.time[window])
        driven = np.column_stack([_impulses(motion, window, 0, resisted[window]), pulled])
        found.append(_driven(motion, window, 0, motion.way, driven, known[window]))
    return found


def yaw_equations(motion: RecordedMotion, windows: Sequence[Indices]) -> list[Equations]:
    """(15) in each window: b₁, b₂, b₃, and b₁ times how much later torques act than assumed."""
    found, yaw_rate = [], motion.smooth_rates[:, 1]
    for window in windows:
        sign = np.sign(yaw_rate[window[len(window) // 2]])
        resisted = np.column_stack([np.full(len(window), sign), yaw_rate[window]])
        driven, known = _impulses(motion, window, 1, resisted), np.zeros(len(window))
        found.append(_driven(motion, window, 1, motion.pose[:, 2], driven, known))
    return found


def way_equations(motion: RecordedMotion, windows: Sequence[Indices]) -> list[Equations]:
    """Way = r (φR + φL)/2 in each window, where wheel angles are known."""
    return _of_wheels(motion, windows, motion.way, (1.0, 1.0))


def heading_equations(motion: RecordedMotion, windows: Sequence[Indices]) -> list[Equations]:
    """Heading = r/d (φR - φL)/2 in each window, where wheel angles are known."""
    return _of_wheels(motion, windows, motion.pose[:, 2], (1.0, -1.0))


def friction_load(motion: RecordedMotion, climber: Climber, site: Site) -> Array:
    """Normal force on the seal (1 - k) P S (n,) [N], μ of which is friction; 1 N without a seal."""
    if not site.has_seal:
        return np.ones(len(motion.time))
    return (1 - climber.wheel_load_share) * climber.suction_area * motion.pressure


def gravity_ahead(motion: RecordedMotion, climber: Climber, site: Site) -> Array:
    """Gravity along the heading (n,) [m/s²]."""
    x, y, heading = motion.pose.T
    s_x, s_y = site.wall.along(climber.inclination, x, y)
    return GRAVITY * (s_x * np.cos(heading) + s_y * np.sin(heading))


def _impulses(motion: RecordedMotion, window: Indices, column: int, resisted: Array) -> Array:
    """What a₁, a₂, a₃ and a₁ δ of a delay δ are multiplied with, or b₁ to b₁ δ (m, 4).

    The speed (column 0) is changed by τR + τL, the yaw rate (1) by τR - τL. `resisted` (m, 2) is
    what friction's coefficients are multiplied with.
    """
    time, pair = motion.time[window], np.array([1.0, (1.0, -1.0)[column]])
    pushed, late = motion.impulse[window] @ pair, motion.torques[window] @ pair
    return np.column_stack([pushed - pushed[0], -integral(resisted, time), late[0] - late])


def _driven(
    motion: RecordedMotion, window: Indices, column: int, gone: Array, impulses: Array, known: Array
) -> Equations:
    """Of the speed (column 0) or the yaw rate (1), by `impulses` (m, c) in the window.

    `gone` (n,) is how far the climber has gone, or turned, by each of the motion's times, `known`
    (m,) the acceleration that has no coefficient.
    """
    time = motion.time[window]
    rate = None if motion.rates is None else motion.rates[window, column]
    return _twice_integrated(time, rate, gone[window], impulses, integral(known, time))


def _twice_integrated(
    time: Array, rate: Array | None, gone: Array, impulses: Array, known: Array
) -> Equations:
    """Equations of a rate, if it is measured (else None), and of its integral `gone` (m,).

    `impulses` (m, c) multiply the coefficients, `known` (m,) is what adds to the rate without one.
    """
    one, since = np.ones_like(time), time - time[0]
    lacking = integral(_shapes(time), time)
    start, target = np.column_stack([since, one]), gone - gone[0] - integral(known, time)
    design, moved = integral(impulses, time), integral(lacking, time)
    if rate is None:
        return Equations(start, design, target, moved, 1)
    return Equations(
        # an unknown of its own, as sensors of rates have a bias
        np.concatenate([np.column_stack([one, 0 * start]), np.column_stack([0 * one, start])]),
        np.concatenate([impulses, design]),
        np.concatenate([rate - known, target]),
        np.concatenate([lacking, moved]),
        2,
    )


def _of_wheels(
    motion: RecordedMotion, windows: Sequence[Indices], gone: Array, signs: tuple[float, float]
) -> list[Equations]:
    """Of `gone` (n,), by half the sum of the wheels' angles with these `signs`."""
    assert motion.wheel_angles is not None
    angle, found = motion.wheel_angles @ np.array(signs) / 2, []
    for window in windows:
        time, since = motion.time[window], window[0]
        one, turned = np.ones((len(time), 1)), (angle[window] - angle[since])[:, None]
        lacking = integral(_shapes(time), time)
        found.append(Equations(one, turned, gone[window] - gone[since], lacking, 1))
    return found


def _shapes(time: Array) -> Array:
    """1, and a line of mean 0 and mean square 1 (n, 2)."""
    middle, half = (time[0] + time[-1]) / 2, (time[-1] - time[0]) / 2
    return np.column_stack([np.ones_like(time), np.sqrt(3) * (time - middle) / half])


def integral(values: Array, time: Array) -> Array:
    """Integral of values (n,) or (n, k) from the first time (n,) to each, by the trapezoidal rule.

    scipy's takes more than twice as long for the few values of a window, and a search for lateness
    needs it ten thousand times.
    """
    steps, total = np.diff(time).reshape(-1, *[1] * (values.ndim - 1)), np.zeros(values.shape)
    np.cumsum(steps * (values[1:] + values[:-1]) / 2.0, axis=0, out=total[1:])
    return total
