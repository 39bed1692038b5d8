"""How near a climber is to slipping and tipping, on ~/margins and in diagnostics."""

from geometry_msgs.msg import Vector3Stamped

from climber_uk.mechanics.contact import AMPLE, Alarm
from climber_uk.messages import writing
from climber_uk.nodes.running import ClimberNode

LEVELS = writing.OK, writing.WARN, writing.ERROR


class Margins:
    """Tells every margin, and in diagnostics the lowest ones since the last time."""

    def __init__(self, node: ClimberNode, alarm: Alarm) -> None:
        self.node, self.alarm = node, alarm
        self.publisher = node.publisher(Vector3Stamped, "~/margins")
        self.last = self.lowest = AMPLE, AMPLE  # slip, tip
        self.told = 0  # level of alarm

    def publish(self, slip: float, tip: float, load: float, stamp: int) -> None:
        """Publish slip margin, tip margin and the wheels' load [N]; diagnose if they worsen."""
        frame = self.node.names.base_frame
        self.publisher.publish(writing.vector((slip, tip, load), stamp, frame))
        self.last = slip, tip
        self.lowest = min(slip, self.lowest[0]), min(tip, self.lowest[1])
        if self.alarm.level(min(self.last)) > self.told:
            self.node.diagnose()

    def diagnose(self) -> None:
        """Publish the lowest margins since the last time."""
        slip, tip = self.lowest
        self.told, self.lowest = self.alarm.level(min(slip, tip)), self.last
        said = f"lowest: slip margin {slip:.2f}, tip margin {tip:.2f}"
        values = {"slip margin": slip, "tip margin": tip}
        self.node.publish_status("margins", LEVELS[self.told], said, values)
