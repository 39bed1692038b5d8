"""The reference of a climber: the pose it should have, with velocity, acceleration and jerk."""

from dataclasses import dataclass
from functools import cached_property

from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import ReferencePoint, across, along


@dataclass(frozen=True)
class Reference:
    """Desired pose and its derivatives at one time, or at many (...), in the wall's frame."""

    pose: Array  # (..., 3) x [m], y [m], θ [rad]
    velocity: Array  # (..., 3) ẋ [m/s], ẏ [m/s], θ̇ [rad/s]
    acceleration: Array  # (..., 3) ẍ [m/s²], ÿ [m/s²], θ̈ [rad/s²]
    jerk: Array  # (..., 2) of x and y [m/s³]

    @classmethod
    def of(cls, target: ReferencePoint) -> "Reference":
        """Reference of the same in components."""
        return cls(pack(*target[:3]), pack(*target[3:6]), pack(*target[6:9]), pack(*target[9:]))

    @cached_property
    def target(self) -> ReferencePoint:
        """The same in components: floats, or arrays (...)."""
        vectors = self.pose, self.velocity, self.acceleration, self.jerk
        return ReferencePoint(*(part for vector in vectors for part in unpack(vector)))

    @cached_property
    def heading(self) -> Array:
        """θ_d (...) [rad]."""
        return unpack(self.pose)[2]

    @cached_property
    def yaw_rate(self) -> Array:
        """ω_d (...) [rad/s]."""
        return unpack(self.velocity)[2]

    # The speed along the heading, negative in reverse gear, and its derivatives:

    @cached_property
    def speed(self) -> Array:
        """Forward speed v_d (...) [m/s]."""
        return along(self.heading, self.velocity)

    @cached_property
    def forward_acceleration(self) -> Array:
        """Forward acceleration v̇_d (...) [m/s²]."""
        return along(self.heading, self.acceleration)


def tracking_error(pose: Array, reference: Reference) -> tuple[Array, Array, Array]:
    """Errors along the track [m], across it [m] and of the heading [rad], each (...).

    Actual minus desired `pose` (..., 3), in the reference's frame: ahead and to the left are
    positive; the heading error is in [-π, π).
    """
    heading, offset = reference.heading, pose - reference.pose
    return along(heading, offset), across(heading, offset), wrapped(unpack(offset)[2])
