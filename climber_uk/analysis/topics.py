"""Which topics of a bag are a climber's."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

ODOMETRY, REFERENCE, TORQUES = "odom", "reference", "wheel_torques"
REFERENCE_TIME = "reference_time"  # where on the reference the climber was
TRUTH = "ground_truth"  # of a simulation, or of what watches from outside
JOINTS, PRESSURE, PARAMETERS = "joint_states", "suction_pressure", "uk_torque_controller/parameters"
FORCE = "uk_torque_controller/constraint_force"
MARGINS = "plant_simulator/margins", "uk_torque_controller/margins"  # the plant knows better
DIAGNOSTICS, LOG = "/diagnostics", "/rosout"
NAMES = (
    *(ODOMETRY, TRUTH, REFERENCE, REFERENCE_TIME, TORQUES, JOINTS, PRESSURE, PARAMETERS, FORCE),
    *MARGINS,
)
CLOCK = "/clock"
TYPES = {
    **dict.fromkeys((ODOMETRY, TRUTH), "nav_msgs/msg/Odometry"),
    **dict.fromkeys((TORQUES, JOINTS), "sensor_msgs/msg/JointState"),
    REFERENCE: "trajectory_msgs/msg/MultiDOFJointTrajectory",
    PRESSURE: "sensor_msgs/msg/FluidPressure",
    PARAMETERS: "rcl_interfaces/msg/ParameterEvent",
    CLOCK: "rosgraph_msgs/msg/Clock",
    DIAGNOSTICS: "diagnostic_msgs/msg/DiagnosticArray",
}  # of those that are read message by message
KNOWN = {*NAMES, DIAGNOSTICS, LOG}
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


def types_of(topics: Iterable[str]) -> dict[str, str]:
    """Type that each of some topics should have, by their full names, which end in ours."""
    return {
        topic: of
        for topic in topics
        for name, of in TYPES.items()
        if f"/{topic}".endswith(f"/{name.lstrip('/')}")
    }
