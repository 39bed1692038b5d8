"""Wheels that give way sideways: by how much, learnt from poses, and the course that is left.

    v_y = ρ |v| - λ |ω| Y / (m g)        Y = m v ω + m g_t cosθ, what the wheels take to the left

on a plane; on a wall that is told, Y has the weight as it pulls there.

ρ is creep. λ is what scrubbing wheels lack: a contact that is dragged round holds sideways like
something viscous, and gives way the more, the faster it is dragged (docs/theory.md, §8.5).
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.elementary import clipped, wrapped
from climber_uk.mechanics.quantities import Motion, ReferencePoint
from climber_uk.mechanics.wall import Wall, weight

CREEP, SCRUB = 0.06, 0.1  # ρ, and λ [m], as large as they may well be
LARGEST = 10.0  # times as large as that, at most
FADE_SPEED = 0.02  # [m/s] of a reference below which its course is its heading
SLOW_TO_LEARN = 0.05  # [m/s] below which poses tell less and less of ρ
MOST_LEAD = 0.7  # [s]
# [s] of the reference behind and ahead that are looked at. They have come in any case: if more
# counted where it happens to be there, a run would not repeat itself
HINDSIGHT, FORESIGHT = 1.0, 0.7
FASTEST = 0.4  # B T, at most
NEGLIGIBLE = 1e-5  # [rad] of a course off its heading
# Gauss-Laguerre, of second order: the integral of exp(-u) f(u) from 0 on is about Σ weight f(node)
NODES = (2 - math.sqrt(2), (2 + math.sqrt(2)) / 4), (2 + math.sqrt(2), (2 - math.sqrt(2)) / 4)
At = Callable[[float], ReferencePoint]


class Course(NamedTuple):
    """How far the course χ, where the climber goes, is from its heading: χ = θ + β."""

    angle: float  # β [rad]
    rate: float  # β̇ [rad/s]
    acceleration: float  # β̈ [rad/s²]
    cosine: float  # of β
    sine: float

    @classmethod
    def at(cls, angle: float, rate: float, acceleration: float) -> "Course":
        """A course that is off by an angle [rad], with its derivatives."""
        return cls(angle, rate, acceleration, math.cos(angle), math.sin(angle))

    @property
    def slope(self) -> float:
        """v_y / v = tan β."""
        return self.sine / self.cosine

    def motion(self, of: Motion) -> Motion:
        """The same motion along its course: that of a climber whose wheels hold."""
        x, y, heading, cosine, sine, v, omega = of
        along = cosine * self.cosine - sine * self.sine, sine * self.cosine + cosine * self.sine
        return Motion(x, y, heading + self.angle, *along, v / self.cosine, omega + self.rate)


class SideSlip(NamedTuple):
    """What is known of it."""

    creep: float = 0.0  # ρ
    scrub: float = 0.0  # λ [m]
    creep_rate: float = 0.0  # of ρ [1/s]
    offset: float = 0.0  # [m] of poses to the left of where they were expected, filtered

    def speed(self, climber: Climber, motion: Motion, wall: Wall | None = None) -> float:
        """v_y [m/s] of a climber in `motion`."""
        return self.creep * abs(motion.speed) + self.scrub * _scrubbing(climber, motion, wall)

    def learnt(
        self,
        climber: Climber,
        before: Motion,
        now: Motion,
        time: float,
        bandwidth: float,
        wall: Wall | None = None,
    ) -> "SideSlip":
        """As two odometry messages teach, `time` [s] apart; with both poles at a bandwidth [1/s].

        It is the least change of the parts that explains it, each by how large it may well be.
        """
        cosine, sine = (before.cosine + now.cosine) / 2, (before.sine + now.sine) / 2
        aside = ((now.y - before.y) * cosine - (now.x - before.x) * sine) / time
        mean, rate = (before.speed + now.speed) / 2, (before.yaw_rate + now.yaw_rate) / 2
        # an arc that is driven ever faster, or bends ever more, is not even about its middle
        faster, tighter = now.speed - before.speed, now.yaw_rate - before.yaw_rate
        aside -= time / 12 * (rate * faster - mean * tighter)
        v, scrubbing = abs(mean), _scrubbing(climber, now, wall)
        error = aside - self.creep * v - self.scrub * scrubbing
        by_creep, by_scrub = CREEP**2 * v, SCRUB**2 * scrubbing
        size = by_creep * v + by_scrub * scrubbing + (CREEP * SLOW_TO_LEARN) ** 2
        poles = min(bandwidth, FASTEST / time)
        # a pose that jumps is no side slip; of noise, each difference takes back the last one
        most = (v + climber.half_track * abs(now.yaw_rate)) / (2 * poles)
        offset = clipped(self.offset + time * error, -most, most)
        gain = poles * poles * offset / size
        creep = clipped(self.creep + time * gain * by_creep, -LARGEST * CREEP, LARGEST * CREEP)
        scrub = clipped(self.scrub + time * gain * by_scrub, 0.0, LARGEST * SCRUB)
        return SideSlip(creep, scrub, gain * by_creep, offset * math.exp(-2 * poles * time))

    def course(
        self, climber: Climber, target: ReferencePoint, at: At, wall: Wall | None = None
    ) -> Course | None:
        """Course of a climber on its reference; None where its wheels hold.

        `at` gives the reference at a time [s] after the one of `target`.
        """
        v, omega = target.speed, target.yaw_rate
        fade = v / (v * v + FADE_SPEED * FADE_SPEED)
        there = Motion.at(target.x, target.y, target.heading, v, omega)
        arm = self.scrub * _reaction(climber, there, wall)  # [m] -v_y / |ω|
        angle, rate = math.atan(self.creep * abs(v) * fade), self.creep_rate * abs(v) * fade
        if abs(angle) + abs(fade * arm * omega) < NEGLIGIBLE:
            return None
        # it sags, whichever way it turns: of both ways to turn, the heading that is higher
        ways = _ahead(target, at, fade * arm), _ahead(target, at, -fade * arm)
        turned, faster, sooner = max(ways) if arm > 0 else min(ways)
        return Course.at(angle - turned, rate - faster, -sooner)


def _ahead(target: ReferencePoint, at: At, lead: float) -> tuple[float, float, float]:
    """How far the heading has to be ahead of a reference, and its derivatives.

    θ - T θ̇ = θ_d, so that θ is the mean of what θ_d will be (was, of T < 0), with weights that fade
    exponentially: the only solution that does not grow.
    """
    lead = clipped(lead, -MOST_LEAD, MOST_LEAD)
    angle = rate = acceleration = 0.0
    for node, share in NODES:
        later = at(clipped(lead * node, -HINDSIGHT, FORESIGHT))
        angle += share * wrapped(later.heading - target.heading)
        rate += share * (later.yaw_rate - target.yaw_rate)
        acceleration += share * (later.yaw_acceleration - target.yaw_acceleration)
    return angle, rate, acceleration


def _scrubbing(climber: Climber, motion: Motion, wall: Wall | None) -> float:
    """What λ is multiplied by [rad/s]."""
    return -_reaction(climber, motion, wall) * abs(motion.yaw_rate)


def _reaction(climber: Climber, motion: Motion, wall: Wall | None) -> float:
    """Y, by the weight."""
    _, pulled = weight(wall, climber, motion)
    turned = climber.mass * motion.speed * motion.yaw_rate
    return float(turned - pulled) / (climber.mass * GRAVITY)


NO_SLIP = SideSlip()
