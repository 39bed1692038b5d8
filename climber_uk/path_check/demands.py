"""What a trajectory asks of a climber that is exactly on it, and how much of each limit is left.

At each time the torques and the lateral reaction (`mechanics.demand`), and of them the margins of
slipping and tipping, as the nodes tell them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.demand import STANDS, demanded
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import Speeds, Wrench
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.wall import PLANE, Wall

PERIOD = 0.02  # [s] between two times that are looked at
MOST_TIMES = 50_000
HALVINGS = 20  # of what changes abruptly between two of them, by [m/s] and [rad]
ABRUPT_SPEED, ABRUPT_TURN = 0.02, 0.1


@dataclass(frozen=True)
class Least:
    """Where least is left of a limit: `reserve` times what is asked for; below 1 it is too much."""

    name: str
    reserve: float
    time: float  # [s]
    place: tuple[float, float]  # [m]


@dataclass(frozen=True)
class Demands:
    """What is asked for at n times."""

    time: Array  # (n,) [s]
    pose: Array  # (n, 3)
    distance: Array  # (n,) [m] along the path
    reserves: dict[str, Array]  # (n,) of each limit by its name: what it allows by what is asked
    torques: Array  # (n, 2) right, left [N m]
    energy: float  # [J] that the wheels do, without what they take back
    is_whole: bool  # whether it is all of the trajectory, and not only a round or two

    def least(self) -> Iterator[Least]:
        """Where least is left of each limit."""
        for name, reserve in self.reserves.items():
            i = int(reserve.argmin())
            x, y, _ = self.pose[i].tolist()
            yield Least(name, float(reserve[i]), float(self.time[i]), (x, y))


class Resistance(NamedTuple):
    """What resists the motion beside the seal; numbers, or arrays (k, 1) of many climbers.

    Without `turning`, what scrubs resists a turn, as the contact's locomotion has it.
    """

    rolling: Any = 0.0  # Coulomb's [N]
    viscous: Any = 0.0  # [N s/m]
    turning: Any = None  # Coulomb's [N m]
    turning_viscous: Any = 0.0  # [N m s]


NOTHING_ELSE = Resistance()


class Reserves(NamedTuple):
    """What is left of the limits at n times, and what the wheels do there."""

    slip: Any  # margin (..., n), as the nodes tell it
    tip: Any  # likewise
    torque: Any  # (..., n) of the motors: what they have by what is asked for
    torques: tuple[Any, Any]  # (..., n) right, left [N m]
    rates: tuple[Any, Any]  # (..., n) of the wheels, right, left [rad/s]
    lateral: Any  # (..., n) what both wheels take to the left [N]
    loads: tuple[Any, Any]  # (..., n) on the right and on the left wheel [N]
    normal: Any  # (..., n) force onto the wall [N]


def looked_at(trajectory: Trajectory) -> tuple[Array, Reference, bool]:
    """Times (n,) [s] to look at, the reference then, and whether they are all, or a round or two.

    They are as near to each other as its speed and its heading change fast. Raises `ValueError`
    where that is not near enough: it turns, or starts, at once.
    """
    duration = trajectory.duration
    horizon = trajectory.law.horizon(trajectory.course)
    last = min(duration, horizon) if np.isfinite(horizon) else duration
    time = np.linspace(0.0, last, min(int(last / PERIOD) + 2, MOST_TIMES))
    at = trajectory.at(time)
    for _ in range(HALVINGS):
        abrupt = np.flatnonzero(_is_abrupt(time, at))
        if not len(abrupt):
            return time, at, bool(last >= duration)
        if len(time) + len(abrupt) > 2 * MOST_TIMES:
            break
        time = np.insert(time, abrupt + 1, (time[abrupt] + time[abrupt + 1]) / 2)
        at = trajectory.at(time)
    x, y, _ = at.pose[abrupt[0]]
    raise ValueError(
        f"the path turns on the spot, or changes its speed at once, at ({x:.4g}, {y:.4g}) m, "
        f"{time[abrupt[0]]:.4g} s"
    )


def _is_abrupt(time: Array, at: Reference) -> Any:
    """Whether (n - 1,) speed or heading changes by more than the rates at both ends explain."""
    step, speed, heading = np.diff(time), np.diff(at.speed), np.diff(at.heading)
    faster, turned = (
        step * (rate[1:] + rate[:-1]) / 2 for rate in (at.forward_acceleration, at.yaw_rate)
    )
    explained = (np.abs(speed - faster) < ABRUPT_SPEED) & (
        np.abs(wrapped(heading - turned)) < ABRUPT_TURN
    )
    return ~explained


def reserves(
    reference: Reference,
    climber: Climber,
    contact: Contact,
    resistance: Resistance = NOTHING_ELSE,
    wall: Wall = PLANE,
) -> Reserves:
    """Reserves at n places of a reference, of one climber, or of many: fields (k, 1)."""
    speed, yaw_rate, radius = reference.speed, reference.yaw_rate, climber.wheel_radius
    friction = contact.seal_friction(climber) + resistance.rolling
    place = *np.moveaxis(reference.pose, -1, 0)[:2], *np.moveaxis(reference.velocity, -1, 0)[:2]
    scrubs: Any = resistance.turning
    if scrubs is None:
        load = contact.wheel_load(climber, wall.into(climber.inclination, *place))
        scrubs = contact.locomotion.turning_resistance(load)
    turns = np.where(climber.half_track * np.abs(yaw_rate) > STANDS, np.sign(yaw_rate), 0.0)
    turning = scrubs * turns + resistance.turning_viscous * yaw_rate
    resists = Wrench(-resistance.viscous * speed, -turning)
    demand = demanded(climber, friction, reference, resists, wall)
    (right, left), lateral, across, into_wall = demand[:4]
    slip = contact.slip_margin(climber, into_wall, (right / radius, left / radius), lateral, across)
    tip = contact.tip_margin(climber, into_wall, demand.along_wall)
    rates = climber.rim_rates(Speeds(speed, yaw_rate))
    motors = _motors(climber, (right, left), rates)
    loads = contact.wheel_loads(climber, contact.wheel_load(climber, into_wall), across)
    tips = tip + 0 * np.asarray(slip)
    normal = contact.normal_force(climber, into_wall)
    return Reserves(slip, tips, motors, (right, left), rates, lateral, loads, normal)


def demands(
    trajectory: Trajectory,
    climber: Climber,
    contact: Contact,
    margin: float,
    wall: Wall = PLANE,
) -> Demands:
    """Demands of a trajectory; slipping is to be a `margin` away.

    Raises `ValueError` where what is asked for is beyond what can be computed with.
    """
    with np.errstate(all="ignore"):
        time, reference, is_whole = looked_at(trajectory)
        left = reserves(reference, climber, contact, wall=wall)
    power = sum(
        np.maximum(torque * rate, 0.0)
        for torque, rate in zip(left.torques, left.rates, strict=True)
    )
    if not (can := np.isfinite([*reference.pose.T, *left.torques]).all(axis=0)).all():
        raise ValueError(
            f"what the path asks for at {time[np.argmin(can)]:.4g} s is too much to compute with"
        )
    step = np.hypot(*np.diff(reference.pose[:, :2], axis=0).T)
    return Demands(
        time=time,
        pose=reference.pose,
        distance=np.insert(np.cumsum(step), 0, 0.0),
        reserves={
            f"slip, to a margin of {margin:g}": left.slip / margin,
            "tip": left.tip,
            "torque": left.torque,
        },
        torques=np.stack(left.torques, axis=-1),
        energy=float(np.sum((power[:-1] + power[1:]) / 2 * np.diff(time))),
        is_whole=is_whole,
    )


def _motors(climber: Climber, torques: tuple[Array, Array], rates: tuple[Array, Array]) -> Any:
    """Reserve (..., n) of the motors' torque, which falls to 0 at `no_load_wheel_rate` if any."""
    sides = []
    for torque, rate in zip(torques, rates, strict=True):
        allowed: Any = climber.max_wheel_torque
        if climber.no_load_wheel_rate:
            # what drives the wheel on, not what brakes it
            drives = np.sign(torque) * rate / climber.no_load_wheel_rate
            allowed = allowed * np.clip(1.0 - drives, 0.0, 1.0)
        sides.append(allowed / np.maximum(np.abs(torque), 1e-9))
    return np.minimum(*sides)
