"""What is under way, and what comes next: a path, a stick, or back from the stick to the path.

Whatever is next begins at an odometry, and at rest: what is under way comes to rest first.
"""

from collections.abc import Callable
from typing import Generic

from climber_uk.mechanics import Array
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.planning.by_hand import ByHand, HandOptions, check_speeds
from climber_uk.planning.course import Course, CourseOptions, Row

PATH, HAND, BACK = "path", "by hand", "back on the path"  # what may be next
Said = tuple[bool, str]  # whether something is done, and what is said of it
NOT_STARTED = False, "not started"
STARTS = "starts at the next odometry"


class Journey(Generic[Row]):
    """Has a course, or a hand in its place, under way; `make` is as `Course` has it."""

    def __init__(
        self,
        planned: Trajectory,
        options: CourseOptions,
        hand: HandOptions,
        make: Callable[[Reference, float], Row],
    ) -> None:
        self.planned = planned  # of the course that begins next
        self.course: Course[Row] | None = None
        self.hand: ByHand[Row] | None = None  # while a stick drives
        self.next = PATH
        self.waits_for_rest = False  # of what is under way, for the next to begin
        self.is_paused, self.speed = False, 1.0
        self.is_halted = False  # paused until something else begins; nothing starts until then
        self._stays_paused = False  # after that, too
        self._options, self._hand_options, self._make = options, hand, make
        self._left = 0.0  # [s] own time at which a stick took over from the course

    @property
    def under_way(self) -> Course[Row] | ByHand[Row] | None:
        """What the reference is of."""
        return self.hand or self.course

    def forget(self) -> None:
        """Have nothing under way: the clock went back."""
        self.course, self.hand, self.waits_for_rest, self.next = None, None, False, PATH

    def begin(self, what: str, position: int, is_driven: bool) -> Said:
        """Begin something, at rest: whether that is now, at the next odometry.

        What is under way is at `position` [ns]; if it is not driven, nothing moves along it.
        """
        self.next, under_way = what, self.under_way
        if self.is_halted:
            self.is_halted, self.is_paused = False, self.is_paused and self._stays_paused
        self.waits_for_rest = bool(under_way and is_driven and not under_way.rests(position))
        if not self.waits_for_rest:
            return True, STARTS
        if self.hand is not None:
            self.hand.stop()
        elif self.course is not None:
            self.course.pause(position)
        return False, "comes to rest, then starts"

    def start(self, start: int, pose: Array, position: int) -> None:
        """Start what is next at `start` [ns], of a climber in a `pose` (3,).

        What was under way has come to `position` [ns].
        """
        course, options = self.course, self._options
        what, self.next = self.next, PATH
        if what == HAND:
            if course is not None:
                self._left, _ = course.own_time(position)
                pose = course.rested(position, pose)
            self.hand = ByHand(pose, start, options, self._hand_options, self._make)
            return
        trajectory, begin = self.planned, 0.0
        if what == BACK and course is not None:
            trajectory, begin = course.trajectory, course.nearest(pose[:2], self._left)
        self.hand = None
        self.course = Course(
            trajectory, start, options, self._make, self.is_paused, self.speed, begin
        )

    # What an operator asks for, while it is at `position` [ns]

    def pause(self, position: int) -> Said:
        """Come to rest, on the path if it is driven."""
        self._stays_paused = True
        return self._pause(position)

    def halt(self, position: int) -> None:
        """Come to rest, as `pause` does, until something is begun."""
        if self.is_halted:
            return
        self.is_halted, self._stays_paused, self.waits_for_rest = True, self.is_paused, False
        self._pause(position)
        self.is_paused = True

    def _pause(self, position: int) -> Said:
        if self.hand is not None:
            self.hand.stop()
            return True, "brakes; a stick that is moved drives on"
        if self.course is None:
            return NOT_STARTED
        self.is_paused = True
        self.course.pause(position)
        return True, f"comes to rest within {self.course.ramp_time:.3g} s"

    def go_on(self, position: int) -> Said:
        """Go on along the path, or with what is to begin."""
        self.is_halted = False
        if self.course is None:
            return NOT_STARTED
        self.is_paused = False
        if self.waits_for_rest and self.next == PATH:
            return True, "comes to rest, then starts"
        self.waits_for_rest = False
        self.course.go_on(position)
        return True, "goes on"

    def retreat(self, position: int) -> Said:
        """Go back along the path."""
        if self.hand is not None:
            return False, "driven by hand: first back to the path, by ~/pause false"
        if self.course is None:
            return NOT_STARTED
        self.is_paused = self.waits_for_rest = False
        self.course.go_on(position, -1)
        return True, "goes back along the path"

    def set_speed(self, speed: float, position: int) -> None:
        """Drive the path at a share of its planned speed."""
        self.speed = speed
        if self.course is not None and self.hand is None:
            self.course.set_speed(speed, position)

    def takes_over(self, speed: float, yaw_rate: float, now: int) -> bool:
        """Whether a stick's speeds [m/s], [rad/s] are to take over; if they have, drive by them.

        Raises as `check_speeds` does.
        """
        check_speeds(speed, yaw_rate)
        if self.hand is not None and not self.waits_for_rest:
            self.hand.command(speed, yaw_rate, now)
            return False
        return bool(speed or yaw_rate) and self.next != HAND
