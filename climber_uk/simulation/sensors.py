"""Simulated odometry: delayed, noisy, biased, or counted from the wheels' rotation."""

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import rotated
from climber_uk.mechanics.quantities import Motion, State
from climber_uk.parameters.declaration import check, parameter


@dataclass(frozen=True)
class Sensors:
    """Errors of the odometry; without any it is the true state."""

    odometry_source: str = parameter(
        "truth", "", "measured: the true pose, or the wheels", choices=("truth", "wheels")
    )
    odometry_delay: float = parameter(
        0.0,
        "s",
        "from measuring, which its stamp tells, to publishing",
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
    yaw_rate_noise: float = parameter(0.0, "rad/s", "standard deviation", at_least=0)
    x_bias: float = parameter(0.0, "m", "added to x")
    y_bias: float = parameter(0.0, "m", "added to y")
    heading_bias: float = parameter(0.0, "rad", "added to the heading")
    speed_bias: float = parameter(0.0, "m/s", "added to the forward speed")
    yaw_rate_bias: float = parameter(0.0, "rad/s", "added to the yaw rate")
    encoder_resolution: float = parameter(
        0.0,
        "rad",
        "of the wheels' encoders, for odometry_source wheels; 0: exact",
        at_least=0,
        plausible=(0.0, 1),
    )
    seed: int = parameter(0, "", "of the noise: the same seed gives the same noise", at_least=0)

    def __post_init__(self) -> None:
        check(self)

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
        """Whether noise and bias are all 0."""
        noise = self.position_noise, self.heading_noise, self.speed_noise, self.yaw_rate_noise
        place_bias = self.x_bias, self.y_bias, self.heading_bias
        errors = (*noise, *place_bias, self.speed_bias, self.yaw_rate_bias)
        return not any(np.any(error) for error in errors)

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

    def __init__(self, sensors: Sensors, climber: Climber, period: float, state: State) -> None:
        self.sensors, self.climber, self.period = sensors, climber, period
        self._random = np.random.default_rng(sensors.seed)
        self._counted: Array = np.zeros(2)  # [rad] right, left
        self._pose: Array = state.pose
        late = sensors.delay_in(period)
        first = self._measured(state)
        # before the start the climber was where it starts
        self._on_its_way = deque([(-number, first) for number in range(late, -1, -1)])

    def latest(self) -> tuple[int, State]:
        """The odometry that is due now: the period in which it was measured, and the state."""
        return self._on_its_way[0]

    def measure(self, state: State, wheels: State, angles: Array) -> None:
        """Measure the true `state` or, by `odometry_source`, `wheels` and their `angles` (2,)."""
        if self.sensors.odometry_source == "wheels":
            state = self._reckoned(wheels, angles)
        number, _ = self._on_its_way[-1]
        self._on_its_way.append((number + 1, self._measured(state)))
        self._on_its_way.popleft()

    def _reckoned(self, wheels: State, angles: Array) -> State:
        """State by dead reckoning to the wheel `angles` (2,) (right, left) [rad]."""
        resolution, climber = self.sensors.encoder_resolution, self.climber
        if resolution > 0:
            angles = resolution * np.floor(angles / resolution)
        right, left = (climber.wheel_radius * (angles - self._counted)).tolist()
        self._counted = angles
        way, angle = (right + left) / 2, (right - left) / (2 * climber.half_track)
        x, y, heading = self._pose.tolist()
        middle = heading + angle / 2
        self._pose = np.array(
            [x + way * math.cos(middle), y + way * math.sin(middle), heading + angle]
        )
        if resolution > 0:
            return State.rolling(self._pose, way / self.period, angle / self.period)
        return State.rolling(self._pose, float(wheels.forward_speed), float(wheels.yaw_rate))

    def _measured(self, state: State) -> State:
        if self.sensors.is_ideal:
            return state
        noise = self._random.normal(size=5).tolist()
        noisy, aside = self.sensors.corrupted(state.motion, noise), float(state.side_slip)
        velocity = [
            noisy.speed * noisy.cosine - aside * noisy.sine,
            noisy.speed * noisy.sine + aside * noisy.cosine,
            noisy.yaw_rate,
        ]
        return State(np.array([noisy.x, noisy.y, noisy.heading]), np.array(velocity))
