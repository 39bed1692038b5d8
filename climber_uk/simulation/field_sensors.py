"""What a robot in the field has in place of odometry: encoders, an IMU, and late fixes.

All are of a simulated robot, off by default, and their noise is of one seed each.
"""

import math
from collections import deque
from typing import Any, NamedTuple

import numpy as np

from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import GRAVITY
from climber_uk.mechanics.quantities import State, across, along
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.simulation.plant import Plant


@parameters
class ImuErrors:
    """An IMU with the axes of the climber's body, but for a yaw, and a sample at each odometry."""

    enabled: bool = parameter(False, "", "whether there is an IMU")
    x: float = parameter(0.0, "m", "where the IMU is: forwards of the centre")
    y: float = parameter(0.0, "m", "where the IMU is: to the left of the centre")
    yaw: float = parameter(0.0, "rad", "angle from the climber's x to the IMU's, anticlockwise")
    gyro_noise: float = parameter(
        0.0, "rad/√s", "deviation of the yaw rate's integral after a second", at_least=0
    )
    gyro_bias: float = parameter(0.0, "rad/s", "bias that is added to the yaw rate")
    acceleration_noise: float = parameter(
        0.0, "m/s/√s", "deviation of the specific force's integral after a second", at_least=0
    )
    forward_bias: float = parameter(
        0.0, "m/s²", "bias that is added to the specific force forwards"
    )
    left_bias: float = parameter(
        0.0, "m/s²", "bias that is added to the specific force to the left"
    )
    seed: int = parameter(0, "", "seed of the noise", at_least=0)


@parameters
class EncoderErrors:
    """What the wheels' encoders tell in joint_states."""

    resolution: float = parameter(
        0.0, "rad", "angle of a count; 0: exact", at_least=0, plausible=(0.0, 1)
    )
    slip: float = parameter(
        0.0, "", "standard deviation of the share by which wheels turn too far", at_least=0
    )
    slip_time: float = parameter(10.0, "s", "time in which the encoders' slip changes", above=0)
    seed: int = parameter(0, "", "seed of the encoders' slip", at_least=0)


@parameters
class FixErrors:
    """Poses measured from outside, on the topic `pose`."""

    period: float = parameter(
        0.0, "s", "time from one fix to the next; 0: there are none", at_least=0
    )
    delay: float = parameter(
        0.0, "s", "time from measuring, which the fix's stamp tells, to publishing", at_least=0
    )
    position_noise: float = parameter(0.025, "m", "standard deviation of x and y", above=0)
    heading_noise: float = parameter(
        0.0, "rad", "standard deviation of the heading; 0: it is not measured", at_least=0
    )
    outlier_share: float = parameter(
        0.0, "", "share of the fixes that are off", at_least=0, at_most=1
    )
    outlier_size: float = parameter(
        3.0, "m", "standard deviation of the fixes that are off", at_least=0
    )
    x: float = parameter(0.0, "m", "where the point that fixes tell of is: forwards of the centre")
    y: float = parameter(
        0.0, "m", "where the point that fixes tell of is: to the left of the centre"
    )
    seed: int = parameter(0, "", "seed of the noise", at_least=0)


# classes of parameters by what is before their names
FIELD_SENSORS: dict[str, type[Any]] = {
    "imu.": ImuErrors,
    "encoders.": EncoderErrors,
    "fixes.": FixErrors,
}


class ImuSample(NamedTuple):
    """Yaw rate and specific force in the body's frame: x forwards, y left, z off the wall."""

    yaw_rate: float  # [rad/s]
    force: Array  # (3,) [m/s²]


class Imu:
    """Measures, once in a `period` [s], its mean acceleration since the last sample."""

    def __init__(self, errors: ImuErrors, period: float, start: State) -> None:
        self.errors, self.period, self._last = errors, period, start
        self._random = np.random.default_rng(errors.seed)
        self.yaw_rate_variance = errors.gyro_noise**2 / period  # of a sample [(rad/s)²]
        self.force_variance = errors.acceleration_noise**2 / period  # [(m/s²)²]

    def measure(self, state: State, plant: Plant) -> ImuSample:
        """Sample of a state."""
        errors, climber = self.errors, plant.climber
        acceleration = (state.velocity - self._last.velocity) / self.period
        turning, square = float(acceleration[2]), float(state.yaw_rate) ** 2
        self._last = state
        (x, y, _), (x_speed, y_speed, _) = state.pose.tolist(), state.velocity.tolist()
        down = np.array([*plant.wall.along(climber.inclination, x, y), 0.0])
        force, heading = acceleration - GRAVITY * down, state.heading
        off_wall = plant.wall.into(climber.inclination, x, y, x_speed, y_speed)
        forwards = along(heading, force) - turning * errors.y - square * errors.x
        left = across(heading, force) + turning * errors.x - square * errors.y
        cosine, sine = math.cos(errors.yaw), math.sin(errors.yaw)
        exact = np.array(
            [cosine * forwards + sine * left, cosine * left - sine * forwards, off_wall]
        )
        bias = np.array([errors.forward_bias, errors.left_bias, 0.0])
        *noise, turning = self._random.normal(size=4).tolist()
        yaw_rate = float(state.yaw_rate) + errors.gyro_bias
        return ImuSample(
            yaw_rate + math.sqrt(self.yaw_rate_variance) * turning,
            exact + bias + math.sqrt(self.force_variance) * np.array(noise),
        )


class WheelEncoders:
    """Counts, once in a `period` [s], the wheels' angles with a slip that wanders."""

    def __init__(self, errors: EncoderErrors, period: float) -> None:
        self.errors, self._kept = errors, math.exp(-period / errors.slip_time)
        self._random = np.random.default_rng(errors.seed)
        self._slip = errors.slip * float(self._random.normal())
        self._exact: Array = np.zeros(2)
        self._turned: Array = np.zeros(2)

    def measure(self, angles: Array) -> Array:
        """Angles (2,) [rad] that are told of those (2,) without slip (right, left)."""
        errors = self.errors
        if errors.slip == 0:
            self._turned = angles
        else:
            noise = errors.slip * math.sqrt(1 - self._kept**2) * float(self._random.normal())
            self._slip = self._kept * self._slip + noise
            self._turned = self._turned + (angles - self._exact) * (1 + self._slip)
            self._exact = angles
        if errors.resolution == 0:
            return self._turned
        return errors.resolution * np.floor(self._turned / errors.resolution)


class PoseFix(NamedTuple):
    """A pose as measured from outside."""

    stamp: int  # [ns]
    pose: Array  # (3,) [m], [rad]


class Fixes:
    """Measures at its own rate, and keeps each fix until its delay is over."""

    def __init__(self, errors: FixErrors) -> None:
        self.errors = errors
        self._random = np.random.default_rng(errors.seed)
        self._due: int | None = None  # [ns] of the next one
        self._on_their_way: deque[PoseFix] = deque()

    def measure(self, stamp: int, state: State) -> list[PoseFix]:
        """Take a fix if one is due at `stamp` [ns]; those that arrive now."""
        errors = self.errors
        if errors.period == 0:
            return []
        self._due = stamp if self._due is None else self._due
        if stamp >= self._due:
            self._due += round(errors.period * SECOND)
            self._on_their_way.append(PoseFix(stamp, self._measured(state.pose)))
        arrived = []
        while (
            self._on_their_way
            and self._on_their_way[0].stamp + round(errors.delay * SECOND) <= stamp
        ):
            arrived.append(self._on_their_way.popleft())
        return arrived

    def _measured(self, pose: Array) -> Array:
        errors, noise = self.errors, self._random.normal(size=5)
        is_off = self._random.random() < errors.outlier_share
        off = errors.position_noise * noise[:2] + is_off * errors.outlier_size * noise[3:]
        heading = float(pose[2])
        cosine, sine = math.cos(heading), math.sin(heading)
        lever = np.array([cosine * errors.x - sine * errors.y, sine * errors.x + cosine * errors.y])
        return np.array([*(pose[:2] + lever + off), heading + errors.heading_noise * noise[2]])


class Measured(NamedTuple):
    """What the sensors tell at a time."""

    stamp: int  # [ns]
    angles: Array  # (2,) of the wheels, right, left [rad]
    imu: ImuSample | None
    fixes: list[PoseFix]  # that arrive now


class FieldSensors:
    """All three of one climber."""

    def __init__(
        self, imu: ImuErrors, encoders: EncoderErrors, fixes: FixErrors, period: float, start: State
    ) -> None:
        self.imu = Imu(imu, period, start)
        self.encoders, self.fixes = WheelEncoders(encoders, period), Fixes(fixes)

    def measure(self, stamp: int, state: State, plant: Plant, angles: Array) -> Measured:
        """Measure a state at `stamp` [ns], and its wheels' angles (2,); once in a period."""
        sample = self.imu.measure(state, plant) if self.imu.errors.enabled else None
        counted = self.encoders.measure(angles)
        return Measured(stamp, counted, sample, self.fixes.measure(stamp, state))
