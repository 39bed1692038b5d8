"""How near a climber is to slipping and tipping, on ~/margins and in diagnostics."""

from geometry_msgs.msg import Vector3Stamped

from climber_uk.mechanics.adhesion import MAX_MARGIN, Alarm
from climber_uk.messages import writing
from climber_uk.messages.topics import MARGINS, private
from climber_uk.ros.running import PUBLISH_PERIOD, ClimberNode, Throttle

LEVELS = writing.OK, writing.WARN, writing.ERROR


class Margins:
    """Tells the lowest margins since the last time, on a topic of their own and in diagnostics."""

    def __init__(self, node: ClimberNode, alarm: Alarm) -> None:
        self.node, self.alarm = node, alarm
        self.publisher = node.publisher(Vector3Stamped, private(MARGINS[0]))
        self.is_due = Throttle(PUBLISH_PERIOD)
        self.last = self.lowest = self.unpublished = MAX_MARGIN, MAX_MARGIN  # slip, tip
        self.told = 0  # level of alarm

    def take(self, slip: float, tip: float, load: float, stamp: int) -> None:
        """Take in slip margin, tip margin and the wheels' load [N]; diagnose if they worsen."""
        self.last = slip, tip
        self.lowest = min(slip, self.lowest[0]), min(tip, self.lowest[1])
        self.unpublished = min(slip, self.unpublished[0]), min(tip, self.unpublished[1])
        if self.is_due(stamp):
            frame = self.node.names.base_frame
            self.publisher.publish(writing.vector((*self.unpublished, load), stamp, frame))
            self.unpublished = MAX_MARGIN, MAX_MARGIN
        if self.alarm.level(min(self.last)) > self.told:
            self.node.diagnose()

    def diagnose(self) -> None:
        """Publish the lowest margins since the last time."""
        slip, tip = self.lowest
        self.told, self.lowest = self.alarm.level(min(slip, tip)), self.last
        said = f"lowest: slip margin {slip:.2f}, tip margin {tip:.2f}"
        values = {"slip margin": slip, "tip margin": tip}
        self.node.publish_status("margins", LEVELS[self.told], said, values)
