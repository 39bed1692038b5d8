"""Wheels that give way sideways: by how much, learnt from poses, and the course that is left.

    v_y = ρ |v| - λ |ω| (Y + f v_y / V) / (m g) + p ω X / (m g)

    Y = m v ω + m g_t cosθ, what pulls to the right        X = m g_t sinθ        V = √(v² + v_y²)

on a plane; on a wall that is told, with the weight as it pulls there. The wheels take what the drag
of the seal, f, leaves of Y: it acts against the whole of the motion.

ρ is creep. λ is what scrubbing wheels lack: a contact that is dragged round holds sideways like
something viscous, and gives way the more, the faster it is dragged (docs/theory.md, §8.5). p is by
how much the point that it turns about is shifted: the weight loads the wheels that are lower.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.elementary import clipped
from climber_uk.mechanics.quantities import Motion, ReferencePoint
from climber_uk.mechanics.wall import Wall, weight

SIZES = 0.06, 0.1, 0.06  # of ρ, λ [m] and p [m], as large as they may well be
LARGEST = 10.0  # times as large as that, at most
FORGOTTEN = 10.0  # [s] in which what is known of them is known no more
FADE_SPEED = 0.02  # [m/s] of a reference below which its course is its heading
SLOW_TO_LEARN = 0.05  # [m/s] below which poses tell less and less of ρ
MOST_LEAD = 0.7  # [s]
# [s] of the reference behind and ahead that are looked at. They have come in any case: if more
# counted where it happens to be there, a run would not repeat itself
HINDSIGHT, FORESIGHT = 1.0, 0.7
FASTEST = 0.4  # B T, at most
NEGLIGIBLE = 1e-5  # [rad] of a course off its heading
REACH, NEAREST = 5.0, 0.035  # times T, and [s]: what is further off counts for nothing
STEPS = 7  # in which that is gone through
PASSES = 3
SHORTEST_LEAD = 1e-9  # [s]
CLEARLY_TURNS = 0.1  # [rad/s]
STILL = 1e-3  # [m/s] below which a seal's drag has no direction
NEWTON = 4  # steps to v_y, each nearer from below
At = Callable[[float], ReferencePoint]


class Covariance(NamedTuple):
    """How little is known of creep ρ, scrub λ [m] and pivot p [m]: the upper triangle, by rows."""

    creep: float = SIZES[0] ** 2
    creep_scrub: float = 0.0
    creep_pivot: float = 0.0
    scrub: float = SIZES[1] ** 2
    scrub_pivot: float = 0.0
    pivot: float = SIZES[2] ** 2

    def times(self, creep: float, scrub: float, pivot: float) -> tuple[float, float, float]:
        """Its product with a vector."""
        a, b, c, d, e, f = self
        return (
            a * creep + b * scrub + c * pivot,
            b * creep + d * scrub + e * pivot,
            c * creep + e * scrub + f * pivot,
        )

    def after(
        self, vector: tuple[float, float, float], known: float, forgotten: float
    ) -> "Covariance":
        """Less a vector's square, times `known`; a share of all that is known is `forgotten`."""
        a, b, c, d, e, f = self
        creep, scrub, pivot = vector
        kept, unknown = 1 - forgotten, NOTHING_KNOWN
        return Covariance(
            kept * a - known * creep * creep + forgotten * unknown.creep,
            kept * b - known * creep * scrub,
            kept * c - known * creep * pivot,
            kept * d - known * scrub * scrub + forgotten * unknown.scrub,
            kept * e - known * scrub * pivot,
            kept * f - known * pivot * pivot + forgotten * unknown.pivot,
        )


NOTHING_KNOWN = Covariance()


class Course(NamedTuple):
    """How far the course χ, where the climber goes, is from its heading: χ = θ + β."""

    angle: float  # β [rad]
    rate: float  # β̇ [rad/s]
    acceleration: float  # β̈ [rad/s²]
    cosine: float  # of β
    sine: float
    lever: float = 0.0  # [m] from the centre ahead to the point that goes along the heading
    away: tuple[float, float] = (0.0, 0.0)  # [m] from that point to the centre, as they should be

    @classmethod
    def at(
        cls, angle: float, rate: float, acceleration: float, lever: float = 0.0, heading: float = 0
    ) -> "Course":
        """A course that is off by an angle [rad], with its derivatives.

        The point that holds is a `lever` [m] ahead, in the direction of the `heading` [rad] wanted.
        """
        away = -lever * math.cos(heading), -lever * math.sin(heading)
        return cls(angle, rate, acceleration, math.cos(angle), math.sin(angle), lever, away)

    @property
    def slope(self) -> float:
        """v_y / v = tan β."""
        return self.sine / self.cosine

    def motion(self, of: Motion) -> Motion:
        """The same motion along its course: that of a climber whose wheels hold.

        One that turns otherwise than it should is where its point that holds tells: as it goes
        aside by a lever times the turn, the centre would tell a turn upwards by a way downwards.
        """
        x, y, heading, cosine, sine, v, omega = of
        along = cosine * self.cosine - sine * self.sine, sine * self.cosine + cosine * self.sine
        x, y = x + self.away[0] + self.lever * cosine, y + self.away[1] + self.lever * sine
        return Motion(x, y, heading + self.angle, *along, v / self.cosine, omega + self.rate)


class SideSlip(NamedTuple):
    """What is known of it."""

    creep: float = 0.0  # ρ
    scrub: float = 0.0  # λ [m]
    pivot: float = 0.0  # p [m]
    creep_rate: float = 0.0  # of ρ [1/s]
    offset: float = 0.0  # [m] of poses to the left of where they were expected, filtered
    covariance: Covariance = NOTHING_KNOWN

    def speed(self, climber: Climber, motion: Motion, wall: Wall | None = None) -> float:
        """v_y [m/s] of a climber in `motion`."""
        return self._shown(climber, motion, wall)[0]

    def _shown(
        self, climber: Climber, motion: Motion, wall: Wall | None
    ) -> tuple[float, tuple[float, float, float]]:
        """v_y [m/s], by Newton's method, and its derivatives by ρ [m/s], λ and p [rad/s]."""
        v, scrubbing, shifting = parts = _rates(climber, motion, wall)
        freely = self.creep * v + self.scrub * scrubbing + self.pivot * shifting
        dragged = _seal(climber) * abs(motion.yaw_rate)
        held = self.scrub * dragged  # [m/s]
        if held == 0.0:
            return freely, parts
        size, along = abs(freely), v * v + STILL * STILL
        slip = max(size / (1 + held / math.sqrt(along)), size - held)  # is too small
        for _ in range(NEWTON):
            speed = math.sqrt(along + slip * slip)
            yields = 1 / (1 + held * along / speed**3)
            slip += yields * (size - slip - held * slip / speed)
        slip = math.copysign(slip, freely)
        scrubbing -= dragged * slip / speed
        return slip, (yields * v, yields * scrubbing, yields * shifting)

    def learnt(
        self,
        climber: Climber,
        now: Motion,
        aside: float,
        time: float,
        bandwidth: float,
        wall: Wall | None = None,
    ) -> "SideSlip":
        """As v_y [m/s] to a side teaches, for a `time` [s]; with both poles at a bandwidth [1/s].

        It is the likeliest change of the parts that explains it, as a Kalman filter finds it.
        """
        expected, (v, scrubbing, shifting) = self._shown(climber, now, wall)
        error = aside - expected
        by_creep, by_scrub, by_pivot = by = self.covariance.times(v, scrubbing, shifting)
        large = math.hypot(SIZES[0] * v, SIZES[1] * scrubbing, SIZES[2] * shifting)
        share = large / math.hypot(large, SIZES[0] * SLOW_TO_LEARN)
        variance = by_creep * v + by_scrub * scrubbing + by_pivot * shifting
        per = share * share / variance if variance > 0 else 0.0
        poles = min(bandwidth, FASTEST / time)
        # a pose that jumps is no side slip; of noise, each difference takes back the last one
        most = (abs(now.speed) + climber.half_track * abs(now.yaw_rate)) / (2 * poles)
        offset = clipped(self.offset + time * error, -most, most)
        gain = poles * poles * offset * per
        creeps, scrubs, pivots = (LARGEST * largest for largest in SIZES)
        return SideSlip(
            clipped(self.creep + time * gain * by_creep, -creeps, creeps),
            clipped(self.scrub + time * gain * by_scrub, 0.0, scrubs),
            clipped(self.pivot + time * gain * by_pivot, -pivots, pivots),
            gain * by_creep,
            offset * math.exp(-2 * poles * time),
            self.covariance.after(by, time * poles * per, time / FORGOTTEN),
        )

    def course(
        self, climber: Climber, target: ReferencePoint, at: At, wall: Wall | None = None
    ) -> Course | None:
        """Course of a climber on its reference; None where its wheels hold.

        `at` gives the reference at a time [s] after the one of `target`.
        """
        v, fade = abs(target.speed), _fade(target.speed)
        angle, rate = math.atan(self.creep * v * fade), self.creep_rate * v * fade
        leads = {way: partial(self._lead, climber, wall, way) for way in (1, -1)}
        one, other = (lead(target, 0.0, target.yaw_rate) for lead in leads.values())
        if abs(angle) + (abs(one) + abs(other)) * abs(target.yaw_rate) < NEGLIGIBLE:
            return None
        # it sags, whichever way it turns: of both ways to turn, the heading that is higher
        ways = [(*_ahead(target, at, lead), way) for way, lead in leads.items()]
        turned, faster, sooner, way = max(ways) if one > other else min(ways)
        turns = target.yaw_rate + faster
        # by how much more it goes aside the faster it turns
        held = v / (v + self.scrub * _seal(climber) * abs(turns))
        lever = leads[way](target, turned, turns) * held * target.speed
        lever *= math.tanh(max(way * turns, 0.0) / CLEARLY_TURNS)
        return Course.at(
            angle - turned, rate - faster, -sooner, lever, target.heading - angle + turned
        )

    def _lead(
        self,
        climber: Climber,
        wall: Wall | None,
        way: int,
        target: ReferencePoint,
        turned: float,
        turning: float,
    ) -> float:
        """Time T [s] by which its heading is ahead of its course, creep apart: θ̇ = (θ - θ_d) / T.

        It turns left (`way` 1) or right (-1), at a heading `turned` [rad] from the reference's,
        at a rate `turning` [rad/s].
        """
        v = target.speed
        there = Motion.at(target.x, target.y, target.heading + turned, v, target.yaw_rate)
        reaction, uphill = _pulls(climber, there, wall)
        lever = way * self.scrub * reaction - self.pivot * uphill
        held = self.scrub * _seal(climber) * abs(turning)
        return clipped(_fade(v, held) * lever, -MOST_LEAD, MOST_LEAD)


def shown(before: Motion, now: Motion, time: float) -> float:
    """v_y [m/s] that the poses of two odometry messages show, `time` [s] apart."""
    cosine, sine = (before.cosine + now.cosine) / 2, (before.sine + now.sine) / 2
    aside = ((now.y - before.y) * cosine - (now.x - before.x) * sine) / time
    mean, rate = (before.speed + now.speed) / 2, (before.yaw_rate + now.yaw_rate) / 2
    # an arc that is driven ever faster, or bends ever more, is not even about its middle
    faster, tighter = now.speed - before.speed, now.yaw_rate - before.yaw_rate
    return aside - time / 12 * (rate * faster - mean * tighter)


def _fade(speed: float, held: float = 0.0) -> float:
    """About 1 / (v + what is `held`) of a speed v [m/s], and 0 at rest."""
    return speed / (speed * speed + abs(speed) * held + FADE_SPEED * FADE_SPEED)


def _seal(climber: Climber) -> float:
    """Drag of the seal, f, over the weight m g."""
    return float(climber.seal_friction) / (climber.mass * GRAVITY)


def _ahead(
    target: ReferencePoint, at: At, lead: Callable[..., float]
) -> tuple[float, float, float]:
    """How far the heading has to be ahead of a reference, and its derivatives.

    `lead` gives T [s] of a reference, for a heading that is so far [rad] ahead of it.

    θ - T θ̇ = θ_d, whose only solution that does not grow comes from what θ_d will be (was, of
    T < 0). From there it is stepped back to now, with T θ̇_d even in a step and T that of its end;
    what is later than can be seen turns on as it does there.
    """
    now = lead(target, 0.0, target.yaw_rate)
    sign, far = (1, FORESIGHT) if now >= 0 else (-1, HINDSIGHT)
    step = sign * clipped(REACH * abs(now), NEAREST, far) / STEPS

    def time(point: ReferencePoint, angle: float, rate: float) -> float:
        return sign * max(sign * lead(point, angle, rate), SHORTEST_LEAD)

    point = at(STEPS * step)
    angle, rate, acceleration = 0.0, point.yaw_rate, 0.0
    for _ in range(PASSES):  # where it ends: a heading that is ahead loads the wheels otherwise
        angle = time(point, angle, rate) * rate
    even = angle  # T θ̇_d
    for number in reversed(range(STEPS)):
        later, point = point, at(number * step) if number else target
        T, change = time(point, angle, rate), (later.yaw_rate - point.yaw_rate) / step
        rises = (even - T * point.yaw_rate) / step
        left = ((angle - even) / T - rises) * math.exp(-step / T)
        rate, acceleration = point.yaw_rate + rises + left, change + left / T
        angle, even = T * rate, T * point.yaw_rate
    return angle, rate - target.yaw_rate, acceleration - target.yaw_acceleration


def _rates(climber: Climber, motion: Motion, wall: Wall | None) -> tuple[float, float, float]:
    """What ρ [m/s], λ and p [rad/s] are multiplied by."""
    (reaction, uphill), turning = _pulls(climber, motion, wall), motion.yaw_rate
    return abs(motion.speed), -reaction * abs(turning), uphill * turning


def _pulls(climber: Climber, motion: Motion, wall: Wall | None) -> tuple[float, float]:
    """Y and X, by the weight."""
    (forward, left), whole = weight(wall, climber, motion), climber.mass * GRAVITY
    turned = climber.mass * motion.speed * motion.yaw_rate
    return float(turned - left) / whole, float(-forward) / whole


NO_SLIP = SideSlip()
