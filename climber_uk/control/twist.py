"""What an odometry's twist is worth: whether it is of its stamp, and whether the pose agrees."""

import math
from typing import NamedTuple

from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import Motion

Products = tuple[float, float, float]
FIELDS = "linear.x", "angular.z"
KIND_MEMORY = 1.0  # [s]
SURELY = 0.1  # share of the other's squares of misfits, below which a twist is taken for a mean
CHECK_MEMORY = 0.5  # [s] in which a difference is forgotten
SHARE = 0.3  # by which they may differ: slip, scale
# A twist that tells less than a half of the pose's way, as in another unit, is found over this
# share of the largest error, where both go alike for some messages: else a pose is noisy or jumps
TOO_LITTLE, TOO_LITTLE_DISTANCE, ALIKE, AT_LEAST = 0.5, 0.05, 0.9, 4
# What tells less in each of some messages in a row is found at once, over as many times that
# distance, if its square is as many times the squares by which the pose's steps have changed
AT_ONCE, SMOOTH = 1.6, 2.0
ROUGH = 1e-3  # [m²] of these at first, when nothing is known of a pose's noise
# One that goes over this share of the largest error, while the other stays exactly as it is
STILL_DISTANCE, STILL = 0.1, 0.02  # and [m/s] of a rim: less may be noise of what stands
OPPOSED_DISTANCE = 0.1  # of the largest error: distance of both, to opposite sides
OPPOSED_IN_A_ROW = 3  # odometry messages
LEAPS = 2.0  # times the twist's way in a message, that a pose goes in it at most: else it leaps
OPPOSED_IF_TOO_FAST = 0.01  # of the largest error: enough, once, where it is too fast as well
# What goes sideways faster than it should go at all is found over this share of the largest error
# in a moment, if that is more than a share of the way ahead
MOMENT = 0.1  # [s]
FAST_SIDEWAYS, ALSO_AHEAD = 0.2, 0.5


class TwistKind:
    """Whether the twist of late is that of its stamp, or the mean of the period before it.

    Encoders give means: the distance of a period, by its time. For twists of the stamp that is the
    mean (v + v₀)/2 of two in a row. What fits the poses better is taken; if in doubt, the twist is
    that of its stamp.
    """

    def __init__(self) -> None:
        self.is_mean = False
        self._as_mean = self._as_instant = 0.0  # [m²/s²] sums of squares of misfits

    def learn(self, before: Motion, now: Motion, time: float) -> None:
        """Take in an odometry, `time` [s] after the one `before`."""
        speed, rate = mean_twist(before, now, time)
        left = max(0.0, 1.0 - time / KIND_MEMORY)
        off, yaw_off = now.speed - speed, now.yaw_rate - rate
        off_0, yaw_off_0 = before.speed - speed, before.yaw_rate - rate
        self._as_mean = left * self._as_mean + off * off + yaw_off * yaw_off
        off, yaw_off = (off + off_0) / 2, (yaw_off + yaw_off_0) / 2
        self._as_instant = left * self._as_instant + off * off + yaw_off * yaw_off
        self.is_mean = self._as_mean < SURELY * self._as_instant


class Unlike(NamedTuple):
    """Distances [m] in messages in a row, of each of which a twist tells less than half.

    Noise of the pose may be the cause, unless they are more than its steps have changed of late.
    """

    pose: float = 0.0
    twist: float = 0.0
    step: float = 0.0  # [m] of the last message, by pose
    roughness: float = ROUGH  # [m²] sum of squares of the changes of steps

    def added(self, left: float, pose: float, twist: float, least: float) -> "Unlike":
        """With a step [m] by pose, of `least` [m], and by twist; `left` of what is forgotten."""
        roughness = left * self.roughness + (pose - self.step) ** 2
        if abs(pose) < least or twist * pose >= TOO_LITTLE * pose * pose:
            return Unlike(step=pose, roughness=roughness)
        return Unlike(self.pose + pose, self.twist + twist, pose, roughness)

    @property
    def is_noise(self) -> bool:
        """Whether it may be."""
        return self.pose * self.pose <= SMOOTH * self.roughness


class TwistCheck:
    """Whether the twist is the rate of the pose: its sign may be wrong.

    Compares distances by pose and by twist, summed over the last moments, older ones counting less.
    A sign is wrong where both go opposite ways all the time: of a climber that swings, sums of a
    twist that is a little late do so now and then. A pose that leaps, as a fix corrects it, is no
    motion, and counts for no more than `LEAPS`. What goes sideways, by more than it goes ahead and
    its rims turn, has another heading than it tells.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Compare from now on."""
        # [m] by pose and by twist: forward, and of a rim by yawing
        self._distances = (0.0, 0.0), (0.0, 0.0)
        # [m²] sums of products, of the same two: pose's by twist's, pose's and twist's squares
        self._products = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        # of the same two: distance by pose [m] and sum of products [m²], but for leaps
        self._smooth = (0.0, 0.0), (0.0, 0.0)
        self._opposed = 0
        # of the same two: by pose while the twist is zero [m], the squares of its steps [m²], and
        # by twist while the pose stands [m]
        self._alone = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        self._unlike = Unlike(), Unlike()  # of the same two
        self._aside = 0.0, 0.0  # [m] by pose, to the left, and the squares of its steps [m²]
        self.aside = 0.0  # [m/s] the same of the last message
        # [m] of the last moment: ahead and aside by pose, of a rim by yawing; squares aside [m²]
        self._of_late = 0.0, 0.0, 0.0, 0.0

    def add(self, last: Motion, motion: Motion, time: float, half_track: float) -> None:
        """Add the distances from the `last` odometry to that of `motion`, `time` [s] later."""
        heading_change = wrapped(motion.heading - last.heading)
        middle = last.heading + heading_change / 2
        forward = (motion.x - last.x) * math.cos(middle) + (motion.y - last.y) * math.sin(middle)
        aside = (motion.y - last.y) * math.cos(middle) - (motion.x - last.x) * math.sin(middle)
        way = time * (last.speed + motion.speed) / 2
        turned = half_track * heading_change
        rim = half_track * time * (last.yaw_rate + motion.yaw_rate) / 2
        left = math.exp(-time / CHECK_MEMORY)
        (pose, twist), (yaw_by_pose, yaw_by_twist) = self._distances
        self._distances = (
            (left * pose + forward, left * twist + way),
            (left * yaw_by_pose + turned, left * yaw_by_twist + rim),
        )
        sideways, squares = self._aside
        self._aside = left * sideways + aside, left * squares + aside * aside
        self.aside = aside / time if time > 0 else 0.0
        new = forward, aside, turned, aside * aside
        forgotten = math.exp(-time / MOMENT)
        self._of_late = (
            *(forgotten * old + it for old, it in zip(self._of_late, new, strict=True)),
        )
        drive, yaw = self._products
        self._products = _summed(left, drive, forward, way), _summed(left, yaw, turned, rim)
        drive_sums, yaw_sums = self._smooth
        self._smooth = _smooth(left, drive_sums, forward, way), _smooth(left, yaw_sums, turned, rim)
        least, (on, round_) = STILL * time, self._alone
        self._alone = (
            _alone(on, forward, way, least, motion.speed == 0),
            _alone(round_, turned, rim, least, motion.yaw_rate == 0),
        )
        at_once, yaw_at_once = self._unlike
        at_once = at_once.added(left, forward, way, least)
        self._unlike = at_once, yaw_at_once.added(left, turned, rim, least)

    def missing(self, largest: float) -> str:
        """Field of the twist that is zero while the pose goes; else ''."""
        for name, (by_pose, pose_2, _) in zip(FIELDS, self._alone, strict=True):
            is_way = abs(by_pose) > STILL_DISTANCE * largest  # and not a noisy pose, at rest
            if is_way and by_pose * by_pose > AT_LEAST * pose_2:
                return name
        return ""

    def opposed(self, least: float, is_sure: bool = False) -> str:
        """Field of the twist whose sign is not its pose's, over `least` [m] of both; else ''.

        If something is wrong surely, what may be noise counts too.
        """
        fields = zip(FIELDS, self._distances, self._smooth, strict=True)
        for name, (_, twist), (pose, alike) in fields:
            if alike < 0 and pose * twist < 0 and min(abs(pose), abs(twist)) > least:
                return f"twist.{name}"
        for name, it in zip(FIELDS, self._unlike, strict=True):
            is_way = min(abs(it.pose), abs(it.twist)) > least and (is_sure or not it.is_noise)
            if it.pose * it.twist < 0 and is_way:
                return f"twist.{name}"
        return ""

    def too_little(self, least: float) -> str:
        """How little of the pose's way, over `least` [m] of it, a twist tells; '' if enough."""
        for name, it in zip(FIELDS, self._unlike, strict=True):
            is_way = abs(it.pose) > AT_ONCE * least and not it.is_noise
            if it.pose * it.twist > 0 and is_way:
                return f"{name} is {it.twist / it.pose:.2f} of it"
        for name, (pose, _), products in zip(FIELDS, self._distances, self._products, strict=True):
            alike, pose_2, twist_2 = products
            is_way = abs(pose) > least and pose * pose > AT_LEAST * pose_2
            are_alike = alike > 0 and alike * alike > ALIKE * pose_2 * twist_2
            if is_way and are_alike and twist_2 < TOO_LITTLE * alike:
                return f"{name} is {twist_2 / alike:.2f} of it"
        return ""

    def sideways(self, largest: float) -> str:
        """By how much it goes to the side, in words, if by more than `largest` [m]; else ''."""
        (ahead, _), (turned, _) = self._distances  # what scrubs turns about another point
        return _sideways(largest, ahead, turned, *self._aside)

    def sideways_of_late(self, largest: float) -> str:
        """The same of the last moment, for what goes sideways faster than it should go at all."""
        ahead, aside, turned, squares = self._of_late
        return _sideways(largest, ALSO_AHEAD * ahead, turned, aside, squares)

    def trouble(self, largest: float) -> tuple[str, bool]:
        """What is wrong if they differ by more than `largest` [m], and whether a sign is."""
        opposed = self.opposed(OPPOSED_DISTANCE * largest)
        self._opposed = self._opposed + 1 if opposed else 0
        if self._opposed >= OPPOSED_IN_A_ROW:
            return opposed, True
        if max(abs(by_twist) for *_, by_twist in self._alone) > STILL_DISTANCE * largest:
            return "the pose stands", False
        if slow := self.too_little(TOO_LITTLE_DISTANCE * largest):
            return slow, False
        differs = max(_difference(*self._distances[0]), _difference(*self._distances[1]))
        return (f"by {differs:.2f} m", False) if differs > largest else ("", False)


def _alone(sums: Products, pose: float, twist: float, least: float, is_zero: bool) -> Products:
    by_pose, pose_2, by_twist = sums
    by_twist = by_twist + twist if pose == 0 and abs(twist) > least else 0.0
    return (by_pose + pose, pose_2 + pose * pose, by_twist) if is_zero else (0.0, 0.0, by_twist)


def _sideways(largest: float, ahead: float, turned: float, aside: float, squares: float) -> str:
    is_far = abs(aside) - abs(ahead) - abs(turned) > largest
    is_leap = aside * aside <= AT_LEAST * squares  # as a fix corrects it
    return f"it goes sideways, by {aside:.2f} m" if is_far and not is_leap else ""


def _smooth(
    left: float, sums: tuple[float, float], pose: float, twist: float
) -> tuple[float, float]:
    most = LEAPS * abs(twist)
    pose = min(max(pose, -most), most)
    return left * sums[0] + pose, left * sums[1] + pose * twist


def _summed(left: float, sums: Products, pose: float, twist: float) -> Products:
    alike, pose_2, twist_2 = sums
    return left * alike + pose * twist, left * pose_2 + pose * pose, left * twist_2 + twist * twist


def mean_twist(before: Motion, now: Motion, time: float) -> tuple[float, float]:
    """Forward speed [m/s] and yaw rate [rad/s] that lead from one pose to another in `time` [s]."""
    x, y, heading, cosine, sine, _, _ = before
    heading_change = now.heading - heading
    ahead = ((now.x - x) * (cosine + now.cosine) + (now.y - y) * (sine + now.sine)) / 2
    # the mean of the directions at both ends has the length cos(heading_change / 2), not 1
    ahead = ahead * (1 + heading_change * heading_change / 8)
    return ahead / time, heading_change / time


def _difference(pose: float, twist: float) -> float:
    """By how much two distances [m] differ, beyond what slip and scale explain [m]."""
    return abs(pose - twist) - SHARE * max(abs(pose), abs(twist))
