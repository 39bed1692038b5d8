"""What limits a climber along its path, in X = ṡ² and U = s̈: X and bounds of U at each place.

Torques, speeds and accelerations of a climber that is exactly on its path are affine in X and U
(docs/theory.md, §9.3), so that at each place and X the U that are allowed are an interval.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, NoReturn

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.wall import Wall
from climber_uk.mechanics.waypoints import Rounding, SlowedPath
from climber_uk.path_check.demands import Reserves, reserves

HALVINGS = 50
SLOWLY = 0.02  # [m/s] at which what is affine is looked at
LEAST_EFFECT = 1e-12  # of U on a row: below it, it has none


@dataclass(frozen=True)
class Limits:
    """What is to be kept, beside what motors can do."""

    margin: float = 1.5  # of slipping
    speed: float = 100.0  # [m/s]: no climber is faster
    yaw_rate: float = np.inf  # [rad/s]
    acceleration: float = np.inf  # [m/s²] of the centre, along and across

    def with_those_of(self, shape: Any) -> "Limits":
        """These, and those of a path through points."""
        if not isinstance(shape, Rounding):
            return self
        yaw_rate = min(self.yaw_rate, shape.max_yaw_rate)
        acceleration = min(self.acceleration, shape.max_acceleration)
        return Limits(self.margin, self.speed, yaw_rate, acceleration)


class Affine(NamedTuple):
    """Numbers (..., n) that are c + x X + u U."""

    c: Array
    x: Array
    u: Array

    @classmethod
    def of(cls, X: Array, at_one: Array, at_two: Array, with_second: Array) -> "Affine":
        """From values at (X, 0), (2 X, 0) and (X, 1)."""
        x = (at_two - at_one) / X
        return cls(at_one - x * X, x, with_second - at_one)


@dataclass(frozen=True)
class PathLimits:
    """Limits at n places s of a path; `tighter` (n,) takes a share of all that is allowed."""

    trajectory: Trajectory
    climber: Climber
    contact: Contact
    wall: Wall
    limits: Limits
    s: Array  # (n,)
    tighter: Array  # (n,)
    torques: Affine  # (2, n) right, left [N m]
    lateral: Affine  # (n,) [N]
    loads: Affine  # (2, n) [N] of the wheels
    rates: Array  # (2, n) of the wheels at ṡ = 1 [rad/s]
    forwards: Affine  # (n,) acceleration along [m/s²]
    across: Array  # (n,) acceleration across by X [m/s²]
    fastest: Array  # (n,) ṡ by speed, yaw rate and the rate at which a motor has no torque left

    @classmethod
    def of(
        cls,
        trajectory: Trajectory,
        climber: Climber,
        contact: Contact,
        wall: Wall,
        limits: Limits,
        s: Array,
        share: float,
    ) -> "PathLimits":
        """Limits at `s` (n,) of a trajectory's course, and a `share` of what they allow.

        Raises `ValueError` if the climber tips over.
        """
        limits = limits.with_those_of(trajectory.shape)
        one = trajectory.at_progress((s, 1 + 0 * s, 0 * s, 0 * s))
        speed, yaw_rate = np.abs(one.speed), np.abs(one.yaw_rate)
        rate = SLOWLY / speed  # at which no curve lifts it off
        at = [
            trajectory.at_progress((s, by * rate, of + 0 * s, 0 * s))
            for by, of in ((1.0, 0.0), (np.sqrt(2.0), 0.0), (1.0, 1.0))
        ]
        found = [reserves(each, climber, contact, wall=wall) for each in at]
        _check_tip(found[0], one)
        affine = partial(Affine.of, rate**2)
        most = np.minimum(_leg_speed(trajectory, s), limits.speed)
        rates = np.stack(found[0].rates) / rate
        no_load = climber.no_load_wheel_rate or np.inf
        with np.errstate(divide="ignore"):
            fastest = np.minimum(most / speed, limits.yaw_rate / yaw_rate)
            fastest = np.minimum(fastest, no_load / np.abs(rates).max(axis=0))
        return cls(
            trajectory=trajectory,
            climber=climber,
            contact=contact,
            wall=wall,
            limits=limits,
            s=s,
            tighter=np.full_like(s, share),
            torques=affine(*(np.stack(each.torques) for each in found)),
            lateral=affine(*(each.lateral for each in found)),
            loads=affine(*(np.stack(each.loads) + 0 * s for each in found)),
            rates=rates,
            forwards=affine(*(each.forward_acceleration for each in at)),
            across=speed * yaw_rate,
            fastest=fastest,
        )

    def interval(self, X: Array) -> tuple[Array, Array]:
        """Least and largest U at X, arrays (n, ...); where there is none, the least is larger."""
        rest = (..., *([None] * (np.ndim(X) - 1)))

        def at(of: Array) -> Array:
            return np.asarray(of)[rest]

        tighter, radius = at(self.tighter), self.climber.wheel_radius
        grip = self.contact.grip.wheel_friction_coefficient / self.limits.margin
        loads = [np.maximum(at(c) + at(x) * X, 0.0) for c, x in zip(*self.loads[:2], strict=True)]
        load = np.maximum(loads[0] + loads[1], 1e-12)
        lateral = (at(self.lateral.c) + at(self.lateral.x) * X) / load
        rate = np.sqrt(X)
        low, high = np.full(X.shape, -np.inf), np.full(X.shape, np.inf)
        impossible = (at(self.fastest * self.tighter) ** 2 < X) | (loads[0] + loads[1] <= 0)
        most, no_load = self.climber.max_wheel_torque, self.climber.no_load_wheel_rate or np.inf
        for side in range(2):
            share = grip * tighter
            holds = share**2 - lateral**2
            impossible |= holds < 0
            grips = radius * loads[side] * np.sqrt(np.maximum(holds, 0.0))
            turns = at(self.rates[side]) * rate / no_load
            least = np.maximum(-most * np.clip(tighter + turns, 0.0, tighter), -grips)
            largest = np.minimum(most * np.clip(tighter - turns, 0.0, tighter), grips)
            row = [at(part[side]) for part in self.torques]
            low, high, never = _narrowed(low, high, row, X, least, largest)
            impossible |= never
        if np.isfinite(self.limits.acceleration):
            left = (self.limits.acceleration * tighter) ** 2 - (at(self.across) * X) ** 2
            impossible |= left < 0
            bound = np.sqrt(np.maximum(left, 0.0))
            row = [at(part) for part in self.forwards]
            low, high, never = _narrowed(low, high, row, X, -bound, bound)
            impossible |= never
        return np.where(impossible, np.inf, low), np.where(impossible, -np.inf, high)

    def largest(self) -> Array:
        """Largest X (n,) up to which any U is allowed; raises `ValueError` where there is none."""
        low, high = np.zeros_like(self.s), self.fastest**2
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            least, most = self.interval(middle)
            fits = least <= most
            low, high = np.where(fits, middle, low), np.where(fits, high, middle)
        least, most = self.interval(np.zeros_like(self.s))
        self._refuse(least > most, "it cannot drive there at any speed")
        return low

    def _refuse(self, where: Any, reason: str) -> None:
        """Raise `ValueError` with the first place where it is so."""
        if where.any():
            self.refuse_at(int(np.argmax(where)), reason)

    def refuse_at(self, place: int, reason: str) -> NoReturn:
        """Raise `ValueError` with a place by its number."""
        s = self.s[[place]]
        x, y, _ = self.trajectory.at_progress((s, 1 + 0 * s, 0 * s, 0 * s)).pose[0]
        raise ValueError(f"at ({x:.4g}, {y:.4g}) m: {reason}")

    def reserve(self, left: Reserves, reference: Reference) -> Array:
        """Least reserve (k,) of what is limited at k places of a reference."""
        speed, yaw_rate = np.abs(reference.speed), np.abs(reference.yaw_rate)
        total = np.hypot(reference.forward_acceleration, speed * yaw_rate)
        torque = np.stack(left.torques) / self.climber.max_wheel_torque
        rate = np.stack(left.rates) / (self.climber.no_load_wheel_rate or np.inf)
        used = np.abs(torque) + np.maximum(np.sign(torque) * rate, 0.0)  # of a motor
        with np.errstate(divide="ignore"):
            return np.min(
                [
                    left.slip / self.limits.margin,
                    1 / used.max(axis=0),
                    1 / np.abs(rate).max(axis=0),
                    self.limits.speed / speed,
                    self.limits.yaw_rate / yaw_rate,
                    self.limits.acceleration / total,
                ],
                axis=0,
            )


def _narrowed(
    low: Array, high: Array, row: Sequence[Array], X: Array, least: Array, largest: Array
) -> tuple[Array, Array, Any]:
    """Bounds of U with those of c + x X + u U between two; and where no U has an effect on that."""
    c, x, u = row
    rest = c + x * X
    has_none = np.abs(u) < LEAST_EFFECT
    safe = np.where(has_none, 1.0, u)
    one, other = (least - rest) / safe, (largest - rest) / safe
    low = np.where(has_none, low, np.maximum(low, np.minimum(one, other)))
    high = np.where(has_none, high, np.minimum(high, np.maximum(one, other)))
    return low, high, has_none & ((rest < least) | (rest > largest))


def _check_tip(found: Reserves, reference: Reference) -> None:
    worst = int(np.argmin(found.tip))
    if found.tip[worst] < 1:
        x, y, _ = reference.pose[worst]
        raise ValueError(f"at ({x:.4g}, {y:.4g}) m: it tips over at any speed")


def _leg_speed(trajectory: Trajectory, s: Array) -> Any:
    """Most speed (n,) [m/s] that a path's own points say."""
    course = trajectory.course
    return course.leg_speed(s) if isinstance(course, SlowedPath) else np.inf
