"""The places of a nav_msgs/Path, serialised or not; no ROS needed.

rclpy takes seconds for 50 000 poses, in which no other message is heard.
"""

import math
import struct
from typing import TYPE_CHECKING

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.messages.reading import LARGEST, check_frame

if TYPE_CHECKING:
    from nav_msgs.msg import Path

MOST_POSES = 50_000
FLAT = 0.1  # [m] by which z may differ: the wall's x and y are along it
HEAD = 4  # [bytes] of the encapsulation, before which nothing is aligned
STAMP, POSE = 8, 56  # [bytes] of a stamp, and of position and orientation


def path_points(data: bytes, odom_frame: str) -> Array:
    """Places (n, 2) [m] of a path's poses, all in `odom_frame`; orientations are not read.

    Raises `ValueError` naming the pose, counted from 1, and what is wrong with it.
    """
    try:
        frame, number, at = _header(data)
        _check(frame, number, odom_frame)
        return _places(data, number, at, odom_frame)
    except (struct.error, UnicodeDecodeError, IndexError):
        raise ValueError("not a serialised Path") from None


def message_points(message: "Path", odom_frame: str) -> Array:
    """The same of a message."""
    _check(message.header.frame_id, len(message.poses), odom_frame)
    places = []
    for i, stamped in enumerate(message.poses, start=1):
        frame, place = stamped.header.frame_id, stamped.pose.position
        if frame and frame != odom_frame:
            raise _wrong_frame(i, frame, odom_frame)
        places.append(_checked(i, place.x, place.y, place.z))
    return _on_the_wall(places)


def _check(frame: str, number: int, odom_frame: str) -> None:
    check_frame(frame, odom_frame)
    if not 2 <= number <= MOST_POSES:
        raise ValueError(f"{number} pose(s), want 2 to {MOST_POSES}")


def _wrong_frame(i: int, frame: str, odom_frame: str) -> ValueError:
    return ValueError(f"pose {i}: frame_id={frame!r} must be {odom_frame!r}")


def _checked(i: int, x: float, y: float, z: float) -> tuple[float, float, float]:
    if not (math.isfinite(x) and math.isfinite(y) and math.isfinite(z)):
        raise ValueError(f"pose {i} at ({x:g}, {y:g}, {z:g}) is not finite")
    if max(abs(x), abs(y)) > LARGEST:
        raise ValueError(f"pose {i} at ({x:g}, {y:g}) must be within {LARGEST:g} m")
    return x, y, z


def _on_the_wall(places: list[tuple[float, float, float]]) -> Array:
    x_y_z = np.array(places)
    off = np.abs(x_y_z[:, 2] - x_y_z[0, 2])
    if off.max() > FLAT:
        i = int(off.argmax())
        raise ValueError(
            f"pose {i + 1} has z={x_y_z[i, 2]:g}, pose 1 z={x_y_z[0, 2]:g} m: a path is along the "
            "wall, in x and y"
        )
    return x_y_z[:, :2]


def _header(data: bytes) -> tuple[str, int, int]:
    """Frame of a path, number of its poses, and where they begin."""
    order = _order(data)
    at = HEAD + STAMP
    (size,) = struct.unpack_from(order + "I", data, at)
    frame = _text(data, at + 4, size)
    at = _aligned(at + 4 + size, 4)
    (number,) = struct.unpack_from(order + "I", data, at)
    return frame, number, at + 4


def _places(data: bytes, number: int, at: int, odom_frame: str) -> Array:
    size_of = struct.Struct(_order(data) + "I").unpack_from
    place_of = struct.Struct(_order(data) + "3d").unpack_from
    own = odom_frame.encode() + b"\0"
    places = []
    for i in range(1, number + 1):
        at = _aligned(at, 4) + STAMP
        (size,) = size_of(data, at)
        at += 4
        if size > 1 and data[at : at + size] != own:
            raise _wrong_frame(i, _text(data, at, size), odom_frame)
        at = _aligned(at + size, 8)
        places.append(_checked(i, *place_of(data, at)))
        at += POSE
    if at > len(data):
        raise struct.error
    return _on_the_wall(places)


def _order(data: bytes) -> str:
    return "<" if data[1] & 1 else ">"


def _text(data: bytes, at: int, size: int) -> str:
    return data[at : at + max(size - 1, 0)].decode()


def _aligned(at: int, size: int) -> int:
    return at + (HEAD - at) % size
