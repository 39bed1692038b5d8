"""Draws a climber for RViz and Foxglove: pose and trace, reference, torques and force.

All is drawn in the wall's frame, at the pose of the odometry: no /tf is needed.
"""

from collections import deque
from collections.abc import Callable
from functools import partial
from math import dist
from typing import Any, TypeVar

from geometry_msgs.msg import Vector3Stamped, WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import MultiDOFJointTrajectory
from visualization_msgs.msg import MarkerArray

from climber_uk.mechanics import SECOND, Array
from climber_uk.messages import reading, references
from climber_uk.messages.drawing import WALL, Drawing, Place, colour_of, place
from climber_uk.messages.topics import FORCE, MARGINS, ODOMETRY, REFERENCE, TORQUES
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.ros.running import BEST_EFFORT, PUBLISH_PERIOD, RELIABLE, ClimberNode, Throttle, run

T = TypeVar("T")
TOPICS = {
    REFERENCE: MultiDOFJointTrajectory,
    TORQUES: JointState,
    FORCE: WrenchStamped,
    MARGINS[1]: Vector3Stamped,
}
AGE = SECOND  # [ns] of a message, above which it is not drawn
ABOVE = 0.05  # [m] off the wall: arrows hide nothing there, and nothing hides them
ORANGE, BLUE = (1.0, 0.6, 0.1, 1.0), (0.2, 0.6, 1.0, 1.0)
GREY, VIOLET = (0.6, 0.6, 0.6, 1.0), (0.6, 0.4, 1.0, 1.0)


@parameters
class MarkerOptions:
    """Sizes in the drawing."""

    half_track: float = parameter(
        0.3, "m", "distance d of a wheel from the centre", above=0, plausible=(0.02, 2)
    )
    wheel_radius: float = parameter(0.027, "m", "wheel radius r", above=0, plausible=(0.005, 0.5))
    torque_scale: float = parameter(0.3, "m/(N m)", "length of an arrow by its torque", above=0)
    force_scale: float = parameter(0.005, "m/N", "length of an arrow by its force", above=0)
    way_spacing: float = parameter(0.05, "m", "distance between two points of the trace", above=0)
    way_points: int = parameter(400, "", "points of the trace that are kept", above=0)


class Markers(ClimberNode):
    """Keeps the latest message of each topic; draws all at an odometry, 20 times a second."""

    def __init__(self) -> None:
        super().__init__("markers")
        self.parameters.declare(MarkerOptions)
        self.parameters.refuse_unknown()
        self.options = self.parameters.read(MarkerOptions)
        self.latest: dict[str, Any] = {}
        self.trace: deque[Place] = deque(maxlen=self.options.way_points)
        self.is_due, self.last_stamp = Throttle(PUBLISH_PERIOD), 0
        self.markers = self.publisher(MarkerArray, "markers", RELIABLE)
        self.subscription(Odometry, ODOMETRY, self.on_odometry, BEST_EFFORT)
        for topic, kind in TOPICS.items():
            self.subscription(kind, topic, partial(self.latest.__setitem__, topic), BEST_EFFORT)

    def summary(self) -> str:
        """Size of the climber that is drawn, for the log."""
        radius, half_track = self.options.wheel_radius, self.options.half_track
        return f"wheels of radius {radius:g} m, {2 * half_track:g} m apart"

    def on_odometry(self, message: Odometry) -> None:
        """Draw, if a `PUBLISH_PERIOD` has passed."""
        stamp = reading.nanoseconds(message.header.stamp)
        if not self.is_due(stamp):
            return
        odom_frame, base_frame = self.names.odom_frame, self.names.base_frame
        state = self.checked(ODOMETRY, reading.state, message, odom_frame, base_frame)
        if state is not None:
            if stamp < self.last_stamp:
                self.trace.clear()
            self.last_stamp = stamp
            self.markers.publish(self.drawing(stamp, state.pose).array)

    def read_latest(self, topic: str, stamp: int, convert: Callable[[Any], T]) -> T | None:
        """Data of a topic's latest message; None if it is more than `AGE` from `stamp` [ns]."""
        message = self.latest.get(topic)
        if message is None or abs(stamp - reading.nanoseconds(message.header.stamp)) > AGE:
            return None
        return self.checked(topic, convert, message)

    def drawing(self, stamp: int, pose: Array) -> Drawing:
        """Drawing at `stamp` [ns] of a climber at `pose` (3,)."""
        prefix = self.get_namespace().strip("/")
        drawing = Drawing(stamp, self.names.odom_frame, f"{prefix}/" if prefix else "")
        margin = self.read_latest(MARGINS[1], stamp, lambda message: float(message.vector.x))
        colour = GREY if margin is None else colour_of(margin)
        drawing.climber("climber", pose, self.options.half_track, self.options.wheel_radius, colour)
        self.draw_trace(drawing, place(pose, 0.0, 0.0, WALL))
        self.draw_reference(drawing, stamp)
        self.draw_arrows(drawing, stamp, pose)
        return drawing

    def draw_trace(self, drawing: Drawing, here: Place) -> None:
        """Draw the trace of the climber up to `here`."""
        if not self.trace or dist(here, self.trace[-1]) >= self.options.way_spacing:
            self.trace.append(here)
        drawing.line("way", [*self.trace, here], GREY)

    def draw_reference(self, drawing: Drawing, stamp: int) -> None:
        """Draw the outline of a climber at the reference's pose."""
        message, odom_frame = self.latest.get(REFERENCE), self.names.odom_frame
        if message is None:
            return
        preview = self.checked(REFERENCE, references.preview, message, odom_frame)
        desired = preview.at(stamp) if preview is not None else None
        if desired is not None:
            drawing.outline(REFERENCE, desired.pose, self.options.half_track, VIOLET)

    def draw_arrows(self, drawing: Drawing, stamp: int, pose: Array) -> None:
        """Draw torques at the wheels, and drive and lateral force at the centre."""
        names, options = self.names, self.options
        torques = self.read_latest(
            TORQUES, stamp, lambda m: reading.wheel_torques(reading.JointFields.of(m), names.wheels)
        )
        if torques is not None:
            for side, torque in zip((-1, 1), torques, strict=True):
                start = (0.0, side * options.half_track, ABOVE)
                drawing.arrow(TORQUES, pose, start, (torque * options.torque_scale, 0.0), ORANGE)
        frames = names.odom_frame, names.base_frame
        force = self.read_latest(FORCE, stamp, lambda message: reading.wrench(message, *frames))
        if force is not None:
            drive, lateral, _ = (force[0] * options.force_scale).tolist()
            drawing.arrow("constraint_force", pose, (0.0, 0.0, ABOVE), (drive, lateral), BLUE)


def main() -> None:
    """Run the node."""
    run(lambda: [Markers()], __doc__)
