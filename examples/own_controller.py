"""A controller of your own in `uk_torque_controller`'s place: Kanayama's law, and a PI below it.

It knows the topics, and nothing of climber_uk. docs/wall_bench.md tells how to run it, and how well
it does beside ours.
"""

import math
from contextlib import suppress

import rclpy
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Quaternion
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

MASS, INERTIA, RADIUS, HALF_TRACK, WEIGHT, FRICTION = 5.0, 0.33, 0.027, 0.3, 49.05, 57.6
ALONG, ACROSS, HEADING = 2.0, 15.0, 6.0  # gains of Kanayama's law [1/s, 1/m², 1/m]
SPEED, YAW_RATE, INTEGRAL = 20.0, 20.0, 60.0  # gains of the PI [1/s, 1/s, 1/s²]
MOST, MOST_SUM = 4.0, 12.0  # [N m] of a wheel; [m/s², rad/s²] of an integral
LOST = 0.3  # [m] from the reference


class OwnController(Node):
    """Answers each odometry with torques."""

    def __init__(self) -> None:
        super().__init__("own_controller")
        self.points: list[MultiDOFJointTrajectoryPoint] = []
        self.start = self.last = 0.0  # [s]
        self.waiting: Odometry | None = None  # for a reference
        self.sums = [0.0, 0.0]
        self.torques = self.create_publisher(JointState, "wheel_torques", 10)
        self.create_subscription(MultiDOFJointTrajectory, "reference", self.on_reference, 10)
        self.create_subscription(Odometry, "odom", self.on_odometry, qos_profile_sensor_data)

    def on_reference(self, message: MultiDOFJointTrajectory) -> None:
        """Keep the next second of the reference; answer an odometry that waits for it."""
        self.points, self.start = message.points, seconds(message.header.stamp)
        if self.waiting is not None:
            self.on_odometry(self.waiting)

    def on_odometry(self, odometry: Odometry) -> None:
        """Answer with torques, in the wall's frame: x horizontal, y up.

        What no reference reaches to is not answered yet: in lock-step, time waits for both.
        """
        now = seconds(odometry.header.stamp)
        ends = self.start + seconds(self.points[-1].time_from_start) if self.points else -math.inf
        self.waiting = odometry if now > ends else None
        if self.waiting is not None:
            return
        step, self.last = now - (self.last or now), now
        force, moment = self.law(odometry, now, step)
        halves = force / 2 - moment / HALF_TRACK / 2, force / 2 + moment / HALF_TRACK / 2
        answer = JointState(name=["left_wheel_joint", "right_wheel_joint"])
        answer.header.stamp = odometry.header.stamp
        answer.effort = [max(-MOST, min(MOST, RADIUS * half)) for half in halves]
        self.torques.publish(answer)

    def law(self, odometry: Odometry, now: float, step: float) -> tuple[float, float]:
        """Force [N] and moment [N m]; without a reference that is near, those that brake."""
        place, heading = odometry.pose.pose.position, yaw(odometry.pose.pose.orientation)
        v, w = odometry.twist.twist.linear.x, odometry.twist.twist.angular.z
        v_d = w_d = e_x = e_y = off = 0.0
        if self.points:
            point = min(
                self.points, key=lambda p: abs(self.start + seconds(p.time_from_start) - now)
            )
            there, turn = point.transforms[0].translation, yaw(point.transforms[0].rotation)
            dx, dy = there.x - place.x, there.y - place.y
            if math.hypot(dx, dy) < LOST:  # it may fail, but not run away
                v_d = math.hypot(point.velocities[0].linear.x, point.velocities[0].linear.y)
                w_d = point.velocities[0].angular.z
                e_x = dx * math.cos(heading) + dy * math.sin(heading)
                e_y = dy * math.cos(heading) - dx * math.sin(heading)
                off = math.remainder(turn - heading, math.tau)
        errors = (
            v_d * math.cos(off) + ALONG * e_x - v,
            w_d + v_d * (ACROSS * e_y + HEADING * math.sin(off)) - w,
        )
        sums = (s + INTEGRAL * e * step for s, e in zip(self.sums, errors, strict=True))
        self.sums = [max(-MOST_SUM, min(MOST_SUM, s)) for s in sums]
        force = MASS * (SPEED * errors[0] + self.sums[0]) + WEIGHT * math.sin(heading)
        force += FRICTION * math.tanh(v_d / 0.01)
        return force, INERTIA * (YAW_RATE * errors[1] + self.sums[1])


def seconds(time: Time | Duration) -> float:
    """Time [s] of a stamp or a duration."""
    return time.sec + 1e-9 * time.nanosec


def yaw(q: Quaternion) -> float:
    """Angle [rad] about z of a quaternion."""
    return 2 * math.atan2(q.z, q.w)


def main() -> None:
    """Answer until Ctrl-C."""
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(OwnController())


if __name__ == "__main__":
    main()
