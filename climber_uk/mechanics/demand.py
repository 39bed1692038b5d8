"""What a reference asks of the wheels of a climber that is exactly on it.

    F = m v̇ + f sgn v + m g_t sinθ     N = J θ̈     τR,L = r (F ± N/d) / 2     L = m v θ̇ + m g_t cosθ

(docs/theory.md, §2 and §4), the weight as it pulls at this place of the wall.
"""

from typing import Any, NamedTuple

import numpy as np

from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.elementary import cos, sin
from climber_uk.mechanics.quantities import NO_WRENCH, Torques, Wrench
from climber_uk.mechanics.reference import Reference
from climber_uk.mechanics.wall import PLANE, Wall

STANDS = 1e-4  # [m/s] below which friction holds, and asks for no torque


class Demand(NamedTuple):
    """What is asked of a climber's wheels, at one time or at many (...)."""

    torques: Torques  # [N m]
    lateral: Any  # [N] reaction of both, to the left
    across: Any  # [N] what pulls the centre of mass to the left
    into_wall: Any  # [m/s²] g_n
    along_wall: Any  # [m/s²] g_t
    direction: Any  # in which the seal slides: 1, -1, or 0 where it holds


def demanded(
    climber: Climber,
    friction: Any,
    reference: Reference,
    learnt: Wrench = NO_WRENCH,
    wall: Wall = PLANE,
) -> Demand:
    """Demand of a reference (...), with `friction` f [N] and a disturbance that was `learnt`."""
    speed, cosine, sine = reference.speed, cos(reference.heading), sin(reference.heading)
    place = climber.inclination, reference.pose[..., 0], reference.pose[..., 1]
    g_x, g_y = (GRAVITY * share for share in wall.along(*place))
    pull, across = (
        climber.mass * (g_x * cosine + g_y * sine),
        climber.mass * (g_y * cosine - g_x * sine),
    )
    direction = np.sign(np.where(np.abs(speed) > STANDS, speed, 0.0))
    force = climber.driven_mass * reference.forward_acceleration + friction * direction - pull
    moment = climber.driven_inertia * reference.acceleration[..., 2]
    return Demand(
        torques=climber.torques(force - learnt.force, moment - learnt.moment),
        lateral=climber.mass * speed * reference.yaw_rate - across,
        across=across,
        into_wall=wall.into(*place, reference.velocity[..., 0], reference.velocity[..., 1]),
        along_wall=np.hypot(g_x, g_y),
        direction=direction,
    )
