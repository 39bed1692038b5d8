"""Steps of a unicycle climber: on a plane, with Coulomb friction, and wheels that do not slip.

On another wall, for a period, it is on the plane that has the wall's gravity along it: `Downhill`.

    v̇ = (F - f σ)/m - g_t sinθ    ω̇ = N/J    ẋ = v cosθ    ẏ = v sinθ       (11), (15), (12), (17)

Under a constant wrench θ(t) is known; the rest is Simpson's rule, of fourth order as the plant is
that integrates (30). Floats, or arrays (N,) of many climbers at once; it agrees with `Plant` to the
latter's error. Within a step, friction stops a climber or gives way once, at the exact instant.
"""

from typing import Any, NamedTuple

from climber_uk.mechanics.climber import DEGREE, GRAVITY, Climber
from climber_uk.mechanics.elementary import (
    arctan2,
    clipped,
    rotated,
    select,
    sign,
    sin,
    sqrt,
    swept,
    with_sign_of,
)
from climber_uk.mechanics.many import amended, keep_what_is_freed
from climber_uk.mechanics.quantities import Motion, Wrench
from climber_uk.mechanics.wall import Wall

ITERATIONS = 5  # of Newton's method to an instant within a step; each squares what is left


class UnicycleModel(NamedTuple):
    """The parameters of (11) and (15), of one climber or of many."""

    mass: Any  # with what turns with the wheels [kg]
    yaw_inertia: Any  # the same [kg m²]
    friction: Any  # f [N]
    gravity: Any  # that weight accelerates it by along the wall, towards -y [m/s²]

    @classmethod
    def of(cls, climber: Climber) -> "UnicycleModel":
        """Model of a climber whose parameters are floats, or arrays (N,)."""
        mass, inertia, friction, _ = climber.inertial
        along = GRAVITY * sin(climber.inclination * DEGREE)
        return cls(mass, inertia, friction, along * (climber.mass / mass))

    def under(self, wrench: Wrench) -> "Accelerations":
        """Accelerations by friction, gravity and a wrench [N, N m]."""
        mass, yaw_inertia, friction, gravity = self
        return Accelerations(
            wrench.force / mass, wrench.moment / yaw_inertia, friction / mass, gravity
        )


class Downhill(NamedTuple):
    """The way that gravity pulls along a wall, and how much: where the plane's -y is to be."""

    angle: Any  # [rad] from -y, anticlockwise
    cosine: Any
    sine: Any
    steep: Any  # pull, by g

    @classmethod
    def of(cls, wall: Wall, climber: Climber, motion: Motion, time: float) -> "Downhill":
        """Where a climber is in the middle of the next `time` [s], at the speed of now."""
        way = 0.5 * time * motion.speed
        place = motion.x + way * motion.cosine, motion.y + way * motion.sine
        s_x, s_y = wall.along(climber.inclination, *place)
        steep = sqrt(s_x * s_x + s_y * s_y)
        pulls = select(steep > 0, steep, 1.0)
        sine, cosine = s_x / pulls, select(steep > 0, -s_y / pulls, 1.0)
        return cls(arctan2(sine, cosine), cosine, sine, steep)

    def body(self, on_plane: UnicycleModel, climber: Climber) -> UnicycleModel:
        """A climber with this gravity."""
        return on_plane._replace(gravity=GRAVITY * self.steep * (climber.mass / on_plane.mass))

    def seen(self, motion: Motion) -> Motion:
        """A motion in a frame at its place, whose -y is downhill."""
        _, _, heading, c, s, v, omega = motion
        _, cosine, sine, _ = self
        along = c * cosine + s * sine, s * cosine - c * sine
        return Motion(0.0 * c, 0.0 * c, heading - self.angle, *along, v, omega)

    def back(self, end: Motion, start: Motion) -> Motion:
        """What was `seen` from a `start`, in the wall's frame."""
        x, y, heading, c, s, v, omega = end
        _, cosine, sine, _ = self
        x, y = start.x + x * cosine - y * sine, start.y + x * sine + y * cosine
        along = c * cosine - s * sine, s * cosine + c * sine
        return Motion(x, y, heading + self.angle, *along, v, omega)


class Accelerations(NamedTuple):
    """What accelerates a climber during a step, by its mass and its yaw inertia."""

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
    """Motion after `steps` steps of `time` [s] under a constant wrench."""
    keep_what_is_freed()
    rates = body.under(wrench)
    for _ in range(steps):
        motion = stepped(rates, motion, time)
    return motion


def stepped(rates: Accelerations, motion: Motion, time: float) -> Motion:
    """Motion after a step of `time` [s], in which the seal may stick and slide."""
    end = slid(rates, motion, with_sign_of(rates.friction, motion.speed), time)
    return amended(motion.speed * end.speed <= 0, end, _stopped, rates, motion, end, time)


def slid(rates: Accelerations, motion: Motion, friction: Any, time: Any) -> Motion:
    """Motion `time` [s] later while the seal slides, decelerated by `friction` [m/s²]."""
    x, y, heading, c_0, s_0, v_0, omega = motion  # an inner loop: faster than attributes
    faster = 0.5 * time * rates.yaw  # in half of the time
    omega_1 = omega + faster
    halfway, angle = 0.5 * time * (omega + 0.5 * faster), time * omega_1
    c_1, s_1, heading, c_2, s_2 = swept(heading, c_0, s_0, halfway, angle)
    weight = time / 6
    fall = weight * rates.gravity
    v_2 = v_0 + (time * (rates.forward - friction) - fall * (s_0 + 4 * s_1 + s_2))
    v_14 = 2 * (v_0 + v_2) - 3 * fall * (s_0 - s_2)  # four times the speed halfway
    return Motion(
        x + weight * (v_0 * c_0 + v_14 * c_1 + v_2 * c_2),
        y + weight * (v_0 * s_0 + v_14 * s_1 + v_2 * s_2),
        heading,
        c_2,
        s_2,
        v_2,
        omega_1 + faster,
    )


def _stuck(rates: Accelerations, motion: Motion, time: Any) -> Motion:
    """Motion `time` [s] later while the seal sticks: it may only yaw on the spot."""
    x, y, heading, cosine, sine, v, omega = motion
    angle = time * (omega + time / 2 * rates.yaw)
    heading, cosine, sine = rotated(heading, cosine, sine, angle)
    return Motion(x, y, heading, cosine, sine, 0.0 * v, omega + time * rates.yaw)


def _applied(rates: Accelerations, motion: Motion) -> Any:
    """Forward acceleration [m/s²] without friction."""
    return rates.forward - rates.gravity * motion.sine


def _stopped(rates: Accelerations, motion: Motion, end: Motion, time: Any) -> Motion:
    """Motion after a step in which it rests or stops; `end` is that as if it slid throughout."""
    direction, rests = with_sign_of(1.0, motion.speed), motion.speed == 0
    end = amended(direction * end.speed < 0, end, _to_rest, rates, motion, direction, time)
    return amended(rests, end, _from_rest, rates, motion, time)


def _from_rest(rates: Accelerations, motion: Motion, time: Any) -> Motion:
    """Motion after `time` [s] that begin at rest."""
    applied = _applied(rates, motion)
    end = _stuck(rates, motion, time)
    later = abs(_applied(rates, end)) > rates.friction
    end = amended(later, end, _broken_loose, rates, motion, end, time)
    starts = abs(applied) > rates.friction
    return amended(starts, end, slid, rates, motion, sign(applied) * rates.friction, time)


def _to_rest(rates: Accelerations, motion: Motion, direction: Any, time: Any) -> Motion:
    """Motion after a step in which a climber that slides in `direction` comes to rest."""
    until, there, friction = 0.0 * motion.speed, motion, direction * rates.friction
    for _ in range(ITERATIONS):
        slope = _applied(rates, there) - friction
        until = clipped(until - there.speed / slope, 0.0, time)
        there = slid(rates, motion, friction, until)
    x, y, heading, cosine, sine, v, omega = there
    there = Motion(x, y, heading, cosine, sine, 0.0 * v, omega)
    return _from_rest(rates, there, time - until)


def _broken_loose(rates: Accelerations, motion: Motion, end: Motion, time: Any) -> Motion:
    """Motion after a step that begins at rest, and in which yawing overcomes stiction.

    `end` is the motion as if it stuck throughout.
    """
    direction, until, there = sign(_applied(rates, end)), time + 0.0 * end.x, end
    friction = direction * rates.friction
    for _ in range(ITERATIONS):
        slope = -rates.gravity * there.cosine * there.yaw_rate
        over = _applied(rates, there) - friction
        until = clipped(until - over / select(slope == 0, float("inf"), slope), 0.0, time)
        there = _stuck(rates, motion, until)
    return slid(rates, there, friction, time - until)
