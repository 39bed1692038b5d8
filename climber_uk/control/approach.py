"""The way to a reference that is elsewhere: turn to it, drive there, and turn as it does.

Each of the three moves goes from rest to rest by the polynomial of least jerk, p(u) = 10 u³ - 15 u⁴
+ 6 u⁵, whose fastest rate is 15/8 of the mean one.
"""

import math

import numpy as np

from climber_uk.control.time_scaling import STANDSTILL, Pace
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, ReferencePoint
from climber_uk.parameters.declaration import parameter, parameters

PEAK_RATE = 15 / 8  # of p'
PEAK_CHANGE = 10 / 3**0.5  # of p''
REACHING = 1.0, 0.5  # [s] in which a short move's acceleration would make the fastest speed, turn
SHORTEST = 0.8  # [s] that a move takes
POINT_PERIOD = 0.05  # [s]
SHIFT = 5e-3  # [m] up to which it need not turn to drive there
BRAKING, BRAKING_PERIOD = 0.8, 0.02  # [s] from full speed to rest, and between its points
SKIP_STEPS = 20  # in which it is looked for where the climber is ahead


@parameters
class Approach:
    """How a climber gets to its reference, which waits for it meanwhile."""

    max_start_distance: float = parameter(
        2.0, "m", "distance from the reference beyond which a start is refused", above=0
    )
    max_distance: float = parameter(
        1.0, "m", "distance from the reference beyond which it waits and is approached", above=0
    )
    max_heading: float = parameter(
        2.0,
        "rad",
        "angle from the reference's heading beyond which the reference waits and is approached",
        above=0,
    )
    approach_speed: float = parameter(0.1, "m/s", "fastest speed of the approach", above=0)
    approach_yaw_rate: float = parameter(0.5, "rad/s", "fastest turn of the approach", above=0)

    def way(self, start: Motion | ReferencePoint, target: ReferencePoint, begin: int) -> Preview:
        """Preview from the pose of `start` at `begin` [ns], at rest there, to that of `target`."""
        offset_x, offset_y = target.x - start.x, target.y - start.y
        first = driven = float(start.heading)
        if math.hypot(offset_x, offset_y) > SHIFT:
            heading_change = float(wrapped(math.atan2(offset_y, offset_x) - first))
            if abs(heading_change) > math.pi / 2:  # in reverse gear it is less of a turn
                heading_change = float(wrapped(heading_change + math.pi))
            driven = first + heading_change
        last = driven + float(wrapped(target.heading - driven))
        here, there = np.array([start.x, start.y]), np.array([target.x, target.y])
        moves = [
            self._move(here, here, first, driven),
            self._move(here, there, driven, driven),
            self._move(there, there, driven, last),
        ]
        return _joined([move for move in moves if move is not None] or [_rest(here, last)], begin)

    def _move(self, place: Array, end: Array, first: float, last: float) -> Array | None:
        """Rows of a move from a place (2,) [m] and a heading to others; None if they are those."""
        way = np.array([*(end - place), last - first])
        if not way.any():
            return None
        sizes = np.array([math.hypot(*way[:2]), abs(way[2])])
        fastest = np.array([self.approach_speed, self.approach_yaw_rate])
        by_speed = PEAK_RATE * sizes / fastest
        gently = np.sqrt(PEAK_CHANGE * sizes * REACHING / fastest)
        time, p, p_1, p_2 = _smooth(max(*by_speed, *gently, SHORTEST))
        rows = np.zeros((len(time), 10))
        rows[:, 0], rows[:, 1:4] = time, np.array([*place, first]) + p[:, None] * way
        rows[:, 4:7], rows[:, 7:10] = p_1[:, None] * way, p_2[:, None] * way
        return rows


ANYWHERE = Approach(max_start_distance=1e6, max_distance=1e6, max_heading=10.0)
"""Follows at once, from wherever the climber is: the law by itself."""


def nearest(preview: Preview, motion: Motion, begin: int, skip: int) -> int:
    """Time of a reference [ns], within `skip` [ns] after `begin`, when it is nearest."""
    times = begin + np.linspace(0, skip, SKIP_STEPS + 1).astype(np.int64)
    targets = [preview.target(int(at)) for at in times]
    offsets = [
        math.hypot(motion.x - target.x, motion.y - target.y)
        for target in targets
        if target is not None
    ]
    time = int(times[int(np.argmin(offsets))])
    target = preview.target(time)
    if target is None or abs(speed := target.speed) < STANDSTILL:
        return time
    ahead = (motion.x - target.x) * target.v_x + (motion.y - target.y) * target.v_y
    ahead = min(max(ahead / (speed * speed), -skip / SKIP_STEPS / SECOND), skip / SECOND)
    return min(max(time + round(ahead * SECOND), begin), begin + skip)


def braked(followed: Preview, position: int, pace: Pace, begin: int) -> Preview | None:
    """Preview from `begin` [ns] on that comes to rest along one that is at `position` [ns].

    That goes on at a `pace`. None if so little of it is left that it cannot.
    """
    left = (int(followed.times[-1]) - position) / SECOND
    number = math.floor(min(BRAKING, 2 * left) / BRAKING_PERIOD)
    if number < 2:
        return None
    duration, rows = number * BRAKING_PERIOD, np.zeros((number + 1, 10))
    for i in range(number + 1):
        u = i / number
        rate = pace.rate * (1 - u**3 * (10 - 15 * u + 6 * u**2))
        change = -pace.rate * 30 * u**2 * (1 - u) ** 2 / duration
        on = pace.rate * duration * (u - u**4 * (2.5 - 3 * u + u**2))
        point = Pace(0.0, rate, change).target(followed, position + round(on * SECOND))
        if point is None:  # it goes on faster than its own time
            return None
        rows[i] = i * BRAKING_PERIOD, *point[:9]
    return _joined([rows], begin)


def _smooth(duration: float) -> tuple[Array, Array, Array, Array]:
    """Times (n,) [s], and p, ṗ, p̈ at them, of a move of a duration [s]."""
    time = np.linspace(0.0, duration, math.ceil(duration / POINT_PERIOD) + 1)
    u = time / duration
    p = u**3 * (10 - 15 * u + 6 * u**2)
    p_1 = 30 * u**2 * (1 - u) ** 2 / duration
    p_2 = 60 * u * (1 - u) * (1 - 2 * u) / duration**2
    return time, p, p_1, p_2


def _rest(place: Array, heading: float) -> Array:
    rows = np.zeros((2, 10))
    rows[:, 0], rows[:, 1:3], rows[:, 3] = (0.0, POINT_PERIOD), place, heading
    return rows


def _joined(moves: list[Array], begin: int) -> Preview:
    """Preview of moves one after the other, from `begin` [ns] on.

    Each is rows (n, 10): time [s], pose, velocity, acceleration, in the wall's frame.
    """
    rows: list[Array] = []
    end = 0.0
    for move in moves:
        rows.append(move[1 if rows else 0 :] + np.eye(10)[0] * end)
        end = rows[-1][-1, 0]
    table = np.concatenate(rows)
    times = begin + np.round(table[:, 0] * SECOND).astype(np.int64)
    return Preview(times, table[:, 1:4], table[:, 4:7], table[:, 7:10])
