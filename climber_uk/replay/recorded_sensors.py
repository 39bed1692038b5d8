"""Encoders, IMU and fixes of a bag, in the order of their stamps, as `wall_odometry` reads them."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from operator import itemgetter
from typing import Any, TypeVar

import numpy as np

from climber_uk.bags.bag import UNFIT, Bag
from climber_uk.bags.restarts import are_many, are_strays, restarts
from climber_uk.bags.topics import Topics
from climber_uk.localization.gate import Fix
from climber_uk.localization.localizer import Localizer
from climber_uk.localization.sensor_frames import SensorFrames
from climber_uk.mechanics import SECOND, Array, Stamps
from climber_uk.messages import reading, reading_sensors
from climber_uk.messages.names import Names
from climber_uk.messages.topics import IMU, JOINTS, POSE, TRUTH

Tell = Callable[[Localizer], Any]
Stamped = TypeVar("Stamped", bound=Sequence[Any])  # first of it, a stamp [ns]
TYPES = {
    IMU: "sensor_msgs/msg/Imu",
    JOINTS: "sensor_msgs/msg/JointState",
    POSE: "geometry_msgs/msg/PoseWithCovarianceStamped",
    TRUTH: "nav_msgs/msg/Odometry",
}


@dataclass
class RecordedSensors:
    """What a bag has of one climber."""

    imu: list[tuple[int, Tell]] = field(default_factory=list)  # stamp [ns], what
    encoders: list[tuple[int, Tell]] = field(default_factory=list)
    fixes: list[Fix] = field(default_factory=list)
    true: list[tuple[float, ...]] = field(default_factory=list)  # stamp [ns], x, y, heading
    counts: Counter[str] = field(default_factory=Counter)  # by topic
    refused: Counter[str] = field(default_factory=Counter)  # by topic and why

    def leave_out_strays(self) -> None:
        """Leave out messages, in the order of arrival, whose stamps are far off those around."""
        self.imu = self._sound(IMU, self.imu)
        self.encoders = self._sound(JOINTS, self.encoders)
        self.fixes = self._sound(POSE, self.fixes)
        self.true = self._sound(TRUTH, self.true)

    def _sound(self, name: str, messages: list[Stamped]) -> list[Stamped]:
        strays = are_strays(np.array([message[0] for message in messages], dtype=np.int64))
        if not strays.any() or are_many(strays):
            return messages
        self.refused[f"{name}: a stamp far off those around it"] += int(strays.sum())
        return [message for message, stray in zip(messages, strays, strict=True) if not stray]

    def tell(self, localizer: Localizer) -> None:
        """Tell a localizer all of it, in the order of the stamps; of one stamp, in that of here."""
        events = [*self.imu, *self.encoders]
        events += [(fix.stamp, partial(Localizer.on_fix, fix=fix)) for fix in self.fixes]
        for _, tell in sorted(events, key=itemgetter(0)):
            try:
                tell(localizer)
            except ValueError as error:
                self.refused[f"{JOINTS}: {error}"] += 1

    def truth(self, stamps: Stamps) -> Array:
        """True poses at stamps (n,) [ns], (n, 3); nan where none was recorded."""
        if not self.true:
            return np.full((len(stamps), 3), math.nan)
        at, x, y, heading = np.array(sorted(self.true)).T
        return np.column_stack(
            [
                np.interp(stamps, at, values, left=math.nan, right=math.nan)
                for values in (x, y, np.unwrap(heading))
            ]
        )


def read_sensors(bag: Bag, namespace: str, names: Names, frames: SensorFrames) -> RecordedSensors:
    """Sensors of the climber in `namespace`; what is unfit is counted, with the reason.

    Raises `ValueError` if there are no encoders, or none that are fit, or several runs.
    """
    found, names = RecordedSensors(), names.within(namespace)
    topics = {Topics().full(name, namespace): name for name in TYPES}
    for connection, _, _, message in bag.messages(topics):
        name = topics[connection.topic]
        if connection.msgtype != TYPES[name]:
            bag.lose(f"{connection.topic}: it is {connection.msgtype}, not {TYPES[name]}")
            continue
        found.counts[name] += 1
        try:
            _take(found, name, message, names, frames)
        except UNFIT as error:
            found.refused[f"{name}: {error}"] += 1
    if not found.counts[JOINTS]:
        topic = Topics().full(JOINTS, namespace)
        lacking = bag.lacks(topic, TYPES[JOINTS])
        raise ValueError("; ".join([f"{bag.path} has {lacking}", *bag.losses]))
    found.leave_out_strays()
    stamps = np.array([stamp for stamp, _ in found.encoders])
    if not len(stamps):
        raise ValueError(f"{bag.path}: {found.refused.most_common(1)[0][0]}")
    if again := len(restarts(stamps)):
        topic = Topics().full(JOINTS, namespace)
        runs = f"there are {again + 1} runs: want one"
        raise ValueError(f"{bag.path}: {topic}: time starts again, {runs}")
    return found


def _take(
    found: RecordedSensors, name: str, message: Any, names: Names, frames: SensorFrames
) -> None:
    if name == TRUTH:
        true = reading.motion(message, names.odom_frame, message.child_frame_id)
        found.true.append((reading_sensors.stamp_of(message), true.x, true.y, true.heading))
        return
    if name == JOINTS:
        angles = reading_sensors.wheel_angles(message, names.wheels)
        stamp = reading_sensors.stamp_of(message)
        found.encoders.append((stamp, lambda it: it.on_encoders(stamp, *angles)))
    elif name == IMU:
        sample = reading_sensors.imu(message, frames.imu_frame or names.base_frame)
        told = sample.stamp, sample.yaw_rate, *frames.force(*sample.force)
        found.imu.append((sample.stamp, lambda it: it.on_imu(*told)))
    else:
        pose = reading_sensors.pose(message, frames.pose_frame or names.odom_frame)
        found.fixes.append(frames.fix(Fix(*pose)))


def seconds(stamps: Stamps) -> Array:
    """Times (n,) [s] since the first stamp."""
    return np.asarray((stamps - stamps[0]) / SECOND, dtype=float)
