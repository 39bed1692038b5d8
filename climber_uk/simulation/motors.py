"""Motors: from the command to the torques at the wheels.

τ̇ = (τ* - τ) / T   of motors that take torques τ*
u̇ = (u* - u) / T   of a servo that takes rates u* of the wheels

within the motor's torque-speed curve (`Climber.bounds`).
"""

import math

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import clipped
from climber_uk.mechanics.quantities import State
from climber_uk.parameters.declaration import parameter, parameters


@parameters
class Motors:
    """Lag and resolution of the motors; their limits are parameters of `Climber`."""

    motors: str = parameter(
        "torque",
        "",
        "what of `wheel_torques` the motors obey: effort or velocity",
        choices=("torque", "velocity"),
    )
    torque_lag: float = parameter(0.0, "s", "time constant T of the motors; 0: at once", at_least=0)
    torque_resolution: float = parameter(
        0.0, "N m", "step in which torques are set; 0: continuous", at_least=0
    )
    servo_time_constant: float = parameter(
        0.02, "s", "time constant T of a speed servo, while its torque suffices", at_least=0
    )
    velocity_resolution: float = parameter(
        0.0, "m/s", "step in which rims' speeds are set; 0: continuous", at_least=0
    )
    velocity_dead_band: float = parameter(
        0.0, "m/s", "rim's speed below which a servo lets the wheel stand", at_least=0
    )

    @property
    def take_speeds(self) -> bool:
        """Whether a command is the wheels' rates, not their torques."""
        return self.motors == "velocity"

    def torques(
        self, climber: Climber, wheels: State, before: Array, commanded: Array, time: float
    ) -> Array:
        """Torques (2,) (right, left) [N m] `time` [s] after they were `before` (2,).

        `commanded` (2,) is constant meanwhile; `wheels` is the state of a climber that rolls as
        its wheels rotate, by which the motors' limits are computed.
        """
        torques = commanded
        if self.torque_resolution > 0:
            torques = self.torque_resolution * np.round(torques / self.torque_resolution)
        if self.torque_lag > 0:
            torques = torques + (before - torques) * math.exp(-time / self.torque_lag)
        return _within_bounds(climber, wheels, torques)

    def servo(
        self,
        climber: Climber,
        wheels: State,
        last: tuple[Array, Array],
        commanded: Array,
        time: float,
        eagerness: float = 1.0,
    ) -> Array:
        """Torques (2,) as of `torques`, of a servo for `commanded` rates (2,) [rad/s].

        `last` are the torques (2,) of the step before, as long as this one, and the rates (2,)
        that the wheels had at its begin. A PI controller in its incremental form: what the last
        torques did not do, these do as well, be it friction, weight or load that is to blame. That
        is stable where wheels carry at least `eagerness` times the climber's inertia.
        """
        before, rates_before = last
        rates, radius = climber.wheel_rates(wheels), climber.wheel_radius
        if self.velocity_resolution > 0:
            step = self.velocity_resolution / radius
            commanded = step * np.round(commanded / step)
        commanded = np.where(np.abs(radius * commanded) < self.velocity_dead_band, 0.0, commanded)
        share = 1 - math.exp(-time / self.servo_time_constant) if self.servo_time_constant else 1.0
        missing = radius * (share * (commanded - rates) - (rates - rates_before)) / time
        right, left = missing.tolist()  # [m/s²] of the rims
        force = eagerness * climber.driven_mass * (right + left) / 2
        moment = eagerness * climber.driven_inertia * (right - left) / (2 * climber.half_track)
        return _within_bounds(climber, wheels, before + climber.wheel_torques(force, moment))


def _within_bounds(climber: Climber, wheels: State, torques: Array) -> Array:
    right, left = torques.tolist()
    right_bounds, left_bounds = climber.bounds(wheels.motion)
    return np.array([clipped(right, *right_bounds), clipped(left, *left_bounds)])
