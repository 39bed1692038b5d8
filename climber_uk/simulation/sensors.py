"""Odometry as a robot's sensors measure it: late, noisy, biased, or counted by its wheels.

A new kind of odometry is one class, an `OdometrySource`, and one entry in `SOURCES`, or an entry
point `climber_uk.odometry_sources` of another package.
"""

import math
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import Field, dataclass, fields
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import rotated
from climber_uk.mechanics.quantities import Motion, State
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.parameters.registry import Variants

Measure = Callable[[State, State, Array], State]
"""What is measured of a state, of that by its wheels, and of their angles (2,) [rad].

It is called once each period; angles are those of the right and the left wheel.
"""


class OdometrySource(Protocol):
    """What odometry measures, before bias and noise are added: a frozen dataclass of parameters."""

    def start(self, sensors: "Sensors", climber: Climber, period: float, state: State) -> Measure:
        """A new measurement, from a start at `state`, every `period` [s]."""


@dataclass(frozen=True)
class Truth(OdometrySource):
    """The climber as it is."""

    def start(self, sensors: "Sensors", climber: Climber, period: float, state: State) -> Measure:
        """See `OdometrySource`."""
        return lambda state, wheels, angles: state


@dataclass(frozen=True)
class Wheels(OdometrySource):
    """The climber as it would be had its wheels never slipped."""

    def start(self, sensors: "Sensors", climber: Climber, period: float, state: State) -> Measure:
        """See `OdometrySource`."""
        return DeadReckoning(sensors, climber, period, state.pose).measure


SOURCES = Variants[type[OdometrySource]]({"truth": Truth, "wheels": Wheels}, "odometry_sources")
# Parameters of what is measured, and when; all others are errors that are added to that
MEASURING = (
    *("odometry_source", "odometry_delay", "encoder_resolution", "effective_half_track"),
    "seed",
)


@parameters
class Sensors:
    """Errors of the odometry; without any it is the true state."""

    odometry_source: str = parameter("truth", "", "what odometry measures", choices=SOURCES)
    odometry_delay: float = parameter(
        0.0,
        "s",
        "time from measuring, which the odometry's stamp tells, to publishing",
        at_least=0,
        plausible=(0.0, 1),
    )
    position_noise: float = parameter(
        0.0, "m", "standard deviation of x and y", at_least=0, plausible=(0.0, 1)
    )
    heading_noise: float = parameter(
        0.0, "rad", "standard deviation of the heading", at_least=0, plausible=(0.0, 1)
    )
    speed_noise: float = parameter(0.0, "m/s", "standard deviation of the speed", at_least=0)
    yaw_rate_noise: float = parameter(
        0.0, "rad/s", "standard deviation of the yaw rate", at_least=0
    )
    x_bias: float = parameter(0.0, "m", "bias that is added to x")
    y_bias: float = parameter(0.0, "m", "bias that is added to y")
    heading_bias: float = parameter(0.0, "rad", "bias that is added to the heading")
    speed_bias: float = parameter(0.0, "m/s", "bias that is added to the forward speed")
    yaw_rate_bias: float = parameter(0.0, "rad/s", "bias that is added to the yaw rate")
    encoder_resolution: float = parameter(
        0.0,
        "rad",
        "resolution of the wheels' encoders, for odometry_source wheels; 0: exact",
        at_least=0,
        plausible=(0.0, 1),
    )
    effective_half_track: float = parameter(
        0.0,
        "m",
        "distance of a wheel from the centre by which turns are reckoned, wider where wheels "
        "scrub; 0: half_track",
        at_least=0,
        plausible=(0.02, 3),
    )
    seed: int = parameter(
        0, "", "seed of the noise: the same seed gives the same noise", at_least=0
    )

    def delay_in(self, period: float) -> int:
        """Odometry's delay in periods of `period` [s]; `ValueError` if it is no multiple."""
        periods = round(self.odometry_delay / period)
        if abs(periods * period - self.odometry_delay) > 1e-9:
            raise ValueError(
                f"odometry_delay={self.odometry_delay} must be a multiple of "
                f"control_period={period} [s]"
            )
        return periods

    @cached_property
    def is_ideal(self) -> bool:
        """Whether odometry has no error: nothing that `corrupted` adds is set."""
        return not any(np.any(getattr(self, field.name)) for field in self.errors())

    @classmethod
    def errors(cls) -> "list[Field[Any]]":
        """Fields of what `corrupted` adds."""
        return [field for field in fields(cls) if field.name not in MEASURING]

    @property
    def ideal(self) -> "Sensors":
        """The same without what `corrupted` adds."""
        return Sensors(**{name: getattr(self, name) for name in MEASURING})

    def corrupted(self, motion: Motion, noise: Iterable[Any]) -> Motion:
        """`motion` with bias and noise; `noise` has unit variance, in the order x, y, θ, v, ω."""
        n_x, n_y, n_heading, n_speed, n_yaw_rate = noise
        angle = self.heading_bias + self.heading_noise * n_heading
        return Motion(
            motion.x + self.x_bias + self.position_noise * n_x,
            motion.y + self.y_bias + self.position_noise * n_y,
            *rotated(motion.heading, motion.cosine, motion.sine, angle),
            motion.speed + self.speed_bias + self.speed_noise * n_speed,
            motion.yaw_rate + self.yaw_rate_bias + self.yaw_rate_noise * n_yaw_rate,
        )


class Odometer:
    """Odometry of one climber: keeps what was measured until its delay is over.

    Raises `ValueError` unless the delay is a multiple of `period` [s].
    """

    def __init__(
        self,
        sensors: Sensors,
        climber: Climber,
        period: float,
        state: State,
        source: OdometrySource | None = None,
    ) -> None:
        self.sensors = sensors
        self._random = np.random.default_rng(sensors.seed)
        source = source or SOURCES[sensors.odometry_source]()
        self._measure = source.start(sensors, climber, period, state)
        late = sensors.delay_in(period)
        first = self._measured(state)
        # before the start the climber was where it starts
        self._on_its_way = deque([(-number, first) for number in range(late, -1, -1)])

    def latest(self) -> tuple[int, State]:
        """The odometry that is due now: the period in which it was measured, and the state."""
        return self._on_its_way[0]

    def measure(self, state: State, wheels: State, angles: Array) -> None:
        """Take a new measurement; `wheels` is the state by them, and their `angles`."""
        number, _ = self._on_its_way[-1]
        measured = self._measure(state, wheels, angles)
        self._on_its_way.append((number + 1, self._measured(measured)))
        self._on_its_way.popleft()

    def _measured(self, state: State) -> State:
        if self.sensors.is_ideal:
            return state
        noise = self._random.normal(size=5).tolist()
        noisy = self.sensors.corrupted(state.motion, noise)
        return State.moving(noisy, float(state.side_slip))


class DeadReckoning:
    """Where wheels have rolled to since the start, counted in steps of their encoders."""

    def __init__(self, sensors: Sensors, climber: Climber, period: float, pose: Array) -> None:
        self.resolution, self.climber, self.period = sensors.encoder_resolution, climber, period
        self.half_track = sensors.effective_half_track or climber.half_track
        self.counted: Array = np.zeros(2)  # [rad] right, left
        self.pose = pose

    def measure(self, _: State, wheels: State, angles: Array) -> State:
        """State that wheels at `angles` (2,) have rolled to since the last measurement."""
        resolution, climber = self.resolution, self.climber
        if resolution > 0:
            angles = resolution * np.floor(angles / resolution)
        right, left = (climber.wheel_radius * (angles - self.counted)).tolist()
        self.counted = angles
        distance, angle = (right + left) / 2, (right - left) / (2 * self.half_track)
        x, y, heading = self.pose.tolist()
        middle = heading + angle / 2
        self.pose = np.array(
            [x + distance * math.cos(middle), y + distance * math.sin(middle), heading + angle]
        )
        if resolution > 0:
            return State.rolling(self.pose, distance / self.period, angle / self.period)
        yaw_rate = float(wheels.yaw_rate) * climber.half_track / self.half_track
        return State.rolling(self.pose, float(wheels.forward_speed), yaw_rate)
