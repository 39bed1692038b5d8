"""Motors: from the commanded torques to the torques at the wheels.

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
    """Lag and resolution of the motors; their limits are parameters of `Climber`."""

    torque_lag: float = parameter(0.0, "s", "time constant T of the motors; 0: at once", at_least=0)
    torque_resolution: float = parameter(
        0.0, "N m", "step in which torques are set; 0: continuous", at_least=0
    )

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
        right, left = torques.tolist()
        right_bounds, left_bounds = climber.torque_bounds(wheels)
        return np.array([clipped(right, *right_bounds), clipped(left, *left_bounds)])
