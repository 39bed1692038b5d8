"""Checks of a motion, whatever causes it: ∫ twist dt against the pose."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from climber_uk.driver_check import thresholds
from climber_uk.driver_check.evidence import Evidence, MotionSeen
from climber_uk.driver_check.report import Finding, failed, graded, skipped, warned
from climber_uk.mechanics import Array
from climber_uk.mechanics.quantities import across, along

DEGREES = math.degrees(1)
TINY = 1e-12  # [m] in place of 0 in a denominator


@dataclass(frozen=True)
class Displacements:
    """Displacements over n blocks of time, by the pose and by the twist."""

    yaw: Array  # (n,) [rad] of the pose
    yaw_by_twist: Array  # (n,)
    on_wall: Array  # (n, 2) [m] of the pose, as x and y
    in_body: Array  # (n, 2) [m] of the pose, forward and to the left
    by_twist: Array  # (n, 2) [m] of the twist, forward and to the left

    def straight(self, clear: Any, half_track: float) -> Any:
        """Those of the blocks `clear` (n,) in which it drives straight; all, if too few are.

        On a wall a climber whose wheels scrub sags while it turns: no fault of the driver.
        """
        ahead = np.abs(self.in_body[:, 0])
        straight = clear & (half_track * np.abs(self.yaw) < thresholds.STRAIGHT * ahead)
        return straight if straight.sum() >= thresholds.FEWEST else clear

    @property
    def drives(self) -> bool:
        """Whether the climber drives, by its pose or by its twist."""
        return max(span(self.on_wall), span(self.by_twist)) > thresholds.MOVED


def displacements(motion: MotionSeen) -> Displacements:
    """Displacements of a motion; twist is integrated by the trapezoidal rule."""
    steps = np.diff(motion.time)[:, None]
    gone = np.cumsum(steps * (motion.twist[1:] + motion.twist[:-1]) / 2, axis=0)
    gone = np.vstack([np.zeros((1, 3)), gone])
    block = max(1, round(thresholds.BLOCK / float(np.median(steps))))
    whole = len(gone) // block * block
    # blocks with lost messages are left out
    gaps = np.append(steps > thresholds.GAP * np.median(steps), False)
    deaf: Any = gaps[:whole].reshape(-1, block).any(axis=1)
    heard = ~(deaf[1:] | deaf[:-1])
    # means over blocks, of pose and twist alike: noise averages out
    places = motion.pose[:whole].reshape(-1, block, 3).mean(axis=1)
    by_twist, by_pose = (
        np.diff(way[:whole].reshape(-1, block, 3).mean(axis=1), axis=0)
        for way in (gone, motion.pose)
    )
    middle = places[:-1, 2] + by_pose[:, 2] / 2
    in_body = np.stack([along(middle, by_pose), across(middle, by_pose)], axis=-1)
    columns = by_pose[:, 2], by_twist[:, 2], by_pose[:, :2], in_body, by_twist[:, :2]
    return Displacements(*(column[heard] for column in columns))


def span(steps: Array) -> float:
    """Largest extent of a way in steps (n,) or (n, 2), along one coordinate."""
    way = np.cumsum(steps, axis=0)
    return float(np.max(np.ptp(way, axis=0), initial=0.0)) if len(way) else 0.0


def above_noise(*ways: Array) -> Any:
    """Blocks (n,) in which one of some displacements, (n,) or (n, 2), is more than noise."""
    sizes = np.max([np.linalg.norm(way.reshape(len(way), -1), axis=1) for way in ways], axis=0)
    return sizes > thresholds.TELLING * sizes.max(initial=0.0)


def ratio(measured: Array, expected: Array) -> float:
    """Factor of `measured` by `expected`, by least squares."""
    return float(np.sum(measured * expected) / np.sum(expected**2))


def size(ways: Array, clear: Any) -> float:
    """Norm of displacements over the blocks `clear`, less the noise that the others show."""
    others = ways[~clear]
    noise = np.mean(others**2) * ways[clear].size if len(others) >= thresholds.FEWEST else 0.0
    return math.sqrt(max(0.0, float(np.sum(ways[clear] ** 2) - noise)))


def heading(seen: Evidence) -> Finding:
    """The heading changes as the twist has it: anticlockwise, in radians."""
    gone = displacements(seen.motion)
    if max(span(gone.yaw), span(gone.yaw_by_twist)) < thresholds.TURNED:
        return skipped("it did not turn: drive it, or use --move")
    clear = above_noise(gone.yaw, gone.yaw_by_twist)
    yaw, by_twist = gone.yaw[clear], gone.yaw_by_twist[clear]
    if np.abs(by_twist).sum() < thresholds.NO_TWIST * np.abs(yaw).sum():
        return failed(
            "the heading turns while twist.angular.z is zero",
            "fill twist.angular.z, or set the controller's velocity_source to pose",
        )
    found = ratio(yaw, by_twist)
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
    """The speed of the twist is that of the pose, in the body's frame."""
    gone = displacements(seen.motion)
    if not gone.drives:
        return skipped("it did not drive: drive it, or use --move")
    clear = above_noise(gone.on_wall, gone.by_twist)
    clear = gone.straight(clear, seen.climber.half_track)
    if np.abs(gone.by_twist[clear]).sum() < thresholds.NO_TWIST * np.abs(gone.on_wall[clear]).sum():
        return failed(
            "the pose moves while twist.linear is zero",
            "fill twist.linear.x, or set the controller's velocity_source to pose",
        )
    way = float(np.linalg.norm(gone.by_twist[clear]))
    in_body, on_wall = (size(w - gone.by_twist, clear) / way for w in (gone.in_body, gone.on_wall))
    found = ratio(gone.in_body[clear], gone.by_twist[clear])
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
    if size(gone.in_body - gone.on_wall, clear) < thresholds.SAME_FRAME * way:
        said += "; with a heading near 0 the frame cannot be told"
        return warned(said, "let it face another way", **value)
    return graded(in_body, (thresholds.RATIO_OFF, thresholds.RATIO_WRONG), said, hint, **value)


def slip(seen: Evidence) -> Finding:
    """The climber does not move sideways."""
    gone = displacements(seen.motion)
    if not gone.drives:
        return skipped("it did not drive: drive it, or use --move")
    clear, (ahead, aside) = above_noise(gone.on_wall), gone.in_body.T
    clear = gone.straight(clear, seen.climber.half_track)
    share = size(aside, clear) / max(float(np.linalg.norm(ahead[clear])), TINY)
    said = f"sideways {share:.2%} of the way forward"
    hint = "pose must be that of the middle between the wheels, and they must not slide"
    return graded(share, (thresholds.SLIP, thresholds.MUCH_SLIP), said, hint, share=share)
