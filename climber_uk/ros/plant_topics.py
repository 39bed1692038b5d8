"""The topics that a simulated climber publishes: a robot's, and the true state."""

from nav_msgs.msg import Odometry
from sensor_msgs.msg import FluidPressure, JointState

from climber_uk.messages import writing
from climber_uk.messages.topics import JOINTS, ODOMETRY, PRESSURE, TRUTH
from climber_uk.ros.running import PUBLISH_PERIOD, ClimberNode, Throttle
from climber_uk.simulation.simulated_robot import SimulatedRobot

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # it comes with a ROS installation, not with the wheels
    TFMessage = None


class PlantTopics:
    """Publishers of a simulated climber, in its node's namespace."""

    def __init__(self, node: ClimberNode) -> None:
        self.names, self.is_due = node.names, Throttle(PUBLISH_PERIOD)
        self.odometry = node.publisher(Odometry, ODOMETRY)
        self.truth = node.publisher(Odometry, TRUTH)
        self.joints = node.publisher(JointState, JOINTS)
        self.pressure = node.publisher(FluidPressure, PRESSURE)
        self.transform = node.publisher(TFMessage, "/tf") if TFMessage else None

    def publish_odometry(self, robot: SimulatedRobot, measured_at: int) -> None:
        """Publish the odometry that is due, with the stamp `measured_at` [ns]."""
        names = self.names
        _, measured = robot.odometer.latest()
        message = writing.odometry(measured, measured_at, names.odom_frame, names.base_frame)
        self.odometry.publish(message)

    def publish_others(self, robot: SimulatedRobot, now: int) -> None:
        """Publish true state, joints and transform at `now` [ns]; now and then the pressure."""
        names, stamp = self.names, writing.time(now)
        truth = writing.odometry(robot.state, now, names.odom_frame, names.base_frame)
        self.truth.publish(truth)
        joints = writing.wheel_torques(
            robot.torques, now, names.left_wheel_joint, names.right_wheel_joint
        )
        joints.position = writing.left_right(robot.angles)
        joints.velocity = writing.left_right(robot.rates)
        self.joints.publish(joints)
        if self.transform is not None:
            self.transform.publish(TFMessage(transforms=[writing.transform(truth)]))
        if self.is_due(now):
            pressure = FluidPressure(fluid_pressure=robot.pressure)
            pressure.header.stamp = stamp
            self.pressure.publish(pressure)
