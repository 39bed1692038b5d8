"""What the controller expects of the climber: how it rolls on, and what disturbs that.

    m v̇ = F - f σ - m g_t sinθ + r_F        J ω̇ = N + r_N

(11) and (15) with a disturbance r = (r_F, r_N) [N, N m] for all that the model does not know:
other friction, mass or suction, a payload, a push.
"""

from dataclasses import dataclass
from typing import Any

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import (
    clipped,
    everywhere,
    exp,
    rotated,
    select,
    swept,
    with_sign_of,
    wrapped,
)
from climber_uk.mechanics.motion import Motion, Wrench, named
from climber_uk.mechanics.parameter import check, parameter

SLOW = 0.01  # [m/s] of a measured speed that may as well be rest
FORGETTING_TIME = 0.2  # [s] of what was learnt, once the observer is off


def rolled(climber: Climber, motion: Motion, drive: Any, turn: Any, time: float) -> Motion:
    """Motion `time` [s] later under a constant drive [N] and turn [N m], by the midpoint rule.

    Both include the disturbance. At rest friction takes whatever value holds the climber, up to f.
    """
    mass, inertia, friction, weight = climber.inertial
    x, y, heading, cosine, sine, v, omega = motion
    half, omega_1 = 0.5 * time, turn / inertia
    halfway, angle = half * (omega + 0.5 * half * omega_1), time * (omega + half * omega_1)
    c, s, heading, cosine, sine = swept(heading, cosine, sine, halfway, angle)
    push = drive - weight * s
    # sliding, friction is all of f, against the motion; at rest, as much as is pushed against it
    rubbing, slides = with_sign_of(friction, v), abs(v) > SLOW
    if not (slides is True or everywhere(slides)):
        rubbing = select(slides, rubbing, clipped(push, -friction, friction))
    v_1 = (push - rubbing) / mass
    way = time * (v + half * v_1)
    v, omega = v + time * v_1, omega + time * omega_1
    return named(Motion, (x + way * c, y + way * s, heading, cosine, sine, v, omega))


@dataclass(frozen=True, slots=True)
class Observer:
    """Learns the disturbance, and the speeds if need be, from what comes out other than expected.

    With measured speeds it is the momentum observer ṙ = K (M q̈ - what the model and r say).
    Without them it is a critically damped filter of poses (fading memory of third order, or of
    second order if K = 0). What friction holds teaches nothing: the model expects no motion.
    """

    bandwidth: float = parameter(
        100.0, "1/s", "K of the disturbance observer; 0 switches it off", at_least=0, runtime=True
    )
    velocity_source: str = parameter(
        "odometry",
        "",
        "where speeds are taken from; pose: for odometry without a twist",
        choices=("odometry", "pose"),
    )
    pose_bandwidth: float = parameter(
        60.0, "1/s", "of the filter that takes speeds from poses", above=0, runtime=True
    )

    def __post_init__(self) -> None:
        check(self)

    def corrected(
        self, climber: Climber, disturbance: Wrench, expected: Motion, found: Motion, time: float
    ) -> tuple[Motion, Wrench]:
        """Motion and disturbance after `time` [s] in which `expected` became `found`."""
        if self.velocity_source == "pose":
            return self._from_pose(climber, disturbance, expected, found, time)
        if everywhere(self.bandwidth == 0):
            return found, _faded(disturbance, time)
        share = (1.0 - exp(-self.bandwidth * time)) / time
        faster, turning = found.speed - expected.speed, found.yaw_rate - expected.yaw_rate
        return found, _more(climber, disturbance, share * faster, share * turning)

    def _from_pose(
        self, climber: Climber, disturbance: Wrench, expected: Motion, found: Motion, time: float
    ) -> tuple[Motion, Wrench]:
        x, y, heading, cosine, sine, v, omega = expected
        ahead = (found.x - x) * cosine + (found.y - y) * sine
        beside = (found.y - y) * cosine - (found.x - x) * sine
        turned = wrapped(found.heading - heading)

        memory = exp(-self.pose_bandwidth * time)
        new = 1 - memory
        if everywhere(self.bandwidth > 0):
            g, h, k = 1 - memory**3, 1.5 * (1 - memory**2) * new, new**3
        else:
            g, h, k = 1 - memory**2, new**2, 0.0
            disturbance = _faded(disturbance, time)
        x, y = x + g * (ahead * cosine - beside * sine), y + g * (ahead * sine + beside * cosine)
        v, omega = v + h / time * ahead, omega + h / time * turned
        motion = Motion(x, y, *rotated(heading, cosine, sine, g * turned), v, omega)
        return motion, _more(climber, disturbance, k / time**2 * ahead, k / time**2 * turned)


def _more(climber: Climber, disturbance: Wrench, v_1: Any, omega_1: Any) -> Wrench:
    r_drive, r_turn = disturbance
    mass, inertia, _, _ = climber.inertial
    return named(Wrench, (r_drive + mass * v_1, r_turn + inertia * omega_1))


def _faded(disturbance: Wrench, time: float) -> Wrench:
    r_drive, r_turn = disturbance
    left = exp(-time / FORGETTING_TIME)
    return Wrench(r_drive * left, r_turn * left)
