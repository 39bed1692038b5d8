"""Result of an identification: parameters with intervals, and why others are not determined."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from climber_uk.identification.integral_equations import Site
from climber_uk.identification.recorded_motion import Indices
from climber_uk.identification.window_fit import WindowFit
from climber_uk.mechanics import Array

Choice = NDArray[np.bool_]
UNITS = {
    "mass": "kg",
    "seal_friction_coefficient": "",
    "viscous_friction": "N s/m",
    "rotor_inertia": "kg m²",
    "yaw_inertia": "kg m²",
    "turning_friction": "N m",
    "turning_resistance": "N m s",
    "wheel_radius": "m",
    "half_track": "m",
}
NAMES = tuple(UNITS)
ROTORS = "rotor_inertia"
OF_TURNING = ("yaw_inertia", "turning_friction", "turning_resistance")
DRIVE, YAW, WAY, HEADING = "drive", "yaw", "way", "heading"  # kinds of equations
IN_TIME = (0.0, 0.0)
UNRESISTED = (0.0, float("inf"))
KNOWN = 0.1  # uncertainty, relative to the value or the drive, above which a value is of no use
NOTHING = 1e-100
WORTH_A_WORD = 0.01  # share of all drive: a model error below it is not reported
SLIGHT = 5e-4  # likewise, of a weight that is not as assumed: it shows less than it is wrong
WEIGHT = ("the weight's part across the heading", "the height")  # explain a weight not as assumed
WORDS = {
    DRIVE: ("the drive", "N"),
    YAW: ("the moment", "N m"),
    WAY: ("the wheels' way", "m/s"),
    HEADING: ("the wheels' turn", "rad/s"),
}
HINTS = {
    WEIGHT[0]: "is the wall tilted, or the centre of mass beside the centre?",
    WEIGHT[1]: "is the wall round, or do wheels scrub?",
    "the yaw rate": "do wheels or a seal scrub?",
    "the speed": "is friction neither Coulomb's nor viscous?",
    "the side it turns to": "are the wheels, or their motors, unlike?",
    "the time": "does something wear, warm up or leak?",
}


class Extent(NamedTuple):
    """What drove a climber and how it moved: root mean squares of the windows' means."""

    force: float  # [N] of the motors along the climber
    moment: float  # [N m] of the motors about the vertical
    load: float  # [N] of the seal; 1 N without one
    speed: float  # [m/s]
    yaw_rate: float  # [rad/s]
    speed_spread: float  # [m/s] standard deviation of the windows' speeds
    yaw_rate_spread: float  # [rad/s]


class Widths(NamedTuple):
    """By how much each parameter (9,) may be wrong, by cause: half widths of 95 % intervals."""

    spread: Array  # what differs from window to window
    white: Array  # noise alone
    bias: Array  # what the model lacks

    @property
    def whole(self) -> Array:
        """Half widths of the whole intervals (9,)."""
        return np.maximum(self.spread, self.white) + self.bias


class Reason(NamedTuple):
    """Why a parameter is not determined."""

    cause: str  # not excited, collinear, noise, misfit, torques; or absent: not an error
    words: str


class Lack(NamedTuple):
    """What the equations of one kind do not explain: root mean squares of all windows."""

    kind: str
    ratio: float  # χ² by the number of windows: about 1 for a model that fits
    size: float  # beyond noise [N], [N m], [m/s] or [rad/s]; 0 where the test does not fail
    share: float  # of the drive (force, moment, speed or yaw rate) as a whole
    goes_with: str  # what it is correlated with; '' for nothing

    @property
    def fits(self) -> bool:
        """Whether it is too little to be reported."""
        return self.share <= (SLIGHT if self.goes_with in WEIGHT else WORTH_A_WORD)

    @property
    def words(self) -> str:
        """A sentence on it, whether it `fits` or not."""
        what, unit = WORDS[self.kind]
        lacking = f"{self.size:.2g} {unit} of {what}, {self.share:.2g} of it, are not explained"
        hint = f" ({HINTS[self.goes_with]})" if self.goes_with in HINTS else ""
        return lacking + (f", and go with {self.goes_with}{hint}" if self.goes_with else "")


@dataclass(frozen=True)
class Identified:
    """Parameters in the order of `NAMES`, and what they were found from."""

    values: Array  # (9,) if not sought: the climber's, or zero; nan: undetermined
    widths: Widths
    sought: Choice  # (9,) which were fitted
    fits: Mapping[str, WindowFit]  # by kind of equation, of those with enough windows
    extent: Extent
    windows: Mapping[str, list[Indices]]  # the times in each, by kind
    site: Site
    left_out: int = 0  # windows that fit much worse than the others
    late: tuple[float, float] = IN_TIME  # [s] delay and lag of the torques beyond what is assumed
    has_effective_track: bool = False  # of wheels that scrub, or may
    resisted: tuple[float, float] = UNRESISTED  # [N m] turning, and half width: see `resisted`
    slips: bool = False  # whether its wheels slip along their way: their angles show no radius
    lacks: Sequence[Lack] = ()  # the test of fit, by kind of equation
    reasons: Mapping[str, Reason] = field(default_factory=dict)  # by name, of undetermined ones

    def __getitem__(self, name: str) -> float:
        return float(self.values[NAMES.index(name)])

    @property
    def half_widths(self) -> Array:
        """Half widths of the 95 % intervals (9,)."""
        return self.widths.whole

    @property
    def known(self) -> Choice:
        """Which parameters are determined (9,)."""
        return np.array([name not in self.reasons for name in NAMES])

    @property
    def friction(self) -> float:
        """Coulomb and viscous friction together, at the motion's speed [N]."""
        coulomb = self["seal_friction_coefficient"] * self.extent.load
        return coulomb + self["viscous_friction"] * self.extent.speed

    @property
    def turning_moment(self) -> float:
        """Moment that resists turning, Coulomb and viscous, at the motion's yaw rate [N m]."""
        return self["turning_friction"] + self["turning_resistance"] * self.extent.yaw_rate

    def half_width(self, name: str) -> float:
        """Half width of a parameter's 95 % interval."""
        return float(self.half_widths[NAMES.index(name)])

    def is_clear(self, name: str) -> bool:
        """Whether zero is not in the interval of a parameter that was sought."""
        return abs(self[name]) > self.half_width(name) > 0

    @property
    def tells_resisted(self) -> bool:
        """Whether what resists turning is told only as one moment, at the bag's yaw rates."""
        moment, half_width = self.resisted
        is_sum = {"turning_friction", "turning_resistance"} <= self.reasons.keys()
        return is_sum and half_width <= KNOWN * moment

    @property
    def tells_effective_track(self) -> bool:
        """Whether wheel angles tell a half track well, but that of wheels that scrub."""
        is_odometrys = "wheel_radius" in self.reasons and not self.slips
        return self.has_effective_track and self.uncertainty[-1] <= KNOWN and not is_odometrys

    @property
    def uncertainty(self) -> Array:
        """Half widths (9,) relative to the value; for frictions, to the drive if that is more."""
        force, moment, load, speed, yaw_rate, *_ = np.maximum(self.extent, NOTHING)
        whole = np.array([0, force / load, force / speed, 0, 0, moment, moment / yaw_rate, 0, 0])
        values = np.nan_to_num(np.abs(self.values))
        return self.half_widths / np.maximum(values, np.maximum(whole, NOTHING))
