"""Answers each odometry with the wheel torques that keep the climber on its reference.

Inactive, it answers with its safe output: a climber on a wall needs torques at all times.
"""

import numpy as np
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterEvent
from rclpy.subscription import Subscription
from sensor_msgs.msg import BatteryState, FluidPressure, JointState, TimeReference
from std_msgs.msg import Bool, Float64MultiArray
from trajectory_msgs.msg import MultiDOFJointTrajectory

from climber_uk.control.build import KINDS, ControllerChoice, build_controller, settings
from climber_uk.control.constraints import UDWADIA_KALABA
from climber_uk.control.control_law import Command
from climber_uk.control.controller import Answer
from climber_uk.control.least_suction import SuctionOptions
from climber_uk.control.safety import Mode
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.adhesion import ADHESION, Alarm, Attachment, Grip
from climber_uk.mechanics.climber import Climber, most_pressure
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion
from climber_uk.mechanics.reference import tracking_error
from climber_uk.messages import reading, reading_sensors, writing
from climber_uk.messages.in_place import NumberReader
from climber_uk.messages.references import PreviewReader
from climber_uk.messages.topics import (
    BATTERY,
    CONTROLLER,
    EMERGENCY_STOP,
    FORCE,
    JOINTS,
    ODOMETRY,
    PARAMETERS,
    PRESSURE,
    REFERENCE,
    REFERENCE_TIME,
    TORQUES,
    private,
)
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.ros.managed import ManagedNode
from climber_uk.ros.margins import Margins
from climber_uk.ros.output import Output
from climber_uk.ros.running import (
    BEST_EFFORT,
    LATCHED,
    PUBLISH_PERIOD,
    RELIABLE,
    WALL_CLOCK,
    Throttle,
    run,
)
from climber_uk.ros.suction_setpoint import SuctionSetpoint

SHORTEST = 0.002  # [s] of a timeout that is looked for: a timer of no time leaves no time
OFF_WALL = 0.1  # [m] by which odometry may leave its plane, before it is said
LARGEST_REFERENCE = 2**18  # [bytes], of some 1500 points, which take a quarter of a second to read


@parameters
class NodeOptions:
    """The commands once more, for boards that take them in another form."""

    effort_commands: bool = parameter(False, "", "publish torques on effort_controller/commands")
    effort_order: str = parameter(
        "left_right",
        "",
        "order of the torques in effort_controller/commands; wrong: the climber yaws away",
        choices=("left_right", "right_left"),
    )
    publish_cmd_vel: bool = parameter(
        False, "", "publish the speeds on cmd_vel, for boards that take a twist"
    )


class UkTorqueController(ManagedNode):
    """Passes messages to a `Controller`, and its answers on."""

    def __init__(self) -> None:
        super().__init__(CONTROLLER)
        parts = [(kind, f"{name}.") for name, kind in ADHESION.items()]
        others = (NodeOptions, ""), (Grip, ""), (Alarm, ""), (SuctionOptions, "least_suction.")
        for kind, prefix in [*KINDS, *others, *parts]:
            self.parameters.declare(kind, prefix)
        self.be_exclusive()
        self.parameters.refuse_unknown("the paper's scenario, up to 20 N m a wheel")
        self.options = self.parameters.read(NodeOptions)
        self.margins = Margins(self, self.parameters.read(Alarm))
        self.attachment = self.read_attachment()
        self.pressure: float | None = None  # [Pa] as last measured
        self.controller = build_controller(self.parameters, self.pressure)
        self.answers = self.saturations = 0
        self.is_due = Throttle(PUBLISH_PERIOD)  # of the disturbance
        self.is_position_due = Throttle(PUBLISH_PERIOD)
        self.last_mode = Mode.WAITING
        self.told_mode = Mode.WAITING  # in diagnostics
        self.answered_mode: Mode | None = None  # of the last answer since then
        self.first_z: float | None = None  # [m] of odometry, off the wall

        self.read_odometry = NumberReader(Odometry, *reading.ODOMETRY)
        self.read_preview = PreviewReader()
        self.joints = self.names.wheels
        zeros = self.joints.rates(0.0, 0.0)
        torques = JointState(name=self.joints.all, velocity=zeros, effort=zeros)
        self.torques = self.output(TORQUES, torques, writing.WHEEL_COMMAND)
        self.efforts = self.publisher(Float64MultiArray, "effort_controller/commands")
        zero, base_frame = (0.0, 0.0, 0.0), self.names.base_frame
        twist = TwistStamped()
        twist.header.frame_id = base_frame
        self.twist = self.output("cmd_vel", twist, writing.TWIST)
        vector, wrench = (of(zero, 0, base_frame) for of in (writing.vector, writing.wrench))
        self.error = self.output("~/tracking_error", vector, writing.VECTOR)
        self.force = self.output(private(FORCE), wrench, writing.WRENCH)
        self.disturbance = self.output("~/disturbance", wrench, writing.WRENCH)
        self.setpoint: SuctionSetpoint | None = None
        if (suction := self.parameters.read(SuctionOptions, "least_suction.")).enabled:
            climber = self.parameters.read(Climber)
            self.setpoint = SuctionSetpoint(self, suction, climber, self.attachment)
        self.reference_time = self.publisher(TimeReference, REFERENCE_TIME)
        self.positions: dict[Mode, Output] = {}  # on this topic, which tells the mode
        self.parameter_values = self.publisher(ParameterEvent, private(PARAMETERS), LATCHED)
        self.publish_parameters()
        safety = self.controller.safety
        shortest = max(safety.shortest, SHORTEST)
        # on the wall clock: one in simulated time would not notice that there is no clock
        self.create_timer(shortest / 2, self.look, clock=WALL_CLOCK)
        self.start_diagnostics(self.values, alone_on=(ODOMETRY, REFERENCE, TORQUES))
        self.start_life()

    def summary(self) -> str:
        """Climber, constraint set and safe output, for the log."""
        climber, choice = self.parameters.read(Climber), self.parameters.read(ControllerChoice)
        law, adhesion = f"constraints {choice.constraints}", choice.adhesion
        law = law if choice.controller == UDWADIA_KALABA else f"controller {choice.controller}"
        pull = self.attachment.adhesion.force(climber)
        return (
            f"{climber.mass:g} kg, at most {climber.max_wheel_torque:g} N m a wheel, "
            f"{adhesion} of {pull:.4g} N, {law}, "
            f"safe output {self.controller.safety.safe_output}"
        )

    def listen(self) -> list[Subscription]:
        """Reset the controller to its safe output, and subscribe all inputs."""
        stops = self.controller.stops
        self.controller = build_controller(self.parameters, self.pressure)
        self.controller.stops = stops  # a button that is pressed stays so
        self.controller.enable(False)
        inputs = []
        if stops.options.emergency_stop:
            inputs.append(self.subscription(Bool, EMERGENCY_STOP, self.on_emergency_stop))
        if stops.options.reads_battery:
            battery = self.subscription(BatteryState, BATTERY, self.on_battery, BEST_EFFORT)
            inputs.append(battery)
        if self.controller.guard.options.encoder_distance > 0:
            inputs.append(self.subscription(JointState, JOINTS, self.on_joints, BEST_EFFORT))
        return [
            *inputs,
            self.subscription(Odometry, ODOMETRY, self.on_odometry, BEST_EFFORT, raw=True),
            self.subscription(
                MultiDOFJointTrajectory, REFERENCE, self.on_reference, RELIABLE, raw=True
            ),
            self.subscription(FluidPressure, PRESSURE, self.on_pressure, BEST_EFFORT),
        ]

    def act(self, active: bool) -> None:
        """Follow the reference, or give the safe output."""
        self.controller.enable(active)

    # Parameters

    def read_attachment(self) -> Attachment:
        """Adhesion and grip by the present parameters, for the margins."""
        read = self.parameters.read
        name = read(ControllerChoice).adhesion
        return Attachment(adhesion=read(ADHESION[name], f"{name}."), grip=read(Grip))

    def on_parameters(self) -> None:
        """Take up changed parameters."""
        self.margins.alarm = self.parameters.read(Alarm)
        self.attachment = self.read_attachment()
        if self.setpoint is not None:
            self.setpoint.take(self.parameters.read(Climber), self.attachment)
        self.retune()
        self.publish_parameters()

    def retune(self) -> None:
        """Give the controller the present parameters, and the measured pressure."""
        self.controller.retune(settings(self.parameters, self.pressure))

    def publish_parameters(self) -> None:
        """Publish all parameters, so that a bag has all that the torques come from."""
        name, now = self.get_fully_qualified_name(), self.now()
        self.parameter_values.publish(writing.parameters(self.parameters.values, name, now))

    # Messages

    def on_odometry(self, serialized: bytes) -> None:
        """Answer an odometry with torques, or a bad one with the safe output."""
        try:
            if self.exclusive:
                self.check_alone(ODOMETRY)
            fields = reading.OdometryFields(*self.read_odometry(serialized))
            motion = reading.motion_of(fields, self.names.odom_frame, self.names.base_frame)
        except ValueError as error:
            self.publish(self.controller.on_bad_odometry(self.now(), str(error)))
            return
        if self.first_z is None:
            self.first_z = fields.z
        elif abs(fields.z - self.first_z) > OFF_WALL:
            detail = f"{self.first_z:.3g} to {fields.z:.3g} m; x and y are to be along the wall"
            self.report(ODOMETRY, "position.z changes", detail, is_fault=False)
        self.publish(self.controller.on_odometry(self.now(), fields.stamp, motion, fields.v_y))

    def on_reference(self, serialized: bytes) -> None:
        """Check and keep a reference; answer an odometry that waits for it."""
        preview = self.checked(REFERENCE, self.read_reference, serialized)
        if preview is not None:
            self.publish(self.controller.on_reference(self.now(), preview))

    def read_reference(self, serialized: bytes) -> Preview:
        """Preview of a message; `ValueError` unless it can be followed."""
        if self.exclusive:
            self.check_alone(REFERENCE)
        if len(serialized) > LARGEST_REFERENCE:
            raise ValueError(f"{len(serialized)} bytes must be <= {LARGEST_REFERENCE}")
        preview = self.read_preview(serialized, self.names.odom_frame)
        preview.check_heading()
        return preview

    def on_pressure(self, message: FluidPressure) -> None:
        """Give the controller the measured pressure difference."""
        most = most_pressure(self.parameters.read(Climber).suction_pressure)
        pressure = self.checked(PRESSURE, reading.pressure, message, most)
        if pressure is None:
            return
        if self.setpoint is not None:
            self.setpoint.measure(pressure, self.now())
        if pressure != self.pressure:
            self.pressure = pressure
            self.retune()

    def on_emergency_stop(self, message: Bool) -> None:
        """Stop at once, or let `~/enable` end the stop."""
        now = self.now()
        self.controller.stops.press(message.data, now)
        if message.data:
            self.publish(self.controller.look(now))

    def on_joints(self, message: JointState) -> None:
        """Compare odometry with the wheels' angles."""
        angles = self.checked(JOINTS, reading_sensors.wheel_angles, message, self.joints)
        if angles is not None:
            self.controller.on_encoders(*angles)

    def on_battery(self, message: BatteryState) -> None:
        """Stop at a low charge or voltage."""
        battery = self.checked(BATTERY, reading_sensors.battery, message)
        if battery is not None:
            self.controller.stops.see_battery(*battery)

    def look(self) -> None:
        """Publish the safe output if odometry or reference have stopped."""
        if self.inputs:
            self.publish(self.controller.look(self.now()))

    def now(self) -> int:
        """Time of the node's clock [ns]; 0 while there is none."""
        return self.get_clock().now().nanoseconds

    def publish(self, answer: Answer | None) -> None:
        """Report what has changed, and publish an answer if there is one."""
        controller = self.controller
        mode = controller.mode
        # WAITING gives no torque, of which a replay would take it for the mode
        if mode is not self.last_mode and mode is not Mode.WAITING:
            approaches = mode is Mode.APPROACHING
            self.report(
                "reference waits", mode.value if approaches else "", controller.detail, False
            )
            trouble = "" if approaches or mode is Mode.FOLLOWING else mode.value
            self.report("safe output", trouble, controller.detail, mode.is_fault)
        if answer is not None:
            self.publish_torques(answer)
            self.answered_mode = mode
            if self.told_mode is Mode.WAITING:
                self.diagnose()
        if self.setpoint is not None:
            self.setpoint.publish(controller, answer, self.now())
        self.publish_position()
        self.report_clock(controller.clock_offset)
        unheard = "" if controller.encoders.is_heard else "not heard: odometry has no witness"
        self.report("encoders", unheard, f"on {JOINTS}")
        if answer is not None and controller.motion is not None:
            if answer.command is not None:
                self.publish_causes(answer.stamp, answer.command, controller.motion)
            self.add_margins(answer, controller.motion)

    def report_clock(self, offset: float) -> None:
        """Report an odometry's clock that is `offset` [s] behind, or that it is no more."""
        if not offset:
            self.report("clock", "")
            return
        detail = f"by {offset:.3f} s; if that is latency, set transport_delay"
        self.report("clock", "odometry's differs from this node's", detail, is_fault=False)

    def publish_position(self) -> None:
        """Publish how far along the reference the climber is, which the planner waits for."""
        controller, stamp = self.controller, self.controller.stamp
        position = controller.active.position(stamp)
        has_changed, self.last_mode = controller.mode is not self.last_mode, controller.mode
        if position is not None and (self.is_position_due(stamp) or has_changed):
            if controller.mode not in self.positions:
                empty = TimeReference(source=controller.mode.name.lower())
                output = Output(self.reference_time, empty, writing.TIME_REFERENCE)
                self.positions[controller.mode] = output
            self.positions[controller.mode].publish(stamp, *divmod(position, SECOND))

    def publish_torques(self, answer: Answer) -> None:
        """Publish torques and speeds with the stamp of the odometry that they answer.

        Wheels of a side share its torque, and turn at the same rate.
        """
        right, left = answer.wheels
        right_rate, left_rate = self.controller.law.climber.rim_rates(answer.speeds)
        torques = self.joints.torques(left, right)
        self.torques.publish(answer.stamp, self.joints.rates(left_rate, right_rate), torques)
        if self.options.publish_cmd_vel:
            self.twist.publish(answer.stamp, *answer.speeds)
        if self.options.effort_commands:
            is_left_first, lefts = self.options.effort_order == "left_right", len(self.joints.left)
            ordered = torques if is_left_first else torques[lefts:] + torques[:lefts]
            self.efforts.publish(Float64MultiArray(data=ordered))

    def publish_causes(self, stamp: int, command: Command, motion: Motion) -> None:
        """Publish constraint force, disturbance and tracking error behind an answer."""
        self.answers += 1
        self.saturations += not command.fits
        controller = self.controller
        if self.force.is_heard:
            force, moment = command.demanded
            self.force.publish(stamp, force, command.lateral, moment)
        if self.is_due(stamp):
            force, moment = controller.estimator.disturbance
            self.disturbance.publish(stamp, force, 0.0, moment)
        if not self.error.is_heard:
            return
        active = controller.active
        desired = active.followed.at(active.progress.at(stamp)) if active.followed else None
        if desired is not None:
            pose = np.array([motion.x, motion.y, motion.heading])
            self.error.publish(stamp, *tracking_error(pose, desired))

    def add_margins(self, answer: Answer, motion: Motion) -> None:
        """Add the slip margin under an answer's torques, and the tip margin."""
        law, attachment = self.controller.law, self.attachment
        climber, (right, left) = law.climber, answer.wheels
        forces = right / climber.wheel_radius, left / climber.wheel_radius
        into_wall, along_wall, across = law.gravity(motion)
        lateral = -across if answer.command is None else answer.command.lateral
        self.margins.take(
            attachment.slip_margin(climber, into_wall, forces, lateral, across),
            attachment.tip_margin(climber, into_wall, along_wall),
            attachment.wheel_load(climber, into_wall),
            answer.stamp,
        )

    def diagnose(self) -> None:
        """Publish a status of troubles and values, and one of the lowest margins.

        A wait for a reference is told if nothing was answered since the last one: in lock-step all
        nodes wait for each other now and then, while no time goes by.
        """
        mode = self.controller.mode
        self.told_mode = (self.answered_mode or mode) if mode is Mode.WAITING else mode
        self.answered_mode = None
        self.report_delay()
        super().diagnose()
        self.margins.diagnose()

    def report_delay(self) -> None:
        """Report torques that act much later, or earlier, than `transport_delay` says."""
        estimator = self.controller.estimator
        late = estimator.latency.is_far_off
        delay = estimator.timing.transport_delay + estimator.latency.delay
        hint = f"set transport_delay to {delay:.3f}, or see check_driver --move"
        self.report("delay", "torques do not act when transport_delay says" * late, hint, False)

    def values(self) -> dict[str, object]:
        """Values for diagnostics."""
        controller, estimator = self.controller, self.controller.estimator
        force, moment = estimator.disturbance
        return {
            "state": self.life,
            "mode": self.told_mode.value,
            "constraints": self.parameters.read(ControllerChoice).constraints,
            "answers": self.answers,
            "saturated answers": self.saturations,
            "odometry period [s]": estimator.period,
            "clock offset [s]": controller.clock_offset,
            "reference waits [s]": controller.active.waited,
            "way on the tether [m]": controller.stops.way,
            "delay learnt [s]": estimator.latency.delay,
            "disturbance of the drive [N]": force,
            "disturbance of the turn [N m]": moment,
            "suction pressure [Pa]": controller.law.climber.suction_pressure,
        }


def main() -> None:
    """Run the node."""
    run(lambda: [UkTorqueController()], __doc__)
