"""What a trajectory asks of a climber that is exactly on it, and how much of each limit is left.

At each time the torques and the lateral reaction (`mechanics.demand`), and of them the margins of
slipping and tipping, as the nodes tell them.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.adhesion import Attachment
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.demand import demanded
from climber_uk.mechanics.trajectory import Trajectory

PERIOD = 0.02  # [s] between two times that are looked at
MOST_TIMES = 50_000


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


def demands(
    trajectory: Trajectory, climber: Climber, attachment: Attachment, margin: float
) -> Demands:
    """Demands of a trajectory; slipping is to be a `margin` away."""
    duration = trajectory.duration
    horizon = trajectory.law.horizon(trajectory.course)
    last = min(duration, horizon) if np.isfinite(horizon) else duration
    time = np.linspace(0.0, last, min(int(last / PERIOD) + 2, MOST_TIMES))
    reference = trajectory.at(time)
    speed, radius = reference.speed, climber.wheel_radius
    friction = attachment.seal_friction(climber)
    (right, left), lateral, across, _ = demanded(climber, friction, reference)
    into_wall, along_wall = climber.gravity_into_wall, climber.weight_along_wall / climber.mass
    slip = attachment.slip_margin(
        climber, into_wall, (right / radius, left / radius), lateral, across
    )
    tip = attachment.tip_margin(climber, into_wall, along_wall)
    rates = (
        (speed + climber.half_track * reference.yaw_rate) / radius,
        (speed - climber.half_track * reference.yaw_rate) / radius,
    )
    power = np.maximum(right * rates[0], 0.0) + np.maximum(left * rates[1], 0.0)
    step = np.hypot(*np.diff(reference.pose[:, :2], axis=0).T)
    return Demands(
        time=time,
        pose=reference.pose,
        distance=np.insert(np.cumsum(step), 0, 0.0),
        reserves={
            f"slip, to a margin of {margin:g}": np.asarray(slip / margin),
            "tip": np.broadcast_to(np.asarray(tip, float), time.shape),
            **_motors(climber, (right, left), rates),
        },
        torques=np.stack([right, left], axis=-1),
        energy=float(np.sum((power[:-1] + power[1:]) / 2 * np.diff(time))),
        is_whole=bool(last >= duration),
    )


def _motors(
    climber: Climber, torques: tuple[Array, Array], rates: tuple[Array, Array]
) -> dict[str, Array]:
    """Reserves (n,) of the motors' torque, which falls to 0 at `no_load_wheel_rate` if there is."""
    reserve = np.full(len(torques[0]), np.inf)
    for torque, rate in zip(torques, rates, strict=True):
        allowed = np.full(len(torque), climber.max_wheel_torque)
        if climber.no_load_wheel_rate:
            # what drives the wheel on, not what brakes it
            drives = np.sign(torque) * rate / climber.no_load_wheel_rate
            allowed = allowed * np.clip(1.0 - drives, 0.0, 1.0)
        asked = np.maximum(np.abs(torque), 1e-9)
        reserve = np.minimum(reserve, allowed / asked)
    return {"torque": reserve}
