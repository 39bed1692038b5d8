"""The least pressure that a climber's margins need, on suction_setpoint, for its pump."""

from sensor_msgs.msg import FluidPressure

from climber_uk.control.controller import Answer, Controller
from climber_uk.control.least_suction import LeastSuction, SuctionOptions
from climber_uk.control.safety import Mode
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.adhesion import Attachment
from climber_uk.mechanics.climber import Climber
from climber_uk.messages.topics import SETPOINT
from climber_uk.ros.running import PUBLISH_PERIOD, ClimberNode, Throttle

PRESSURE_AGE = SECOND // 2  # [ns] of a measured pressure, above which that of now is not known


class SuctionSetpoint:
    """Publishes 20 times a second, and at once where the controller's mode changes.

    A controller that hears no odometry publishes none: the pump has to go back to its full pressure
    by itself. Raises as `LeastSuction` does.
    """

    def __init__(
        self, node: ClimberNode, options: SuctionOptions, climber: Climber, attachment: Attachment
    ) -> None:
        self.node, self.options = node, options
        self.least = LeastSuction(options, climber, attachment)
        self.topic = node.output(SETPOINT, FluidPressure(), ["fluid_pressure"])
        self.is_due = Throttle(PUBLISH_PERIOD)
        self.mode = Mode.WAITING
        self.measured: float | None = None  # [Pa] pressure
        self.measured_at = 0  # [ns]

    def take(self, climber: Climber, attachment: Attachment) -> None:
        """Go over to other parameters, from the full pressure on, if they are others."""
        if (climber, attachment) != (self.least.climber, self.least.attachment):
            self.least = LeastSuction(self.options, climber, attachment)

    def measure(self, pressure: float, now: int) -> None:
        """Take a measured pressure [Pa] at `now` [ns]."""
        self.measured, self.measured_at = pressure, now

    def publish(self, controller: Controller, answer: Answer | None, now: int) -> None:
        """Publish the setpoint after an answer, at `now` [ns]."""
        is_due, before = self.is_due(controller.stamp), self.mode
        self.mode = controller.mode
        if not is_due and self.mode is before:
            return
        is_known = abs(now - self.measured_at) <= PRESSURE_AGE
        measured = self.measured if is_known else None
        pressure, trouble = self.least.setpoint(controller, answer, measured)
        self.topic.publish(controller.stamp, pressure)
        self.node.report("suction", trouble and f"{trouble}: full pressure", is_fault=False)
