"""How a climber moved and what drove it, as arrays, from the messages of a bag."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from climber_uk.analysis.bag import read_messages
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import State
from climber_uk.mechanics.preview import SECOND
from climber_uk.messages import reading

Indices = NDArray[np.intp]
PATIENCE = 5.0  # typical times from one torque to the next, after which some are missing
SMOOTHING = 0.1  # [s] to either side, over which rates are taken


@dataclass(frozen=True)
class RecordedMotion:
    """What n odometry messages and the torques between them tell."""

    time: Array  # (n,) [s]
    pose: Array  # (n, 3) x [m], y [m], θ [rad] without jumps by 2π
    rates: Array | None  # (n, 2) forward speed [m/s], yaw rate [rad/s]; None: odometry without
    impulse: Array  # (n, 2) ∫ τ dt of the right and left wheel [N m s]
    pressure: Array  # (n,) of the suction [Pa]
    stretch: Indices  # (n,) a number that changes where torques are missing
    wheel_angles: Array | None = None  # (n, 2) right, left [rad]

    @cached_property
    def way(self) -> Array:
        """Way along the heading since the start, backwards negative (n,) [m]."""
        x, y, heading = np.diff(self.pose, axis=0).T
        middle = self.pose[:-1, 2] + heading / 2
        return np.concatenate([[0.0], np.cumsum(x * np.cos(middle) + y * np.sin(middle))])

    @cached_property
    def smooth_rates(self) -> Array:
        """Forward speed [m/s] and yaw rate [rad/s] (n, 2), from way and heading, smoothed."""
        first = np.maximum(self.time - SMOOTHING, self.time[0])
        last = np.minimum(self.time + SMOOTHING, self.time[-1])
        both = self.way, self.pose[:, 2]
        gone = [np.interp(last, self.time, one) - np.interp(first, self.time, one) for one in both]
        return np.column_stack(gone) / (last - first)[:, None]

    @property
    def speed(self) -> Array:
        """Forward speed (n,) [m/s], smoothed."""
        return self.smooth_rates[:, 0]


def impulse(time: Array, begins: Array, torques: Array) -> Array:
    """∫ τ dt (n, 2) [N m s] at `time` (n,) of torques (m, 2), each held until the next begins."""
    sums = np.cumsum(torques[:-1] * np.diff(begins)[:, None], axis=0)
    since_first = np.concatenate([np.zeros((1, 2)), sums])
    return np.stack([np.interp(time, begins, wheel) for wheel in since_first.T], axis=1)


def stretches(time: Array, begins: Array) -> Indices:
    """Numbers (n,) that differ before, in and after each gap between torques."""
    gaps = np.flatnonzero(np.diff(begins) > PATIENCE * np.median(np.diff(begins)))
    return np.searchsorted(begins[np.stack([gaps, gaps + 1], axis=1).ravel()], time)


def read_motion(
    bag: str | Path,
    joints: tuple[str, str],
    pressure: float,
    delay: float = 0.0,
    namespace: str = "",
    odometry: str = "odom",
) -> tuple[RecordedMotion, int]:
    """Motion of the climber in `namespace`, and how many messages are unfit and left out.

    `joints` are those of the right and left wheel; `pressure` [Pa] is that of a bag which tells
    none, `delay` [s] that of torques which only `wheel_torques` tells, after their odometry.
    Raises `FileNotFoundError` or `ValueError` naming the bag and what it lacks.
    """
    prefix = f"/{namespace}/".replace("//", "/")
    readers = {
        odometry: _state,
        "wheel_torques": lambda message: reading.wheel_torques(message, joints[1], joints[0]),
        "joint_states": lambda message: _wheels(message, joints),
        "suction_pressure": reading.pressure,
    }
    topics = {prefix + name.lstrip("/"): name for name in readers}
    found: dict[str, dict[float, Any]] = {name: {} for name in readers}
    unfit = 0
    for topic, _, message in read_messages(bag, topics):
        name = topics[topic]
        try:
            stamp = reading.nanoseconds(message.header.stamp) / SECOND
            found[name][stamp] = readers[name](message)
        except ValueError:
            unfit += 1
    states, wheels = (dict(sorted(found[name].items())) for name in (odometry, "joint_states"))
    begins, torques = _torques(found["wheel_torques"], wheels, delay)
    time = np.array([t for t in states if len(begins) > 1 and begins[0] <= t <= begins[-1]])
    if len(time) < 2:
        raise ValueError(
            f"{bag} has no odometry on {prefix}{odometry} at times that torques are known"
        )
    kept = [states[t] for t in time.tolist()]
    rates = np.array([[state.forward_speed, state.yaw_rate] for state in kept])
    told = dict(sorted(found["suction_pressure"].items())) or {0.0: pressure}
    return (
        RecordedMotion(
            time=time,
            pose=_continuous(np.array([state.pose for state in kept])),
            rates=rates if rates.any() else None,
            impulse=impulse(time, begins, torques),
            pressure=np.interp(time, list(told), list(told.values())),
            stretch=stretches(time, begins),
            wheel_angles=_angles(time, wheels),
        ),
        unfit,
    )


def _state(message: Any) -> State:
    return reading.state(message, message.header.frame_id, message.child_frame_id)


def _wheels(message: Any, joints: Sequence[str]) -> tuple[Array, Array]:
    """Torques (2,) and angles (2,) of two joints, nan where they are not told."""
    both = []
    for values in (message.effort, message.position):
        told = dict(zip(message.name, values, strict=False))
        both.append(np.array([told.get(joint, np.nan) for joint in joints]))
    return both[0], both[1]


def _torques(
    commanded: dict[float, Array], wheels: dict[float, tuple[Array, Array]], delay: float
) -> tuple[Array, Array]:
    """When torques begin (m,) [s], and they (m, 2): those at the wheels if these are told."""
    efforts = np.array([torques for torques, _ in wheels.values()]).reshape(-1, 2)
    if len(efforts) > 1 and np.isfinite(efforts).all() and efforts.any():
        ends = np.array(list(wheels))
        return ends, np.concatenate([efforts[1:], efforts[-1:]])  # each tells of the time before it
    sent = dict(sorted(commanded.items()))
    return np.array(list(sent)) + delay, np.array(list(sent.values())).reshape(-1, 2)


def _angles(time: Array, wheels: dict[float, tuple[Array, Array]]) -> Array | None:
    angles = np.array([angles for _, angles in wheels.values()]).reshape(-1, 2)
    if len(angles) < 2 or not np.isfinite(angles).all() or not angles.any():
        return None
    stamps = list(wheels)
    return np.stack([np.interp(time, stamps, wheel) for wheel in angles.T], axis=1)


def _continuous(pose: Array) -> Array:
    return np.column_stack([pose[:, :2], np.unwrap(pose[:, 2])])
