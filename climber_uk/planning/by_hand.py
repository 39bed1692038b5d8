"""A stick's speeds as a reference, from where the climber rests.

Both speeds go to what the stick asks for by the smooth ramps of `PathClock`, and x, y are the
integral of what is along the heading. What is published always ends at rest: what the stick asks
for counts for `HOLD` beyond the points that are kept, then it brakes, unless the next preview says
otherwise. So a lost stick, or a lost planner, stops the climber.
"""

import math
from collections import deque
from collections.abc import Callable
from typing import Generic

import numpy as np

from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.reference import Reference
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.planning.course import CourseOptions, Row
from climber_uk.planning.path_clock import PathClock

HOLD = 2.0  # publish periods, for which what is asked counts beyond the points that are kept
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)


@parameters
class HandOptions:
    """How a stick drives the climber."""

    input: str = parameter(
        "none", "", "message of cmd_vel, if it is heard", choices=("none", "twist", "twist_stamped")
    )
    speed: float = parameter(0.2, "m/s", "fastest speed; what is more is cut", above=0)
    yaw_rate: float = parameter(0.5, "rad/s", "fastest turn; what is more is cut", above=0)
    ramp_time: float = parameter(
        1.0, "s", "time in which a speed is the one asked for", at_least=0.1
    )
    timeout: float = parameter(
        0.5, "s", "time without a message after which the climber brakes", above=0
    )


def check_speeds(speed: float, yaw_rate: float) -> None:
    """Raise `ValueError` if they are none."""
    if not (math.isfinite(speed) and math.isfinite(yaw_rate)):
        raise ValueError(f"speed={speed}, yaw rate={yaw_rate} must be finite")


class ByHand(Generic[Row]):
    """A reference that started at `start` [ns] at rest in `pose` (3,), as `Course` is one."""

    def __init__(
        self,
        pose: Array,
        start: int,
        options: CourseOptions,
        hand: HandOptions,
        make: Callable[[Reference, float], Row],
    ) -> None:
        self.start, self.options, self.hand = start, options, hand
        ramp = math.ceil(hand.ramp_time / options.point_period - 1e-9) * options.point_period
        self._forward = PathClock(ramp, rate=0.0)
        self._turn = PathClock(ramp, begin=float(pose[2]), rate=0.0)
        self._make = make
        self._poses = deque([(0.0, pose.copy())])  # at the points, with their times [s]
        self._rows: deque[tuple[float, Row]] = deque()
        self._asked = (0.0, 0.0)  # [m/s], [rad/s]
        self._heard = -math.inf  # [s] when

    def command(self, speed: float, yaw_rate: float, now: int) -> None:
        """Ask for speeds [m/s], [rad/s] at `now` [ns]; raises as `check_speeds` does."""
        check_speeds(speed, yaw_rate)
        hand = self.hand
        self._asked = (
            min(max(speed, -hand.speed), hand.speed),
            min(max(yaw_rate, -hand.yaw_rate), hand.yaw_rate),
        )
        self._heard = (now - self.start) / SECOND

    def rests(self, position: int) -> bool:
        """Whether it rests at `position` [ns], and goes on resting if it is not asked."""
        time = (position - self.start) / SECOND
        return time >= max(self._forward.settles(), self._turn.settles()) and not any(self._asked)

    def stop(self) -> None:
        """Ask for rest."""
        self._asked = (0.0, 0.0)

    def preview(self, position: int, now: int) -> list[Row]:
        """Points around `position` [ns], from a little before it until it rests."""
        options, time = self.options, (position - self.start) / SECOND
        if (now - self.start) / SECOND - self._heard > self.hand.timeout:
            self.stop()
        period = options.point_period
        kept = math.ceil((time + options.reaction) / period) * period
        brakes = kept + HOLD * options.publish_period
        speed, yaw_rate = self._asked
        done = max(time, 0.0)
        self._forward = self._forward.turned(kept, speed, done).changed(brakes, 0.0, done)
        self._turn = self._turn.turned(kept, yaw_rate, done).changed(brakes, 0.0, done)
        while self._poses[-1][0] > kept + period / 2:
            self._poses.pop()
        while self._rows and self._rows[-1][0] > kept + period / 2:
            self._rows.pop()
        end = max(brakes + self._forward.ramp_time, time + options.preview)
        self._extend(end)
        oldest = time - options.publish_period - 2 * period
        while self._rows[0][0] < oldest:
            self._rows.popleft()
            self._poses.popleft()
        return [row for _, row in self._rows]

    def _extend(self, end: float) -> None:
        """Compute all points up to `end` [s] that there are not."""
        period = self.options.point_period
        if not self._rows:
            time, pose = self._poses[-1]
            self._rows.append((time, self._make(self._at(time, pose), time)))
        while self._poses[-1][0] < end:
            before, pose = self._poses[-1]
            time = round(before / period + 1) * period
            pose = self._moved(before, time, pose)
            self._poses.append((time, pose))
            self._rows.append((time, self._make(self._at(time, pose), time)))

    def _moved(self, before: float, time: float, pose: Array) -> Array:
        """Pose (3,) at `time` [s] from that at the time `before` it, by Gauss' quadrature."""
        half = (time - before) / 2
        times = before + half * (1 + NODES)
        speed, heading = self._forward.at(times)[1], self._turn.at(times)[0]
        x, y = (half * np.sum(WEIGHTS * speed * f(heading)) for f in (np.cos, np.sin))
        return np.array([pose[0] + x, pose[1] + y, float(self._turn.at(time)[0])])

    def _at(self, time: float, pose: Array) -> Reference:
        """Reference at `time` [s], where its `pose` (3,) is known."""
        _, v, v_1, v_2 = map(float, self._forward.at(time))
        _, omega, omega_1, _ = map(float, self._turn.at(time))
        along = np.array([math.cos(pose[2]), math.sin(pose[2])])
        left = np.array([-along[1], along[0]])
        return Reference(
            pose=pose,
            velocity=np.array([*(v * along), omega]),
            acceleration=np.array([*(v_1 * along + v * omega * left), omega_1]),
            jerk=(v_2 - v * omega**2) * along + (2 * v_1 * omega + v * omega_1) * left,
        )
