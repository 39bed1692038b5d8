"""The places of a serialised nav_msgs/Path; no ROS needed.

rclpy takes seconds for 50 000 poses, in which no other message is heard.
"""

import math
import struct

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.messages.reading import LARGEST

MOST_POSES = 50_000
HEAD = 4  # [bytes] of the encapsulation, before which nothing is aligned
STAMP, POSE = 8, 56  # [bytes] of a stamp, and of position and orientation


def path_points(data: bytes, odom_frame: str) -> Array:
    """Places (n, 2) [m] of a path's poses, all in `odom_frame`; orientations are not read.

    Raises `ValueError` naming the pose, counted from 1, and what is wrong with it.
    """
    try:
        frame, number, at = _header(data)
        if frame != odom_frame:
            raise ValueError(f"frame_id={frame!r} must be {odom_frame!r}")
        if not 2 <= number <= MOST_POSES:
            raise ValueError(f"{number} pose(s), want 2 to {MOST_POSES}")
        return _places(data, number, at, odom_frame)
    except (struct.error, UnicodeDecodeError, IndexError):
        raise ValueError("not a serialised Path") from None


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
    place_of = struct.Struct(_order(data) + "2d").unpack_from
    own = odom_frame.encode() + b"\0"
    places = []
    for i in range(1, number + 1):
        at = _aligned(at, 4) + STAMP
        (size,) = size_of(data, at)
        at += 4
        if size > 1 and data[at : at + size] != own:
            raise ValueError(f"pose {i}: frame_id={_text(data, at, size)!r} must be {odom_frame!r}")
        at = _aligned(at + size, 8)
        x, y = place_of(data, at)
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ValueError(f"pose {i} at ({x:g}, {y:g}) is not finite")
        if max(abs(x), abs(y)) > LARGEST:
            raise ValueError(f"pose {i} at ({x:g}, {y:g}) must be within {LARGEST:g} m")
        places.append((x, y))
        at += POSE
    if at > len(data):
        raise struct.error
    return np.array(places)


def _order(data: bytes) -> str:
    return "<" if data[1] & 1 else ">"


def _text(data: bytes, at: int, size: int) -> str:
    return data[at : at + max(size - 1, 0)].decode()


def _aligned(at: int, size: int) -> int:
    return at + (HEAD - at) % size
