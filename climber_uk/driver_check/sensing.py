"""Checks of what `wall_odometry` makes odometry of: an IMU, and fixes; by the odometry there is.

Where that is made of the same IMU, gravity agrees with it by itself: then the wheels and the fixes
are what tells (docs/check_driver.md).
"""

import math
from itertools import permutations, product

import numpy as np

from climber_uk.driver_check import thresholds
from climber_uk.driver_check.evidence import Evidence, MotionSeen, SensorStamps, Times
from climber_uk.driver_check.report import Finding, failed, graded, passed, skipped, warned
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import DEGREE, GRAVITY

AXES = "x", "y", "z"
# signed permutations of axes, (48, 3, 3): those that change least come first
TURNS = sorted(
    (
        np.diag(signs)[list(order)]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ),
    key=lambda turn: (-np.count_nonzero(np.diag(turn)), -np.trace(turn)),
)


def imu(seen: Evidence) -> Finding:
    """Stamps, frame and units of the IMU."""
    sensor = seen.imu
    if not len(sensor.stamp):
        return skipped("nothing comes on imu")
    if trouble := stamp_trouble(sensor, seen.graph.has_clock):
        return failed(trouble, "stamp each sample with the time of its measuring, by the ROS clock")
    if wrong := set(sensor.frames) - {seen.frames[1]}:
        hint = "fill header.frame_id, or set imu_frame and imu_yaw of wall_odometry"
        return warned(f"in {min(wrong)!r}, not in {seen.frames[1]!r}", hint)
    if not np.isfinite(sensor.values).all():
        return failed("not finite", "do not publish what was not measured")
    force = float(np.median(np.linalg.norm(sensor.values[:, 3:], axis=1)))
    value = {"force": force}
    if near(force, 1.0):
        return failed("accelerations are in g", "publish them in m/s²", **value)
    if force < thresholds.NO_GRAVITY:
        hint = "publish specific force, with gravity in it, as sensor_msgs/Imu says"
        return failed(f"{force:.2g} m/s² without gravity", hint, **value)
    if not near(force, GRAVITY):
        hint = "publish m/s²: at rest they are 9.81 in all"
        return failed(f"{force:.3g} m/s² of gravity's 9.81", hint, **value)
    return passed(f"{len(sensor.stamp)} samples, {force:.2f} m/s²", **value)


def gravity(seen: Evidence) -> Finding:
    """The specific force is gravity's, in the climber's axes."""
    if not len(seen.imu.stamp):
        return skipped("nothing comes on imu")
    motion, inclination = seen.motion, seen.climber.inclination * DEGREE
    heading = at(motion, motion.pose[:, 2], seen.imu.stamp)
    pull, off_wall = GRAVITY * math.sin(inclination), GRAVITY * math.cos(inclination)
    expected = np.stack(
        [pull * np.sin(heading), pull * np.cos(heading), np.full(len(heading), off_wall)], axis=1
    )
    force = seen.imu.values[:, 3:]
    if not np.linalg.norm(force, axis=1).min() > 0.0:  # nan, too
        hint = "publish specific force, with gravity in it, as sensor_msgs/Imu says"
        return failed("some samples are without gravity", hint)
    off = [angle_between(force @ turn.T, expected) for turn in TURNS]
    angle = off[0] / DEGREE
    if angle > thresholds.TILTED[1]:
        fits = np.array(off) < thresholds.TILTED[1] * DEGREE
        best = TURNS[int(np.argmax(fits))]
        if fits[[np.array_equal(turn, -np.eye(3)) for turn in TURNS]].any():
            hint = "at rest an accelerometer tells what holds it: 9.81 m/s² upwards"
            return failed("gravity has the wrong sign", hint, angle=angle)
        if not np.array_equal(best, np.eye(3)):
            axes = ", ".join(
                f"{AXES[i]} is its {'-' * int(row.sum() < 0)}{AXES[int(np.abs(row).argmax())]}"
                for i, row in enumerate(best)
                if row[i] != 1
            )
            hint = "turn its axes: x forward, y left, z off the wall; or set imu_yaw"
            return failed(f"gravity is {angle:.0f}° off; fits if {axes}", hint, angle=angle)
    said = f"gravity is {angle:.1f}° off what heading and inclination say"
    hint = "set imu_yaw or inclination, or mend the heading of odometry"
    return graded(angle, thresholds.TILTED, said, hint, angle=angle)


def gyro(seen: Evidence) -> Finding:
    """The yaw rate is about z, anticlockwise, in rad/s."""
    if not len(seen.imu.stamp):
        return skipped("nothing comes on imu")
    motion = seen.motion
    if np.ptp(motion.pose[:, 2]) < thresholds.TURNED_ENOUGH:
        return skipped("it did not turn")
    rate = at(motion, motion.twist[:, 2], seen.imu.stamp)
    slopes = rate @ seen.imu.values[:, :3] / float(rate @ rate)
    about_z, largest = float(slopes[2]), int(np.abs(slopes).argmax())
    value = {"ratio": about_z}
    if largest < 2 and abs(about_z) < thresholds.RATIO_WRONG:
        hint = "turn its axes: angular_velocity.z is about z off the wall"
        return failed(f"turns about its {AXES[largest]}", hint, **value)
    if near(about_z, 180 / math.pi):
        return failed("in degrees per second", "publish rad/s", **value)
    if about_z < 0:
        hint = "z has to point off the wall, and turns are anticlockwise"
        return failed("turns the opposite way", hint, **value)
    bounds = thresholds.RATIO_OFF, thresholds.RATIO_WRONG
    said = f"turns {about_z:.3f} times as fast as odometry"
    return graded(abs(about_z - 1), bounds, said, "mend the gyro's scale", **value)


def fixes(seen: Evidence) -> Finding:
    """Fixes: stamps, frame, variances, unit and axes."""
    sensor = seen.fixes
    if not len(sensor.stamp):
        return skipped("nothing comes on pose")
    if trouble := stamp_trouble(sensor, seen.graph.has_clock):
        return failed(trouble, "stamp each fix with the time of its measuring, by the ROS clock")
    place, variances = sensor.values[:, :2], sensor.values[:, 2:]
    if not np.isfinite(sensor.values).all() or not (variances > 0).all():
        return failed("variances of x, y or yaw are not > 0", "tell how good a fix is; 1e4: not")
    if wrong := set(sensor.frames) - {seen.frames[0]}:
        hint = "fill header.frame_id, or set pose_frame of wall_odometry, and where that is"
        return warned(f"in {min(wrong)!r}, not in {seen.frames[0]!r}", hint)
    motion = seen.motion
    true = np.stack([at(motion, motion.pose[:, i], sensor.stamp) for i in (0, 1)], axis=1)
    noise = math.sqrt(float(np.median(variances[:, :2])))
    said = f"{len(place)} fixes of {1e3 * noise:.0f} mm"
    if np.hypot(*np.ptp(true, axis=0)) < max(thresholds.FIXED_WAY, 5 * noise):
        return passed(f"{said}; axes are told once it drives", noise=noise)
    return fixed_axes(place, true, said)


def fixed_axes(place: Array, true: Array, said: str) -> Finding:
    """Finding on how places (n, 2) lie beside true ones: as they are, turned, mirrored, in cm."""
    told, known = ((p - p.mean(axis=0)) @ (1, 1j) for p in (place, true))
    fits = [(told @ np.conj(seen), seen) for seen in (known, np.conj(known))]
    scales = [product / float(np.vdot(seen, seen).real) for product, seen in fits]
    off = [
        float(np.linalg.norm(told - a * seen)) for a, (_, seen) in zip(scales, fits, strict=True)
    ]
    scale = scales[0]
    if off[1] < thresholds.MIRRORED * off[0]:
        hint = "mend the sign of x or y, or their order: y is to the left of x"
        return failed("the way of the fixes is mirrored", hint)
    size, angle = abs(scale), math.degrees(np.angle(scale))
    for unit, times in (("centimetres", 100.0), ("millimetres", 1000.0)):
        if near(size, times):
            return failed(f"fixes are in {unit}", "publish metres", ratio=size)
    if not abs(size - 1) < thresholds.RATIO_WRONG:
        return failed(f"go {size:.3g} times as far as odometry", "publish metres", ratio=size)
    bounds = thresholds.TILTED
    hint = "set pose_frame_yaw, or mend the heading of odometry"
    return graded(abs(angle), bounds, f"{said}, turned by {angle:.1f}°", hint, angle=angle)


def stamp_trouble(sensor: SensorStamps, may_repeat: bool) -> str:
    """What is wrong with the stamps, or ''; in lock-step an unanswered message comes again."""
    if (sensor.stamp == 0).any():
        return "stamps are zero"
    if (np.diff(sensor.stamp) < (0 if may_repeat else 1)).any():
        return "stamps go back, or are the same twice"
    age = float(np.median(sensor.came - sensor.stamp)) / SECOND
    if not -thresholds.SENSOR_AHEAD < age < thresholds.SENSOR_LATE:
        return f"stamps are {abs(age):.3g} s {'behind' if age > 0 else 'ahead of'} the clock"
    return ""


def near(value: float, wanted: float) -> bool:
    """Whether a value is what is wanted, but for `UNIT_OFF` of it."""
    return abs(value / wanted - 1) < thresholds.UNIT_OFF


def at(motion: MotionSeen, values: Array, stamps: Times) -> Array:
    """Values (n,) of odometry at other stamps."""
    since = (stamps - motion.stamp[0]) / SECOND
    return np.interp(since, motion.time, values)


def angle_between(vectors: Array, others: Array) -> float:
    """Median angle [rad] between vectors (n, 3) and others."""
    dots = (vectors * others).sum(axis=1)
    sizes = np.linalg.norm(vectors, axis=1) * np.linalg.norm(others, axis=1)
    return float(np.median(np.arccos(np.clip(dots / sizes, -1, 1))))
