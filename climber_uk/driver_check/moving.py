"""Checks of what odometry says of a motion, whoever causes it: ∫ twist dt against the pose."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from climber_uk.driver_check import thresholds
from climber_uk.driver_check.evidence import Evidence, MotionSeen
from climber_uk.driver_check.report import Finding, failed, graded, skipped, warned
from climber_uk.mechanics import Array

DEGREES = math.degrees(1)
TINY = 1e-12  # [m] instead of nothing


@dataclass(frozen=True)
class Ways:
    """Ways over n blocks of time, by the pose and by the twist."""

    turn: Array  # (n,) [rad] of the pose
    turn_by_twist: Array  # (n,)
    on_wall: Array  # (n, 2) [m] of the pose, as x and y
    in_body: Array  # (n, 2) [m] of the pose, forward and to the left
    by_twist: Array  # (n, 2) [m], as twist has it

    @property
    def drives(self) -> bool:
        """Whether it goes anywhere, by the one or by the other."""
        return max(span(self.on_wall), span(self.by_twist)) > thresholds.MOVED


def ways(motion: MotionSeen) -> Ways:
    """Ways of a motion; twist is integrated by the trapezoidal rule."""
    steps = np.diff(motion.time)[:, None]
    gone = np.cumsum(steps * (motion.twist[1:] + motion.twist[:-1]) / 2, axis=0)
    gone = np.vstack([np.zeros((1, 3)), gone])
    block = max(1, round(thresholds.BLOCK / float(np.median(steps))))
    whole = len(gone) // block * block
    # what was not heard was not integrated
    gaps = np.append(steps > thresholds.GAP * np.median(steps), False)
    deaf: Any = gaps[:whole].reshape(-1, block).any(axis=1)
    heard = ~(deaf[1:] | deaf[:-1])
    # means over blocks, of both alike: noise averages out
    places = motion.pose[:whole].reshape(-1, block, 3).mean(axis=1)
    by_twist, by_pose = (
        np.diff(way[:whole].reshape(-1, block, 3).mean(axis=1), axis=0)
        for way in (gone, motion.pose)
    )
    middle = places[:-1, 2] + by_pose[:, 2] / 2
    cosine, sine = np.cos(middle), np.sin(middle)
    x, y = by_pose[:, 0], by_pose[:, 1]
    in_body = np.stack([x * cosine + y * sine, y * cosine - x * sine], axis=-1)
    all_ways = by_pose[:, 2], by_twist[:, 2], by_pose[:, :2], in_body, by_twist[:, :2]
    return Ways(*(way[heard] for way in all_ways))


def span(steps: Array) -> float:
    """How far steps (n,) or (n, 2) lead at most."""
    way = np.cumsum(steps, axis=0)
    return float(np.max(np.ptp(way, axis=0), initial=0.0)) if len(way) else 0.0


def telling(*ways: Array) -> Any:
    """Blocks (n,) in which one of some ways, (n,) or (n, 2), is more than noise."""
    sizes = np.max([np.linalg.norm(way.reshape(len(way), -1), axis=1) for way in ways], axis=0)
    return sizes > thresholds.TELLING * sizes.max(initial=0.0)


def ratio(one: Array, other: Array) -> float:
    """How many times `other` is `one`, by least squares over all."""
    return float(np.sum(one * other) / np.sum(other**2))


def size(ways: Array, tells: Any) -> float:
    """Size of ways over some blocks, less the noise that the other blocks show."""
    others = ways[~tells]
    noise = np.mean(others**2) * ways[tells].size if len(others) >= thresholds.FEWEST else 0.0
    return math.sqrt(max(0.0, float(np.sum(ways[tells] ** 2) - noise)))


def heading(seen: Evidence) -> Finding:
    """The heading turns as fast as the twist says, anticlockwise, in radians."""
    gone = ways(seen.motion)
    if max(span(gone.turn), span(gone.turn_by_twist)) < thresholds.TURNED:
        return skipped("it did not turn: drive it, or use --move")
    tells = telling(gone.turn, gone.turn_by_twist)
    turn, by_twist = gone.turn[tells], gone.turn_by_twist[tells]
    if np.abs(by_twist).sum() < thresholds.NOTHING * np.abs(turn).sum():
        return failed(
            "the heading turns while twist.angular.z is zero",
            "fill twist.angular.z, or set the controller's velocity_source to pose",
        )
    found = ratio(turn, by_twist)
    for wrong, said, hint in (
        (DEGREES, "the heading is in degrees", "orientation is made of the heading in radians"),
        (1 / DEGREES, "twist.angular.z is in degrees per second", "publish it in rad/s"),
        (-1.0, "heading and twist.angular.z turn opposite ways", "both are anticlockwise"),
    ):
        if abs(found / wrong - 1) < thresholds.UNIT_OFF:
            return failed(f"{said} ({found:.3g} times the twist)", hint, ratio=found)
    bounds = thresholds.RATIO_OFF, thresholds.RATIO_WRONG
    said = f"turns {found:.3f} times as fast as twist.angular.z says"
    return graded(abs(found - 1), bounds, said, "see half track and wheel radius", ratio=found)


def twist(seen: Evidence) -> Finding:
    """The speed is that of the pose, seen from the climber."""
    gone = ways(seen.motion)
    if not gone.drives:
        return skipped("it did not drive: drive it, or use --move")
    tells = telling(gone.on_wall, gone.by_twist)
    if np.abs(gone.by_twist[tells]).sum() < thresholds.NOTHING * np.abs(gone.on_wall[tells]).sum():
        return failed(
            "the pose moves while twist.linear is zero",
            "fill twist.linear.x, or set the controller's velocity_source to pose",
        )
    way = float(np.linalg.norm(gone.by_twist[tells]))
    in_body, on_wall = (size(w - gone.by_twist, tells) / way for w in (gone.in_body, gone.on_wall))
    found = ratio(gone.in_body[tells], gone.by_twist[tells])
    value = {"ratio": found, "off_in_body": in_body, "off_on_wall": on_wall}
    if on_wall < min(in_body / 2, thresholds.RATIO_WRONG) and in_body > thresholds.SAME_FRAME:
        return failed(
            f"twist.linear is in {seen.frames[0]}, not in {seen.frames[1]}",
            "publish the speed forward and to the left: (v, 0) for wheels that do not slip",
            **value,
        )
    if abs(found - 1) > thresholds.RATIO_WRONG:
        said = f"the pose moves {found:.3g} times as fast as twist.linear says"
        return failed(said, "both are in metres, x forward", **value)
    said = f"agrees with the pose, but for {in_body:.1%}"
    hint = "take pose and twist of one message from the same measurement"
    if size(gone.in_body - gone.on_wall, tells) < thresholds.SAME_FRAME * way:
        said += "; with a heading near 0 the frame cannot be told"
        return warned(said, "let it face another way", **value)
    return graded(in_body, (thresholds.RATIO_OFF, thresholds.RATIO_WRONG), said, hint, **value)


def slip(seen: Evidence) -> Finding:
    """It does not go sideways."""
    gone = ways(seen.motion)
    if not gone.drives:
        return skipped("it did not drive: drive it, or use --move")
    tells, (ahead, aside) = telling(gone.on_wall), gone.in_body.T
    share = size(aside, tells) / max(float(np.linalg.norm(ahead[tells])), TINY)
    said = f"sideways {share:.2%} of the way forward"
    hint = "pose must be that of the middle between the wheels, and they must not slide"
    return graded(share, (thresholds.SLIP, thresholds.MUCH_SLIP), said, hint, share=share)
