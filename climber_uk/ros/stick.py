"""A stick's speeds, as messages of either kind."""

from collections.abc import Callable

from geometry_msgs.msg import Twist, TwistStamped

from climber_uk.messages.topics import STICK
from climber_uk.ros.running import ClimberNode


def listen_to_stick(node: ClimberNode, kind: str, take: Callable[[float, float], None]) -> None:
    """Have `take` called with speed [m/s] and yaw rate [rad/s]; `kind`: twist or twist_stamped.

    A message counts from when it comes: its stamp may be of another computer's clock.
    """

    def on_twist(message: Twist) -> None:
        take(float(message.linear.x), float(message.angular.z))

    if kind == "twist":
        node.subscription(Twist, STICK, on_twist)
    elif kind == "twist_stamped":
        node.subscription(TwistStamped, STICK, lambda message: on_twist(message.twist))
