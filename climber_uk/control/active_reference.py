"""Where the climber should be: on its reference, or on the way to where that waits.

Times are stamps [ns] on the odometry's clock; a reference's own time [ns] is behind them by as much
as it has waited.
"""

import math
from typing import NamedTuple

from climber_uk.control.approach import Approach, braked, nearest
from climber_uk.control.constraint_set import ConstraintSet
from climber_uk.control.guard import STANDS, Expected, Rates
from climber_uk.control.guidance import Guidance
from climber_uk.control.safety import Mode
from climber_uk.control.time_scaling import IN_TIME, STANDSTILL, Pace, Pacing
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, ReferencePoint

TOLERANCE = 0.05  # [m, rad] within which a new preview goes on with the old one
SAME = 1e-4  # [m, rad] the same for one that rests, and where it need not be approached
NEAR = 0.05  # [m, rad] from where it should rest, from where it is approached then
AROUND = SECOND // 2  # [ns] of what is followed, before and after, whose fastest motion counts
GOES = 0.02  # [m/s] of a reference, from which on it is clear which way it goes
KEPT_BEHIND = 2 * SECOND  # [ns] of a reference that is kept behind the climber
MOST_POINTS = 5000  # of a reference that are kept, however many come
LONGEST_SKIP = SECOND  # [ns] of a reference that a climber, which went on unanswered, may be ahead
AS_FAST = 0.9  # of the reference's speed, from which a climber goes on in time
STRAYED = 1.5  # times `max_distance`, beyond which a climber that follows is off its path
LONGEST_LAG = 5.0  # [s] that is made up for later; a longer delay shifts the rest of the reference
LONGEST_GAP = round(0.3 * SECOND)  # [ns] between two answers over which the reference goes on
IN_TIME_AGAIN = 1e-3  # 1 - σ at the end of a restart


AT_REST = Approach(max_distance=SAME, max_heading=SAME)


class Progress(NamedTuple):
    """How far along the reference a climber has come."""

    time: int | None = None  # [ns] of the last answer
    waited: int = 0  # [ns]
    pace: Pace = IN_TIME
    is_restarting: bool = False  # σ rises to 1; what is lost until then is not made up for

    def at(self, time: int) -> int:
        """Time of the reference [ns] at `time` [ns], near that of the last answer."""
        return time - self.waited - round(self.pace.lag * SECOND)

    def target(self, preview: Preview, time: int) -> ReferencePoint | None:
        """Target for `time` [ns]; None outside of the preview."""
        if self.pace == IN_TIME:
            return preview.target(time - self.waited)
        return self.pace.target(preview, time - self.waited)

    def advanced(self, time: int, pacing: Pacing) -> "Progress":
        """Progress at `time` [ns]; the reference stands still where the clock has jumped."""
        if self.time is None:
            return self._replace(time=time)
        passed = time - self.time
        if not 0 <= passed <= LONGEST_GAP:
            return self._replace(time=time, waited=self.waited + passed)
        if self.pace == IN_TIME:
            return Progress(time, self.waited, self.pace, self.is_restarting)
        pace, waited = self.pace.after(passed / SECOND, pacing), self.waited
        is_restarting = self.is_restarting and pace.rate < 1 - IN_TIME_AGAIN
        excess = pace.lag if self.is_restarting else pace.lag - LONGEST_LAG
        if excess > 0:
            waited += round(excess * SECOND)
            pace = pace._replace(lag=pace.lag - excess)
        if self.is_restarting and not is_restarting:
            pace = IN_TIME
        return Progress(time, waited, pace, is_restarting)


class Target(NamedTuple):
    """Where a climber should be when its torques act, or why it is not to follow."""

    mode: Mode
    detail: str = ""
    point: ReferencePoint | None = None
    is_gentle: bool = False  # to be followed by constraints that can begin at rest
    progress: Progress = Progress()  # once it is followed


class ActiveReference:
    """How far along its reference a climber is; if it is elsewhere, the way there."""

    def __init__(self, pacing: Pacing, options: Approach, gentle: Guidance) -> None:
        self.pacing, self.options = pacing, options
        self.gentle = gentle  # constraints that can begin at rest, in the place of the law's
        self.preview: Preview | None = None  # of the reference
        self.way: Preview | None = None  # to where it waits
        self.progress = Progress()  # along what is followed
        self._position: int | None = None  # [ns] time of the reference; None: not begun
        self._is_paused = True
        # what is followed, number of `AROUND`, and the fastest motion around it
        self._around: tuple[Preview, int, tuple[float, float]] | None = None
        self._began_at = 0.0  # [m] from the reference, when it was begun to follow it
        self._rested: ReferencePoint | None = None  # where it should rest, at the end of another

    @property
    def followed(self) -> Preview | None:
        """The reference, or the way to it."""
        return self.way or self.preview

    @property
    def is_gentle(self) -> bool:
        """Whether what is followed begins at rest."""
        return self.way is not None or self.progress.is_restarting

    def position(self, stamp: int) -> int | None:
        """Time of the reference [ns] at `stamp` [ns]; None if none was followed or waits."""
        if self.way is None and not self._is_paused:
            return self.progress.at(stamp)
        return self._position

    @property
    def waited(self) -> float:
        """How much later than planned the reference is [s]."""
        return self.progress.waited / SECOND + float(self.progress.pace.lag)

    def begins_after(self, stamp: int) -> bool:
        """Whether the reference begins later."""
        return self.preview is not None and self._position is None and stamp < self.preview.times[0]

    def take(self, preview: Preview) -> None:
        """Take a newer part of the reference, or another reference."""
        rests = self.preview is not None and self._rests()
        tolerance = SAME if rests else TOLERANCE
        if self.preview is None or not self.preview.goes_on_with(preview, tolerance):
            self._replace(preview)
            return
        here = int(preview.times[0]) if self._position is None else self._position
        self.preview = self.preview.continued(preview, here - KEPT_BEHIND).last(MOST_POINTS)

    def _rests(self) -> bool:
        """Whether what is followed rests where the climber has come to."""
        time = self.progress.time
        target = None if time is None else self.at(time)
        return target is not None and max(abs(target.speed), abs(target.yaw_rate)) < STANDSTILL

    def _replace(self, preview: Preview) -> None:
        """Take another reference: what is followed comes to rest first, so that no torque jumps."""
        followed, progress, time = self.followed, self.progress, self.progress.time
        is_followed = followed is not None and not self._is_paused
        self.preview, self.way, self._position, self._is_paused = preview, None, None, True
        self._rested = None
        if is_followed and followed and time and preview.times[0] <= time + LONGEST_GAP:
            self.way = braked(followed, progress.at(time), progress.pace, time)
        if self.way is not None and time:
            self._rested = self.way.target(int(self.way.times[-1]))
            self._is_paused, self.progress = False, Progress()
            self._position = self._first_position(time)

    def pause(self, stamp: int) -> None:
        """Stand still on the reference, which is not followed at `stamp` [ns]."""
        self._is_paused, self.way, self._rested = True, None, None
        if self._position is None and self.preview is not None and not self.begins_after(stamp):
            self._position = self._first_position(stamp)

    # What is expected of a climber that follows

    def at(self, stamp: int) -> ReferencePoint | None:
        """Where the climber should be at `stamp` [ns]; None if nothing is followed."""
        followed = self.followed
        if followed is None or self._is_paused:
            return None
        return followed.target(self.progress.at(stamp))

    def expected(self, stamp: int, target: ReferencePoint, constraints: ConstraintSet) -> Expected:
        """What is expected of a climber that should be at `target` at `stamp` [ns].

        `constraints` are those of the law.
        """
        followed, pace = self.followed, self.progress.pace
        assert followed is not None
        number = self.progress.at(stamp) // AROUND
        if self._around is None or self._around[0] is not followed or self._around[1] != number:
            fastest = followed.fastest((number - 1) * AROUND, (number + 2) * AROUND)
            self._around = followed, number, fastest
        hurry = 1 + (self.pacing.catch_up if pace.lag > 0 else 0.0)
        speed, yaw_rate = self._around[2]
        constraints = self.gentle if self.is_gentle else constraints
        against = constraints.fastest(0.0, 0.0)[0] if abs(target.speed) > GOES else math.inf
        return Expected(
            wanted=Rates(math.hypot(target.v_x, target.v_y), abs(target.yaw_rate)),
            allowed=Rates(*constraints.fastest(hurry * speed, hurry * yaw_rate)),
            waits=pace.rate < STANDS,
            speed=target.speed,
            against=against,
        )

    def strayed(self, motion: Motion, target: ReferencePoint) -> tuple[Mode, str] | None:
        """Mode and detail if a climber is too far from its `target`, else None."""
        distance = math.hypot(motion.x - target.x, motion.y - target.y)
        most = STRAYED * self.options.max_distance
        if distance <= most:
            return None
        return Mode.OFF_PATH, f"{distance:.2f} m from it, at most {most:.2f} m"

    # Where it is to be next

    def target(self, motion: Motion, begins: int, target_time: int) -> Target:
        """Target at `target_time` [ns], of a climber in `motion` at `begins` [ns].

        Its torques act from `begins` on; they are computed for `target_time`.
        """
        if self.preview is None:
            return Target(Mode.WAITING)
        if self._is_paused:
            refused = self._begin(self.preview, motion, begins)
            if refused is not None:
                return refused
        progress = self.progress.advanced(begins, self.pacing)
        if self.way is not None:
            point = progress.target(self.way, target_time)
            if point is None:  # it has arrived
                self.way, self._is_paused = None, True
                return self.target(motion, begins, target_time)
            brakes = self._rested is not None
            detail = "comes to rest first" if brakes else f"{self._began_at:.2f} m away"
            return Target(Mode.APPROACHING, detail, point, True, progress)
        point = progress.target(self.preview, target_time)
        if point is None:
            return Target(Mode.WAITING)
        return Target(Mode.FOLLOWING, "", point, self.is_gentle, progress)

    def around(self, target: Target, target_time: int, later: float) -> ReferencePoint:
        """The point of a target, `later` [s]; the first or the last there is, if that is beyond."""
        followed, point = self.followed, target.point
        assert followed is not None
        assert point is not None
        shift = target.progress.at(0)
        first, last = int(followed.times[0]) - shift, int(followed.times[-1]) - shift
        time = min(max(target_time + round(later * SECOND), first), last)
        return target.progress.target(followed, time) or point

    def slowed(self, target: Target, missing: float, target_time: int, period: float) -> Target:
        """Target that asks `missing` [m/s²] less along the climber; see `Pace.slowed`."""
        preview, progress = self.followed, target.progress
        assert preview is not None
        pace = progress.pace.slowed(missing, preview, target_time - progress.waited, period)
        progress = progress._replace(pace=pace)
        return target._replace(point=progress.target(preview, target_time), progress=progress)

    def go_on(self, target: Target) -> None:
        """Take over the progress of a target whose torques are sent."""
        self.progress = target.progress
        if self.way is None and target.progress.time is not None:
            self._position = target.progress.at(target.progress.time)

    def wait(self, target: Target) -> None:
        """Stand still on what is followed, until the time [ns] of a target."""
        before, time = self.progress.time, target.progress.time
        if before is not None and time is not None:
            waited = self.progress.waited + time - before
            self.progress = self.progress._replace(time=time, waited=waited)

    # Beginning, and going on after a pause

    def _first_position(self, time: int) -> int:
        """Time of the reference [ns] at which it is begun: `time`, or else its first."""
        assert self.preview is not None
        first, last = int(self.preview.times[0]), int(self.preview.times[-1])
        return time if first <= time <= last else first

    def _begin(self, preview: Preview, motion: Motion, time: int) -> Target | None:
        """Follow the reference, or a way to it, from `time` [ns]; else a target without a point."""
        options = self.options
        position = self._where(preview, motion, time)
        point = preview.target(position)
        if point is None:
            return Target(Mode.WAITING)
        distance = math.hypot(motion.x - point.x, motion.y - point.y)
        if distance > options.max_start_distance:
            return Target(
                Mode.TOO_FAR,
                f"{distance:.2f} m, from ({motion.x:.2f}, {motion.y:.2f}) to ({point.x:.2f}, "
                f"{point.y:.2f}); max_start_distance is {options.max_start_distance} m",
            )
        self._is_paused, self._began_at, self._position = False, distance, position
        begin, self._rested = self._begins_at(motion), None
        far, turn = _apart(begin, point)
        most = options if begin is motion else AT_REST
        if far > most.max_distance or turn > most.max_heading:
            self.way = options.way(begin, point, time)
            self.progress = Progress()
        else:
            rate = _rate(motion, point)
            pace = IN_TIME if rate > 1 - IN_TIME_AGAIN else Pace(rate=rate)
            self.progress = Progress(time, time - position, pace, pace != IN_TIME)
        return None

    def _begins_at(self, motion: Motion) -> Motion | ReferencePoint:
        """Pose from which another reference is approached: where it should be, if it rests there.

        Friction holds it a little off, and with it a torque that would jump.
        """
        rested = self._rested
        return motion if rested is None or max(_apart(motion, rested)) > NEAR else rested

    def _where(self, preview: Preview, motion: Motion, time: int) -> int:
        """Time of the reference [ns] at which to go on: the climber may have gone on unanswered."""
        if self._position is None:
            return self._first_position(time)
        first, last = int(preview.times[0]), int(preview.times[-1])
        position, answered = max(self._position, first), self.progress.time
        skip = 0 if answered is None else min(time - answered, LONGEST_SKIP, last - position)
        return position if skip <= 0 else nearest(preview, motion, position, skip)


def _apart(one: Motion | ReferencePoint, other: ReferencePoint) -> tuple[float, float]:
    """Distance [m] and angle [rad] of two poses."""
    distance = math.hypot(one.x - other.x, one.y - other.y)
    return distance, abs(wrapped(one.heading - other.heading))


def _rate(motion: Motion, target: ReferencePoint) -> float:
    """Rate σ of a reference that is as fast as the climber is, 1 if that is nearly so."""
    speed = target.speed
    if abs(speed) < STANDSTILL:
        return 1.0
    rate = float(min(max(motion.speed / speed, 0.0), 1.0))
    return 1.0 if rate > AS_FAST else rate
