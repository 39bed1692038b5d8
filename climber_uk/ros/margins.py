"""Slip and tip margin of a climber (§7), on ~/margins and in diagnostics."""

from climber_uk.mechanics.adhesion import MAX_MARGIN, Alarm
from climber_uk.messages import writing
from climber_uk.messages.topics import MARGINS, private
from climber_uk.ros.running import PUBLISH_PERIOD, ClimberNode, Throttle

STATUS_LEVELS = writing.OK, writing.WARN, writing.ERROR


class Margins:
    """Publishes the lowest margins since the last message, on ~/margins and /diagnostics."""

    def __init__(self, node: ClimberNode, alarm: Alarm) -> None:
        self.node, self.alarm = node, alarm
        margins = writing.vector((0.0, 0.0, 0.0), 0, node.names.base_frame)
        self.topic = node.output(private(MARGINS[0]), margins, writing.VECTOR)
        self.is_due = Throttle(PUBLISH_PERIOD)
        self.last = self.lowest = self.unpublished = MAX_MARGIN, MAX_MARGIN  # slip, tip
        self.level = 0  # of the alarm, as published last

    def take(self, slip: float, tip: float, load: float, stamp: int) -> None:
        """Add slip and tip margin, and the wheels' load [N], of a time `stamp` [ns]."""
        self.last = slip, tip
        self.lowest = min(slip, self.lowest[0]), min(tip, self.lowest[1])
        self.unpublished = min(slip, self.unpublished[0]), min(tip, self.unpublished[1])
        if self.is_due(stamp):
            self.topic.publish(stamp, *self.unpublished, load)
            self.unpublished = MAX_MARGIN, MAX_MARGIN
        if self.alarm.level(min(self.last)) > self.level:
            self.node.diagnose()

    def diagnose(self) -> None:
        """Publish a status of the lowest margins since the last one."""
        slip, tip = self.lowest
        self.level, self.lowest = self.alarm.level(min(slip, tip)), self.last
        down_to = f"slip margin down to {slip:.2f}, tip margin to {tip:.2f}"
        said = f"{down_to}; below 1 it slips, or tips over"
        values = {"slip margin": slip, "tip margin": tip}
        self.node.publish_status("margins", STATUS_LEVELS[self.level], said, values)
