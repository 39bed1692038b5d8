"""Publishes the reference: a short preview of a trajectory, again and again.

The trajectory's times never change their meaning. A controller publishes on `reference_time` how
far it has come, and the preview begins there, however long the controller waits. Where no
controller publishes it, the clock leads.
"""

from collections import deque
from dataclasses import replace

from nav_msgs.msg import Odometry, Path
from rclpy.subscription import Subscription
from sensor_msgs.msg import TimeReference
from std_srvs.srv import Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.summary import summary
from climber_uk.mechanics.time_laws import Stopping
from climber_uk.mechanics.trajectory_parameters import TYPES, TrajectoryParameters, build_trajectory
from climber_uk.messages import reading, writing
from climber_uk.messages.references import ReferenceWriter, Row
from climber_uk.messages.topics import ODOMETRY, PLANNER, REFERENCE, REFERENCE_PATH, REFERENCE_TIME
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.ros.running import BEST_EFFORT, LATCHED, WALL_CLOCK, ClimberNode, run

STANDSTILL = 0.2  # [s] of wall-clock time without a change, after which a clock stands still
ODOMETRY_AGE = 1.0  # [s] of an odometry, above which it does not start a trajectory
CLOCK_STEP = SECOND // 5  # [ns] back, from which on a clock was reset


@parameters
class PublisherOptions:
    """When a trajectory starts and stops, and how it is published."""

    autostart: bool = parameter(True, "", "start at the first odometry; false: only at ~/start")
    start_delay: float = parameter(0.0, "s", "from that odometry's stamp to the start", at_least=0)
    preview: float = parameter(1.0, "s", "how far ahead the reference is published", above=0)
    point_period: float = parameter(0.05, "s", "time between two points of a preview", above=0)
    publish_period: float = parameter(0.1, "s", "time between two previews", above=0)
    stop_time: float = parameter(1.0, "s", "time from the full rate to rest after ~/stop", above=0)

    def __post_init__(self) -> None:
        if self.preview < 2 * self.publish_period:
            raise ValueError(
                f"preview={self.preview} must be >= 2 publish_period={self.publish_period} [s]"
            )


class TrajectoryPublisher(ClimberNode):
    """Starts a trajectory at an odometry's stamp, and publishes it as far as it is followed."""

    def __init__(self) -> None:
        super().__init__(PLANNER)
        for kind, prefix in [*TYPES, (PublisherOptions, "")]:
            self.parameters.declare(kind, prefix)
        self.parameters.refuse_unknown("the paper's scenario, up to 10 m/s")
        self.options = self.parameters.read(PublisherOptions)
        self.planned = build_trajectory(self.parameters.read)
        self.trajectory = self.planned
        self.start: int | None = None  # [ns] stamp of the trajectory's time 0
        self.followed: int | None = None  # [ns] how far a controller has come
        self.last_look = self.stood_at = 0  # [ns] of the clock
        self.points: deque[Row] = deque()
        self.next_point = 0  # every point is computed once: previews agree to the last bit

        self.reference = self.publisher(MultiDOFJointTrajectory, REFERENCE)
        self.serialized = ReferenceWriter(self.names.odom_frame, self.names.base_frame)
        self.path = self.publisher(Path, REFERENCE_PATH, LATCHED)
        self.subscription(TimeReference, REFERENCE_TIME, self.on_reference_time)
        self.create_service(Trigger, "~/start", self.on_start)
        self.create_service(Trigger, "~/stop", self.on_stop)
        self.create_timer(self.options.publish_period, self.publish)
        self.create_timer(STANDSTILL, self.publish_at_standstill, clock=WALL_CLOCK)
        self.odometry: Subscription | None = None  # only while a start is waited for
        self.publish_path(self.get_clock().now().nanoseconds)
        if self.options.autostart:
            self.wait_for_odometry()

    def summary(self) -> str:
        """Extremes of the trajectory, for the log."""
        described = summary(self.planned)
        self.parameters.remarks += described.remarks
        return f"{self.parameters.read(TrajectoryParameters).shape}, {described}"

    def on_start(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Service ~/start: start from the beginning, at the next odometry."""
        self.wait_for_odometry()
        response.success, response.message = True, "starts at the next odometry"
        return response

    def on_stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Service ~/stop: come to rest on the path, after the points that are published already."""
        if self.start is None:
            response.message = "not started"
            return response
        start = self.next_point * self.options.point_period
        law = Stopping(self.trajectory.law, start, self.options.stop_time)
        self.trajectory = replace(self.planned, law=law)
        response.success, response.message = True, f"comes to rest from {start:.2f} s on"
        self.get_logger().info(response.message)
        return response

    def wait_for_odometry(self) -> None:
        """Subscribe the odometry, to start at the next one."""
        if self.odometry is None:
            self.odometry = self.subscription(Odometry, ODOMETRY, self.on_odometry, BEST_EFFORT)

    def on_odometry(self, message: Odometry) -> None:
        """Start the trajectory `start_delay` after the stamp of `message`."""
        if self.odometry is None:
            return
        now, stamp = self.get_clock().now().nanoseconds, reading.nanoseconds(message.header.stamp)
        try:
            reading.state(message, self.names.odom_frame, self.names.base_frame)
            if not self.reference.get_subscription_count():
                self.report("start", "waits for a subscriber of reference", is_fault=False)
                return
            if now > 0 and abs(now - stamp) > ODOMETRY_AGE * SECOND:
                raise ValueError("stamp is too far from the clock")
        except ValueError as error:
            self.report("start", "odometry refused", str(error))
            return
        self.report("start", "")
        self.destroy_subscription(self.odometry)
        self.odometry = None
        self.trajectory, self.next_point = self.planned, 0
        self.points.clear()
        self.followed = None
        self.start = stamp + round(self.options.start_delay * SECOND)
        self.last_look = now or stamp  # the odometry may have come before the first clock
        self.publish_around(self.start)
        shape = self.parameters.read(TrajectoryParameters).shape
        self.get_logger().info(f"{shape} starts at {self.start / SECOND:.3f} s")
        self.publish_path(self.start)

    def on_reference_time(self, message: TimeReference) -> None:
        """Keep how far a controller has come, unless that is of another trajectory."""
        followed = reading.nanoseconds(message.time_ref)
        stamp, now = reading.nanoseconds(message.header.stamp), self.get_clock().now().nanoseconds
        is_of_now = stamp < now + ODOMETRY_AGE * SECOND
        if self.start is not None and is_of_now and self.start <= followed <= stamp + SECOND:
            self.followed = followed

    @property
    def position(self) -> int:
        """Stamp [ns] that the trajectory has come to: the controller's, else the clock's."""
        assert self.start is not None
        if self.followed is not None:
            return self.followed
        if self.count_publishers(REFERENCE_TIME):
            return self.start
        return max(self.start, self.get_clock().now().nanoseconds)

    def publish_path(self, stamp: int) -> None:
        """Publish the whole path, for display."""
        path = self.planned.path(points=400)
        self.path.publish(writing.path(path, stamp, self.names.odom_frame))

    def publish(self) -> None:
        """Publish the preview from where the trajectory has come to."""
        now = self.get_clock().now().nanoseconds
        if 0 < now < self.last_look - CLOCK_STEP and self.start is not None:
            self.get_logger().warning("the clock went back: starts again at the next odometry")
            self.start = None
            self.wait_for_odometry()
        self.last_look = now
        if self.start is not None:
            self.publish_around(self.position)

    def publish_at_standstill(self) -> None:
        """Publish again while time stands still: lock-step may wait for a preview that was lost."""
        now = self.get_clock().now().nanoseconds
        if now == self.stood_at:
            self.publish()
        self.stood_at = now

    def publish_around(self, position: int) -> None:
        """Publish the preview at `position` [ns], from a little before it to its end."""
        assert self.start is not None
        options, time = self.options, (position - self.start) / SECOND
        oldest = time - options.publish_period - 2 * options.point_period
        self.next_point = max(self.next_point, int(oldest / options.point_period))
        while self.next_point * options.point_period < time + options.preview:
            at = self.next_point * options.point_period
            self.points.append(writing.reference_numbers(self.trajectory.at(at), at))
            self.next_point += 1
        while self.points[0][-2] * SECOND + self.points[0][-1] < oldest * SECOND:
            self.points.popleft()
        self.reference.publish(self.serialized(self.points, self.start))


def main() -> None:
    """Run the node."""
    run(lambda: [TrajectoryPublisher()], __doc__)
