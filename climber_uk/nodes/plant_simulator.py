"""Simulates a climber on its wall, in place of a robot: wheel torques in, odometry out."""

from collections.abc import Sequence
from math import inf

import numpy as np
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import FluidPressure, JointState
from std_srvs.srv import SetBool, Trigger

from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.adhesion import Alarm
from climber_uk.mechanics.quantities import NO_TORQUES
from climber_uk.messages import reading
from climber_uk.messages.in_place import NumberReader
from climber_uk.messages.topics import (
    FELL,
    JOINTS,
    ODOMETRY,
    PLANT,
    PUSH,
    REFERENCE,
    SETPOINT,
    TORQUES,
)
from climber_uk.ros import plant_parts
from climber_uk.ros.margins import Margins
from climber_uk.ros.plant_time import PlantTime
from climber_uk.ros.plant_topics import PlantTopics
from climber_uk.ros.running import ClimberNode, run
from climber_uk.simulation.command_buffer import CommandBuffer
from climber_uk.simulation.inputs import FellOff, NotFinite
from climber_uk.simulation.options import SimulationOptions
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import UNPUSHED, Physics, Push, SimulatedRobot

AWAITED = ODOMETRY, JOINTS, TORQUES, REFERENCE  # that `wait_for` subscribes


class PlantSimulator(ClimberNode):
    """The node of one climber; its `time` may be shared with others of the same process.

    A run that starts in motion starts when the first torque other than zero arrives.
    """

    def __init__(self, namespace: str = "", time: PlantTime | None = None) -> None:
        super().__init__(PLANT, namespace)
        plant_parts.declare(self.parameters)
        self.be_exclusive()
        self.parameters.refuse_unknown("the paper's climber, at rest")
        self.options = self.parameters.read(SimulationOptions)
        self.margins = Margins(self, self.parameters.read(Alarm))
        self.time = time or PlantTime(self, self.options)
        self.time.join(self)
        self.place_at_start()

        self.topics = PlantTopics(self, self.sensors, self.options)
        self.take_speeds = self.robot.parts.motors.take_speeds
        obeyed = reading.JOINT_RATES if self.take_speeds else reading.JOINT_STATE
        self.read_torques = NumberReader(JointState, *obeyed)
        self.subscription(JointState, TORQUES, self.on_torques, raw=True)
        self.subscription(WrenchStamped, PUSH, self.on_push)
        if self.options.setpoint_timeout > 0:
            self.subscription(FluidPressure, SETPOINT, self.on_setpoint)
        self.create_service(Trigger, "~/reset", self.on_reset)
        self.create_service(SetBool, "~/pause", self.on_pause)
        self.create_service(Trigger, "~/step", self.on_step)
        self.start_diagnostics(self.values, alone_on=(ODOMETRY, TORQUES))
        self.time.publish([self])

    def on_parameters(self) -> None:
        """Take up changed parameters: the pump's pressure, a magnet's gap, levels of alarm."""
        self.robot.take(plant_parts.parts(self.parameters))
        self.margins.alarm = self.parameters.read(Alarm)

    def summary(self) -> str:
        """Climber, physics and clock, for the log."""
        climber, physics = self.robot.plant.climber, self.parameters.read(Physics)
        pull = self.robot.plant.contact.adhesion.force(climber)
        rate = 1 / self.options.control_period
        return (
            f"{climber.mass:g} kg, {physics.locomotion}, {physics.friction} friction, "
            f"{physics.adhesion} of {pull:.4g} N, wall {physics.wall}, {rate:g} Hz in "
            + ("lock-step" if self.options.simulated_time else "the wall clock's time")
        )

    # Commands

    def place_at_start(self) -> None:
        """Go to the initial state, without torques."""
        start = self.options.initial_state
        self.robot = SimulatedRobot(
            plant_parts.parts(self.parameters), start, self.options.control_period
        )
        self.waits = bool(start.velocity.any())  # for a torque, to start in motion
        self.origin = self.time.stamp  # of the first odometry [ns]
        timeout = 0.0 if self.options.simulated_time else self.options.command_timeout
        self.commands: CommandBuffer[Array] = CommandBuffer(round(timeout * SECOND))
        self.pushes: CommandBuffer[Push] = CommandBuffer(round(self.options.push_timeout * SECOND))
        timeout = self.options.setpoint_timeout
        self.setpoints: CommandBuffer[float] = CommandBuffer(round(timeout * SECOND))
        self.fallen = self.answered = self.is_lost = False
        self.losses = np.random.default_rng(self.parameters.read(Sensors).seed)
        self.sensors = plant_parts.field_sensors(self.parameters)
        self.sense(self.time.stamp)

    def on_reset(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Service ~/reset: start again from the initial state; time goes on."""
        late = self.parameters.read(Sensors).delay_in(self.options.control_period)
        self.time.skip(self, periods=1 + late)  # no odometry has the stamp of one before
        self.place_at_start()
        self.report("climber", "")
        self.time.publish(self.time.standing)
        response.success, response.message = True, f"at the start at {self.now}"
        return response

    def on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Service ~/pause: stop time, or let it run."""
        self.time.pause(bool(request.data))
        response.success = True
        response.message = f"{'paused' if request.data else 'going on'} at {self.now}"
        return response

    def on_step(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Service ~/step: in a pause, run for one control period once its torque has come."""
        response.success, response.message = False, "not paused"
        if self.fallen:
            response.message = "fallen: reset first"
        elif self.time.paused:
            response.success, response.message = True, f"from {self.now}"
            self.time.grant()
        return response

    def on_push(self, message: WrenchStamped) -> None:
        """Let a push act from the message's stamp on, or from now if that is 0 or past."""
        frames = self.names.odom_frame, self.names.base_frame
        wrench = self.checked(PUSH, reading.wrench, message, *frames)
        if wrench is not None:
            begin = reading.nanoseconds(message.header.stamp) or self.time.stamp
            self.pushes.add(begin, Push(*wrench))

    def on_setpoint(self, message: FluidPressure) -> None:
        """Set the pump, from now on until the setpoint is too old."""
        pressure = self.checked(SETPOINT, self.read_setpoint, message)
        if pressure is not None:
            self.setpoints.add(self.time.stamp, pressure)

    def read_setpoint(self, message: FluidPressure) -> float:
        """Pressure [Pa] of a message that is to be obeyed; `ValueError` if it is not."""
        if self.exclusive:
            self.check_alone(SETPOINT)
        return reading.pressure(message)

    def on_torques(self, serialized: bytes) -> None:
        """Let a command act from now on; in lock-step only if it answers the last odometry."""
        stamp, told = None, NO_TORQUES
        try:
            fields = reading.JointFields(*self.read_torques(serialized))
            stamp = fields.stamp
            if self.exclusive:
                self.check_alone(TORQUES)
            what: reading.Told = "velocities" if self.take_speeds else "efforts"
            told = reading.wheel_torques(fields, self.names.wheels, what)
            self.report(TORQUES, "")
        except ValueError as error:
            self.report(TORQUES, f"refused, {self.instead} instead", str(error))
        limit = inf if self.take_speeds else self.robot.plant.climber.max_wheel_torque
        torques = np.array([min(max(torque, -limit), limit) for torque in told])
        self.waits = self.waits and not any(told)
        if not self.options.simulated_time:
            self.commands.add(self.get_clock().now().nanoseconds, torques)
        elif stamp == self.asked and not self.answered:
            self.commands.add(self.time.stamp, torques)
            self.answered = True
            self.report("lock-step", "")
            self.time.step_if_due()

    def command_at(self, time: int) -> Array:
        """Command (2,) in force at `time` [ns]: the latest, or 0 if it is too old."""
        torques, is_stale = self.commands.at(time)
        if not self.options.simulated_time:
            self.report("torque command", f"stale; {self.instead} instead" if is_stale else "")
        return np.zeros(2) if torques is None else torques

    @property
    def instead(self) -> str:
        """What the wheels get in the place of a bad command."""
        return "standstill" if self.take_speeds else "zero torque"

    # Time

    @property
    def asked(self) -> int:
        """Stamp of the latest odometry [ns], which a torque is to answer."""
        number, _ = self.robot.odometer.latest()
        return self.origin + number * self.time.period

    @property
    def now(self) -> str:
        """Time, for messages."""
        return f"{self.time.stamp / SECOND:.3f} s"

    def is_heard_by(self, node: str) -> bool:
        """Whether a node of that name has subscribed all topics of `AWAITED`."""
        return all(
            node in (info.node_name for info in self.get_subscriptions_info_by_topic(topic))
            for topic in map(self.resolve_topic_name, AWAITED)
        )

    def advance(self) -> None:
        """Advance by a control period and measure; a climber that falls is `fallen` then."""
        self.robot.setpoint, is_stale = self.setpoints.at(self.time.stamp)
        self.report("suction setpoint", "stale; full pressure instead" if is_stale else "")
        try:
            for number in range(0 if self.waits else self.options.steps):
                time = self.time.stamp + number * self.time.period // self.options.steps
                push, _ = self.pushes.at(time)
                self.robot.advance(self.command_at(time), push or UNPUSHED)
        except (FellOff, NotFinite) as error:
            self.fallen = True
            self.report("climber", f"{FELL}: {error}" if isinstance(error, FellOff) else str(error))
            return
        self.robot.measure()
        loss = self.options.odometry_loss
        self.is_lost = loss > 0 and self.losses.random() < loss
        self.sense(self.time.stamp + self.time.period)

    def sense(self, stamp: int) -> None:
        """Have encoders, IMU and fixes measure at `stamp` [ns]."""
        robot = self.robot
        self.measured = self.sensors.measure(stamp, robot.state, robot.plant, robot.angles)

    def no_answer(self) -> None:
        """Report that no torque answers the last odometry."""
        self.report("lock-step", f"no torque for the odometry of {self.asked / SECOND:.3f} s")

    # Outputs

    def publish_odometry(self) -> None:
        """Publish the odometry, or what is made one of, which a torque is to answer."""
        if not self.is_lost:
            self.topics.publish_odometry(self.robot, self.asked)
        if not self.options.publish_odometry:
            self.publish_sensors()

    def publish_sensors(self) -> None:
        """Publish encoders, IMU and fixes; fixes only once."""
        self.topics.publish_sensors(self.robot, self.measured)
        self.measured = self.measured._replace(fixes=[])

    def publish_others(self) -> None:
        """Publish all other topics, and the margins."""
        if self.options.publish_odometry:
            self.publish_sensors()
        self.topics.publish_others(self.robot, self.time.stamp)
        load = self.robot.plant.wheel_load(self.robot.state)
        self.margins.take(*self.robot.margins(), load, self.time.stamp)

    def diagnose(self) -> None:
        """Publish a status of troubles and values, and one of the lowest margins."""
        super().diagnose()
        self.margins.diagnose()

    def values(self) -> dict[str, object]:
        """Values for diagnostics."""
        return {
            "time [s]": self.time.stamp / SECOND,
            "suction pressure [Pa]": self.robot.pressure,
            "side slip [m/s]": float(self.robot.state.side_slip),
            "paused": self.time.paused,
        }


def with_one_clock(climbers: Sequence[str] = ("",)) -> list[PlantSimulator]:
    """Nodes of climbers in some namespaces; all are stepped by the clock of the first."""
    first, *others = climbers
    leader = PlantSimulator(first)
    return [leader, *(PlantSimulator(namespace, leader.time) for namespace in others)]


def main() -> None:
    """Run a climber, or one in each of some namespaces."""
    climbers = {
        "nargs": "+",
        "metavar": "NAMESPACE",
        "help": "of each climber (default: one, in none)",
    }
    run(with_one_clock, __doc__, {"--climbers": climbers})
