"""Mass, inertia, friction and geometry of a climber from how it moved and what drove it.

The coefficients of `integral_equations`,

    a = (1/(m r), μ/m, c/m)      b = (d/(J r), D/J)      and with wheel angles  r  and  r/d,

are fitted to all windows at once (`window_fit`), and give the parameters. Those of a Coulomb and a
viscous friction can be told apart where speeds differ, mass and friction where the weight along the
way does, or the speed changes.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from climber_uk.analysis.integral_equations import Cut, Equations, equations, seal_load
from climber_uk.analysis.recorded_motion import Indices, RecordedMotion
from climber_uk.analysis.window_fit import WindowFit
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber

Choice = NDArray[np.bool_]
UNITS = {
    "mass": "kg",
    "seal_friction_coefficient": "",
    "viscous_friction": "N s/m",
    "yaw_inertia": "kg m²",
    "turning_resistance": "N m s",
    "wheel_radius": "m",
    "half_track": "m",
}
NAMES = tuple(UNITS)
RESISTANCES = np.array([False, False, True, False, True, False, False])  # which there need not be
OF_WHEELS = np.array([False] * 5 + [True] * 2)  # which wheel angles tell
CUT, LEAST_WINDOWS, REFINEMENTS = Cut(), 5, 3
SPREAD = 0.05  # of the speed: least difference of speeds that shows viscous friction
KNOWN = 0.1  # of a value, or of all that drives: the widest interval that is of use
# [SI] of speed, way; yaw rate, heading; way; heading: noise to begin with, and a tenth of it is the
# least that is believed of a sensor.
NOISE = ((1e-2, 1e-3), (1e-2, 1e-3), (1e-3,), (1e-3,))
NOTHING = 1e-100


class Extent(NamedTuple):
    """What drove a climber and how it moved, root mean squares of the windows' means."""

    drive: float  # [N]
    turn: float  # [N m]
    load: float  # [N] of the seal
    speed: float  # [m/s]
    yaw_rate: float  # [rad/s]
    speed_spread: float  # [m/s] standard deviation of the windows' speeds


@dataclass(frozen=True)
class Identified:
    """Parameters in the order of `NAMES`, and what they were found from."""

    values: Array  # (7,) those that were not sought are the climber's, or zero
    half_widths: Array  # (7,) of the 95 % intervals
    sought: Choice  # (7,)
    noise: Array  # (q,) standard deviation of each measured quantity
    residuals: list[Array]  # (q) of (times in windows,), in these
    extent: Extent
    windows: list[Indices]  # the times in each

    def __getitem__(self, name: str) -> float:
        return float(self.values[NAMES.index(name)])

    @property
    def friction(self) -> float:
        """Of the seal and viscous, at the motion's speed [N]."""
        seal = self["seal_friction_coefficient"] * self.extent.load
        return seal + self["viscous_friction"] * self.extent.speed

    def is_clear(self, name: str) -> bool:
        """Whether zero is not in the interval of a parameter that was sought."""
        return abs(self[name]) > self.half_widths[NAMES.index(name)] > 0

    @property
    def uncertainty(self) -> Array:
        """Half widths as shares of the value, or of all drive or turn if that is more (7,)."""
        drive, turn, load, speed, yaw_rate, _ = np.maximum(self.extent, NOTHING)
        whole = np.array([0, drive / load, drive / speed, 0, turn / yaw_rate, 0, 0])
        return self.half_widths / np.maximum(np.abs(self.values), whole)

    @property
    def known(self) -> Choice:
        """Which intervals are narrow enough to be of use (7,)."""
        known: Choice = self.uncertainty <= KNOWN
        return known


def identify(motion: RecordedMotion, climber: Climber, cut: Cut = CUT) -> Identified:
    """Parameters of a climber that is believed to be `climber`; raises `ValueError`.

    Viscous friction and turning resistance that a motion does not show are taken for none.
    """
    windows = cut.windows(motion)
    if len(windows) < LEAST_WINDOWS:
        raise ValueError(
            f"{len(windows)} windows of {cut.window} s in motion must be >= {LEAST_WINDOWS}"
        )
    each = [equations(motion, climber, window) for window in windows]
    extent = _extent(motion, climber, windows)
    sought = ~OF_WHEELS | (motion.wheel_angles is not None)
    if extent.speed_spread < SPREAD * extent.speed:
        # noise would look like a difference of speeds, and tell that it makes none in friction
        sought[NAMES.index("viscous_friction")] = False
    found = Identified(*_fitted(each, climber, sought), extent, windows)
    needless = RESISTANCES & ~found.known
    if needless.any():
        found = Identified(*_fitted(each, climber, sought & ~needless), extent, windows)
    return found


def predicted(motion: RecordedMotion, climber: Climber, cut: Cut = CUT) -> Identified:
    """What would be found of `climber` if it moved like this, with the noise to begin with."""
    windows = cut.windows(motion)
    each = [equations(motion, climber, window) for window in windows]
    noise, values, sought = _noise(each), _believed(climber), ~OF_WHEELS
    fit, half_widths = WindowFit.of(each, noise), np.zeros(len(NAMES))
    half_widths[sought] = fit.half_widths(_slopes(values, sought), 0 * fit.target)
    extent = _extent(motion, climber, windows)
    return Identified(values, half_widths, sought, noise, [], extent, windows)


def _fitted(
    windows: list[list[Equations]], climber: Climber, sought: Choice
) -> tuple[Array, Array, Choice, Array, list[Array]]:
    """First fields of `Identified`, with the noise as it turns out to be."""
    noise = _noise(windows)
    least, coefficients, half_widths = 0.1 * noise, np.zeros(len(NAMES)), np.zeros(len(NAMES))
    for _ in range(REFINEMENTS):
        whole, used = WindowFit.of(windows, noise), noise
        fit = replace(whole, design=whole.design[:, sought[: whole.design.shape[1]]])
        coefficients[sought], residuals = fit.solved()
        each = [residuals[fit.quantity == number] for number in range(len(noise))]
        noise = np.maximum(noise * [1.4826 * np.median(np.abs(one)) for one in each], least)
    values = _parameters(coefficients, climber)
    half_widths[sought] = fit.half_widths(_slopes(values, sought), residuals)
    return values, half_widths, sought, used, each


def _slopes(values: Array, sought: Choice) -> Array:
    """Of the coefficients sought by the parameters sought; exact, by a complex step."""
    step = 1e-20
    slopes = [_coefficients(values + 1j * step * unit).imag / step for unit in np.eye(len(NAMES))]
    return np.stack(slopes, axis=1)[np.ix_(sought, sought)]


def _noise(windows: list[list[Equations]]) -> Array:
    kinds = zip(NOISE, windows[0], strict=False)
    return np.concatenate([sigmas[-kind.measured :] for sigmas, kind in kinds])


def _believed(climber: Climber) -> Array:
    return np.array([getattr(climber, name, 0.0) for name in NAMES])


def _coefficients(values: Array) -> Array:
    """Coefficients (7,) of parameters (7,)."""
    m, mu, c, J, D, r, d = values
    return np.array([1 / (m * r), mu / m, c / m, d / (J * r), D / J, r, r / d])


def _parameters(coefficients: Array, climber: Climber) -> Array:
    """Parameters (7,) of coefficients (7,); the climber's where these make no sense."""
    a_1, a_2, a_3, b_1, b_2, radius, per_track = coefficients.tolist()
    r = radius or climber.wheel_radius
    d = _quotient(r, per_track, climber.half_track)
    m, J = _quotient(1 / r, a_1, climber.mass), _quotient(d / r, b_1, climber.yaw_inertia)
    return np.array([m, a_2 * m, a_3 * m, J, b_2 * J, r, d])


def _quotient(dividend: float, divisor: float, believed: float) -> float:
    """Quotient, or what is believed if it were beyond a thousand times that."""
    return dividend / divisor if divisor > 1e-3 * dividend / believed else believed


def _extent(motion: RecordedMotion, climber: Climber, windows: list[Indices]) -> Extent:
    ends = np.array([window[[0, -1]] for window in windows]).T
    quantities = np.column_stack([motion.time, motion.impulse, motion.way, motion.pose[:, 2]])
    time, right, left, way, turned = (quantities[ends[1]] - quantities[ends[0]]).T
    drive, turn = climber.drive_and_turn(np.column_stack([right, left]) / time[:, None])
    each = (drive, turn, seal_load(motion, climber), way / time, turned / time)
    rms = [np.sqrt(np.mean(values**2)) for values in each]
    return Extent(*map(float, (*rms, np.std(np.abs(way / time)))))
