"""Which topics of a bag belong to which climber."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from climber_uk.messages import topics
from climber_uk.messages.topics import ODOMETRY

NAMES = (
    *(ODOMETRY, topics.TRUTH, topics.REFERENCE, topics.REFERENCE_TIME, topics.TORQUES),
    *(topics.JOINTS, topics.PRESSURE, topics.SETPOINT),
    *(topics.PARAMETERS, topics.FORCE, *topics.MARGINS),
)
TYPES = {
    ODOMETRY: "nav_msgs/msg/Odometry",
    topics.TORQUES: "sensor_msgs/msg/JointState",
    topics.REFERENCE: "trajectory_msgs/msg/MultiDOFJointTrajectory",
    topics.PRESSURE: "sensor_msgs/msg/FluidPressure",
    topics.CLOCK: "rosgraph_msgs/msg/Clock",
}  # of those that are read message by message
REMAP_HINT = f"--remap {ODOMETRY}:=TOPIC"
KNOWN = {*NAMES, topics.DIAGNOSTICS, topics.LOG}
MOST_CLIMBERS = 100  # that are read, unless they are chosen by namespace


@dataclass(frozen=True)
class Topics:
    """Topics by the names that the nodes give them, some of them remapped."""

    remapped: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def parse(cls, rules: Sequence[str]) -> "Topics":
        """Topics by rules such as odom:=/robot/odom; raises `ValueError` naming a wrong one."""
        pairs = [rule.partition(":=") for rule in rules]
        for rule, (name, sign, other) in zip(rules, pairs, strict=True):
            if not (name and sign and other):
                raise ValueError(f"remapping {rule!r} must be FROM:=TO")
            if name not in KNOWN:
                raise ValueError(
                    f"remapping {rule!r}: {name} is none of {', '.join(sorted(KNOWN))}"
                )
        return cls({name: other for name, _, other in pairs})

    def full(self, name: str, namespace: str) -> str:
        """Full name of a topic of the climber in `namespace`."""
        name = self.remapped.get(name, name)
        return name if name.startswith("/") else f"/{namespace}/{name}".replace("//", "/")

    def namespaces(self, types: Mapping[str, str]) -> list[str]:
        """Namespaces of the climbers that have odometry, of a bag's `types` by topic.

        Raises `ValueError` if there are too many.
        """
        name = self.full(ODOMETRY, "")
        if name in types and ODOMETRY in self.remapped and self.remapped[ODOMETRY][0] == "/":
            return [""]
        found = sorted(
            topic.removesuffix(name).strip("/")
            for topic, kind in types.items()
            if kind == TYPES[ODOMETRY] and topic.endswith(name)
        )
        if len(found) > MOST_CLIMBERS:
            raise ValueError(
                f"odometry of {len(found)} climbers, more than {MOST_CLIMBERS}: choose by namespace"
            )
        return found
