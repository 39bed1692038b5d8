"""Publishes the reference: a short preview of a trajectory, again and again.

The trajectory's times never change their meaning. A controller publishes on `reference_time` how
far it has come, and the preview begins there, however long the controller waits. Where no
controller publishes it, the clock leads. What an operator asks for, to pause, to go on, slower or
back, changes the points ahead of the climber: see `planning.course`.
"""

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry, Path
from rclpy.parameter import Parameter
from rclpy.subscription import Subscription
from sensor_msgs.msg import TimeReference
from std_msgs.msg import Float64
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import MultiDOFJointTrajectory

from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.summary import summary
from climber_uk.mechanics.trajectory_parameters import TYPES, TrajectoryParameters, build_trajectory
from climber_uk.messages import reading, writing
from climber_uk.messages.references import ReferenceWriter, Row
from climber_uk.messages.topics import (
    EVENTS,
    GIVEN_PATH,
    ODOMETRY,
    PLANNER,
    PROGRESS,
    REFERENCE,
    REFERENCE_PATH,
    REFERENCE_TIME,
    private,
)
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.planning.by_hand import HandOptions
from climber_uk.planning.course import CourseOptions
from climber_uk.planning.events import Events
from climber_uk.planning.given_path import Manner
from climber_uk.planning.journey import HAND, PATH, Journey, Said
from climber_uk.planning.progress import (
    APPROACHING,
    BY_HAND,
    FOLLOWING,
    WAITING,
    Odometer,
    Progress,
    progress,
)
from climber_uk.ros.path_goals import path_goals
from climber_uk.ros.path_intake import PathIntake
from climber_uk.ros.running import (
    BEST_EFFORT,
    LATCHED,
    RELIABLE,
    WALL_CLOCK,
    ClimberNode,
    Throttle,
    run,
)
from climber_uk.ros.stick import listen_to_stick

STANDSTILL = 0.2  # [s] of wall-clock time without a change, after which a clock stands still
ODOMETRY_AGE = 1.0  # [s] of an odometry, above which it does not start a trajectory
PROGRESS_PERIOD = SECOND // 10  # [ns]
COASTS = 0.4  # [s] at its speed, for which a climber goes on that brakes on its way to a path
CLOCK_STEP = SECOND // 5  # [ns] back, from which on a clock was reset


@parameters
class PublisherOptions:
    """When a trajectory starts, and how fast it is driven."""

    autostart: bool = parameter(True, "", "start at the first odometry; false: only at ~/start")
    start_delay: float = parameter(
        0.0, "s", "time from the first odometry's stamp to the start", at_least=0
    )
    speed: float = parameter(
        1.0,
        "",
        "share of the planned speed, also set by ~/speed; no more, so that what is planned holds",
        at_least=0.01,
        at_most=1,
        runtime=True,
    )
    goal_patience: float = parameter(
        10.0,
        "s",
        "time for which a goal of follow_path may not begin or be followed, until it fails",
        above=0,
        plausible=(0.5, 600),
    )


class TrajectoryPublisher(ClimberNode):
    """Starts a trajectory at an odometry's stamp, and publishes it as far as it is followed."""

    def __init__(self) -> None:
        super().__init__(PLANNER)
        kinds = (PublisherOptions, ""), (CourseOptions, ""), (HandOptions, "by_hand.")
        for kind, prefix in [*TYPES, *kinds]:
            self.parameters.declare(kind, prefix)
        self.parameters.refuse_unknown("the paper's scenario, up to 10 m/s")
        self.options = self.parameters.read(CourseOptions)
        self.shape = self.parameters.read(TrajectoryParameters).shape
        hand = self.parameters.read(HandOptions, "by_hand.")
        planned, make = build_trajectory(self.parameters.read), writing.reference_numbers
        self.journey: Journey[Row] = Journey(planned, self.options, hand, make)
        self.journey.speed = self.parameters.read(PublisherOptions).speed
        self.has_told_done = False
        self.followed: int | None = None  # [ns] how far a controller has come
        self.mode = ""  # what it does; empty: none tells
        self.last_look = self.stood_at = 0  # [ns] of the clock
        self.odometer: Odometer | None = None  # once progress is asked for
        self.tags: Events | None = None  # of the course
        self.is_progress_due = Throttle(PROGRESS_PERIOD)

        self.reference = self.publisher(MultiDOFJointTrajectory, REFERENCE)
        self.serialized = ReferenceWriter(self.names.odom_frame, self.names.base_frame)
        self.path = self.publisher(Path, REFERENCE_PATH, LATCHED)
        self.progress = self.publisher(DiagnosticArray, private(PROGRESS), RELIABLE)
        self.events = self.publisher(DiagnosticArray, private(EVENTS))
        self.subscription(TimeReference, REFERENCE_TIME, self.on_reference_time)
        self.subscription(Float64, "~/speed", self.on_speed)
        self.given = PathIntake(self, GIVEN_PATH, self.manner)
        patience = self.parameters.read(PublisherOptions).goal_patience
        self.goals = path_goals(self, self.journey, self.given, patience)
        listen_to_stick(self, hand.input, self.on_stick)
        self.create_service(Trigger, "~/start", self.on_start)
        self.create_service(Trigger, "~/stop", self.on_stop)
        self.create_service(SetBool, "~/pause", self.on_pause)
        self.create_service(Trigger, "~/retreat", self.on_retreat)
        self.create_timer(self.options.publish_period, self.publish)
        self.create_timer(STANDSTILL, self.publish_at_standstill, clock=WALL_CLOCK)
        self.odometry: Subscription | None = None  # only while a start is waited for
        self.publish_path(self.get_clock().now().nanoseconds)
        if self.parameters.read(PublisherOptions).autostart:
            self.begin(PATH)

    def summary(self) -> str:
        """Extremes of the trajectory, for the log."""
        described = summary(self.journey.planned)
        self.parameters.remarks += described.remarks
        return f"{self.shape}, {described}"

    def manner(self) -> Manner:
        """How a path is driven that comes from outside: as waypoints would be."""
        return Manner.by(self.parameters.read, self.journey.planned.reverse_gear)

    # What an operator asks for

    def on_start(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Service ~/start: start from the beginning, at the next odometry."""
        self.journey.is_paused = False
        response.success, response.message = True, self.begin(PATH)
        return response

    def on_stop(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Service ~/stop: come to rest, as ~/pause does."""
        response.success, response.message = self.said(self.pause())
        return response

    def on_pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        """Service ~/pause: come to rest (true), or go on along the path (false)."""
        said = self.pause() if request.data else self.journey.go_on(self.position, self.is_driven)
        response.success, response.message = self.said(said)
        self.wait_for_odometry()
        return response

    def pause(self) -> Said:
        """Come to rest on the path if it is driven, else where the climber is."""
        return self.journey.pause(self.position, self.is_driven)

    def on_retreat(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Service ~/retreat: go back along the path as it was driven, the heading kept."""
        response.success, response.message = self.said(
            self.journey.retreat(self.position, self.is_driven)
        )
        return response

    def on_speed(self, message: Float64) -> None:
        """Topic ~/speed: as the parameter `speed`."""
        result = self.set_parameters([Parameter("speed", value=float(message.data))])[0]
        refused = "" if result.successful else f"refused: {result.reason}"
        self.report("speed", refused, is_fault=False)

    def on_parameters(self) -> None:
        """Take up another speed."""
        speed = self.parameters.read(PublisherOptions).speed
        self.journey.set_speed(speed, self.position, self.is_driven)

    def on_stick(self, speed: float, yaw_rate: float) -> None:
        """Drive by hand: at once if it is already, else once the climber rests."""
        try:
            now = self.get_clock().now().nanoseconds
            if self.journey.takes_over(speed, yaw_rate, now):
                self.said((True, f"by hand: {self.begin(HAND)}"))
        except ValueError as error:
            self.report("stick", "refused", str(error))
            return
        self.report("stick", "")

    def said(self, said: Said) -> Said:
        """Log what is done for an operator."""
        if said[0]:
            self.get_logger().info(said[1])
        return said

    # Beginning

    def begin(self, what: str) -> str:
        """Begin something at the next odometry, once the climber rests; say so."""
        _, said = self.journey.begin(what, self.position, self.is_driven)
        self.wait_for_odometry()
        return said

    @property
    def is_driven(self) -> bool:
        """Whether the course is followed, as far as is known."""
        return self.mode == FOLLOWING or not (self.mode or self.count_publishers(REFERENCE_TIME))

    def wait_for_odometry(self) -> None:
        """Subscribe the odometry, if something starts at the next one."""
        if self.odometry is None and self.journey.is_due:
            self.odometry = self.subscription(Odometry, ODOMETRY, self.on_odometry, BEST_EFFORT)

    def on_odometry(self, message: Odometry) -> None:
        """Start what is next at the stamp of `message`, a path `start_delay` after it."""
        if self.odometry is None or not self.journey.is_due:
            return
        now, stamp = self.get_clock().now().nanoseconds, reading.nanoseconds(message.header.stamp)
        try:
            state = reading.state(message, self.names.odom_frame, self.names.base_frame)
            if not self.reference.get_subscription_count():
                self.report("start", "waits for a subscriber of reference", is_fault=False)
                return
            if now > 0 and abs(now - stamp) > ODOMETRY_AGE * SECOND:
                raise ValueError("stamp is too far from the clock")
            delay = self.parameters.read(PublisherOptions).start_delay
            start = stamp + round(delay * SECOND) * (self.journey.next == PATH)
            reading.check_stamp(start)
        except ValueError as error:
            self.report("start", "odometry refused", str(error))
            return
        self.report("start", "")
        self.destroy_subscription(self.odometry)
        self.odometry = None
        what = self.shape if self.journey.next == PATH else self.journey.next
        goes_on = self.journey.next != PATH
        self.journey.start(start, self.resting_pose(state), self.position)
        self.begin_events(goes_on)
        self.followed, self.mode, self.has_told_done = None, "", False
        self.last_look = now or stamp  # the odometry may have come before the first clock
        self.publish_around(start)
        self.get_logger().info(f"{what} starts at {start / SECOND:.3f} s")
        self.publish_path(start)

    def resting_pose(self, state: State) -> Array:
        """Pose (3,) at which a climber in a state is once it rests: on its way it brakes first."""
        goes_on = COASTS if self.mode == APPROACHING else 0.0
        return np.asarray(state.pose + goes_on * state.velocity)

    def on_reference_time(self, message: TimeReference) -> None:
        """Keep how far a controller has come, unless that is of another trajectory."""
        followed = reading.nanoseconds(message.time_ref)
        stamp, now = reading.nanoseconds(message.header.stamp), self.get_clock().now().nanoseconds
        is_of_now = stamp < now + ODOMETRY_AGE * SECOND
        under_way = self.journey.under_way
        if under_way and is_of_now and under_way.start <= followed <= stamp + SECOND:
            self.followed, self.mode = followed, message.source
            self.tell_events(stamp)
            if self.goals is not None:
                self.goals.hear(self.mode, now)

    @property
    def position(self) -> int:
        """Stamp [ns] that what is under way has come to: the controller's, else the clock's."""
        under_way = self.journey.under_way
        if under_way is None:
            return 0
        if self.followed is not None:
            return self.followed
        if self.count_publishers(REFERENCE_TIME):
            return under_way.start
        return max(under_way.start, self.get_clock().now().nanoseconds)

    def publish_path(self, stamp: int) -> None:
        """Publish the whole path, for display."""
        path = self.journey.planned.path(points=400)
        self.path.publish(writing.path(path, stamp, self.names.odom_frame))

    def publish(self) -> None:
        """Publish the preview from where the trajectory has come to."""
        now = self.get_clock().now().nanoseconds
        if 0 < now < self.last_look - CLOCK_STEP and self.journey.under_way is not None:
            self.get_logger().warning("the clock went back: starts again at the next odometry")
            self.journey.forget()
        self.last_look = now
        given = self.given.ready()
        if given is not None:
            self.journey.planned, described = given
            self.shape, begins = "path", self.begin(PATH)
            self.get_logger().info(f"path taken: {described}; {begins}")
            for remark in described.remarks:
                self.get_logger().warning(remark)
        under_way = self.journey.under_way
        if under_way is not None:
            position = self.position
            self.publish_around(position)
            self.tell_done(position)
            if not self.mode and self.is_driven:
                self.tell_events(now)
            if self.journey.waits_for_rest and self.journey.next is not None:
                self.begin(self.journey.next)
        if self.goals is not None:
            self.goals.look(now, self.position, self.is_driven)
        self.wait_for_odometry()
        if self.is_progress_due(now) and self.progress.get_subscription_count():
            self.publish_progress(now)

    def tell_done(self, position: int) -> None:
        """Log once that the course has come to its end."""
        course = self.journey.course
        if self.journey.hand is not None or course is None:
            return
        is_done = course.is_done(position)
        if is_done and not self.has_told_done:
            where = "end" if course.direction > 0 else "beginning"
            self.get_logger().info(f"done: at the {where} after {course.time(position):.1f} s")
        self.has_told_done = is_done

    def begin_events(self, goes_on: bool) -> None:
        """Expect all tags of a course that begins, or of one that goes on those ahead."""
        course = self.journey.course
        if course is None or self.journey.hand is not None:
            return
        if self.tags is None or not goes_on:
            self.tags = Events(course.trajectory)
        self.tags.skip(course.begin)

    def tell_events(self, stamp: int) -> None:
        """Publish the tags that the climber has reached by a stamp [ns]."""
        course = self.journey.course
        if course is None or self.tags is None or not self.is_driven or self.journey.hand:
            return
        own_time, rate = course.own_time(self.position)
        for tag, at, (x, y) in self.tags.reached(own_time, rate, stamp):
            name = self.get_fully_qualified_name()
            values = {"state": tag, "x": x, "y": y}
            self.events.publish(writing.progress(name, values, at))

    def publish_progress(self, now: int) -> None:
        """Publish how far the course is."""
        course = self.journey.course
        by_hand = self.journey.hand is not None and not self.journey.is_held
        how_far = Progress(BY_HAND if by_hand else WAITING)
        if course is not None and not by_hand:
            if self.odometer is None or self.odometer.trajectory is not course.trajectory:
                self.odometer = Odometer(course.trajectory)
            how_far = progress(course, self.odometer, self.position, self.mode)
        name = self.get_fully_qualified_name()
        self.progress.publish(writing.progress(name, vars(how_far), now))

    def publish_at_standstill(self) -> None:
        """Publish again while time stands still: lock-step may wait for a preview that was lost."""
        now = self.get_clock().now().nanoseconds
        if now == self.stood_at:
            self.publish()
        self.stood_at = now

    def publish_around(self, position: int) -> None:
        """Publish the preview at `position` [ns], from a little before it to its end."""
        under_way = self.journey.under_way
        assert under_way is not None
        points = under_way.preview(position, self.get_clock().now().nanoseconds)
        self.reference.publish(self.serialized(points, under_way.start))


def main() -> None:
    """Run the node."""
    run(lambda: [TrajectoryPublisher()], __doc__)
