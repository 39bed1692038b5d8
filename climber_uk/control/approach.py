"""The way to a reference that is elsewhere: turn to it, drive there, and turn as it does.

Each of the three moves goes from rest to rest by the polynomial of least jerk, p(u) = 10 u³ - 15 u⁴
+ 6 u⁵, whose fastest rate is 15/8 of the mean one.
"""

import math

import numpy as np

from climber_uk.control.time_scaling import STANDSTILL
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, ReferencePoint
from climber_uk.parameters.declaration import parameter, parameters

PEAK_RATE = 15 / 8  # of p'
SHORTEST = 0.4  # [s] that a move takes
POINT_PERIOD = 0.05  # [s]
NO_DISTANCE = 1e-3  # [m] that need not be driven
SKIP_STEPS = 20  # in which it is looked for where the climber is ahead


@parameters
class Approach:
    """How a climber gets to its reference, which waits for it meanwhile."""

    max_start_distance: float = parameter(
        2.0, "m", "from further away the reference is refused", above=0
    )
    max_distance: float = parameter(
        1.0, "m", "from the reference, beyond which it waits and is approached", above=0
    )
    max_heading: float = parameter(
        2.0, "rad", "away from the reference's heading, beyond which it is the same", above=0
    )
    approach_speed: float = parameter(0.1, "m/s", "fastest speed of the approach", above=0)
    approach_yaw_rate: float = parameter(0.5, "rad/s", "fastest turn of the approach", above=0)

    def way(self, motion: Motion, target: ReferencePoint, begin: int) -> Preview:
        """Preview from a climber's pose at `begin` [ns], at rest there, to the pose of `target`."""
        offset_x, offset_y = target.x - motion.x, target.y - motion.y
        distance = math.hypot(offset_x, offset_y)
        first, direction = float(motion.heading), 1.0
        if distance > NO_DISTANCE:
            heading_change = float(wrapped(math.atan2(offset_y, offset_x) - first))
            if abs(heading_change) > math.pi / 2:  # in reverse gear it is less of a turn
                heading_change, direction = float(wrapped(heading_change + math.pi)), -1.0
            drive_heading = first + heading_change
        else:
            distance, drive_heading = 0.0, first
        last = drive_heading + float(wrapped(target.heading - drive_heading))
        start = (motion.x, motion.y)
        end = (target.x, target.y) if distance else start
        moves = [
            self._turn(start, first, drive_heading),
            self._drive(start, drive_heading, direction, distance),
            self._turn(end, drive_heading, last),
        ]
        return _joined([move for move in moves if move is not None] or [_rest(end, last)], begin)

    def _turn(self, place: tuple[float, float], first: float, last: float) -> Array | None:
        angle = last - first
        if not angle:
            return None
        time, p, p_1, p_2 = _move(abs(angle), self.approach_yaw_rate)
        rows = np.zeros((len(time), 10))
        rows[:, 0], rows[:, 1:3], rows[:, 3] = time, place, first + p * angle
        rows[:, 6], rows[:, 9] = p_1 * angle, p_2 * angle
        return rows

    def _drive(
        self, place: tuple[float, float], heading: float, direction: float, distance: float
    ) -> Array | None:
        if not distance:
            return None
        time, p, p_1, p_2 = _move(distance, self.approach_speed)
        displacement = direction * distance * np.array([math.cos(heading), math.sin(heading)])
        rows = np.zeros((len(time), 10))
        rows[:, 0], rows[:, 1:3], rows[:, 3] = time, place + p[:, None] * displacement, heading
        rows[:, 4:6], rows[:, 7:9] = p_1[:, None] * displacement, p_2[:, None] * displacement
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


def _move(size: float, fastest: float) -> tuple[Array, Array, Array, Array]:
    """Times (n,) [s], and p, ṗ, p̈ at them, of a move of `size` at a rate of `fastest` at most."""
    duration = max(PEAK_RATE * size / fastest, SHORTEST)
    time = np.linspace(0.0, duration, math.ceil(duration / POINT_PERIOD) + 1)
    u = time / duration
    p = u**3 * (10 - 15 * u + 6 * u**2)
    p_1 = 30 * u**2 * (1 - u) ** 2 / duration
    p_2 = 60 * u * (1 - u) * (1 - 2 * u) / duration**2
    return time, p, p_1, p_2


def _rest(place: tuple[float, float], heading: float) -> Array:
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
