"""References as serialised messages, read and written; apart, as not every node needs them.

A point is a row of numbers, at the paths of `POINT`.
"""

from collections.abc import Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from geometry_msgs.msg import Transform, Twist
from rclpy.serialization import serialize_message
from trajectory_msgs.msg import MultiDOFJointTrajectory, MultiDOFJointTrajectoryPoint

from climber_uk.mechanics import SECOND
from climber_uk.mechanics.preview import Preview
from climber_uk.messages import writing
from climber_uk.messages.cdr_layout import Layout
from climber_uk.messages.in_place import Layouts, serialized
from climber_uk.messages.reading import (
    STAMP,
    check_frame,
    check_size,
    check_stamp,
    heading_of,
    nanoseconds,
)

PARTS = "transforms", "velocities", "accelerations"  # of a point
TRANSFORM = "translation.x", "translation.y", *(f"rotation.{axis}" for axis in "xyzw")
TWIST = "linear.x", "linear.y", "angular.z"
SINCE = "time_from_start.sec", "time_from_start.nanosec"
POINT = (
    *(f"transforms.0.{path}" for path in TRANSFORM),
    *(f"{part}.0.{path}" for part in PARTS[1:] for path in TWIST),
    *SINCE,
)
get_transform, get_twist, get_since = (attrgetter(*paths) for paths in (TRANSFORM, TWIST, SINCE))
Row = tuple[Any, ...]  # the numbers at POINT


class PreviewReader:
    """Makes previews of serialised trajectories of one joint."""

    def __init__(self) -> None:
        self._layouts = Layouts(MultiDOFJointTrajectory, _points)

    def __call__(self, data: bytes, odom_frame: str) -> Preview:
        """Preview in `odom_frame`; `ValueError` if it is unfit."""
        contents = self._layouts.of(data)
        if contents is None:
            return preview(self._layouts.deserialized(data), odom_frame)
        frame, stamp, points = contents
        ((sec, nanosec),) = np.frombuffer(data, stamp).tolist()
        number, row, begin, stride = points
        rows = np.ndarray(number, row, data, begin, stride).tolist()
        return _preview(sec * SECOND + nanosec, frame, rows, odom_frame)


class ReferenceWriter:
    """Writes previews of a trajectory as serialised messages."""

    def __init__(self, odom_frame: str, base_frame: str) -> None:
        self.frames = odom_frame, base_frame
        self._by_number: dict[int, tuple[bytearray, Any, Any]] = {}  # bytes, stamp and points

    def __call__(self, rows: Sequence[Row], start: int) -> bytes:
        """Points of a trajectory that started at `start` [ns]."""
        if len(rows) not in self._by_number:
            self._by_number[len(rows)] = self._empty(len(rows))
        data, stamp, points = self._by_number[len(rows)]
        stamp[0] = divmod(start, SECOND)
        points[:] = rows
        return bytes(data)

    def _empty(self, number: int) -> tuple[bytearray, Any, Any]:
        point = MultiDOFJointTrajectoryPoint(
            transforms=[Transform()], velocities=[Twist()], accelerations=[Twist()]
        )
        # of many points, the first two tell where the others are
        _, layout = serialized(writing.reference([point] * min(number, 2), 0, *self.frames))
        _, stamp, (_, row, begin, (stride,)) = _points(layout)
        whole = serialize_message(writing.reference([point] * number, 0, *self.frames))
        data = bytearray(whole[: begin + (number - 1) * stride + row.itemsize])
        points = np.ndarray(number, row, data, begin, (stride,))
        return data, np.ndarray(1, stamp, data), points


def _points(layout: Layout) -> tuple[str, Any, tuple[Any, ...]]:
    """Frame, dtype of the stamp, and of the points: number, dtype, first byte and distance.

    Raises `ValueError` or `LookupError` unless all points have one of each part.
    """
    number = layout.lengths["points"]
    counts = {layout.lengths[f"points.{i}.{part}"] for i in range(number) for part in PARTS}
    places = np.array(
        [[layout.fields[f"points.{i}.{path}"][1] for path in POINT] for i in range(number)]
    )
    begin, stride = int(places[0, 0]), int(places[min(1, number - 1), 0] - places[0, 0])
    if counts != {1} or (np.diff(places, axis=0) != stride).any():
        raise ValueError("points are not laid out alike")
    formats = [layout.fields[f"points.0.{path}"][0] for path in POINT]
    row = np.dtype({"names": POINT, "formats": formats, "offsets": (places[0] - begin).tolist()})
    return layout.strings["header.frame_id"], layout.chosen(STAMP), (number, row, begin, (stride,))


def preview(message: MultiDOFJointTrajectory, odom_frame: str) -> Preview:
    """Preview of a trajectory of one joint, in `odom_frame`; `ValueError` if it is unfit."""
    rows = []
    for number, point in enumerate(message.points, start=1):
        parts = [getattr(point, part) for part in PARTS]
        if any(len(part) != 1 for part in parts):
            raise ValueError(f"point {number} must have one transform, velocity and acceleration")
        (transform,), *twists = parts
        rates = (rate for (twist,) in twists for rate in get_twist(twist))
        rows.append((*get_transform(transform), *rates, *get_since(point)))
    header = message.header
    return _preview(nanoseconds(header.stamp), header.frame_id, rows, odom_frame)


def _preview(start: int, frame: str, rows: list[Row], odom_frame: str) -> Preview:
    """Preview of points from `start` [ns] on."""
    check_frame(frame, odom_frame)
    poses = [[x, y, heading_of(*rotation)] for x, y, *rotation in (row[:6] for row in rows)]
    velocities, accelerations = [row[6:9] for row in rows], [row[9:12] for row in rows]
    check_size(pose=poses, velocity=velocities, acceleration=accelerations)
    times = [start + sec * SECOND + nanosec for sec, nanosec in (row[12:] for row in rows)]
    for time in times[:1] + times[-1:]:
        check_stamp(time)
    return Preview(
        times=np.array(times, np.int64),
        pose=np.array(poses),
        velocity=np.array(velocities),
        acceleration=np.array(accelerations),
    )
