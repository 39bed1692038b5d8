"""A plain climber over a step: on a plane, Coulomb's friction on its seal, wheels that do not slip.

    v̇ = (F - f σ)/m - g_t sinθ    ω̇ = N/J    ẋ = v cosθ    ẏ = v sinθ       (11), (15), (12), (17)

Under a constant wrench θ(t) is known; the rest is Simpson's rule, of fourth order as the plant is
that integrates (30). Floats, or arrays (N,) of many climbers at once; numbers are those of `Plant`
to its own error. Within a step, friction stops a climber or gives way once, at the exact instant.
"""

from typing import Any, NamedTuple

from climber_uk.mechanics.climber import DEGREE, GRAVITY, Climber
from climber_uk.mechanics.elementary import clipped, rotated, select, sign, sin, with_sign_of
from climber_uk.mechanics.many import amended
from climber_uk.mechanics.motion import Motion, Wrench

ITERATIONS = 5  # of Newton's method to an instant within a step; each squares what is left


class Plain(NamedTuple):
    """What of a climber matters to its motion."""

    mass: Any  # [kg]
    yaw_inertia: Any  # [kg m²]
    friction: Any  # f [N]
    gravity: Any  # g_t along the wall, towards -y [m/s²]

    @classmethod
    def of(cls, climber: Climber) -> "Plain":
        """That of a climber, or of many."""
        gravity = GRAVITY * sin(climber.inclination * DEGREE)
        return cls(climber.mass, climber.yaw_inertia, climber.seal_friction, gravity)


def advanced(body: Plain, motion: Motion, wrench: Wrench, time: float) -> Motion:
    """Motion after a step of `time` [s] under a wrench, in which the seal may stick and slide."""
    direction, rests = with_sign_of(1.0, motion.speed), motion.speed == 0
    end = slid(body, motion, wrench, direction, time)
    end = amended(direction * end.speed < 0, end, _stopped, body, motion, wrench, direction, time)
    return amended(rests, end, _from_rest, body, motion, wrench, time)


def advanced_often(body: Plain, motion: Motion, wrench: Wrench, time: float, steps: int) -> Motion:
    """Motion after `steps` such steps."""
    for _ in range(steps):
        motion = advanced(body, motion, wrench, time)
    return motion


def slid(body: Plain, motion: Motion, wrench: Wrench, direction: Any, time: Any) -> Motion:
    """Motion `time` [s] later of a climber whose seal slides in `direction`, 1 or -1."""
    x, y, heading, c_0, s_0, v_0, omega = motion
    half, turning = time / 2, wrench.turn / body.yaw_inertia
    _, c_1, s_1 = rotated(heading, c_0, s_0, half * (omega + half / 2 * turning))
    heading, c_2, s_2 = rotated(heading, c_0, s_0, time * (omega + half * turning))
    free = (wrench.drive - direction * body.friction) / body.mass
    part, s_14 = time / 6, 4 * s_1
    fall = part * body.gravity
    v_1 = v_0 + half * free - fall * (1.25 * s_0 + 0.5 * s_14 - 0.25 * s_2)
    v_2 = v_0 + time * free - fall * (s_0 + s_14 + s_2)
    first, middle, last = part * v_0, 4 * part * v_1, part * v_2
    return Motion(
        x + (first * c_0 + middle * c_1 + last * c_2),
        y + (first * s_0 + middle * s_1 + last * s_2),
        heading,
        c_2,
        s_2,
        v_2,
        omega + time * turning,
    )


def _held(body: Plain, motion: Motion, wrench: Wrench, time: Any) -> Motion:
    """Motion `time` [s] later of a climber that friction holds: it may turn on the spot."""
    x, y, heading, cosine, sine, v, omega = motion
    turning = wrench.turn / body.yaw_inertia
    angle = time * (omega + time / 2 * turning)
    heading, cosine, sine = rotated(heading, cosine, sine, angle)
    return Motion(x, y, heading, cosine, sine, 0.0 * v, omega + time * turning)


def _push(body: Plain, motion: Motion, wrench: Wrench) -> Any:
    """What friction at rest is up against [N]."""
    return wrench.drive - body.mass * body.gravity * motion.sine


def _from_rest(body: Plain, motion: Motion, wrench: Wrench, time: Any) -> Motion:
    """Motion after a step, or what is left of one, that begins at rest."""
    push = _push(body, motion, wrench)
    end = _held(body, motion, wrench, time)
    later = abs(_push(body, end, wrench)) > body.friction
    end = amended(later, end, _given_way, body, motion, end, wrench, time)
    starts = abs(push) > body.friction
    return amended(starts, end, slid, body, motion, wrench, sign(push), time)


def _stopped(body: Plain, motion: Motion, wrench: Wrench, direction: Any, time: Any) -> Motion:
    """Motion after a step within which the climber comes to rest."""
    until, there = 0.0 * motion.speed, motion
    for _ in range(ITERATIONS):
        slope = (_push(body, there, wrench) - direction * body.friction) / body.mass
        until = clipped(until - there.speed / slope, 0.0, time)
        there = slid(body, motion, wrench, direction, until)
    x, y, heading, cosine, sine, v, omega = there
    there = Motion(x, y, heading, cosine, sine, 0.0 * v, omega)
    return _from_rest(body, there, wrench, time - until)


def _given_way(body: Plain, motion: Motion, end: Motion, wrench: Wrench, time: Any) -> Motion:
    """Motion after a step within which what friction holds, turning, becomes too much for it."""
    way, until, there = sign(_push(body, end, wrench)), time + 0.0 * end.x, end
    for _ in range(ITERATIONS):
        slope = -body.mass * body.gravity * there.cosine * there.yaw_rate
        over = _push(body, there, wrench) - way * body.friction
        until = clipped(until - over / select(slope == 0, float("inf"), slope), 0.0, time)
        there = _held(body, motion, wrench, until)
    return slid(body, there, wrench, way, time - until)
