"""Paths as goals of an action: FollowPath of Nav2, where nav2_msgs is installed.

The newest goal is driven; the one before it is aborted once that is taken up. What a release's
definition has not, of fields and of error codes, is left out.
"""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from rclpy.task import Future

from climber_uk.mechanics import SECOND
from climber_uk.messages.reading_path import message_points
from climber_uk.messages.topics import FOLLOW_PATH, REFERENCE_TIME
from climber_uk.planning.goal import Fate, fate
from climber_uk.planning.progress import APPROACHING, FOLLOWING, Odometer
from climber_uk.ros.running import ClimberNode

if TYPE_CHECKING:
    from rclpy.action.server import ServerGoalHandle

    from climber_uk.mechanics.trajectory import Trajectory
    from climber_uk.planning.journey import Journey
    from climber_uk.ros.path_intake import PathIntake

try:
    from nav2_msgs.action import FollowPath
except ImportError:  # it comes with Nav2, not with the wheels
    FollowPath = None


@dataclass(eq=False)
class Goal:
    """A path that is asked for; its trajectory once that is planned."""

    handle: "ServerGoalHandle"
    result: Future = field(default_factory=Future)
    odometer: Odometer | None = None


class PathGoals:
    """Plans and drives the paths of goals, and tells what has become of them.

    A goal fails that begins or is followed `patience` [s] later than it should be; then, as when it
    is cancelled, the climber comes to rest.
    """

    def __init__(
        self, node: ClimberNode, journey: "Journey[Any]", intake: "PathIntake", patience: float
    ) -> None:
        from rclpy.action import ActionServer, CancelResponse  # only for those who have actions

        self._node, self._journey, self._intake = node, journey, intake
        self._patience = round(patience * SECOND)
        self._planned: Goal | None = None  # whose path is being planned
        self._driven: Goal | None = None
        self._mode = ""  # of the controller; empty: none has told
        self._heard_at = self._followed_at = 0  # [ns]
        self._goals: dict[bytes, Goal] = {}
        self._server = ActionServer(
            node,
            FollowPath,
            FOLLOW_PATH,
            self._execute,
            handle_accepted_callback=self._accept,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
        )

    # A goal comes

    def _accept(self, handle: "ServerGoalHandle") -> None:
        """Plan the path of a goal."""
        goal = Goal(handle)
        self._goals[bytes(handle.goal_id.uuid)] = goal
        handle.execute()
        try:
            places = message_points(handle.request.path, self._node.names.odom_frame)
        except ValueError as error:
            self._end(goal, "abort", "INVALID_PATH", f"refused: {error}")
            return
        self._intake.plan(places, self)  # a goal whose path is still planned is dropped
        self._planned = goal

    async def _execute(self, handle: "ServerGoalHandle") -> Any:
        """Result of a goal, once it has ended."""
        return await self._goals.pop(bytes(handle.goal_id.uuid)).result

    def refused(self, why: str) -> None:
        """Be told that the path that was to be planned is not driven."""
        goal, self._planned = self._planned, None
        if goal is not None:
            self._end(goal, "abort", "INVALID_PATH", f"refused: {why}")

    def dropped(self) -> None:
        """Be told that another path came before it was planned."""
        goal, self._planned = self._planned, None
        if goal is not None:
            self._end(goal, "abort", "UNKNOWN", Fate.REPLACED.value)

    def taken(self, trajectory: "Trajectory") -> None:
        """Be told what the path has become, which is driven next."""
        if self._driven is not None:
            self._end(self._driven, "abort", "UNKNOWN", Fate.REPLACED.value)
        self._driven, self._planned = self._planned, None
        if self._driven is not None:
            self._driven.odometer = Odometer(trajectory)
            self._heard_at = self._followed_at = self._node.get_clock().now().nanoseconds

    # While it is driven

    def hear(self, mode: str, now: int) -> None:
        """Be told what the controller does, at `now` [ns]."""
        self._mode, self._heard_at = mode, now
        if mode in (FOLLOWING, APPROACHING):
            self._followed_at = now

    def look(self, now: int, position: int, is_driven: bool) -> None:
        """Tell how goals do, of a journey that has come to `position` [ns].

        `is_driven`: what is under way is followed, as far as is known.
        """
        if self._planned is not None and self._planned.handle.is_cancel_requested:
            cancelled, self._planned = self._planned, None
            self._intake.drop()
            self._end(cancelled, "canceled", "NONE", "cancelled before it was taken up")
        goal = self._driven
        if goal is None or goal.odometer is None:
            return
        what = fate(self._journey, goal.odometer.trajectory, position)
        if what is Fate.DONE:
            self._end(goal, "succeed", "NONE", what.value)
        elif goal.handle.is_cancel_requested:
            self._journey.halt(position, is_driven)
            if self._rests(position):
                where = "where it was" if self._journey.is_held else "on the path"
                self._end(goal, "canceled", "NONE", f"cancelled: at rest {where}")
        elif what.is_left:
            self._end(goal, "abort", "UNKNOWN", what.value)
        elif trouble := self._trouble(now, what):
            self._journey.halt(position, is_driven)
            self._end(goal, "abort", *trouble)
        else:
            self._tell(goal, goal.odometer, position if what is Fate.DRIVEN else None, is_driven)

    def _rests(self, position: int) -> bool:
        """Whether the climber rests, as far as is known: one that is not to move does."""
        under_way = self._journey.under_way
        if under_way is None or self._mode not in ("", FOLLOWING, APPROACHING):
            return True
        is_braking = self._mode == APPROACHING or self._journey.next is not None
        return not is_braking and under_way.rests(position)

    def _trouble(self, now: int, what: Fate) -> tuple[str, str] | None:
        """Error code, and in words why a goal fails, if it does."""
        is_alone = not self._mode and not self._node.count_publishers(REFERENCE_TIME)
        is_paused = self._journey.is_paused and not self._journey.is_halted
        if is_paused or (is_alone and (self._journey.waits_for_rest or what is Fate.DRIVEN)):
            self._heard_at = self._followed_at = now  # by the clock
        if now - self._followed_at <= self._patience:
            return None
        seconds = f"for {self._patience / SECOND:g} s"
        begins = what is Fate.BEGINS
        # whether it is known that the one before still moves does not change what is wrong
        if now - self._heard_at > self._patience and (self._mode or not begins):
            return "CONTROLLER_TIMED_OUT", f"the controller is not heard {seconds}"
        if begins:
            return "FAILED_TO_MAKE_PROGRESS", f"it does not begin, {seconds}: see the log"
        return "FAILED_TO_MAKE_PROGRESS", f"the controller does not follow {seconds}: {self._mode}"

    # What is told

    def _tell(self, goal: Goal, odometer: Odometer, position: int | None, is_driven: bool) -> None:
        """Publish the distance that is left, and the speed, as planned."""
        own_time = speed = 0.0
        course = self._journey.course
        if position is not None and course is not None:
            own_time, rate = course.own_time(position)
            speed = abs(float(course.trajectory.at(own_time).speed) * rate) * is_driven
        left = odometer.whole - odometer.at(own_time)
        goal.handle.publish_feedback(_of(FollowPath.Feedback, distance_to_goal=left, speed=speed))

    def _end(self, goal: Goal, how: str, code: str, why: str) -> None:
        """End a goal: `how` is a method of its handle, `code` the name of an error code."""
        if goal is self._driven:
            self._driven = None
        self._node.get_logger().info(f"{FOLLOW_PATH}: {why}")
        number = getattr(FollowPath.Result, code, getattr(FollowPath.Result, "UNKNOWN", 0))
        getattr(goal.handle, how)()
        goal.result.set_result(_of(FollowPath.Result, error_code=number, error_msg=why))


def path_goals(
    node: ClimberNode, journey: "Journey[Any]", intake: "PathIntake", patience: float
) -> PathGoals | None:
    """Goals of a node, where nav2_msgs is installed; else None."""
    return None if FollowPath is None else PathGoals(node, journey, intake, patience)


def _of(kind: Any, **values: Any) -> Any:
    """Message with those of some values for which it has a field."""
    fields = kind.get_fields_and_field_types()
    return kind(**{name: value for name, value in values.items() if name in fields})
