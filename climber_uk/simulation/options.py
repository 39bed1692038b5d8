"""Options of a simulation: its clock, its steps, its timeouts and its initial state."""

import numpy as np

from climber_uk.mechanics.quantities import State
from climber_uk.parameters.declaration import parameter, parameters


@parameters
class SimulationOptions:
    """Clock, steps, timeouts and initial state of a simulation."""

    simulated_time: bool = parameter(
        False, "", "publish /clock, and step when the odometry is answered: lock-step"
    )
    publish_odometry: bool = parameter(
        True, "", "publish odom; false: wall_odometry makes it, of joint_states, imu and pose"
    )
    publish_tf: bool = parameter(
        True, "", "publish base_frame in odom_frame on /tf, where tf2_msgs is installed"
    )
    real_time_factor: float = parameter(
        0.0, "", "fastest simulated time by wall-clock time; 0: no limit", at_least=0
    )
    control_period: float = parameter(
        0.005, "s", "time from one odometry to the next", at_least=1e-4, plausible=(5e-4, 0.5)
    )
    integration_step: float = parameter(
        0.0025, "s", "step of the integrator", at_least=1e-6, plausible=(1e-5, 0.5)
    )
    command_timeout: float = parameter(
        0.1, "s", "age of a torque after which wheels get none", above=0, plausible=(0.002, 5)
    )
    push_timeout: float = parameter(
        0.5, "s", "age at which a push ends; 0: only with the next one", at_least=0
    )
    setpoint_timeout: float = parameter(
        0.0,
        "s",
        "age of a suction_setpoint after which the pump has suction_pressure; 0: it heeds none",
        at_least=0,
        plausible=(0.1, 5),
    )
    lockstep_timeout: float = parameter(
        5.0, "s", "wall-clock wait for a torque, then a warning", above=0
    )
    wait_for: str = parameter(
        "", "", "node, as a recorder, for whose subscriptions time waits; empty: none"
    )
    initial_x: float = parameter(0.0, "m", "x of the initial pose")
    initial_y: float = parameter(0.0, "m", "y of the initial pose")
    initial_heading: float = parameter(0.0, "rad", "initial heading")
    initial_speed: float = parameter(0.0, "m/s", "initial forward speed")
    initial_yaw_rate: float = parameter(0.0, "rad/s", "initial yaw rate")

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
        """Initial state, without side slip."""
        pose = np.array([self.initial_x, self.initial_y, self.initial_heading])
        return State.rolling(pose, self.initial_speed, self.initial_yaw_rate)
