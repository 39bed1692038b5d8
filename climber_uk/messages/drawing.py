"""Markers that draw a climber, in the wall's frame.

    p = (x, y) + R(θ) (forward, left)        z is off the wall, 0 at the centre of mass

A viewer removes each after `LIFETIME` unless it is drawn again.
"""

import math
from collections.abc import Iterable, Sequence

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point, Vector3
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from climber_uk.mechanics import Array
from climber_uk.messages import writing

Colour = tuple[float, float, float, float]  # red, green, blue, opacity, each from 0 to 1
Place = tuple[float, float, float]  # [m]
LIFETIME = Duration(sec=1)
WALL, OVER_PLATE, AXLE = -0.04, -0.03, -0.023  # [m]
DARK = (0.1, 0.1, 0.1, 1.0)
# outline of a climber that points forward, in half tracks
OUTLINE = (-0.6, -1.2), (0.6, -1.2), (0.9, 0.0), (0.6, 1.2), (-0.6, 1.2), (-0.6, -1.2)


def colour_of(margin: float) -> Colour:
    """Colour of a margin: red up to 1, below which it slips; yellow at 2; green from 3 on."""
    ample = min(max(0.0, (margin - 1) / 2), 1.0)
    return min(2 - 2 * ample, 1.0), min(2 * ample, 1.0), 0.0, 1.0


def place(pose: Array, forward: float, left: float, off_wall: float) -> Place:
    """Point (x, y, z) [m] that is `forward` and `left` [m] of a climber at `pose` (3,)."""
    x, y, heading = pose.tolist()
    cosine, sine = math.cos(heading), math.sin(heading)
    return x + forward * cosine - left * sine, y + forward * sine + left * cosine, off_wall


class Drawing:
    """Markers at one `stamp` [ns] in `frame`; names of groups begin with `prefix`."""

    def __init__(self, stamp: int, frame: str, prefix: str = "") -> None:
        self.stamp, self.frame, self.prefix = writing.time(stamp), frame, prefix
        self.array = MarkerArray()

    def add(self, group: str, kind: int, size: Place, colour: Colour) -> Marker:
        """Add a marker to a group, at the origin, and return it; `size` [m]."""
        name = self.prefix + group
        number = sum(marker.ns == name for marker in self.array.markers)
        marker = Marker(ns=name, id=number, type=kind, lifetime=LIFETIME)
        marker.header.stamp, marker.header.frame_id = self.stamp, self.frame
        marker.scale = Vector3(x=size[0], y=size[1], z=size[2])
        red, green, blue, opacity = colour
        marker.color = ColorRGBA(r=red, g=green, b=blue, a=opacity)
        self.array.markers.append(marker)
        return marker

    def climber(
        self, group: str, pose: Array, half_track: float, wheel_radius: float, colour: Colour
    ) -> None:
        """Draw a climber at `pose` (3,): a plate, with a front and two wheels."""
        plate, front = (1.2 * half_track, 2.4 * half_track, 0.01), (0.04, half_track, 0.06)
        wheel = 2 * wheel_radius, 0.02, 2 * wheel_radius
        self.box(group, pose, (0.0, 0.0, WALL), plate, colour)
        self.box(group, pose, (0.4 * half_track, 0.0, 0.0), front, DARK)
        for left in (half_track, -half_track):
            self.box(group, pose, (0.0, left, AXLE), wheel, DARK)

    def outline(self, group: str, pose: Array, half_track: float, colour: Colour) -> None:
        """Draw the outline of a climber at `pose` (3,), with a tip at its front."""
        corners = [(half_track * forward, half_track * left) for forward, left in OUTLINE]
        self.line(group, [place(pose, *corner, OVER_PLATE) for corner in corners], colour)

    def box(self, group: str, pose: Array, centre: Place, size: Place, colour: Colour) -> None:
        """Draw a box of `size` at `centre`, both in the frame of a climber at `pose` (3,) [m]."""
        marker = self.add(group, Marker.CUBE, size, colour)
        marker.pose.position = point(place(pose, *centre))
        marker.pose.orientation = writing.quaternion(float(pose[2]))

    def arrow(
        self, group: str, pose: Array, start: Place, vector: Sequence[float], colour: Colour
    ) -> None:
        """Draw an arrow on a climber at `pose` (3,), `vector` (forward, left) [m] long."""
        end = start[0] + vector[0], start[1] + vector[1], start[2]
        marker = self.add(group, Marker.ARROW, (0.03, 0.07, 0.0), colour)
        marker.points = [point(place(pose, *start)), point(place(pose, *end))]

    def line(self, group: str, places: Iterable[Place], colour: Colour) -> None:
        """Draw a line through points (x, y, z) [m]."""
        marker = self.add(group, Marker.LINE_STRIP, (0.02, 0.0, 0.0), colour)
        marker.points = [point(place) for place in places]


def point(place: Place) -> Point:
    """Message of a point (x, y, z) [m]."""
    return Point(x=place[0], y=place[1], z=place[2])
