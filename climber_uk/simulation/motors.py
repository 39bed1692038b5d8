"""Motors between a torque that is commanded and the torque at the wheel.

τ̇ = (τ_commanded - τ) / T,   within the motor's torque-speed curve (`Climber.torque_bounds`)
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
    """How far motors do as they are told; the limits themselves are the climber's."""

    torque_lag: float = parameter(0.0, "s", "T of the motors' current control", at_least=0)
    torque_resolution: float = parameter(
        0.0, "N m", "step in which torques are set; 0: any torque", at_least=0
    )

    def torques(
        self, climber: Climber, wheels: State, before: Array, commanded: Array, time: float
    ) -> Array:
        """Torques (2,) right, left, after `time` [s], of `commanded` (2,) and those `before` (2,).

        `wheels` is the state of a climber that rolls as its wheels turn.
        """
        wanted = commanded
        if self.torque_resolution > 0:
            wanted = self.torque_resolution * np.round(wanted / self.torque_resolution)
        if self.torque_lag > 0:
            wanted = wanted + (before - wanted) * math.exp(-time / self.torque_lag)
        right, left = wanted.tolist()
        right_bounds, left_bounds = climber.torque_bounds(wheels)
        return np.array([clipped(right, *right_bounds), clipped(left, *left_bounds)])
