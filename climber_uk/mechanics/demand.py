"""What a reference asks of the wheels of a climber that is exactly on it.

    F = m v̇ + f sgn v + m g_t sinθ     N = J θ̈     τR,L = r (F ± N/d) / 2     L = m v θ̇ + m g_t cosθ

(docs/theory.md, §2 and §4).
"""

from typing import Any, NamedTuple

import numpy as np

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import cos, sin
from climber_uk.mechanics.quantities import Torques, Wrench
from climber_uk.mechanics.reference import Reference

STANDS = 1e-4  # [m/s] below which friction holds, and asks for no torque
NO_WRENCH = Wrench(0.0, 0.0)


class Demand(NamedTuple):
    """What is asked of a climber's wheels, at one time or at many (...)."""

    torques: Torques  # [N m]
    lateral: Any  # [N] reaction of both, to the left
    across: Any  # [N] what pulls the centre of mass to the left
    direction: Any  # in which the seal slides: 1, -1, or 0 where it holds


def demanded(
    climber: Climber, friction: float, reference: Reference, learnt: Wrench = NO_WRENCH
) -> Demand:
    """Demand of a reference (...), with `friction` f [N] and a disturbance that was `learnt`."""
    speed, heading, weight = reference.speed, reference.heading, climber.weight_along_wall
    direction = np.sign(np.where(np.abs(speed) > STANDS, speed, 0.0))
    force = climber.driven_mass * reference.forward_acceleration + friction * direction
    moment = climber.driven_inertia * reference.acceleration[..., 2]
    torques = climber.torques(force + weight * sin(heading) - learnt.force, moment - learnt.moment)
    across = -weight * cos(heading)
    return Demand(torques, climber.mass * speed * reference.yaw_rate - across, across, direction)
