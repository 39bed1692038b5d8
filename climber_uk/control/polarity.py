"""Whether a measured speed follows its torque, which tells its sign, whoever else may doubt it.

What brakes may push where a sign is wrong: of the torque, or of the speed. A torque that opposes a
speed that has followed its torques so far brakes it, and one with it brakes what has gone against
them. Where neither is known, nothing brakes.
"""

import math

from climber_uk.control.observed import Observed
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import wrapped

SWING_TIME = 0.15  # [s] what changes more slowly is left out: weight, friction, load
MEMORY = 1.0  # [s]
WHEEL_MEMORY = 0.2  # [s]
LEAST_SWING = 0.005  # [m/s] of a rim that torques should cause, RMS, to tell anything
# correlation of what they should cause with what is measured, for a sign that is right, and wrong:
# odometry that is late by a third of an oscillation goes against its torques, too
RIGHT, WRONG = 0.5, -0.85
POSE_SMOOTHING = 0.03  # [s] of speeds that are taken from poses
SLIDES = 0.01  # [m/s] from which it is known which way friction acts
TINY = 1e-30


class Swing:
    """What of a speed is quick, by two high-passes: nothing of one that grows steadily."""

    def __init__(self) -> None:
        self._first = self.value = 0.0

    def add(self, change: float, kept: float) -> float:
        """Take a change, of which a share is `kept`; what is quick."""
        before = self._first
        self._first = kept * (before + change)
        self.value = kept * (self.value + self._first - before)
        return self.value


class Polarity:
    """Of one speed: compares its swings with those that the torques should cause."""

    def __init__(self, memory: float = MEMORY) -> None:
        self.memory = memory  # [s]
        self._expected, self._measured = Swing(), Swing()
        self._squares = self._products = self._squares_measured = 0.0  # [m²/s]

    def add(self, expected: float, measured: float, time: float) -> None:
        """Take changes of a rim's speed [m/s] within `time` [s]."""
        kept, left = math.exp(-time / SWING_TIME), math.exp(-time / self.memory)
        should, does = self._expected.add(expected, kept), self._measured.add(measured, kept)
        self._squares = left * self._squares + time * should * should
        self._products = left * self._products + time * should * does
        self._squares_measured = left * self._squares_measured + time * does * does

    @property
    def sign(self) -> int:
        """1 where it follows its torque, -1 where it goes against it; 0: nobody knows."""
        if self._squares < LEAST_SWING**2 * self.memory:
            return 0
        correlation = self._products / math.sqrt(self._squares * self._squares_measured + TINY)
        return int(correlation > RIGHT) - int(correlation < WRONG)


class Polarities:
    """Of speed and yaw rate of a climber, and of each wheel.

    What is measured of a wheel is the force that acted on it, by (11) and (15): nothing of what
    the other one does, nor of a steady push.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Know nothing."""
        self.drive, self.yaw = Polarity(), Polarity()
        self.forget_wheels()

    def forget_wheels(self) -> None:
        """Know nothing of each wheel."""
        self.right, self.left = Polarity(WHEEL_MEMORY), Polarity(WHEEL_MEMORY)

    def forget_unknown(self) -> None:
        """Begin anew with what is not known: what nobody caused would hide an answer."""
        self.drive = self.drive if self.drive.sign else Polarity()
        self.yaw = self.yaw if self.yaw.sign else Polarity()

    def add(self, climber: Climber, observed: Observed) -> None:
        """Take what an odometry tells of the time since the last."""
        before, after, time = observed.before, observed.after, observed.time
        if time <= 0:
            return
        force, moment = climber.wrench(*observed.torques)
        mass, inertia, friction, weight = climber.inertial
        resisting = weight * after.sine, math.copysign(friction, after.speed)
        force += observed.pull - sum(resisting)
        self.drive.add(force / mass * time, after.speed - before.speed, time)
        lever = climber.half_track
        turn = lever * (after.yaw_rate - before.yaw_rate)
        self.yaw.add(lever * moment / inertia * time, turn, time)
        if min(abs(before.speed), abs(after.speed)) < SLIDES:
            return  # what rubs may be anything
        drive = after.speed - before.speed + (sum(resisting) - observed.pull) / mass * time
        turn *= inertia / lever**2 / mass
        wheels, acted = (self.right, self.left), (drive + turn, drive - turn)
        for wheel, torque, does in zip(wheels, observed.torques, acted, strict=True):
            wheel.add(2 * torque / climber.wheel_radius / mass * time, does, time)

    @property
    def signs(self) -> tuple[int, int]:
        """Of speed and yaw rate; see `Polarity.sign`."""
        return self.drive.sign, self.yaw.sign

    @property
    def is_wrong(self) -> bool:
        """Whether a wheel goes against its torque."""
        return min(self.right.sign, self.left.sign) < 0

    @property
    def are_right(self) -> bool:
        """Whether both wheels follow their torques."""
        return min(self.right.sign, self.left.sign) > 0


class PoseSpeeds:
    """Speed and yaw rate by poses, for where the twist is in doubt, and whether they follow."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Know nothing."""
        self.polarities, self.speeds = Polarities(), (0.0, 0.0)

    def add(self, climber: Climber, observed: Observed) -> None:
        """Take what an odometry tells of the time since the last."""
        before, after, time = observed.before, observed.after, observed.time
        if time <= 0:
            return
        gone = (after.x - before.x) * after.cosine + (after.y - before.y) * after.sine
        by_pose = gone / time, wrapped(after.heading - before.heading) / time
        new, last = 1 - math.exp(-time / POSE_SMOOTHING), self.speeds
        speed, yaw_rate = self.speeds = tuple(
            old + new * (now - old) for old, now in zip(last, by_pose, strict=True)
        )
        smoothed = observed._replace(
            before=before._replace(speed=last[0], yaw_rate=last[1]),
            after=after._replace(speed=speed, yaw_rate=yaw_rate),
        )
        self.polarities.add(climber, smoothed)
