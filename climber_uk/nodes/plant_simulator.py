"""A climber on its wall in a robot's place: wheel torques in, odometry out."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import FluidPressure, JointState
from std_srvs.srv import Trigger

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber, State
from climber_uk.mechanics.parameter import check, parameter
from climber_uk.mechanics.preview import SECOND
from climber_uk.messages import reading, writing
from climber_uk.nodes.running import WALL_CLOCK, ClimberNode, run
from climber_uk.simulation.plant import Plant

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # it comes with a ROS installation, not with the wheels
    TFMessage = None

ASK_AGAIN = 0.2  # [s] of wall-clock time, for a torque that does not come
PRESSURE_PERIOD = SECOND // 10  # [ns] of the suction pressure, which changes slowly
FALLEN_BEHIND = 1.0  # [s] from which lost wall-clock time is not made up for


@dataclass(frozen=True)
class Options:
    """How time passes, and where the climber starts."""

    simulated_time: bool = parameter(
        False, "", "publish /clock and step when a torque answers the odometry: lock-step"
    )
    control_period: float = parameter(0.005, "s", "between two odometry messages", above=0)
    integration_step: float = parameter(0.0025, "s", "of the integrator", above=0)
    command_timeout: float = parameter(0.1, "s", "age at which a torque is dropped", above=0)
    lockstep_timeout: float = parameter(5.0, "s", "wall-clock wait that is reported", above=0)
    initial_x: float = parameter(0.0, "m", "x at the start")
    initial_y: float = parameter(0.0, "m", "y at the start")
    initial_heading: float = parameter(0.0, "rad", "heading at the start")
    initial_speed: float = parameter(0.0, "m/s", "forward speed at the start")
    initial_yaw_rate: float = parameter(0.0, "rad/s", "yaw rate at the start")

    def __post_init__(self) -> None:
        check(self)
        if abs(self.steps * self.integration_step - self.control_period) > 1e-9:
            raise ValueError(
                f"control_period={self.control_period} must be a multiple of "
                f"integration_step={self.integration_step} [s]"
            )

    @property
    def steps(self) -> int:
        """Integration steps in a control period."""
        return max(1, round(self.control_period / self.integration_step))

    @property
    def initial_state(self) -> State:
        """Where the climber starts; it does not slip."""
        pose = np.array([self.initial_x, self.initial_y, self.initial_heading])
        return State.rolling(pose, self.initial_speed, self.initial_yaw_rate)


class PlantSimulator(ClimberNode):
    """The plant with its time: the wall clock's, or its own that waits for every torque.

    A run that starts in motion starts when the first torque other than zero arrives.
    """

    def __init__(self) -> None:
        super().__init__("plant_simulator")
        for kind in (Options, Climber):
            self.parameters.declare(kind)
        self.parameters.refuse_unknown()
        self.options = self.parameters.read(Options)
        self.period = round(self.options.control_period * SECOND)  # [ns]
        self.on_parameters()
        self.place_at_start()

        self.odometry = self.publisher(Odometry, "odom")
        self.joints = self.publisher(JointState, "joint_states")
        self.pressure = self.publisher(FluidPressure, "suction_pressure")
        self.transform = self.publisher(TFMessage, "/tf") if TFMessage else None
        self.subscription(JointState, "wheel_torques", self.on_torques)
        self.create_service(Trigger, "~/reset", self.on_reset)
        self.start_diagnostics(self.values, alone_on=("odom", "wheel_torques"))
        if self.options.simulated_time:
            self.stamp = SECOND  # [ns]; 0 would mean that there is no time yet
            self.clock = self.publisher(ClockMessage, "/clock")
            self.create_timer(ASK_AGAIN, self.ask_again, clock=WALL_CLOCK)
        else:
            self.stamp = self.get_clock().now().nanoseconds
            self.create_timer(self.options.control_period, self.keep_up)
        self.stepped_at = WALL_CLOCK.now()
        self.publish_state()

    def on_parameters(self) -> None:
        """Take up a changed suction pressure."""
        self.plant = Plant(self.parameters.read(Climber), self.options.integration_step)

    def place_at_start(self) -> None:
        """Go back to the initial state, with no torque yet."""
        self.state = self.options.initial_state
        self.held = bool(self.state.velocity.any())
        self.angles: Array = np.zeros(2)  # [rad] of the wheels: right, left
        self.applied: Array = np.zeros(2)  # [N m] right, left
        self.commands: deque[tuple[int, Array]] = deque()  # arrival [ns], torques

    def on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Start again from the initial state; time goes on."""
        self.place_at_start()
        self.stamp += self.period
        self.publish_state()
        response.success, response.message = True, f"at the start at {self.stamp * 1e-9:.3f} s"
        return response

    def on_torques(self, message: JointState) -> None:
        """Apply torques from now on or, in simulated time, for a step if they answer the last."""
        names = self.names
        try:
            torques = reading.wheel_torques(
                message, names.left_wheel_joint, names.right_wheel_joint
            )
            self.say("wheel_torques", "")
        except ValueError as error:
            self.say("wheel_torques", "refused, zero torque instead", str(error))
            torques = np.zeros(2)
        limit = self.plant.climber.max_wheel_torque
        torques = np.clip(torques, -limit, limit)
        self.held = self.held and not torques.any()
        if not self.options.simulated_time:
            self.commands.append((self.get_clock().now().nanoseconds, torques))
        elif reading.nanoseconds(message.header.stamp) == self.stamp:
            self.commands = deque([(self.stamp, torques)])
            self.step()
            self.say("lock-step", "")

    def ask_again(self) -> None:
        """Publish the odometry once more to whom missed it; report who does not answer."""
        waited = (WALL_CLOCK.now() - self.stepped_at).nanoseconds
        if waited > ASK_AGAIN * SECOND:
            self.publish_state()
        if waited > self.options.lockstep_timeout * SECOND:
            self.say("lock-step", f"no torque for the odometry of {self.stamp * 1e-9:.3f} s")

    def keep_up(self) -> None:
        """Step until the clock's time is reached."""
        now = self.get_clock().now().nanoseconds
        if now - self.stamp > FALLEN_BEHIND * SECOND:
            self.get_logger().warning(f"{(now - self.stamp) * 1e-9:.1f} s behind: left out")
            self.stamp = now - self.period
        while self.stamp + self.period <= now:
            self.step()

    def step(self) -> None:
        """Advance by a control period and publish."""
        rates = self.plant.climber.wheel_rates(self.state)
        for number in range(0 if self.held else self.options.steps):
            self.applied = self.command_at(self.stamp + number * self.period // self.options.steps)
            self.state = self.plant.advance(self.state, self.applied, steps=1)
        rates = (rates + self.plant.climber.wheel_rates(self.state)) / 2
        self.angles = self.angles + rates * self.options.control_period * (not self.held)
        self.stamp += self.period
        self.stepped_at = WALL_CLOCK.now()
        self.publish_state()

    def command_at(self, time: int) -> Array:
        """Torques that act at `time` [ns]: the last to arrive, unless they are too old."""
        while len(self.commands) > 1 and self.commands[1][0] <= time:
            self.commands.popleft()
        if not self.commands or self.commands[0][0] > time:
            return np.zeros(2)
        if self.options.simulated_time:
            return self.commands[0][1]
        stale = time - self.commands[0][0] > self.options.command_timeout * SECOND
        self.say("torque command", "stale; zero torque instead" if stale else "")
        return np.zeros(2) if stale else self.commands[0][1]

    def publish_state(self) -> None:
        """Publish all that a robot would tell, the odometry first: it is waited for."""
        names, stamp = self.names, writing.time(self.stamp)
        odometry = writing.odometry(self.state, self.stamp, names.odom_frame, names.base_frame)
        self.odometry.publish(odometry)
        if self.options.simulated_time:
            self.clock.publish(ClockMessage(clock=stamp))
        joints = writing.wheel_torques(
            self.applied, self.stamp, names.left_wheel_joint, names.right_wheel_joint
        )
        joints.position = self.angles[::-1].tolist()
        joints.velocity = self.plant.climber.wheel_rates(self.state)[::-1].tolist()
        self.joints.publish(joints)
        if self.transform is not None:
            self.transform.publish(TFMessage(transforms=[writing.transform(odometry)]))
        if self.stamp % PRESSURE_PERIOD < self.period:
            pressure = FluidPressure(fluid_pressure=self.plant.climber.suction_pressure)
            pressure.header.stamp = stamp
            self.pressure.publish(pressure)

    def values(self) -> dict[str, object]:
        """Tell diagnostics how it goes."""
        return {
            "time [s]": self.stamp * 1e-9,
            "suction pressure [Pa]": self.plant.climber.suction_pressure,
            "side slip [m/s]": float(self.state.side_slip),
        }


def main() -> None:
    """Run the node."""
    run(PlantSimulator)
