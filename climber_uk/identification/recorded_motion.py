"""Motion of a climber and the torques that drove it, as arrays, from a bag."""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from climber_uk.bags.collecting import Collected
from climber_uk.bags.joints import torques_and_angles
from climber_uk.bags.restarts import are_strays
from climber_uk.bags.run_reader import Parameters, RunReader
from climber_uk.bags.time_series import TimeSeries
from climber_uk.bags.topics import TYPES
from climber_uk.identification.even_time import lagging, rate
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import most_pressure
from climber_uk.mechanics.quantities import across, along
from climber_uk.messages.topics import JOINTS, ODOMETRY, PARAMETERS, PRESSURE, TORQUES

Indices = NDArray[np.intp]
Torques = tuple[Array, Array]  # times (m,) [s] at which they begin, and torques (m, 2) [N m]
TOPICS = ODOMETRY, TORQUES, JOINTS, PRESSURE, PARAMETERS  # that are read
HALF_SECOND = 0.5  # [s]
TORQUE_GAP = 5.0  # typical times from one torque to the next, above which some are missing
SMOOTHING = 0.2  # [s] to either side, over which rates are smoothed
SLIP_SMOOTHING = 0.5  # [s] the same for side slip, which is small
CLEAR = 3.0  # standard deviations of noise


@dataclass(frozen=True)
class RecordedMotion:
    """n odometry messages, and the torques between them; poses are in the wall's frame."""

    time: Array  # (n,) [s]
    pose: Array  # (n, 3) x [m], y [m], θ [rad] without jumps by 2π
    rates: Array | None  # (n, 2) forward speed [m/s], yaw rate [rad/s]; None: no twist
    impulse: Array  # (n, 2) ∫ τ dt of the right and left wheel [N m s]
    pressure: Array  # (n,) of the suction [Pa]
    stretch: Indices  # (n,) a number that changes where torques are missing
    wheel_angles: Array | None = None  # (n, 2) right, left [rad]
    torque_ratio: float = 1.0  # of torques at the wheels to those commanded, if both are known

    @cached_property
    def way(self) -> Array:
        """Way along the heading since the start, backwards negative (n,) [m]."""
        return np.concatenate([[0.0], np.cumsum(self._steps[0])])

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
        """Speed to the left (n,) [m/s], smoothed; 0 where noise hides it."""
        steps = self._steps[1]
        aside = np.concatenate([[0.0], np.cumsum(steps)])
        slip = rate(self.time, aside, SLIP_SMOOTHING)
        noise = np.std(np.diff(steps)) / np.sqrt(6) / SLIP_SMOOTHING  # less, with cubics
        return slip if np.sqrt(np.mean(slip**2)) > CLEAR * noise else 0 * slip

    @cached_property
    def _steps(self) -> tuple[Array, Array]:
        """Ahead and to the left (n - 1,) [m] from each pose to the next, by the heading midway."""
        step = np.diff(self.pose, axis=0)
        middle = self.pose[:-1, 2] + step[:, 2] / 2
        return along(middle, step), across(middle, step)

    @cached_property
    def torques(self) -> Array:
        """Torques of the right and left wheel (n, 2) [N m] just before each time.

        Those just after it answer the odometry of that time, and so depend on its noise.
        """
        torques = np.diff(self.impulse, axis=0) / np.diff(self.time)[:, None]
        return np.concatenate([torques[:1], torques])

    def acting(self, delay: float, lag: float) -> "RecordedMotion":
        """The same, if torques act `delay` [s] later, and with a lag of first order [s]."""
        delayed = [np.interp(self.time - delay, self.time, wheel) for wheel in self.impulse.T]
        acting = np.stack([lagging(self.time, wheel, lag) for wheel in delayed], axis=1)
        late = replace(self, impulse=acting)
        of_poses = {name: getattr(self, name) for name in ("way", "smooth_rates", "side_slip")}
        vars(late).update(of_poses)  # the same: a search for the delay takes a hundred
        return late


def impulse(time: Array, begins: Array, torques: Array) -> Array:
    """∫ τ dt (n, 2) [N m s] at `time` (n,) of torques (m, 2), each held until the next begins."""
    sums = np.cumsum(torques[:-1] * np.diff(begins)[:, None], axis=0)
    since_first = np.concatenate([np.zeros((1, 2)), sums])
    return np.stack([np.interp(time, begins, wheel) for wheel in since_first.T], axis=1)


def stretches(time: Array, begins: Array) -> Indices:
    """Number (n,) of the stretch each time is in: before, in or after each gap between torques."""
    gaps = np.flatnonzero(np.diff(begins) > TORQUE_GAP * np.median(np.diff(begins)))
    return np.searchsorted(begins[np.stack([gaps, gaps + 1], axis=1).ravel()], time)


def read_motion(
    reader: RunReader,
    found: Collected,
    parameters: Parameters,
    pressure: float = 0.0,
    delay: float = 0.0,
) -> tuple[RecordedMotion, int]:
    """Motion of a climber, and how many messages are unfit and left out.

    `pressure` [Pa] is assumed if none was recorded, `delay` [s] from an odometry to its command if
    joint_states has no torques. `parameters` are the controller's. Raises `ValueError` naming the
    bag and what it lacks.
    """
    odometry, pressures = (reader.series(found, name) for name in (ODOMETRY, PRESSURE))
    others = pressures, reader.commands(found, parameters), _wheels(found, parameters)
    unfit = sum(sum(series.unfit.values()) for series in (odometry, *others))
    # far off the others' stamps; `collect` has marked odometry's
    strays = [are_strays(series.stamps) for series in others]
    unfit += sum(int(np.sum(are_off)) for are_off in strays)
    pressures, commands, wheels = (
        series.where(~are_off) for series, are_off in zip(others, strays, strict=True)
    )
    fit = np.isfinite(odometry.values).all(axis=1)  # the twist too
    commanded = _seconds(commands) + delay, commands.values[:, :2]
    at_wheels = _at_wheels(wheels)
    begins, torques = at_wheels or commanded
    first, last = (begins[0], begins[-1]) if len(begins) > 1 else (np.inf, np.inf)
    time = _seconds(odometry)
    kept = fit & (first <= time) & (time <= last)
    if np.sum(kept) < 2:
        raise ValueError(
            "; ".join([_lacking(reader, len(odometry), len(begins)), *reader.bag.losses])
        )
    time, values = time[kept], odometry.values[kept]
    rates = values[:, [3, 5]]
    measured = pressures.values[:, 0]
    is_believed = (measured >= 0) & (measured <= most_pressure(pressure))
    pressures, unfit = pressures.where(is_believed), unfit + int(np.sum(~is_believed))
    motion = RecordedMotion(
        time=time,
        pose=np.column_stack([values[:, :2], np.unwrap(values[:, 2])]),
        rates=rates if rates.any() else None,
        impulse=impulse(time, begins, torques),
        pressure=np.interp(time, _seconds(pressures), pressures.values[:, 0])
        if len(pressures)
        else np.full(len(time), pressure),
        stretch=stretches(time, begins),
        wheel_angles=_angles(time, wheels),
        torque_ratio=_ratio(at_wheels, commanded) if at_wheels else 1.0,
    )
    return motion, unfit + int(np.sum(~fit))


def _seconds(series: TimeSeries) -> Array:
    """Stamps (n,) [s]."""
    return np.array([stamp / SECOND for stamp in series.stamps.tolist()])


def _wheels(found: Collected, parameters: Parameters) -> TimeSeries:
    """Torques and angles of both wheels (n, 4), of joint_states; empty if it has none."""
    with suppress(ValueError):
        return torques_and_angles(found.joints[JOINTS], parameters)
    return TimeSeries.of([])


def _lacking(reader: RunReader, odometries: int, torques: int) -> str:
    """What a bag does not have, by the numbers of messages that it has."""
    path = reader.bag.path
    for name, count in ((ODOMETRY, odometries), (TORQUES, torques)):
        if not count:
            return f"{path} has {reader.bag.lacks(reader.topic(name), TYPES[name])}"
    topic = reader.topic(ODOMETRY)
    return f"{path} has no odometry on {topic} at times that torques are known"


def _at_wheels(wheels: TimeSeries) -> Torques | None:
    """Torques at the wheels, of joint_states; None if it has none."""
    efforts = wheels.values[:, :2]
    if len(efforts) < 2 or not np.isfinite(efforts).all() or not efforts.any():
        return None
    # each message is of the time before it
    return _seconds(wheels), np.concatenate([efforts[1:], efforts[-1:]])


def _ratio(at_wheels: Torques, commanded: Torques) -> float:
    """Ratio of torques at the wheels to those commanded: least squares over half seconds."""
    if not len(commanded[0]):
        return 1.0
    first = max(at_wheels[0][0], commanded[0][0])
    times = np.arange(first, min(at_wheels[0][-1], commanded[0][-1]), HALF_SECOND)
    if len(times) < 2:
        return 1.0
    at, by = (np.diff(impulse(times, *each), axis=0).ravel() for each in (at_wheels, commanded))
    return float(at @ by / (by @ by)) if by.any() else 1.0


def _angles(time: Array, wheels: TimeSeries) -> Array | None:
    angles = wheels.values[:, 2:4]
    if len(angles) < 2 or not np.isfinite(angles).all() or not angles.any():
        return None
    if np.ptp(angles) <= 2 * np.pi:  # they may begin anew each turn
        angles = np.unwrap(angles, axis=0)
    return np.stack([np.interp(time, _seconds(wheels), wheel) for wheel in angles.T], axis=1)
