"""What becomes of a path that somebody waits for, by what is under way."""

from enum import Enum

from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.planning.course import Row
from climber_uk.planning.journey import Journey


class Fate(Enum):
    """Whether a path is driven, or why not."""

    BEGINS = "it begins when the climber rests"
    DRIVEN = "it is driven"
    DONE = "it is driven to its end"
    REPLACED = "another path took over"
    BY_HAND = "a stick took over"
    BACK = "the climber goes back along it"

    @property
    def is_left(self) -> bool:
        """Whether something else is done in its place."""
        return self in (Fate.REPLACED, Fate.BY_HAND, Fate.BACK)


def fate(journey: Journey[Row], trajectory: Trajectory, position: int) -> Fate:
    """Fate of a trajectory, of a journey that has come to `position` [ns]."""
    course = journey.course
    if journey.planned is not trajectory:
        return Fate.REPLACED
    if journey.next is not None:
        return Fate.BEGINS
    if journey.hand is not None and not journey.is_held:
        return Fate.BY_HAND
    if course is None or course.trajectory is not trajectory:
        return Fate.REPLACED
    if course.direction < 0:
        return Fate.BACK
    return Fate.DONE if course.is_done(position) else Fate.DRIVEN
