"""Names of frames and joints in messages, as parameters."""

from dataclasses import dataclass, replace

from climber_uk.parameters.declaration import parameter


@dataclass(frozen=True)
class Names:
    """Frames and joints, as the robot's description calls them."""

    odom_frame: str = parameter("odom", "", "frame of the wall")
    base_frame: str = parameter("base_link", "", "frame of the climber's body")
    left_wheel_joint: str = parameter("left_wheel_joint", "", "joint of the left wheel")
    right_wheel_joint: str = parameter("right_wheel_joint", "", "joint of the right wheel")
    prefix_frames: bool = parameter(True, "", "put the node's namespace before both frames")

    def within(self, namespace: str) -> "Names":
        """Names that a node in `namespace` uses: with `prefix_frames`, frames begin with it."""
        prefix = namespace.strip("/") + "/"
        if not self.prefix_frames or prefix == "/":
            return self
        odom_frame, base_frame = prefix + self.odom_frame, prefix + self.base_frame
        return replace(self, odom_frame=odom_frame, base_frame=base_frame)
