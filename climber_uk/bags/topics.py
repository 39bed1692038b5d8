"""Which topics of a bag are a climber's."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from climber_uk.messages import topics
from climber_uk.messages.topics import ODOMETRY

NAMES = (
    *(ODOMETRY, topics.TRUTH, topics.REFERENCE, topics.REFERENCE_TIME, topics.TORQUES),
    *(topics.JOINTS, topics.PRESSURE, topics.PARAMETERS, topics.FORCE, *topics.MARGINS),
)
TYPES = {
    ODOMETRY: "nav_msgs/msg/Odometry",
    topics.TORQUES: "sensor_msgs/msg/JointState",
    topics.REFERENCE: "trajectory_msgs/msg/MultiDOFJointTrajectory",
    topics.PRESSURE: "sensor_msgs/msg/FluidPressure",
    topics.CLOCK: "rosgraph_msgs/msg/Clock",
}  # of those that are read message by message
KNOWN = {*NAMES, topics.DIAGNOSTICS, topics.LOG}
MOST_CLIMBERS = 100  # that are told of, unless they were chosen


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

    def of(self, namespace: str) -> Iterator[tuple[str, str]]:
        """Full name, and name, of the topics of one climber."""
        for name in NAMES:
            yield self.full(name, namespace), name

    def namespaces(self, types: Mapping[str, str]) -> list[str]:
        """Those of the climbers that have odometry in a bag with topics of some types.

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
