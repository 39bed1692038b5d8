"""What the controller expects of the climber: how it rolls on, and what disturbs that.

    m v̇ = F - f σ - m g_t sinθ + r_F        J ω̇ = N + r_N

(11) and (15) with a disturbance r = (r_F, r_N) [N, N m] for all that the model does not know:
other friction, mass or suction, a payload, a push.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import (
    anywhere,
    clipped,
    everywhere,
    exp,
    rotated,
    select,
    swept,
    with_sign_of,
    wrapped,
)
from climber_uk.mechanics.motion import Motion, named
from climber_uk.mechanics.parameter import check, parameter

SLOW = 0.01  # [m/s] of a measured speed that may as well be rest
REST = 1e-3  # [m/s] of an expected speed that is none
FORGETTING_TIME = 0.2  # [s] of what was learnt, once the observer is off
MOST_LEARNT = 0.4  # of K (2 T + δ), at most


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
    way, end = time * (v + half * v_1), v + time * v_1
    stops = v * end < 0
    if anywhere(stops):  # friction ends a motion, and does not reverse it
        left = time + v / select(stops, v_1, 1.0)
        back_1 = (push - clipped(push, -friction, friction)) / mass
        way = select(stops, 0.5 * (v * (time - left) + left * left * back_1), way)
        end = select(stops, left * back_1, end)
    v, omega = end, omega + time * omega_1
    return named(Motion, (x + way * c, y + way * s, heading, cosine, sine, v, omega))


class Learnt(NamedTuple):
    """What is known of the disturbance: itself, and how it changes."""

    drive: Any = 0.0  # r_F [N]
    turn: Any = 0.0  # r_N [N m]
    drive_rate: Any = 0.0  # [N/s]
    turn_rate: Any = 0.0  # [N m/s]

    @property
    def held(self) -> "Learnt":
        """The same while nothing can be learnt."""
        return named(Learnt, (self.drive, self.turn, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class Observer:
    """Learns the disturbance, and the speeds if need be, from what comes out other than expected.

    With measured speeds it is a momentum observer of second order: a disturbance that grows
    steadily leaves no error. Both poles are at K, or lower: K (2 T + δ) <= `MOST_LEARNT`, with T
    the period and δ the delay that is known. Without measured speeds it is a critically damped
    filter of poses (fading memory of third order, or of second order if K = 0). What friction
    holds teaches nothing: the model expects no motion.
    """

    bandwidth: float = parameter(
        14.0, "1/s", "K of the disturbance observer; 0 switches it off", at_least=0, runtime=True
    )
    velocity_source: str = parameter(
        "odometry",
        "",
        "where speeds are taken from; pose: for odometry without a twist",
        choices=("odometry", "pose"),
    )
    twist: str = parameter(
        "auto",
        "",
        "speeds of odometry: those of its stamp, or means of the period before, as of encoders",
        choices=("auto", "instantaneous", "mean"),
    )
    pose_bandwidth: float = parameter(
        60.0, "1/s", "of the filter that takes speeds from poses", above=0, runtime=True
    )

    def __post_init__(self) -> None:
        check(self)

    def corrected(
        self,
        climber: Climber,
        learnt: Learnt,
        expected: Motion,
        found: Motion,
        time: float,
        shares: tuple[Any, Any],
    ) -> tuple[Motion, Learnt]:
        """Motion and disturbance after `time` [s] in which `expected` became `found`.

        `shares` are those of the observer for that time.
        """
        if self.velocity_source == "pose":
            return self._from_pose(climber, learnt, expected, found, time)
        if everywhere(self.bandwidth == 0):
            return found, _faded(learnt, time)
        drive, turn, drive_rate, turn_rate = learnt
        mass, inertia, _, _ = climber.inertial
        new, newer = shares
        faster = (found.speed - expected.speed) / time
        turning = (found.yaw_rate - expected.yaw_rate) / time
        drive, turn = drive + time * drive_rate, turn + time * turn_rate
        drive, turn = drive + new * mass * faster, turn + new * inertia * turning
        # at rest, where friction holds whatever it is, nothing tells of a change
        slides = abs(expected.speed) > REST
        drive_rate = select(slides, drive_rate + newer / time * mass * faster, 0.0)
        turn_rate = turn_rate + newer / time * inertia * turning
        return found, named(Learnt, (drive, turn, drive_rate, turn_rate))

    def shares(self, time: float, delay: float) -> tuple[Any, Any]:
        """What of an acceleration that was not expected is put down to the disturbance.

        And what of it to the disturbance's change in `time` [s]; `delay` [s] is that of torques.
        """
        most = MOST_LEARNT * time / (2.0 * time + delay)
        new = 1.0 - exp(-clipped(self.bandwidth * time, 0.0, most))
        return 2.0 * new, new * new

    def _from_pose(
        self, climber: Climber, learnt: Learnt, expected: Motion, found: Motion, time: float
    ) -> tuple[Motion, Learnt]:
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
            learnt = _faded(learnt, time)
        x, y = x + g * (ahead * cosine - beside * sine), y + g * (ahead * sine + beside * cosine)
        v, omega = v + h / time * ahead, omega + h / time * turned
        motion = Motion(x, y, *rotated(heading, cosine, sine, g * turned), v, omega)
        mass, inertia, _, _ = climber.inertial
        drive = learnt.drive + k / time**2 * mass * ahead
        return motion, Learnt(drive, learnt.turn + k / time**2 * inertia * turned)


def _faded(learnt: Learnt, time: float) -> Learnt:
    left = exp(-time / FORGETTING_TIME)
    return Learnt(learnt.drive * left, learnt.turn * left)
