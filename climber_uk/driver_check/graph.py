"""Publishers of odometry and subscriptions of torques, and whether their QoS fits."""

from rclpy.duration import Infinite
from rclpy.node import Node
from rclpy.qos import LivelinessPolicy, QoSCompatibility, QoSProfile, ReliabilityPolicy
from rclpy.qos import qos_check_compatible as compatibility
from rclpy.topic_endpoint_info import TopicEndpointInfo

from climber_uk.driver_check import listening
from climber_uk.driver_check.evidence import Endpoint, Graph
from climber_uk.messages.topics import CLOCK, ODOMETRY, TORQUES
from climber_uk.ros.running import BEST_EFFORT

# the QoS profile that the controller offers for torques
OFFERED = QoSProfile(
    depth=10,
    deadline=Infinite,
    liveliness=LivelinessPolicy.AUTOMATIC,
    liveliness_lease_duration=Infinite,
)


def graph(node: Node, topic: str) -> Graph:
    """Graph as `node` sees it now, which has subscribed `topic` as odom."""
    odometry = node.get_publishers_info_by_topic(ODOMETRY)
    commanded = node.get_subscriptions_info_by_topic(TORQUES)
    return Graph(
        topic=topic,
        odometry=[_endpoint(info, info.qos_profile, BEST_EFFORT) for info in odometry],
        commanded=[_endpoint(info, OFFERED, info.qos_profile) for info in commanded],
        elsewhere=[
            name
            for name, kinds in node.get_topic_names_and_types()
            if listening.ODOMETRY in kinds and name != topic
        ],
        has_clock=bool(node.count_publishers(CLOCK)),
    )


def others_commanding(node: Node) -> list[str]:
    """Full names of other nodes than `node` that publish torques."""
    names = map(_name, node.get_publishers_info_by_topic(TORQUES))
    return [name for name in names if name != node.get_fully_qualified_name()]


def is_known(name: str) -> bool:
    """Whether a name is a node's, not the placeholder of one that is still being discovered."""
    return "_NODE_NAME_UNKNOWN_" not in name


def _name(info: TopicEndpointInfo) -> str:
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"


def _endpoint(info: TopicEndpointInfo, offered: QoSProfile, wanted: QoSProfile) -> Endpoint:
    return Endpoint(
        node=_name(info),
        kind=info.topic_type,
        fits=compatibility(offered, wanted)[0] != QoSCompatibility.ERROR,
        reliable=info.qos_profile.reliability == ReliabilityPolicy.RELIABLE,
    )
