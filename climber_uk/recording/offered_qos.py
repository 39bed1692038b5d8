"""QoS: what publishers offer, a request that fits them all, and its form in a bag's metadata."""

from collections.abc import Sequence

from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)

from climber_uk.bags.storage import Qos

QUEUE_DEPTH = 12_000  # messages of one topic that may wait: more than localhost.xml has kept


def request_for(offers: Sequence[QoSProfile]) -> QoSProfile:
    """The strictest request that all offers can serve; a reliable one if there are none."""
    reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers)
    return QoSProfile(
        depth=QUEUE_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(
            DurabilityPolicy.TRANSIENT_LOCAL if latched and offers else DurabilityPolicy.VOLATILE
        ),
    )


def is_compatible(offer: QoSProfile, request: QoSProfile) -> bool:
    """Whether a publisher's offer can serve a subscription's request."""
    return bool(qos_check_compatible(offer, request)[0] != QoSCompatibility.ERROR)


def to_metadata(qos: QoSProfile) -> Qos:
    """Profile in the form of metadata.yaml."""

    def to_parts(duration: Duration) -> dict[str, int]:
        return dict(zip(("sec", "nsec"), divmod(duration.nanoseconds, 10**9), strict=True))

    return {
        "history": qos.history.name.lower(),
        "depth": qos.depth,
        "reliability": qos.reliability.name.lower(),
        "durability": qos.durability.name.lower(),
        "deadline": to_parts(qos.deadline),
        "lifespan": to_parts(qos.lifespan),
        "liveliness": qos.liveliness.name.lower(),
        "liveliness_lease_duration": to_parts(qos.liveliness_lease_duration),
        "avoid_ros_namespace_conventions": qos.avoid_ros_namespace_conventions,
    }
