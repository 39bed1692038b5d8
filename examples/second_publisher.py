"""Shows that anybody can take the wheels: run it beside nodes that drive a simulated climber.

For two seconds it publishes torques that turn the climber on `wheel_torques`, beside those of the
controller, and counts which the wheels obeyed, by `joint_states`. docs/security.md: what helps.
"""

import sys
import time
from collections.abc import Iterator

import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

THEIRS = (-0.61, 0.61)  # [N m] left, right: of no controller
PERIOD, DURATION, PATIENCE = 0.002, 2.0, 20.0  # [s]


class SecondPublisher(Node):
    """Publishes torques, and counts the wheels' that are its own."""

    def __init__(self) -> None:
        super().__init__("second_publisher")
        self.torques = self.create_publisher(JointState, "wheel_torques", 10)
        self.names: list[str] = []
        self.told = self.obeyed = 0
        self.create_subscription(JointState, "joint_states", self.look, qos_profile_sensor_data)

    @property
    def is_simulated(self) -> bool:
        """Whether there are wheels, and they are a simulator's."""
        return self.told > 0 and "plant_simulator" in self.get_node_names()

    def spin(self, duration: float) -> Iterator[None]:
        """Take messages for a while [s]."""
        begin = time.monotonic()
        while time.monotonic() < begin + duration:
            rclpy.spin_once(self, timeout_sec=0.1)
            yield

    def look(self, wheels: JointState) -> None:
        """Count whose torques act."""
        self.names = list(wheels.name)
        self.told += 1
        self.obeyed += (wheels.effort[0], wheels.effort[-1]) == THEIRS

    def publish(self) -> None:
        """Publish torques for the wheels of each side, once their names are known."""
        half = len(self.names) // 2
        efforts = [THEIRS[0]] * half + [THEIRS[1]] * half
        self.torques.publish(JointState(name=self.names, effort=efforts))


def main() -> None:
    """Take the wheels for a while, of a simulated climber only, and tell how that went."""
    rclpy.init()
    node = SecondPublisher()
    if not any(node.is_simulated for _ in node.spin(PATIENCE)):
        sys.exit("second_publisher: no plant_simulator here: a robot it would drive off")
    node.create_timer(PERIOD, node.publish)
    node.told = node.obeyed = 0
    for _ in node.spin(DURATION):
        pass
    print(f"the wheels obeyed a stranger in {node.obeyed} of {node.told} periods", flush=True)


if __name__ == "__main__":
    main()
