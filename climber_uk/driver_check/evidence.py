"""Data on a driver: its topics, its odometry with times of arrival, the torques of a trial.

Stamps and times of arrival are integers in nanoseconds.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from climber_uk.control.twist import TwistKind
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import Motion, State
from climber_uk.messages import reading
from climber_uk.parameters.declaration import parameter, parameters

if TYPE_CHECKING:
    from nav_msgs.msg import Odometry

Times = NDArray[np.int64]
PLANAR = 0, 7, 35  # x, y and about z, on the diagonal of a covariance


@parameters
class ExpectedDriver:
    """Parameters of the controller that describe the driver."""

    control_period: float = parameter(
        0.005,
        "s",
        "time from an odometry to the next; wrong: a warning on `rate`",
        above=0,
        at_most=1,
    )
    odometry_timeout: float = parameter(
        0.1, "s", "age above which odometry is refused; too short: `age` fails", above=0
    )
    motors: str = parameter(
        "torque",
        "",
        "what of `wheel_torques` the driver obeys, effort or velocity; wrong: `motors` fails",
        choices=("torque", "velocity"),
    )
    servo_time_constant: float = parameter(
        0.02,
        "s",
        "time constant of a board that takes speeds; wrong by two: `servo` warns",
        at_least=0,
    )
    transport_delay: float = parameter(
        0.0,
        "s",
        "time from a torque's publication to its action; wrong: `latency` warns",
        at_least=0,
    )


class Endpoint(NamedTuple):
    """A publisher or subscription of a topic."""

    node: str
    kind: str  # the type's full name
    fits: bool  # whether its QoS is compatible with the controller's
    reliable: bool


@dataclass(frozen=True)
class Graph:
    """Publishers and subscriptions around the driver."""

    topic: str  # full name of odom
    odometry: Sequence[Endpoint]  # publishers
    commanded: Sequence[Endpoint]  # subscribers of wheel_torques
    elsewhere: Sequence[str]  # other topics with odometry
    has_clock: bool  # whether /clock is published


class Arrival(NamedTuple):
    """An odometry, and the times of three clocks at which it was received [ns]."""

    message: "Odometry"
    wall: int
    boot: int  # since the computer started
    simulated: int  # 0: no /clock


@dataclass(frozen=True)
class MotionSeen:
    """Odometry as arrays: n messages, each stamp once."""

    stamp: Times  # (n,)
    pose: Array  # (n, 3) x [m], y [m], θ [rad], continuous
    twist: Array  # (n, 3) forward, to the left [m/s], about z [rad/s]

    @cached_property
    def time(self) -> Array:
        """Time (n,) [s] since the first stamp."""
        return (self.stamp - self.stamp[:1]) / SECOND

    @cached_property
    def period(self) -> float:
        """Median time between two stamps [s]; 0 if there is one only."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else 0.0

    @cached_property
    def has_mean_twist(self) -> bool:
        """Whether twists are means of the period before, as of encoders; see `TwistKind`."""
        kind = TwistKind()
        motions = [Motion.at(*row) for row in np.hstack([self.pose, self.reaction]).tolist()]
        for (before, now), time in zip(pairwise(motions), np.diff(self.time).tolist(), strict=True):
            kind.learn(before, now, time)
        return kind.is_mean

    @cached_property
    def reaction(self) -> Array:
        """Forward speed [m/s] and yaw rate [rad/s] (n, 2), which torques change."""
        return self.twist[:, [0, 2]]


NOTHING: Array = np.zeros(2)


class WheelCommand(NamedTuple):
    """What is told of a time [ns] on; a board obeys torques or rates."""

    time: int
    torques: Array  # (2,) right, left [N m]
    rates: Array = NOTHING  # (2,) right, left [rad/s]


class WheelRates(NamedTuple):
    """Rates of the wheels that a joint_states tells."""

    stamp: int  # [ns]
    right: float  # [rad/s]
    left: float


class SensorStamps(NamedTuple):
    """Messages of a sensor: n of them."""

    stamp: Times  # (n,)
    came: Times  # (n,) by the node's clock
    frames: Sequence[str]
    # (n, 6) of an IMU: rates [rad/s] and forces [m/s²] about and along x, y, z;
    # (n, 5) of fixes: x, y [m], and the variances of x, y, yaw
    values: Array

    @classmethod
    def of(cls, rows: Sequence[tuple[int, int, str, Sequence[float]]], size: int) -> "SensorStamps":
        """Of rows of stamp, arrival, frame and `size` values."""
        stamp, came = ([row[i] for row in rows] for i in (0, 1))
        values = np.array([row[3] for row in rows], float).reshape(-1, size)
        frames = [row[2] for row in rows]
        return cls(np.array(stamp, np.int64), np.array(came, np.int64), frames, values)


NO_IMU, NO_FIXES = SensorStamps.of([], 6), SensorStamps.of([], 5)


class PulseTimes(NamedTuple):
    """Begin and end [ns] of a pulse of torques, or of speeds."""

    turns: bool  # τR = -τL, else τR = τL
    begin: int
    end: int


@dataclass(frozen=True)
class TrialRecord:
    """The commands of a trial, and why it was stopped if it was."""

    pulses: Sequence[PulseTimes]
    commands: Sequence[WheelCommand]
    highest: float  # [N m] limit of a wheel's torque in the trial
    silence: tuple[int, int] | None = None  # begin and end [ns] without commands
    trouble: str = ""  # why it was stopped before the end
    hint: str = ""  # what to do about that
    takes_speeds: bool | None = False  # whether the board obeys rates; None: not found out


@dataclass(frozen=True)
class Evidence:
    """All data on a driver that the checks use."""

    climber: Climber
    expected: ExpectedDriver
    frames: tuple[str, str]  # that odometry should have
    use_sim_time: bool
    graph: Graph
    arrivals: Sequence[Arrival]
    turning: Sequence[WheelRates] = ()  # as joint_states tell
    trial: TrialRecord | None = None
    imu: SensorStamps = NO_IMU
    fixes: SensorStamps = NO_FIXES

    @cached_property
    def stamps(self) -> Times:
        """Stamps (n,) [ns] of all odometry, as it arrived."""
        return np.array(
            [reading.nanoseconds(a.message.header.stamp) for a in self.arrivals], np.int64
        )

    @cached_property
    def errors(self) -> list[str]:
        """Messages on unfit odometry, one for each."""
        errors = []
        for arrival in self.arrivals:
            try:
                _state(arrival.message)
            except ValueError as error:
                errors.append(str(error))
        return errors

    @cached_property
    def covariances(self) -> Array:
        """Covariances (n, 6), on the diagonal: of x, y, θ, and of their rates."""
        messages = [arrival.message for arrival in self.arrivals]
        both = np.array([(m.pose.covariance, m.twist.covariance) for m in messages])
        return both.reshape(-1, 2, 36)[:, :, PLANAR].reshape(-1, 6)

    @cached_property
    def motion(self) -> MotionSeen:
        """Odometry as arrays; raises `ValueError` if one is unfit."""
        return motion_of(self.arrivals)


def motion_of(arrivals: Sequence[Arrival]) -> MotionSeen:
    """Motion of what arrived, if all of it is good."""
    found = {}
    for arrival in arrivals:
        message = arrival.message
        state = _state(message)
        twist = message.twist.twist
        found[reading.nanoseconds(message.header.stamp)] = (
            *state.pose.tolist(),
            *(twist.linear.x, twist.linear.y, twist.angular.z),
        )
    table = np.array([found[stamp] for stamp in sorted(found)]).reshape(-1, 6)
    pose = table[:, :3].copy()
    pose[:, 2] = np.unwrap(pose[:, 2])
    return MotionSeen(np.array(sorted(found), np.int64), pose, table[:, 3:])


def _state(message: "Odometry") -> State:
    return reading.state(message, message.header.frame_id, message.child_frame_id)
