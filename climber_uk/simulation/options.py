"""How a simulation runs: its time, its start, and what of it is worth a word."""

import numpy as np

from climber_uk.mechanics.quantities import State
from climber_uk.parameters.declaration import parameter, parameters


@parameters
class SimulationOptions:
    """How time passes, and where the climber starts."""

    simulated_time: bool = parameter(
        False, "", "publish /clock and step when a torque answers the odometry: lock-step"
    )
    real_time_factor: float = parameter(
        0.0, "", "most of simulated time to the wall clock's; 0: as answers come", at_least=0
    )
    control_period: float = parameter(
        0.005, "s", "between two odometry messages", above=0, plausible=(5e-4, 0.5)
    )
    integration_step: float = parameter(
        0.0025, "s", "of the integrator", above=0, plausible=(1e-5, 0.5)
    )
    command_timeout: float = parameter(
        0.1, "s", "age at which a torque is dropped", above=0, plausible=(0.002, 5)
    )
    push_timeout: float = parameter(
        0.5, "s", "age at which a push ends; 0: with the next one", at_least=0
    )
    lockstep_timeout: float = parameter(5.0, "s", "wall-clock wait that is reported", above=0)
    wait_for: str = parameter(
        "", "", "node, as a recorder, that must have subscribed all before time runs; none if empty"
    )
    initial_x: float = parameter(0.0, "m", "x at the start")
    initial_y: float = parameter(0.0, "m", "y at the start")
    initial_heading: float = parameter(0.0, "rad", "heading at the start")
    initial_speed: float = parameter(0.0, "m/s", "forward speed at the start")
    initial_yaw_rate: float = parameter(0.0, "rad/s", "yaw rate at the start")

    def __post_init__(self) -> None:
        if abs(self.steps * self.integration_step - self.control_period) > 1e-9:
            raise ValueError(
                f"control_period={self.control_period} must be a multiple of "
                f"integration_step={self.integration_step} [s]"
            )
        if self.real_time_factor > 0 and not self.simulated_time:
            raise ValueError(f"real_time_factor={self.real_time_factor} needs simulated_time=True")

    @property
    def steps(self) -> int:
        """Integration steps in a control period."""
        return max(1, round(self.control_period / self.integration_step))

    @property
    def initial_state(self) -> State:
        """Where the climber starts; it does not slip."""
        pose = np.array([self.initial_x, self.initial_y, self.initial_heading])
        return State.rolling(pose, self.initial_speed, self.initial_yaw_rate)
