"""A plain climber over a step: on a plane, Coulomb's friction on its seal, wheels that do not slip.

    v̇ = (F - f σ)/m - g_t sinθ    ω̇ = N/J    ẋ = v cosθ    ẏ = v sinθ       (11), (15), (12), (17)

Under a constant wrench θ(t) is known; the rest is Simpson's rule, of fourth order as the plant is
that integrates (30). Floats, or arrays (N,) of many climbers at once; numbers are those of `Plant`
to its own error. Within a step, friction stops a climber or gives way once, at the exact instant.
"""

from typing import Any, NamedTuple

from climber_uk.mechanics.climber import DEGREE, GRAVITY, Climber
from climber_uk.mechanics.elementary import (
    clipped,
    everywhere,
    rotated,
    select,
    sign,
    sin,
    swept,
    with_sign_of,
)
from climber_uk.mechanics.many import amended, keep_what_is_freed
from climber_uk.mechanics.quantities import Motion, Wrench

ITERATIONS = 5  # of Newton's method to an instant within a step; each squares what is left


class UnicycleModel(NamedTuple):
    """What of a climber matters to its motion."""

    mass: Any  # [kg]
    yaw_inertia: Any  # [kg m²]
    friction: Any  # f [N]
    gravity: Any  # g_t along the wall, towards -y [m/s²]

    @classmethod
    def of(cls, climber: Climber) -> "UnicycleModel":
        """That of a climber, or of many."""
        gravity = GRAVITY * sin(climber.inclination * DEGREE)
        return cls(climber.mass, climber.yaw_inertia, climber.seal_friction, gravity)

    def under(self, wrench: Wrench) -> "Accelerations":
        """It, with what a wrench does to it."""
        mass, yaw_inertia, friction, gravity = self
        return Accelerations(
            wrench.force / mass, wrench.moment / yaw_inertia, friction / mass, gravity
        )


class Accelerations(NamedTuple):
    """What accelerates a climber."""

    forward: Any  # F/m [m/s²]
    yaw: Any  # ω̇ = N/J [rad/s²]
    friction: Any  # f/m [m/s²]
    gravity: Any  # g_t [m/s²]


def advanced(body: UnicycleModel, motion: Motion, wrench: Wrench, time: float) -> Motion:
    """Motion after a step of `time` [s] under a wrench, in which the seal may stick and slide."""
    return stepped(body.under(wrench), motion, time)


def advanced_often(
    body: UnicycleModel, motion: Motion, wrench: Wrench, time: float, steps: int
) -> Motion:
    """Motion after `steps` such steps."""
    keep_what_is_freed()
    pushed = body.under(wrench)
    for _ in range(steps):
        motion = stepped(pushed, motion, time)
    return motion


def stepped(pushed: Accelerations, motion: Motion, time: float) -> Motion:
    """Motion after a step of `time` [s]."""
    end = slid(pushed, motion, with_sign_of(pushed.friction, motion.speed), time)
    if everywhere(motion.speed * end.speed > 0):
        return end
    direction, rests = with_sign_of(1.0, motion.speed), motion.speed == 0
    end = amended(direction * end.speed < 0, end, _stopped, pushed, motion, direction, time)
    return amended(rests, end, _from_rest, pushed, motion, time)


def slid(pushed: Accelerations, motion: Motion, rubbing: Any, time: Any) -> Motion:
    """Motion `time` [s] later of a climber whose seal slides: friction decelerates by `rubbing`."""
    x, y, heading, c_0, s_0, v_0, omega = motion
    faster = 0.5 * time * pushed.yaw  # in half of the time
    omega_1 = omega + faster
    halfway, angle = 0.5 * time * (omega + 0.5 * faster), time * omega_1
    c_1, s_1, heading, c_2, s_2 = swept(heading, c_0, s_0, halfway, angle)
    part = time / 6
    fall = part * pushed.gravity
    v_2 = v_0 + (time * (pushed.forward - rubbing) - fall * (s_0 + 4 * s_1 + s_2))
    v_14 = 2 * (v_0 + v_2) - 3 * fall * (s_0 - s_2)  # four times the speed halfway
    return Motion(
        x + part * (v_0 * c_0 + v_14 * c_1 + v_2 * c_2),
        y + part * (v_0 * s_0 + v_14 * s_1 + v_2 * s_2),
        heading,
        c_2,
        s_2,
        v_2,
        omega_1 + faster,
    )


def _held(pushed: Accelerations, motion: Motion, time: Any) -> Motion:
    """Motion `time` [s] later of a climber that friction holds: it may turn on the spot."""
    x, y, heading, cosine, sine, v, omega = motion
    angle = time * (omega + time / 2 * pushed.yaw)
    heading, cosine, sine = rotated(heading, cosine, sine, angle)
    return Motion(x, y, heading, cosine, sine, 0.0 * v, omega + time * pushed.yaw)


def _push(pushed: Accelerations, motion: Motion) -> Any:
    """What friction at rest is up against [m/s²]."""
    return pushed.forward - pushed.gravity * motion.sine


def _from_rest(pushed: Accelerations, motion: Motion, time: Any) -> Motion:
    """Motion after a step, or what is left of one, that begins at rest."""
    push = _push(pushed, motion)
    end = _held(pushed, motion, time)
    later = abs(_push(pushed, end)) > pushed.friction
    end = amended(later, end, _given_way, pushed, motion, end, time)
    starts = abs(push) > pushed.friction
    return amended(starts, end, slid, pushed, motion, sign(push) * pushed.friction, time)


def _stopped(pushed: Accelerations, motion: Motion, direction: Any, time: Any) -> Motion:
    """Motion after a step within which the climber comes to rest."""
    until, there, rubbing = 0.0 * motion.speed, motion, direction * pushed.friction
    for _ in range(ITERATIONS):
        slope = _push(pushed, there) - rubbing
        until = clipped(until - there.speed / slope, 0.0, time)
        there = slid(pushed, motion, rubbing, until)
    x, y, heading, cosine, sine, v, omega = there
    there = Motion(x, y, heading, cosine, sine, 0.0 * v, omega)
    return _from_rest(pushed, there, time - until)


def _given_way(pushed: Accelerations, motion: Motion, end: Motion, time: Any) -> Motion:
    """Motion after a step within which what friction holds, turning, becomes too much for it."""
    way, until, there = sign(_push(pushed, end)), time + 0.0 * end.x, end
    rubbing = way * pushed.friction
    for _ in range(ITERATIONS):
        slope = -pushed.gravity * there.cosine * there.yaw_rate
        over = _push(pushed, there) - rubbing
        until = clipped(until - over / select(slope == 0, float("inf"), slope), 0.0, time)
        there = _held(pushed, motion, until)
    return slid(pushed, there, rubbing, time - until)
