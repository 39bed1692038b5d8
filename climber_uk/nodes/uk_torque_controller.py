"""Answers each odometry with the wheel torques that keep the climber on its reference."""

from dataclasses import dataclass, replace

import numpy as np
from geometry_msgs.msg import Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import FluidPressure, JointState
from std_msgs.msg import Float64MultiArray
from std_srvs.srv import SetBool
from trajectory_msgs.msg import MultiDOFJointTrajectory

from climber_uk.control.constraints import CONSTRAINTS, tracking_error
from climber_uk.control.controller import Command, Controller, Timing
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber, State
from climber_uk.mechanics.parameter import check, parameter
from climber_uk.mechanics.preview import Preview
from climber_uk.messages import reading, writing
from climber_uk.messages.reading import SECOND
from climber_uk.nodes.running import BEST_EFFORT, ClimberNode, run

NO_ODOMETRY, NO_REFERENCE, DISABLED = "no odometry", "no reference", "disabled"
NOT_BEGUN, BAD_ODOMETRY = "the reference begins later", "bad odometry"
NO_SOLUTION = "no torque can be computed"


@dataclass(frozen=True)
class Options:
    """Which constraints, and what is done when following is impossible."""

    constraints: str = parameter("guidance", "", "constraint set", choices=tuple(CONSTRAINTS))
    safe_output: str = parameter(
        "zero",
        "",
        "without odometry or reference: no torque, or weight held and motion braked",
        choices=("zero", "hold"),
    )
    braking_rate: float = parameter(5.0, "1/s", "of the safe output 'hold'", at_least=0)
    odometry_timeout: float = parameter(0.1, "s", "age at which odometry is stale", above=0)
    reference_timeout: float = parameter(0.1, "s", "how long a reference is waited for", above=0)
    effort_commands: bool = parameter(False, "", "publish effort_controller/commands as well")
    effort_order: str = parameter(
        "left_right", "", "order of the torques in them", choices=("left_right", "right_left")
    )

    def __post_init__(self) -> None:
        check(self)


class UkTorqueController(ClimberNode):
    """Odometry in, torque out; a safe torque whenever either side of the answer is missing.

    An odometry without a reference waits for one until `reference_timeout` on the node's clock.
    In simulated time that clock stands still meanwhile: a simulation waits, a robot does not.
    """

    def __init__(self) -> None:
        super().__init__("uk_torque_controller")
        for kind in (Options, Climber, Timing):
            self.parameters.declare(kind)
        for name, constraints in CONSTRAINTS.items():
            self.parameters.declare(constraints, f"{name}.")
        self.parameters.refuse_unknown()
        self.options = self.parameters.read(Options)
        self.pressure: float | None = None  # [Pa] as last measured
        self.on_parameters()

        self.enabled = True
        self.fault = ""
        self.stamp = 0  # [ns] of the last odometry
        self.state: State | None = None
        self.waiting_since: int | None = None  # [ns] stamp of the first odometry not answered
        self.preview: Preview | None = None
        self.answer: JointState | None = None  # the last one
        self.held: Array = np.zeros(2)  # [N m] right, left: what it said
        self.started: int | None = None  # [ns] when the watchdog first looked
        self.answers = self.saturations = 0

        self.torques = self.publisher(JointState, "wheel_torques")
        self.efforts = self.publisher(Float64MultiArray, "effort_controller/commands")
        self.error = self.publisher(Vector3Stamped, "~/tracking_error")
        self.force = self.publisher(WrenchStamped, "~/constraint_force")
        self.subscription(Odometry, "odom", self.on_odometry, BEST_EFFORT)
        self.subscription(MultiDOFJointTrajectory, "reference", self.on_reference)
        self.subscription(FluidPressure, "suction_pressure", self.on_pressure, BEST_EFFORT)
        self.create_service(SetBool, "~/enable", self.on_enable)
        shortest = min(self.options.odometry_timeout, self.options.reference_timeout)
        self.create_timer(shortest / 2, self.watch)
        self.start_diagnostics(self.values)

    def on_parameters(self) -> None:
        """Make the controller of the parameters as they are now."""
        climber, name = self.parameters.read(Climber), self.options.constraints
        if self.pressure is not None:
            climber = replace(climber, suction_pressure=self.pressure)
        self.controller = Controller(
            climber=climber,
            constraints=self.parameters.read(CONSTRAINTS[name], f"{name}."),
            timing=self.parameters.read(Timing),
        )

    def on_odometry(self, message: Odometry) -> None:
        """Answer an odometry, or keep it until there is a reference to answer it with."""
        stamp = reading.nanoseconds(message.header.stamp)
        asked_again = stamp == self.stamp and self.waiting_since is None and not self.fault
        if asked_again and self.answer is not None:  # it was not received: the same once more
            self.torques.publish(self.answer)
            return
        now, timeout = self.get_clock().now().nanoseconds, self.options.odometry_timeout * SECOND
        try:
            if now > 0 and abs(now - stamp) > timeout:
                raise ValueError("stamp is too far from the clock")
            state = reading.state(message, self.names.odom_frame, self.names.base_frame)
        except ValueError as error:
            self.be_safe(BAD_ODOMETRY, str(error))
            return
        self.stamp, self.state = stamp, state
        self.try_to_answer()

    def on_reference(self, message: MultiDOFJointTrajectory) -> None:
        """Keep the reference; answer the odometry that waits for it."""
        try:
            self.preview = reading.preview(message, self.names.odom_frame)
        except ValueError as error:
            self.say("reference", "refused", str(error))
            return
        self.say("reference", "")
        if self.waiting_since is not None or self.fault == NO_REFERENCE:
            self.try_to_answer()

    def on_pressure(self, message: FluidPressure) -> None:
        """Take the measured pressure difference into the model."""
        try:
            pressure = reading.pressure(message)
        except ValueError as error:
            self.say("suction_pressure", "refused", str(error))
            return
        self.say("suction_pressure", "")
        if pressure != self.pressure:
            self.pressure = pressure
            self.on_parameters()

    def on_enable(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Follow the reference, or give the safe output."""
        self.enabled = request.data
        response.success, response.message = True, "enabled" if self.enabled else "disabled"
        return response

    def try_to_answer(self) -> None:
        """Publish the torques that answer the last odometry."""
        if not self.enabled:
            self.be_safe(DISABLED)
            return
        if self.preview is not None and self.stamp < self.preview.times[0]:
            self.waiting_since = None
            self.be_safe(NOT_BEGUN)
            return
        ahead = self.stamp + round(self.controller.timing.lookahead * SECOND)
        reference = self.preview.at(ahead) if self.preview else None
        if self.state is None or reference is None:
            self.waiting_since = self.waiting_since or self.stamp
            if self.fault == NO_REFERENCE:
                self.be_safe(NO_REFERENCE)
            return
        try:
            command = self.controller.command(self.state, reference, self.held)
            if not np.isfinite(command.torques).all():
                raise ValueError(f"torques {command.torques} are not finite")
        except ValueError as error:
            self.be_safe(NO_SOLUTION, str(error))
            return
        self.publish_torques(command.torques)
        self.waiting_since = None
        self.set_fault("")
        self.tell(command)

    def publish_torques(self, torques: Array) -> None:
        """Publish torques (right, left) with the stamp of the odometry that they answer."""
        left_joint, right_joint = self.names.left_wheel_joint, self.names.right_wheel_joint
        self.held = torques
        self.answer = writing.wheel_torques(torques, self.stamp, left_joint, right_joint)
        self.torques.publish(self.answer)
        if self.options.effort_commands:
            left, right = self.answer.effort
            ordered = [left, right] if self.options.effort_order == "left_right" else [right, left]
            self.efforts.publish(Float64MultiArray(data=ordered))

    def tell(self, command: Command) -> None:
        """Publish what the answer came from."""
        self.answers += 1
        self.saturations += int(command.saturated)
        base_frame = self.names.base_frame
        force = writing.wrench(command.constraint_force, self.stamp, base_frame)
        self.force.publish(force)
        desired = self.preview.at(self.stamp) if self.preview else None
        if self.state is not None and desired is not None:
            error = tracking_error(self.state.pose, desired)
            self.error.publish(writing.vector(error, self.stamp, base_frame))

    def watch(self) -> None:
        """Give the safe output when odometry has stopped, or its reference does not come."""
        now = self.get_clock().now().nanoseconds
        self.started = now if self.started is None else self.started
        heard = self.started if self.state is None else self.stamp
        if now - heard > self.options.odometry_timeout * SECOND:
            self.be_safe(NO_ODOMETRY)
            return
        waited = 0 if self.waiting_since is None else now - self.waiting_since
        if waited > self.options.reference_timeout * SECOND:
            self.be_safe(NO_REFERENCE)

    def be_safe(self, fault: str, detail: str = "") -> None:
        """Publish the safe output, and say why once."""
        torques: Array = np.zeros(2)
        if self.options.safe_output == "hold" and self.state is not None:
            torques = self.controller.holding(self.state, self.options.braking_rate)
        self.publish_torques(torques)
        self.set_fault(fault, detail)

    def set_fault(self, fault: str, detail: str = "") -> None:
        """Change the fault ('': none), and say so if it is another one."""
        self.fault = fault
        self.say("safe output", fault, detail)

    def values(self) -> dict[str, object]:
        """Tell diagnostics how it goes."""
        return {
            "constraints": self.options.constraints,
            "enabled": self.enabled,
            "answers": self.answers,
            "saturated answers": self.saturations,
            "suction pressure [Pa]": self.controller.climber.suction_pressure,
            "transport delay [s]": self.controller.timing.transport_delay,
        }


def main() -> None:
    """Run the node."""
    run(UkTorqueController)
