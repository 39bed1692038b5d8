"""The topics that a simulated climber publishes: a robot's, and the true state."""

import math

import numpy as np
from sensor_msgs.msg import FluidPressure, JointState

from climber_uk.mechanics.quantities import State
from climber_uk.messages import writing, writing_sensors
from climber_uk.messages.topics import IMU, JOINTS, ODOMETRY, POSE, PRESSURE, TRUTH
from climber_uk.ros.output import Output
from climber_uk.ros.running import PUBLISH_PERIOD, ClimberNode, Throttle
from climber_uk.simulation.field_sensors import FieldSensors, Measured
from climber_uk.simulation.options import SimulationOptions
from climber_uk.simulation.simulated_robot import SimulatedRobot

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # it comes with a ROS installation, not with the wheels
    TFMessage = None

NO_STATE = State(np.zeros(3), np.zeros(3))


class PlantTopics:
    """Publishers of a simulated climber, in its node's namespace."""

    def __init__(
        self, node: ClimberNode, sensors: FieldSensors, options: SimulationOptions
    ) -> None:
        self.names, self.is_due = node.names, Throttle(PUBLISH_PERIOD)
        names = self.names
        self.wheels = names.wheels
        zeros = self.wheels.rates(0.0, 0.0)
        state = JointState(name=self.wheels.all, position=zeros, velocity=zeros, effort=zeros)
        odometry = writing.odometry(NO_STATE, 0, names.odom_frame, names.base_frame)
        self.odometry: Output | None = None
        self.has_twist = options.publish_twist
        if options.publish_odometry:
            self.odometry = node.output(ODOMETRY, odometry, writing.ODOMETRY)
        self.truth = node.output(TRUTH, odometry, writing.ODOMETRY)
        self.joints = node.output(JOINTS, state, writing.JOINT_STATE)
        self.imu = self.pose = None
        if sensors.imu.errors.enabled:
            variances = sensors.imu.yaw_rate_variance, sensors.imu.force_variance
            sample = writing_sensors.imu(names.base_frame, *variances)
            self.imu = node.output(IMU, sample, writing_sensors.IMU)
        if (fixes := sensors.fixes.errors).period > 0:
            variances = fixes.position_noise**2, fixes.heading_noise**2
            pose = writing_sensors.pose(names.odom_frame, *variances)
            self.pose = node.output(POSE, pose, writing_sensors.POSE)
        self.pressure = node.output(PRESSURE, FluidPressure(), ["fluid_pressure"])
        has_tf = TFMessage and options.publish_tf
        self.transform = node.publisher(TFMessage, "/tf") if has_tf else None

    def publish_odometry(self, robot: SimulatedRobot, measured_at: int) -> None:
        """Publish the odometry that is due, with the stamp `measured_at` [ns]."""
        _, measured = robot.odometer.latest()
        if self.odometry is not None:
            *pose, speed, slip, yaw_rate = writing.odometry_numbers(measured)
            twist = (speed, slip, yaw_rate) if self.has_twist else (0.0, 0.0, 0.0)
            self.odometry.publish(measured_at, *pose, *twist)

    def publish_sensors(self, robot: SimulatedRobot, measured: Measured) -> None:
        """Publish what encoders, IMU and fixes have measured."""
        if measured.imu is not None and self.imu is not None:
            force, yaw_rate = measured.imu.force.tolist(), measured.imu.yaw_rate
            self.imu.publish(measured.stamp, *force, yaw_rate)
        if self.pose is not None:
            for fix in measured.fixes:
                x, y, heading = fix.pose.tolist()
                self.pose.publish(fix.stamp, x, y, math.sin(heading / 2), math.cos(heading / 2))
        if self.joints.is_heard:
            angles, rates, torques = map(
                writing.left_right, (measured.angles, robot.rates, robot.torques)
            )
            told = self.wheels.rates(*angles), self.wheels.rates(*rates)
            self.joints.publish(measured.stamp, *told, self.wheels.torques(*torques))

    def publish_others(self, robot: SimulatedRobot, now: int) -> None:
        """Publish true state and transform at `now` [ns]; now and then the pressure."""
        if self.truth.is_heard:
            self.truth.publish(now, *writing.odometry_numbers(robot.state))
        if self.transform is not None and self.transform.get_subscription_count():
            frames = self.names.odom_frame, self.names.base_frame
            transform = writing.transform(robot.state.pose.tolist(), now, *frames)
            self.transform.publish(TFMessage(transforms=[transform]))
        if self.is_due(now):
            self.pressure.publish(now, float(robot.pressure))
