"""What is followed: the reference, as far as it is followed, or the way to where it waits."""

import math
from typing import NamedTuple

import numpy as np

from climber_uk.control.approach import Approach
from climber_uk.control.control_law import Command
from climber_uk.control.guard import STANDS, Expected, Rates
from climber_uk.control.guidance import Guidance
from climber_uk.control.safety import Mode
from climber_uk.control.sampled_controller import SampledController
from climber_uk.control.time_scaling import Progress, restarted
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, ReferencePoint

SAME = 0.05  # [m, rad] within which a new preview goes on with the old one
AROUND = SECOND // 2  # [ns] of what is followed, before and after, whose fastest motion counts
KEPT = 2 * SECOND  # [ns] of a reference that is kept behind the climber
MOST_POINTS = 5000  # of a reference that are kept: who plans it may not wait
LONGEST_SKIP = SECOND  # [ns] of a reference that a climber, which went on unanswered, may be ahead
SKIP_STEPS = 20  # in which it is looked for there
SLOW = 0.01  # [m/s] of a reference that is at rest
AS_FAST = 0.9  # of the reference's speed, from which a climber goes on in time
STRAYED = 1.5  # times `max_distance`, beyond which a climber that follows is off its path


class Followed(NamedTuple):
    """What came of following."""

    mode: Mode
    detail: str = ""
    command: Command | None = None


class ActiveReference:
    """Knows where on its reference the climber is, and takes it there if it is elsewhere."""

    def __init__(self, sampled_controller: SampledController, options: Approach) -> None:
        self.sampled_controller, self.options = sampled_controller, options
        self.approach_constraints = Guidance()  # that can begin at rest
        self.preview: Preview | None = None  # of the reference
        self.way: Preview | None = None  # to where it waits
        self._position: int | None = None  # [ns] time of the reference; None: not begun
        self._is_paused = True
        # what is followed, number of `AROUND`, and the fastest motion around it
        self._around: tuple[Preview, int, tuple[float, float]] | None = None
        self._began_at = 0.0  # [m] from the reference, when it was begun to follow it

    @property
    def followed(self) -> Preview | None:
        """The reference, or the way to it."""
        return self.way or self.preview

    @property
    def target(self) -> ReferencePoint | None:
        """Where the climber should be at the last odometry; None if nothing is followed."""
        followed = self.followed
        if followed is None or self._is_paused:
            return None
        return followed.target(self.time_followed(self.sampled_controller.stamp))

    def expected(self, target: ReferencePoint) -> Expected:
        """What is expected of a climber that should be at `target`."""
        sampled_controller, followed = self.sampled_controller, self.followed
        assert followed is not None
        number = self.time_followed(sampled_controller.stamp) // AROUND
        if self._around is None or self._around[0] is not followed or self._around[1] != number:
            fastest = followed.fastest((number - 1) * AROUND, (number + 2) * AROUND)
            self._around = followed, number, fastest
        pace = sampled_controller.progress.pace
        hurry = 1 + (sampled_controller.pacing.catch_up if pace.lag > 0 else 0.0)
        constraints = (
            self.approach_constraints if self._is_gentle else sampled_controller.law.constraints
        )
        return Expected(
            wanted=Rates(math.hypot(target.v_x, target.v_y), abs(target.yaw_rate)),
            allowed=Rates(*constraints.fastest(*(hurry * rate for rate in self._around[2]))),
            waits=pace.rate < STANDS,
        )

    @property
    def _is_gentle(self) -> bool:
        """Whether what is followed begins at rest."""
        return self.way is not None or self.sampled_controller.progress.is_restarting

    def position(self, stamp: int) -> int | None:
        """Time of the reference [ns] at `stamp` [ns]; None if none was followed or waits."""
        if self.way is None and not self._is_paused:
            return self.sampled_controller.progress.at(stamp)
        return self._position

    @property
    def waited(self) -> float:
        """How much later than planned the reference is [s]."""
        progress = self.sampled_controller.progress
        return progress.waited / SECOND + float(progress.pace.lag)

    def time_followed(self, stamp: int) -> int:
        """Time of what is followed [ns] at `stamp` [ns]."""
        return self.sampled_controller.progress.at(stamp)

    def begins_after(self, stamp: int) -> bool:
        """Whether the reference begins later."""
        return self.preview is not None and self._position is None and stamp < self.preview.times[0]

    def take(self, preview: Preview) -> None:
        """Take a newer part of the reference, or another reference."""
        if self.preview is None or not self.preview.goes_on_with(preview, SAME):
            self.preview, self.way, self._position, self._is_paused = preview, None, None, True
            return
        here = int(preview.times[0]) if self._position is None else self._position
        self.preview = self.preview.continued(preview, here - KEPT).last(MOST_POINTS)

    def pause(self, stamp: int) -> None:
        """Stand still on the reference, which is not followed at `stamp` [ns]."""
        self._is_paused, self.way = True, None
        if self._position is None and self.preview is not None and not self.begins_after(stamp):
            self._position = self._first_position(stamp)

    def follow(self, age: float) -> Followed:
        """Torques for the last odometry that the `SampledController` saw, of `age` [s]."""
        if self.preview is None:
            return Followed(Mode.WAITING)
        try:
            if self._is_paused:
                refused = self._begin(self.sampled_controller.begin(age))
                if refused is not None:
                    return refused
            return self._go_on(self.preview, age)
        except (ValueError, ArithmeticError) as error:
            return Followed(Mode.NO_SOLUTION, str(error))

    def strayed(self, motion: Motion, target: ReferencePoint) -> tuple[Mode, str] | None:
        """Whether a climber is too far from where it should be."""
        distance = math.hypot(motion.x - target.x, motion.y - target.y)
        if distance <= STRAYED * self.options.max_distance:
            return None
        return Mode.OFF_PATH, f"{distance:.2f} m from it"

    def _go_on(self, preview: Preview, age: float) -> Followed:
        sampled_controller = self.sampled_controller
        constraints = self.approach_constraints if self._is_gentle else None
        if self.way is not None:
            command = sampled_controller.answer(self.way, age, constraints)
            if command is not None:
                return Followed(Mode.APPROACHING, f"{self._began_at:.2f} m away", command)
            self.way, self._is_paused = None, True  # it has arrived
            refused = self._begin(sampled_controller.begin(age))
            if refused is not None:
                return refused
            return self._go_on(preview, age)
        command = sampled_controller.answer(preview, age, constraints)
        if command is None:
            return Followed(Mode.WAITING)
        self._position = sampled_controller.progress.position
        return Followed(Mode.FOLLOWING, "", command)

    # Beginning, and going on after a pause

    def _first_position(self, time: int) -> int:
        """Where a reference that was not followed yet is begun: now, if it is there."""
        assert self.preview is not None
        first, last = int(self.preview.times[0]), int(self.preview.times[-1])
        return time if first <= time <= last else first

    def _begin(self, time: int) -> Followed | None:
        """Follow from `time` [ns] on: the reference, or a way to it; else say why not."""
        sampled_controller, preview, options = self.sampled_controller, self.preview, self.options
        assert preview is not None
        motion = sampled_controller.expected_at(time)
        position = self._where(preview, motion, time)
        target = preview.target(position)
        if target is None:
            return Followed(Mode.WAITING)
        distance = math.hypot(motion.x - target.x, motion.y - target.y)
        if distance > options.max_start_distance:
            return Followed(
                Mode.TOO_FAR,
                f"{distance:.2f} m, from ({motion.x:.2f}, {motion.y:.2f}) to ({target.x:.2f}, "
                f"{target.y:.2f}); max_start_distance is {options.max_start_distance} m",
            )
        self._is_paused, self._began_at, self._position = False, distance, position
        turned = abs(wrapped(motion.heading - target.heading))
        if distance > options.max_distance or turned > options.max_heading:
            self.way = options.way(motion, target, time)
            sampled_controller.progress = Progress()
        else:
            sampled_controller.progress = restarted(time, position, _rate(motion, target))
        return None

    def _where(self, preview: Preview, motion: Motion, time: int) -> int:
        """Time of the reference [ns] at which to go on: the climber may have gone on unanswered."""
        if self._position is None:
            return self._first_position(time)
        first, last = int(preview.times[0]), int(preview.times[-1])
        position = max(self._position, first)
        answered = self.sampled_controller.progress.time
        skip = 0 if answered is None else min(time - answered, LONGEST_SKIP, last - position)
        if skip <= 0:
            return position
        times = position + np.linspace(0, skip, SKIP_STEPS + 1).astype(np.int64)
        targets = [preview.target(int(at)) for at in times]
        offsets = [
            math.hypot(motion.x - target.x, motion.y - target.y)
            for target in targets
            if target is not None
        ]
        nearest = int(times[int(np.argmin(offsets))])
        target = preview.target(nearest)
        if target is None or abs(speed := target.speed) < SLOW:
            return nearest
        ahead = (motion.x - target.x) * target.v_x + (motion.y - target.y) * target.v_y
        ahead = min(max(ahead / (speed * speed), -skip / SKIP_STEPS / SECOND), skip / SECOND)
        return min(max(nearest + round(ahead * SECOND), position), position + skip)


def _rate(motion: Motion, target: ReferencePoint) -> float:
    """Rate σ of a reference that is as fast as the climber is, 1 if that is nearly so."""
    speed = target.speed
    if abs(speed) < SLOW:
        return 1.0
    rate = float(min(max(motion.speed / speed, 0.0), 1.0))
    return 1.0 if rate > AS_FAST else rate
