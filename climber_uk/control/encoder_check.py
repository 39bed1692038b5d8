"""Whether the wheels turn as odometry says: encoders as a witness of what estimates the state.

An estimator that is stuck looks like a seal that holds: stamps go on, nothing moves, and torque
grows until the climber slides, which nobody sees. Its wheels do.
"""

import math

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import turned
from climber_uk.mechanics.quantities import Motion

MEMORY = 0.5  # [s] in which a difference is forgotten
SHARE = 0.3  # of the longer way by which they may differ: slip, scale
LONGEST_SILENCE = 0.2  # [s] of the encoders, after which nothing is compared
Ways = tuple[float, float]  # [m] of the right and the left rim


class EncoderCheck:
    """Compares the ways of both rims, by encoders and by odometry, older ones counting less."""

    def __init__(self) -> None:
        self._angles: Ways | None = None  # [rad] of the wheels
        self._unheard = 0.0  # [s] of odometry since they were heard, or since the start
        self.restart()

    def restart(self) -> None:
        """Compare from now on."""
        self._turned: Ways = 0.0, 0.0  # by the wheels' angles
        self._gone: Ways = 0.0, 0.0  # by odometry
        self._silent = math.inf  # [s] since the encoders were heard

    def turn(self, climber: Climber, right: float, left: float) -> None:
        """Take the angles of the wheels [rad]."""
        before, self._angles = self._angles, (right, left)
        if self._silent > LONGEST_SILENCE or before is None:
            self.restart()
        else:
            steps = zip(self._turned, self._angles, before, strict=True)
            r = climber.wheel_radius
            right_way, left_way = (
                way + r * turned(now, then, self._unheard) for way, now, then in steps
            )
            self._turned = right_way, left_way
        self._silent = self._unheard = 0.0

    @property
    def is_heard(self) -> bool:
        """Whether encoders are there, or may yet come: else odometry has no witness."""
        return self._unheard <= LONGEST_SILENCE

    def go(self, climber: Climber, motion: Motion, time: float) -> None:
        """Take an odometry, `time` [s] after the last one."""
        self._silent += time
        self._unheard += time
        left = math.exp(-time / MEMORY)
        turn = climber.half_track * motion.yaw_rate
        (right_gone, left_gone), (right, left_turned) = self._gone, self._turned
        self._gone = (
            left * right_gone + time * (motion.speed + turn),
            left * left_gone + time * (motion.speed - turn),
        )
        self._turned = left * right, left * left_turned

    def trouble(self, most: float) -> str:
        """By how much they differ, if that is more than `most` [m]; else ''."""
        if self._silent > LONGEST_SILENCE:
            return ""
        for name, way, gone in zip(("right", "left"), self._turned, self._gone, strict=True):
            if abs(way - gone) - SHARE * max(abs(way), abs(gone)) > most:
                return f"the {name} one by {way:.3f} m, {gone:.3f} m by odometry"
        return ""
