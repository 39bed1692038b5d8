"""Names of frames and joints in messages, as parameters."""

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from typing import NamedTuple

from climber_uk.parameters.declaration import parameter, parameters


class WheelJoints(NamedTuple):
    """Joints of the wheels of each side, front to rear; messages have them in this order."""

    left: tuple[str, ...]
    right: tuple[str, ...]

    @property
    def all(self) -> list[str]:
        """Of both sides."""
        return [*self.left, *self.right]

    def rates(self, left: float, right: float) -> list[float]:
        """Number of each joint, where all of a side have the same."""
        return [left] * len(self.left) + [right] * len(self.right)

    def torques(self, left: float, right: float) -> list[float]:
        """Number of each joint, where those of a side share theirs evenly."""
        return self.rates(left / len(self.left), right / len(self.right))


@cache
def wheel_joints(left_joint: str, right_joint: str) -> WheelJoints:
    """Joints of two parameters; `ValueError` unless each side has one at least, and none twice."""
    sides = WheelJoints(*(_split(names) for names in (left_joint, right_joint)))
    if not (all(sides.all) and len(set(sides.all)) == len(sides.all)):
        raise ValueError(
            f"left_wheel_joint={left_joint!r} and right_wheel_joint={right_joint!r} must name each "
            "joint once"
        )
    return sides


def _split(names: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in names.split(","))


def listed(joints: Iterable[str]) -> str:
    """Joints for a message of an error."""
    *others, last = map(repr, joints)
    return f"{', '.join(others)} and {last}" if others else last


@parameters
class Names:
    """Frames and joints, as the robot's description calls them."""

    odom_frame: str = parameter("odom", "", "frame of the wall")
    base_frame: str = parameter("base_link", "", "frame of the climber's body")
    left_wheel_joint: str = parameter(
        "left_wheel_joint", "", "joint of the left wheel; of several, front to rear: a, b"
    )
    right_wheel_joint: str = parameter(
        "right_wheel_joint", "", "joint of the right wheel; of several, front to rear: a, b"
    )
    prefix_frames: bool = parameter(True, "", "put the node's namespace before both frames")

    def __post_init__(self) -> None:
        _ = self.wheels

    @property
    def wheels(self) -> WheelJoints:
        """Joints of both sides; their number is that of the wheels."""
        return wheel_joints(self.left_wheel_joint, self.right_wheel_joint)

    def within(self, namespace: str) -> "Names":
        """Names that a node in `namespace` uses: with `prefix_frames`, frames begin with it."""
        prefix = namespace.strip("/") + "/"
        if not self.prefix_frames or prefix == "/":
            return self
        odom_frame, base_frame = prefix + self.odom_frame, prefix + self.base_frame
        return replace(self, odom_frame=odom_frame, base_frame=base_frame)
