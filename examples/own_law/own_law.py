"""A control law of your own inside our node: a linear-quadratic regulator along the path.

docs/your-own-law.md tells how it is run in the demonstration, in wall_bench and in a campaign.
"""

from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import solve_continuous_are

from climber_uk.control.control_law import ForceLaw
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import clipped, cos, sin, tanh, wrapped
from climber_uk.mechanics.quantities import Motion, ReferencePoint, Wrench
from climber_uk.parameters.declaration import parameter, parameters


@parameters
class Lqr(ForceLaw):
    """Least ∫ Σ (error / tolerance)² + (acceleration / its tolerance)² dt about a straight line.

    Errors are those that the reference has in the climber's frame: along, across, heading, speed
    and yaw rate; the line is driven at `speed`, at which the gains are found.
    """

    place: float = parameter(0.01, "m", "tolerance along and across", above=0)
    turn: float = parameter(0.05, "rad", "tolerance of the heading", above=0)
    push: float = parameter(2.0, "m/s²", "tolerance of an acceleration", above=0)
    twist: float = parameter(8.0, "rad/s²", "tolerance of an angular acceleration", above=0)
    speed: float = parameter(0.2, "m/s", "of the line", above=0)

    @cached_property
    def gains(self) -> tuple[Any, Any]:
        """Of (along, speed), and of (across, heading, yaw rate), for the two accelerations."""
        straight = gains([[0, 1], [0, 0]], [1 / self.place, 0], self.push)
        sideways = gains(
            [[0, self.speed, 0], [0, 0, 1], [0, 0, 0]],
            [1 / self.place, 1 / self.turn, 0],
            self.twist,
        )
        return straight, sideways

    def wrench(self, climber: Climber, target: ReferencePoint, motion: Motion) -> Wrench:
        """Drive [N] and yaw moment [N m]: the regulator's accelerations, weight and friction."""
        x, y = target.x - motion.x, target.y - motion.y
        along, across = x * motion.cosine + y * motion.sine, y * motion.cosine - x * motion.sine
        speed = target.v_x * cos(target.heading) + target.v_y * sin(target.heading)
        turned = wrapped(target.heading - motion.heading)
        yaw_rate = target.yaw_rate - motion.yaw_rate
        (k_along, k_speed), (k_across, k_turned, k_rate) = self.gains
        a = k_along * along + k_speed * (speed * cos(turned) - motion.speed)
        forward = clipped(speed / self.speed, -1, 1)  # backwards, it steers the other way round
        alpha = k_across * forward * across + k_turned * turned + k_rate * yaw_rate
        mass, inertia, friction, weight = climber.inertial
        carried = weight * motion.sine + friction * tanh(speed / 0.001)
        return Wrench(mass * a + carried, inertia * alpha)


def gains(A: Any, weights: Any, tolerance: float) -> Any:
    """K = R⁻¹ Bᵀ P of ẋ = A x + B u, whose last state is the one that u changes."""
    B = np.eye(len(A))[:, -1:]
    R = np.array([[tolerance**-2]])
    P = solve_continuous_are(np.array(A, float), B, np.diag(np.square(weights)), R)
    return (B.T @ P)[0] / R[0, 0]
