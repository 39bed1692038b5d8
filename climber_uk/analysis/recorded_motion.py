"""How a climber moved and what drove it, as arrays, from the messages of a bag."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from climber_uk.analysis.bag import read_messages
from climber_uk.analysis.even_time import lagging, rate
from climber_uk.analysis.restarts import are_strays
from climber_uk.analysis.taking import FAULTS, STRAY
from climber_uk.analysis.topics import ODOMETRY, TYPES
from climber_uk.mechanics import SECOND, Array
from climber_uk.messages import reading

Indices = NDArray[np.intp]
Wheels = tuple[Array, Array]  # torques (2,), angles (2,)
Torques = tuple[Array, Array]  # when they begin (m,) [s], and they (m, 2) [N m]
HALF_SECOND = 0.5  # [s]
PATIENCE = 5.0  # typical times from one torque to the next, after which some are missing
SMOOTHING = 0.2  # [s] to either side, over which rates are taken
SLIP_SMOOTHING = 0.5  # [s] the same for side slip, which is small
CLEAR = 3.0  # standard deviations of noise


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
    torque_ratio: float = 1.0  # of the torques at the wheels to those commanded, if both are told

    @cached_property
    def way(self) -> Array:
        """Way along the heading since the start, backwards negative (n,) [m]."""
        x, y, heading = np.diff(self.pose, axis=0).T
        middle = self.pose[:-1, 2] + heading / 2
        return np.concatenate([[0.0], np.cumsum(x * np.cos(middle) + y * np.sin(middle))])

    @cached_property
    def smooth_rates(self) -> Array:
        """Forward speed [m/s] and yaw rate [rad/s] (n, 2), from way and heading, smoothed."""
        both = self.way, self.pose[:, 2]
        return np.column_stack([rate(self.time, gone, SMOOTHING) for gone in both])

    @property
    def speed(self) -> Array:
        """Forward speed (n,) [m/s], smoothed."""
        return self.smooth_rates[:, 0]

    @cached_property
    def side_slip(self) -> Array:
        """Speed to the left (n,) [m/s], smoothed; 0 where it cannot be told from noise."""
        x, y, turned = np.diff(self.pose, axis=0).T
        middle = self.pose[:-1, 2] + turned / 2
        steps = y * np.cos(middle) - x * np.sin(middle)
        aside = np.concatenate([[0.0], np.cumsum(steps)])
        slip = rate(self.time, aside, SLIP_SMOOTHING)
        noise = np.std(np.diff(steps)) / np.sqrt(6) / SLIP_SMOOTHING  # less, with cubics
        return slip if np.sqrt(np.mean(slip**2)) > CLEAR * noise else 0 * slip

    @cached_property
    def torques(self) -> Array:
        """Of the right and left wheel (n, 2) [N m], just before each time.

        Those after it answer the odometry of that time, and its noise.
        """
        torques = np.diff(self.impulse, axis=0) / np.diff(self.time)[:, None]
        return np.concatenate([torques[:1], torques])

    def acting(self, delay: float, lag: float) -> "RecordedMotion":
        """The same, if torques act `delay` [s] later, and with a lag of first order [s]."""
        told = [np.interp(self.time - delay, self.time, wheel) for wheel in self.impulse.T]
        acting = np.stack([lagging(self.time, wheel, lag) for wheel in told], axis=1)
        return replace(self, impulse=acting)


def impulse(time: Array, begins: Array, torques: Array) -> Array:
    """∫ τ dt (n, 2) [N m s] at `time` (n,) of torques (m, 2), each held until the next begins."""
    sums = np.cumsum(torques[:-1] * np.diff(begins)[:, None], axis=0)
    since_first = np.concatenate([np.zeros((1, 2)), sums])
    return np.stack([np.interp(time, begins, wheel) for wheel in since_first.T], axis=1)


def stretches(time: Array, begins: Array) -> Indices:
    """Numbers (n,) that differ before, in and after each gap between torques."""
    gaps = np.flatnonzero(np.diff(begins) > PATIENCE * np.median(np.diff(begins)))
    return np.searchsorted(begins[np.stack([gaps, gaps + 1], axis=1).ravel()], time)


@dataclass(frozen=True)
class Source:
    """Where a bag tells of a climber, and what holds where it does not."""

    namespace: str = ""
    odometry: str = "odom"  # topic
    joints: tuple[str, str] = ("right_wheel_joint", "left_wheel_joint")
    pressure: float = 0.0  # [Pa] without suction_pressure
    delay: float = 0.0  # [s] of a command after its odometry, without torques in joint_states

    def topic(self, name: str) -> str:
        """Full name of a topic."""
        return f"/{self.namespace.strip('/')}/{name.lstrip('/')}".replace("//", "/")


def read_motion(bag: str | Path, source: Source) -> tuple[RecordedMotion, int]:
    """Motion of a climber, and how many messages are unfit and left out.

    Raises `FileNotFoundError` or `ValueError` naming the bag and what it lacks.
    """
    found, unfit = _collected(bag, source)
    states, commands, wheels, pressures = found
    commanded, at_wheels = _commanded(commands, source.delay), _at_wheels(wheels)
    begins, torques = at_wheels or commanded
    time = np.array([t for t in states if len(begins) > 1 and begins[0] <= t <= begins[-1]])
    if len(time) < 2:
        topic = source.topic(source.odometry)
        because = f" ({len(unfit)} messages are unfit: {unfit[-1]})" if unfit else ""
        raise ValueError(
            f"{bag} has no odometry on {topic} at times that torques are known{because}"
        )
    kept = [states[t] for t in time.tolist()]
    pose = np.array([state.pose for state in kept])
    rates = np.array([[state.forward_speed, state.yaw_rate] for state in kept])
    told = pressures or {0.0: source.pressure}
    motion = RecordedMotion(
        time=time,
        pose=np.column_stack([pose[:, :2], np.unwrap(pose[:, 2])]),
        rates=rates if rates.any() else None,
        impulse=impulse(time, begins, torques),
        pressure=np.interp(time, list(told), list(told.values())),
        stretch=stretches(time, begins),
        wheel_angles=_angles(time, wheels),
        torque_ratio=_ratio(at_wheels, commanded) if at_wheels else 1.0,
    )
    return motion, len(unfit)


def _collected(bag: str | Path, source: Source) -> tuple[list[dict[float, Any]], list[str]]:
    """Contents by stamp [s] of odometry, commands, wheels and pressure; why others are unfit."""
    right, left = source.joints
    readers: dict[str, Callable[[Any], Any]] = {
        ODOMETRY: lambda m: reading.state(m, m.header.frame_id, m.child_frame_id),
        "wheel_torques": lambda m: reading.wheel_torques(m, left, right),
        "joint_states": lambda m: _wheels(m, source.joints),
        "suction_pressure": reading.pressure,
    }
    topics = {source.topic(source.odometry): ODOMETRY}
    topics |= {source.topic(name): name for name in readers if name != ODOMETRY}
    found: dict[str, dict[float, Any]] = {name: {} for name in readers}
    unfit: list[str] = []
    for topic, _, message in read_messages(bag, topics):
        name = topics[topic]
        try:
            if message.__msgtype__ != (wanted := TYPES[name]):
                raise ValueError(f"type {message.__msgtype__} must be {wanted}")
            content = readers[name](message)
        except ValueError as error:
            unfit.append(str(error))
        else:
            if content is not None:
                found[name][reading.nanoseconds(message.header.stamp) / SECOND] = content
    return [dict(sorted(_at_sound_times(contents, unfit))) for contents in found.values()], unfit


def _at_sound_times(contents: dict[float, Any], unfit: list[str]) -> Iterator[tuple[float, Any]]:
    """Contents without those whose stamps are far off those recorded around them."""
    strays = are_strays(np.array([round(time * SECOND) for time in contents], np.int64))
    for item, is_stray in zip(contents.items(), strays.tolist(), strict=True):
        if is_stray:
            unfit.append(FAULTS[STRAY])
        else:
            yield item


def _wheels(message: Any, joints: Sequence[str]) -> Wheels | None:
    """Torques (2,) and angles (2,) of two joints, nan where not told; None: of others alone."""
    if not set(joints) <= set(message.name):
        return None
    both = []
    for values in (message.effort, message.position):
        told = dict(zip(message.name, values, strict=False))
        both.append(np.array([told.get(joint, np.nan) for joint in joints]))
    return both[0], both[1]


def _at_wheels(wheels: dict[float, Wheels]) -> Torques | None:
    """When torques at the wheels begin (m,) [s], and they (m, 2); None if these are not told."""
    efforts = np.array([torques for torques, _ in wheels.values()]).reshape(-1, 2)
    if len(efforts) < 2 or not np.isfinite(efforts).all() or not efforts.any():
        return None
    # each tells of the time before it
    return np.array(list(wheels)), np.concatenate([efforts[1:], efforts[-1:]])


def _commanded(commands: dict[float, Array], delay: float) -> Torques:
    """The same of commanded torques."""
    return np.array(list(commands)) + delay, np.array(list(commands.values())).reshape(-1, 2)


def _ratio(at_wheels: Torques, commanded: Torques) -> float:
    """Of the torques at the wheels to those commanded, by least squares over half seconds."""
    if not len(commanded[0]):
        return 1.0
    first = max(at_wheels[0][0], commanded[0][0])
    times = np.arange(first, min(at_wheels[0][-1], commanded[0][-1]), HALF_SECOND)
    if len(times) < 2:
        return 1.0
    are, were = (np.diff(impulse(times, *told), axis=0).ravel() for told in (at_wheels, commanded))
    return float(are @ were / (were @ were)) if were.any() else 1.0


def _angles(time: Array, wheels: dict[float, Wheels]) -> Array | None:
    angles = np.array([angles for _, angles in wheels.values()]).reshape(-1, 2)
    if len(angles) < 2 or not np.isfinite(angles).all() or not angles.any():
        return None
    stamps = list(wheels)
    return np.stack([np.interp(time, stamps, wheel) for wheel in angles.T], axis=1)
