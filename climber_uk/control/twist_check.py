"""Whether the twist that odometry tells is the rate of its pose: its sign may be wrong."""

import math

from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import Motion

MEMORY = 0.5  # [s] in which a difference is forgotten
SHARE = 0.3  # by which they may differ: slip, scale
OPPOSED = 0.2  # of the largest error: way both of them must have gone, to opposite sides
IN_A_ROW = 3  # odometry messages that say so
SUSPECTED = 0.02  # of the largest error: enough, and once, where a climber is too fast as well


class TwistCheck:
    """Compares ways by pose and by twist, each the sum of what was gone in the last moments."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Compare from now on."""
        self._ways = [(0.0, 0.0), (0.0, 0.0)]  # [m] by pose and by twist: forward, rim in turning
        self._opposed = 0

    def add(self, last: Motion, motion: Motion, time: float, half_track: float) -> None:
        """Add the way from the last odometry to the next, `time` [s] later."""
        turned = wrapped(motion.heading - last.heading)
        middle = last.heading + turned / 2
        forward = (motion.x - last.x) * math.cos(middle) + (motion.y - last.y) * math.sin(middle)
        gone = (
            (forward, time * (last.speed + motion.speed) / 2),
            (half_track * turned, half_track * time * (last.yaw_rate + motion.yaw_rate) / 2),
        )
        left = math.exp(-time / MEMORY)
        self._ways = [
            (left * by_pose + pose, left * by_twist + twist)
            for (by_pose, by_twist), (pose, twist) in zip(self._ways, gone, strict=True)
        ]

    def opposed(self, least: float) -> str:
        """Which part of the twist has another sign than its way, of `least` [m]; else ''."""
        for name, (pose, twist) in zip(("linear.x", "angular.z"), self._ways, strict=True):
            if pose * twist < 0 and min(abs(pose), abs(twist)) > least:
                return f"twist.{name}"
        return ""

    def trouble(self, largest: float) -> tuple[str, bool]:
        """What is wrong if they differ by more than `largest` [m], and whether a sign is."""
        opposed = self.opposed(OPPOSED * largest)
        self._opposed = self._opposed + 1 if opposed else 0
        if self._opposed >= IN_A_ROW:
            return opposed, True
        differs = max(
            abs(pose - twist) - SHARE * max(abs(pose), abs(twist)) for pose, twist in self._ways
        )
        return (f"by {differs:.2f} m", False) if differs > largest else ("", False)
