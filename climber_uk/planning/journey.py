"""What is under way, and what comes next: a path, a stick, rest in place, or back to the path.

Whatever is next begins at an odometry, and at rest: what is under way comes to rest first. What
changes along a path that is not driven (the climber is on its way to it, or its controller does not
follow) begins anew from rest at its place: nothing moves along it that would have to brake. Paused,
a climber rests where it is; what is to begin waits until it is to go on.
"""

from collections.abc import Callable
from typing import Generic

from climber_uk.mechanics import Array
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.planning.by_hand import ByHand, HandOptions, check_speeds
from climber_uk.planning.course import Course, CourseOptions, Row

# What may be next: a path from its beginning, a stick, or rest where the climber is; the path from
# where the stick has come nearest to it, from where it was left, or from there back
PATH, HAND, HOLD = "path", "by hand", "rest in place"
BACK, ON, RETREAT = "back on the path", "on along the path", "back along the path"
Said = tuple[bool, str]  # whether something is done, and what is said of it
NOT_STARTED = False, "not started"
AT_END = False, "at the end of the path: ~/start drives it again"
AT_BEGINNING = False, "at the beginning of the path: nothing to go back along"
STARTS, RESTS_FIRST = "starts at the next odometry", "comes to rest, then starts"
WAITS = "waits until it is to go on, by ~/pause false"


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
        self.hand: ByHand[Row] | None = None  # while a stick drives, or the climber is held
        self.is_held = False  # at rest off the course, which waits, paused
        self.next: str | None = None  # what is to begin
        self.waits_for_rest = False  # of what is under way, for the next to begin
        self.is_paused, self.speed = False, 1.0
        self.is_locked = False  # whether a stick is ignored
        self.is_halted = False  # paused until something else begins
        self._stays_paused = False  # after that, too
        self._options, self._hand_options, self._make = options, hand, make
        self._left = 0.0  # [s] own time at which a stick took over from the course
        self._then = ON  # what begins as a held climber goes on

    @property
    def under_way(self) -> Course[Row] | ByHand[Row] | None:
        """What the reference is of."""
        return self.hand or self.course

    @property
    def is_due(self) -> bool:
        """Whether what is next begins at the next odometry."""
        is_held_up = self.is_paused and self.next not in (HAND, HOLD)
        return self.next is not None and not self.waits_for_rest and not is_held_up

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
        if self.waits_for_rest:
            if self.hand is not None:
                self.hand.stop()
            elif self.course is not None:
                self.course.pause(position)
            return False, RESTS_FIRST
        return self.is_due, STARTS if self.is_due else WAITS

    def start(self, start: int, pose: Array, position: int) -> None:
        """Start what is next at `start` [ns], of a climber in a `pose` (3,).

        What was under way has come to `position` [ns].
        """
        course, options = self.course, self._options
        what, self.next = self.next, None
        left = 0.0 if course is None else course.own_time(position)[0]
        self.is_held = what == HOLD
        if what == HAND and course is not None:
            self._left, pose = left, course.rested(position, pose)
        trajectory, begin = self.planned, 0.0
        if what in (BACK, ON, RETREAT, HOLD) and course is not None:
            trajectory = course.trajectory
            begin = course.nearest(pose[:2], self._left) if what == BACK else left
        hand = ByHand(pose, start, options, self._hand_options, self._make)
        self.hand = hand if what in (HAND, HOLD) else None
        if what != HAND:
            how = self.is_paused, self.speed, begin, -1 if what == RETREAT else 1
            self.course = Course(trajectory, start, options, self._make, *how)

    # What an operator asks for, while it is at `position` [ns]

    def pause(self, position: int, is_driven: bool = True) -> Said:
        """Come to rest: on the path if it is driven, else where the climber is."""
        self._stays_paused = True
        return self._pause(position, is_driven)

    def halt(self, position: int, is_driven: bool = True) -> None:
        """Come to rest, as `pause` does, until something is begun."""
        if self.is_halted:
            return
        self.is_halted, self._stays_paused = True, self.is_paused
        self.waits_for_rest, self.next = False, None
        self._pause(position, is_driven)
        self.is_paused = True

    def _pause(self, position: int, is_driven: bool) -> Said:
        if self.hand is not None and not self.is_held:
            self.hand.stop()
            return True, "brakes; a stick that is moved drives on"
        if self.course is None:
            return NOT_STARTED
        self.is_paused = True
        if self.is_held or self.next == HOLD:
            return True, "rests where it is"
        if not is_driven:
            self._then = ON if self.next in (None, HAND) else self.next
            self.next, self.waits_for_rest = HOLD, False
            return True, "comes to rest where it is"
        self.course.pause(position)
        return True, f"comes to rest within {self.course.ramp_time:.3g} s"

    def go_on(self, position: int, is_driven: bool = True) -> Said:
        """Go on along the path, or with what is to begin."""
        self.is_halted = False
        if self.course is None and self.next is None:
            return NOT_STARTED
        was_paused, self.is_paused = self.is_paused, False
        if self.next not in (None, HAND, HOLD):
            return True, RESTS_FIRST if self.waits_for_rest else STARTS
        is_held = self.is_held or self.next == HOLD
        self.waits_for_rest, self.next = False, None
        if is_held or self.hand is not None:
            said = self.begin(self._then if is_held else BACK, position, is_driven)[1]
            return True, f"back to the path: {said}"
        assert self.course is not None
        if self.course.direction > 0 and self.course.is_done(position):
            return AT_END
        if is_driven:
            self.course.go_on(position)
        elif was_paused or self.course.direction < 0:
            self.begin(ON, position, is_driven)
        return True, "goes on"

    def retreat(self, position: int, is_driven: bool = True) -> Said:
        """Go back along the path."""
        if self.hand is not None and not self.is_held:
            return False, "driven by hand: first back to the path, by ~/pause false"
        if self.course is None:
            return NOT_STARTED
        if self.course.own_time(position)[0] <= self._options.reaction:
            return AT_BEGINNING
        self.is_paused = self.waits_for_rest = False
        self.next = None
        if is_driven and not self.is_held:
            self.course.go_on(position, -1)
        else:
            self.begin(RETREAT, position, is_driven)
        return True, "goes back along the path"

    def set_speed(self, speed: float, position: int, is_driven: bool = True) -> None:
        """Drive the path at a share of its planned speed."""
        changes, self.speed = speed != self.speed, speed
        if not changes or self.course is None or self.hand is not None:
            return
        if is_driven or self.is_paused or self.next is not None:
            self.course.set_speed(speed, position)
        else:
            self.begin(ON if self.course.direction > 0 else RETREAT, position, is_driven)

    def lock(self, is_locked: bool) -> None:
        """Ignore a stick, which drives no more, or heed it again."""
        self.is_locked = is_locked
        if is_locked and self.hand is not None:
            self.hand.stop()

    def takes_over(self, speed: float, yaw_rate: float, now: int) -> bool:
        """Whether a stick's speeds [m/s], [rad/s] are to take over; if they have, drive by them.

        Raises as `check_speeds` does.
        """
        check_speeds(speed, yaw_rate)
        if self.is_locked:
            return False
        if self.hand is not None and not self.waits_for_rest:
            self.hand.command(speed, yaw_rate, now)
            self.is_held = self.is_held and not (speed or yaw_rate)
            return False
        return bool(speed or yaw_rate) and self.next != HAND
