"""Outcome of many closed loops, summed up while they run."""

from typing import Any, NamedTuple

import numpy as np

from climber_uk.control.control_law import Command
from climber_uk.mechanics import Array
from climber_uk.mechanics.adhesion import MAX_MARGIN
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact, is_pulled_off
from climber_uk.mechanics.quantities import Motion, ReferencePoint, Torques

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


class Tally:
    """Sums and extremes of `number` loops, period by period."""

    def __init__(self, number: int, contact: Contact) -> None:
        self.contact, self.times = contact, np.zeros(number)
        self.squares, self.saturated = np.zeros(number), np.zeros(number)
        self.worst, self.last, self.settled_at = np.zeros((3, number))
        self.peak = np.zeros(number)
        self.slip, self.tip = np.full(number, MAX_MARGIN), np.full(number, MAX_MARGIN)
        self.fell = np.full(number, np.inf)
        self._climber: Climber | None = None
        self._on_wall: Any = True  # or an array (N,), once one has fallen

    def add(
        self,
        time: float,
        motion: Motion,
        target: ReferencePoint,
        command: Command,
        wheels: Torques,
        climber: Climber,
    ) -> None:
        """Add a period that begins at `time` [s], with the torques that act on the wheels in it."""
        if climber is not self._climber:
            self._update_fallen(time, climber)
        x, y = motion.x - target.x, motion.y - target.y
        square, on = x * x + y * y, self._on_wall
        np.add(self.times, 1, out=self.times, where=on)
        np.add(self.squares, square, out=self.squares, where=on)
        np.maximum(self.worst, square, out=self.worst, where=on)
        np.copyto(self.last, square, where=on)
        np.copyto(self.settled_at, time, where=(square > SETTLED * SETTLED) & on)
        np.add(self.saturated, np.logical_not(command.fits), out=self.saturated, where=on)
        for torque in wheels:
            np.maximum(self.peak, np.abs(torque), out=self.peak, where=on)
        lateral = climber.lateral_reaction(motion)
        forces = wheels.right / climber.wheel_radius, wheels.left / climber.wheel_radius
        across = -climber.weight_along_wall * motion.cosine
        margin = self.contact.slip_margin(climber, self._into, forces, lateral, across)
        np.minimum(self.slip, margin, out=self.slip, where=on)

    def _update_fallen(self, time: float, climber: Climber) -> None:
        """Find the loops that fall at `time` [s], as `climber` becomes the true one."""
        self._climber = climber
        self._into = climber.gravity_into_wall
        normal = self.contact.normal_force(climber, self._into)
        along = climber.weight_along_wall / climber.mass
        tip = self.contact.tip_margin(climber, self._into, along)
        falls = is_pulled_off(climber, normal) | (tip < 1)
        self.tip = np.minimum(self.tip, tip)
        self.fell = np.minimum(self.fell, np.where(falls, time, np.inf))
        if np.isfinite(self.fell).any():
            self._on_wall = np.isinf(self.fell)

    def outcome(self) -> Outcome:
        """Outcome of the periods so far."""
        times = np.maximum(self.times, 1)
        return Outcome(
            *(np.sqrt(self.squares / times), np.sqrt(self.worst), np.sqrt(self.last)),
            *(self.settled_at, self.peak, self.saturated / times, self.slip, self.tip, self.fell),
        )
