"""Odometry as a robot's sensors tell it: late, noisy, biased, or counted by its wheels."""

import math
from collections import deque
from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import rotated
from climber_uk.mechanics.quantities import Motion, State
from climber_uk.parameters.declaration import parameter, parameters


@parameters
class Sensors:
    """What is between the truth and the odometry; all of it off."""

    odometry_source: str = parameter(
        "truth", "", "what odometry measures", choices=("truth", "wheels")
    )
    odometry_delay: float = parameter(
        0.0,
        "s",
        "from measuring, which is the stamp, to publishing",
        at_least=0,
        plausible=(0.0, 1),
    )
    position_noise: float = parameter(
        0.0, "m", "standard deviation of x and y", at_least=0, plausible=(0.0, 1)
    )
    heading_noise: float = parameter(
        0.0, "rad", "standard deviation", at_least=0, plausible=(0.0, 1)
    )
    speed_noise: float = parameter(0.0, "m/s", "standard deviation", at_least=0)
    yaw_rate_noise: float = parameter(0.0, "rad/s", "standard deviation", at_least=0)
    x_bias: float = parameter(0.0, "m", "added to x")
    y_bias: float = parameter(0.0, "m", "added to y")
    heading_bias: float = parameter(0.0, "rad", "added to the heading")
    speed_bias: float = parameter(0.0, "m/s", "added to the forward speed")
    yaw_rate_bias: float = parameter(0.0, "rad/s", "added to the yaw rate")
    encoder_resolution: float = parameter(
        0.0,
        "rad",
        "of the wheels' encoders, for odometry from wheels; 0: exact",
        at_least=0,
        plausible=(0.0, 1),
    )
    seed: int = parameter(0, "", "of all noise", at_least=0)

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
        """Whether they tell the truth."""
        noise = self.position_noise, self.heading_noise, self.speed_noise, self.yaw_rate_noise
        place_bias = self.x_bias, self.y_bias, self.heading_bias
        errors = (*noise, *place_bias, self.speed_bias, self.yaw_rate_bias)
        return not any(np.any(error) for error in errors)

    def told(self, motion: Motion, noise: Iterable[Any]) -> Motion:
        """Motion with bias and noise, of five numbers of unit variance: x, y, θ, v, ω."""
        x, y, heading, cosine, sine, speed, yaw_rate = motion
        right, up, turned, faster, turning = noise
        return Motion(
            x + self.x_bias + self.position_noise * right,
            y + self.y_bias + self.position_noise * up,
            *rotated(heading, cosine, sine, self.heading_bias + self.heading_noise * turned),
            speed + self.speed_bias + self.speed_noise * faster,
            yaw_rate + self.yaw_rate_bias + self.yaw_rate_noise * turning,
        )


class Odometer:
    """The sensors at work, from a start at `state`; the same seed, the same noise."""

    def __init__(self, sensors: Sensors, climber: Climber, period: float, state: State) -> None:
        self.sensors, self.climber, self.period = sensors, climber, period
        self._random = np.random.default_rng(sensors.seed)
        self._counted: Array = np.zeros(2)  # [rad] right, left
        self._pose: Array = state.pose
        late = sensors.delay_in(period)
        first = self._measured(state)
        # before the start the climber was where it is
        self._on_its_way = deque([(-number, first) for number in range(late, -1, -1)])

    def latest(self) -> tuple[int, State]:
        """Period, counted from the start, in which the odometry due now was measured, and it."""
        return self._on_its_way[0]

    def measure(self, state: State, wheels: State, angles: Array) -> None:
        """Take a new measurement; `wheels` is the state as they tell it, and their `angles`."""
        if self.sensors.odometry_source == "wheels":
            state = self._reckoned(wheels, angles)
        number, _ = self._on_its_way[-1]
        self._on_its_way.append((number + 1, self._measured(state)))
        self._on_its_way.popleft()

    def _reckoned(self, wheels: State, angles: Array) -> State:
        """State that wheels at `angles` (2,) have rolled to since the last measurement."""
        resolution, climber = self.sensors.encoder_resolution, self.climber
        if resolution > 0:
            angles = resolution * np.floor(angles / resolution)
        right, left = (climber.wheel_radius * (angles - self._counted)).tolist()
        self._counted = angles
        way, turn = (right + left) / 2, (right - left) / (2 * climber.half_track)
        x, y, heading = self._pose.tolist()
        middle = heading + turn / 2
        self._pose = np.array(
            [x + way * math.cos(middle), y + way * math.sin(middle), heading + turn]
        )
        if resolution > 0:
            return State.rolling(self._pose, way / self.period, turn / self.period)
        return State.rolling(self._pose, float(wheels.forward_speed), float(wheels.yaw_rate))

    def _measured(self, state: State) -> State:
        if self.sensors.is_ideal:
            return state
        noise = self._random.normal(size=5).tolist()
        told, aside = self.sensors.told(state.motion, noise), float(state.side_slip)
        velocity = [
            told.speed * told.cosine - aside * told.sine,
            told.speed * told.sine + aside * told.cosine,
            told.yaw_rate,
        ]
        return State(np.array([told.x, told.y, told.heading]), np.array(velocity))
