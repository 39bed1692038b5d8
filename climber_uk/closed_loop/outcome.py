"""Outcome of many closed loops, summed up while they run."""

from typing import Any, NamedTuple

import numpy as np

from climber_uk.control.control_law import Command
from climber_uk.mechanics import Array
from climber_uk.mechanics.adhesion import MAX_MARGIN
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact, is_pulled_off
from climber_uk.mechanics.elementary import anywhere, larger, select, smaller
from climber_uk.mechanics.quantities import Motion, ReferencePoint, Torques
from climber_uk.mechanics.wall import Wall, gravity, weight

SETTLED = 0.01  # [m] from the reference, within which a loop has settled


class Outcome(NamedTuple):
    """Outcome of each loop, arrays (N,), up to its fall if it fell."""

    rms: Array  # of the distance from the reference [m]
    worst: Array  # highest distance [m]
    last: Array  # distance at the end [m]
    settled: Array  # last time further away than `SETTLED` [s]
    peak_torque: Array  # of a wheel [N m]
    saturated: Array  # share of the commands that limits cut
    slip_margin: Array  # lowest
    tip_margin: Array  # lowest
    fell: Array  # time of the fall [s]; infinite without one


class Sums(NamedTuple):
    """Sums and extremes of the periods so far, of each loop until its fall, arrays (N,)."""

    periods: Any
    squares: Any  # of the distance [m²]
    saturated: Any
    worst: Any  # square of the distance [m²]
    last: Any  # likewise
    settled: Any
    peak_torque: Any
    slip_margin: Any
    tip_margin: Any
    fell: Any


class Tally:
    """Sums up many loops, period by period."""

    def __init__(self, sums: Sums, contact: Contact, wall: Wall | None) -> None:
        self.sums, self.contact, self.wall = sums, contact, wall
        self._climber: Climber | None = None
        self._on_wall: Any = True  # or an array (N,), once one has fallen

    @classmethod
    def begun(cls, number: int, contact: Contact, wall: Wall | None = None) -> "Tally":
        """Tally of `number` loops, on a wall; None: an untilted plane."""
        none, most, never = np.zeros(number), np.full(number, MAX_MARGIN), np.full(number, np.inf)
        return cls(Sums(*(*[none] * 7, most, most, never)), contact, wall)

    def add(
        self,
        time: Any,
        motion: Motion,
        target: ReferencePoint,
        command: Command,
        wheels: Torques,
        climber: Climber,
    ) -> None:
        """Add a period that begins at `time` [s], with the torques that act on the wheels in it."""
        if climber is not self._climber or self.wall is not None:
            self._update_fallen(time, climber, motion)
        x, y = motion.x - target.x, motion.y - target.y
        square, on, sums = x * x + y * y, self._on_wall, self.sums
        is_far = square > SETTLED * SETTLED
        cut = select(command.fits, sums.saturated, sums.saturated + 1)
        torque = larger(abs(wheels.right), abs(wheels.left))
        _, across = weight(self.wall, climber, motion)
        lateral = climber.mass * motion.speed * motion.yaw_rate - across
        forces = wheels.right / climber.wheel_radius, wheels.left / climber.wheel_radius
        margin = self.contact.slip_margin(climber, self._into, forces, lateral, across)
        self.sums = Sums(
            periods=select(on, sums.periods + 1, sums.periods),
            squares=select(on, sums.squares + square, sums.squares),
            saturated=select(on, cut, sums.saturated),
            worst=select(on, larger(sums.worst, square), sums.worst),
            last=select(on, square, sums.last),
            settled=select(is_far & on, time, sums.settled),
            peak_torque=select(on, larger(sums.peak_torque, torque), sums.peak_torque),
            slip_margin=select(on, smaller(sums.slip_margin, margin), sums.slip_margin),
            tip_margin=sums.tip_margin,
            fell=sums.fell,
        )

    def _update_fallen(self, time: Any, climber: Climber, motion: Motion) -> None:
        """Find the loops that fall at `time` [s], in `motion`, if `climber` is the true one."""
        self._climber = climber
        self._into, along = gravity(self.wall, climber, motion)
        normal = self.contact.normal_force(climber, self._into)
        tip = self.contact.tip_margin(climber, self._into, along)
        falls = is_pulled_off(climber, normal) | (tip < 1)
        sums = self.sums
        tip = select(sums.fell == np.inf, smaller(sums.tip_margin, tip), sums.tip_margin)
        fell = smaller(sums.fell, select(falls, time, np.inf))
        self.sums = sums._replace(tip_margin=tip, fell=fell)
        if anywhere(fell < np.inf):
            self._on_wall = fell == np.inf

    def outcome(self) -> Outcome:
        """Outcome of the periods so far."""
        sums = Sums(*(np.asarray(each) for each in self.sums))
        periods = np.maximum(sums.periods, 1)
        return Outcome(
            rms=np.sqrt(sums.squares / periods),
            worst=np.sqrt(sums.worst),
            last=np.sqrt(sums.last),
            settled=sums.settled,
            peak_torque=sums.peak_torque,
            saturated=sums.saturated / periods,
            slip_margin=sums.slip_margin,
            tip_margin=sums.tip_margin,
            fell=sums.fell,
        )
