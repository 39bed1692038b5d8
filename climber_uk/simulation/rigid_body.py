"""Equations of motion of a climber on its wall: (q̇, v̇) of (30) under the no-slip row.

    q̇ = v + M^(-1/2) B⁺ (b_q - A v),   v̇ = a + M^(-1/2) B⁺ (b - A a)

(30) alone lets v drift away from q̇, because b depends on the velocity. Here b is taken at the
corrected velocity q̇, and after each step v is replaced by q̇: the rows then hold for both.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.friction import Bristles
from climber_uk.mechanics.wall import Wall
from climber_uk.simulation.inputs import Inputs

# Relaxation lengths in a step from which on bristles are in their steady state: exp(-20) = 2e-9.
SETTLED = 20.0


@dataclass(frozen=True)
class RigidBody:
    """A climber with the forces on it; y is q (3,), v (3,), and bristles (3,) if there are any."""

    climber: Climber
    contact: Contact
    wall: Wall
    step: float  # [s]

    @cached_property
    def friction(self) -> float:
        """Coulomb's friction f of the seal [N]."""
        return self.contact.seal_friction(self.climber)

    @cached_property
    def stiction(self) -> float:
        """Most friction of the seal at rest [N]."""
        return float(self.contact.friction.stiction(self.friction))

    @cached_property
    def bristles(self) -> Bristles | None:
        """See `Friction`."""
        return self.contact.friction.bristles

    # a plane's are the same everywhere
    @cached_property
    def _weight_on_plane(self) -> tuple[float, float]:
        return self._weight(0.0, 0.0)

    @cached_property
    def _gravity_on_plane(self) -> tuple[float, float]:
        return self._gravity(0.0, 0.0, 0.0, 0.0)

    def _weight(self, x: float, height: float) -> tuple[float, float]:
        """Weight along the wall (x, y) [N], at x and y = `height` [m]."""
        s_x, s_y = self.wall.along(self.climber.inclination, x, height)
        weight = self.climber.mass * GRAVITY
        return weight * s_x, weight * s_y

    def _gravity(
        self, x: float, height: float, x_speed: float, y_speed: float
    ) -> tuple[float, float]:
        inclination = self.climber.inclination
        into = self.wall.into(inclination, x, height, x_speed, y_speed)
        return float(into), GRAVITY * math.hypot(*self.wall.along(inclination, x, height))

    def outside(self, x: float, height: float, inputs: Inputs) -> tuple[float, float]:
        """Weight and push along the wall (x, y) [N], at x and y = `height` [m]."""
        w_x, w_y = self._weight_on_plane if self.wall.flat else self._weight(x, height)
        return inputs.push_x + w_x, inputs.push_y + w_y

    def push(self, y: Array, inputs: Inputs) -> float:
        """Force along the climber, without friction [N]."""
        x, height, heading, *_ = y.tolist()
        f_x, f_y = self.outside(x, height, inputs)
        return float(inputs.force + f_x * math.cos(heading) + f_y * math.sin(heading))

    def lateral(self, y: Array, inputs: Inputs, mass: float) -> float:
        """Lateral reaction, to the left, that keeps `mass` [kg] from slipping sideways [N]."""
        return mass * forward_speed(y) * float(y[5]) - self.across(y, inputs)

    def across(self, y: Array, inputs: Inputs) -> float:
        """What of weight and push pulls to the left [N]."""
        x, height, heading, *_ = y.tolist()
        f_x, f_y = self.outside(x, height, inputs)
        return float(f_y * math.cos(heading) - f_x * math.sin(heading))

    def gravity(self, y: Array) -> tuple[float, float]:
        """g_n into the wall, with the centripetal part of a curved one, and g_t along it [m/s²]."""
        if self.wall.flat:
            return self._gravity_on_plane
        x, height, _, v_x, v_y, *_ = y.tolist()
        return self._gravity(x, height, v_x, v_y)

    def into_wall(self, y: Array) -> float:
        """g_n [m/s²], see `gravity`."""
        into, _ = self.gravity(y)
        return into

    def runge_kutta(self, y: Array, inputs: Inputs, direction: float | None, h: float) -> Array:
        """y after `h` [s], by the classic fourth-order method; `direction` as in `derivative`."""
        start = y.tolist()  # arithmetic on a few floats is faster than on a small array
        k1 = self.derivative(start, inputs, direction)
        k2 = self.derivative(_along(start, k1, h / 2), inputs, direction)
        k3 = self.derivative(_along(start, k2, h / 2), inputs, direction)
        k4 = self.derivative(_along(start, k3, h), inputs, direction)
        slopes = zip(k1, k2, k3, k4, strict=True)
        end = _along(start, [a + 2 * b + 2 * c + d for a, b, c, d in slopes], h / 6)
        end[3:6] = self.derivative(end, inputs, direction)[:3]
        return np.array(end)

    def derivative(self, y: list[float], inputs: Inputs, direction: float | None) -> list[float]:
        """(q̇, v̇) of (30), both (3,), and the bristles' rates (3,) if there are any.

        A = [sinθ -cosθ 0] has unit length and M weighs x and y alike, so that M^(-1/2) B⁺ = Aᵀ.
        Where the seal slides in `direction` 1 or -1, friction is its law's; for 0 it holds the
        climber: [cosθ sinθ 0] is a second row with b_q = b = 0. For None see `_ring`.
        """
        climber = self.climber
        x, height, heading, v_x, v_y, yaw_rate, *deflection = y
        cosine, sine = math.cos(heading), math.sin(heading)
        force, moment = inputs.force, inputs.moment + inputs.push_moment
        bending = [0.0] * len(deflection)
        if direction == 0:
            return [0.0, 0.0, yaw_rate, 0.0, 0.0, moment / climber.driven_inertia, *bending]

        A_v = sine * v_x - cosine * v_y
        x_dot, y_dot = v_x - sine * A_v, v_y + cosine * A_v
        speed = x_dot * cosine + y_dot * sine
        if direction is None:
            resistance, torsion, bending = self._ring(speed, yaw_rate, deflection)
            force, moment = force - resistance, moment - torsion
        else:
            sliding = direction * speed
            force = force - self.contact.friction.level(self.friction, sliding) * direction

        # as `outside`, without the call: this is where the plant spends its time
        w_x, w_y = self._weight_on_plane if self.wall.flat else self._weight(x, height)
        f_x, f_y = inputs.push_x + w_x, inputs.push_y + w_y
        a_x = (force * cosine + f_x) / climber.driven_mass
        a_y = (force * sine + f_y) / climber.driven_mass
        b_minus_A_a = -yaw_rate * speed - (sine * a_x - cosine * a_y)
        return [
            *(x_dot, y_dot, yaw_rate),
            *(
                a_x + sine * b_minus_A_a,
                a_y - cosine * b_minus_A_a,
                moment / climber.driven_inertia,
            ),
            *bending,
        ]

    def _ring(
        self, v: float, omega: float, deflection: list[float]
    ) -> tuple[float, float, list[float]]:
        """Force and moment of the seal against v and ω, and the rates of its bristles.

        A ring of radius R that slides at s = √(v² + (R ω)²): exact for driving alone and for yawing
        alone, and for both the ellipse between them.
        """
        radius, law, f = self.contact.grip.seal_radius, self.contact.friction, self.friction
        rim_speed = radius * omega
        speed = math.hypot(v, rim_speed)
        if (bristles := self.bristles) is not None and not self.has_settled(speed):
            relaxation = bristles.relaxation(speed)
            ahead, aside, around = deflection
            ahead_1, around_1 = v - relaxation * ahead, rim_speed - relaxation * around
            moment = radius * bristles.force(f, rim_speed, around, around_1)
            rates = [ahead_1, -relaxation * aside, around_1]
            return bristles.force(f, v, ahead, ahead_1), moment, rates
        drag = law.level(f, speed) / speed if speed > 0 else 0.0
        return drag * v, drag * rim_speed * radius, [0.0] * len(deflection)

    def has_settled(self, speed: float) -> bool:
        """Whether bristles are, within a step, where they end up at a sliding `speed` [m/s]."""
        bristles = self.bristles
        return bristles is not None and bool(bristles.relaxation(speed) * self.step >= SETTLED)


def forward_speed(y: Array) -> float:
    """v = ẋ cosθ + ẏ sinθ (12) [m/s]."""
    _, _, heading, v_x, v_y, *_ = y.tolist()
    return float(v_x * math.cos(heading) + v_y * math.sin(heading))


def _along(y: list[float], rates: list[float], time: float) -> list[float]:
    """y after a time [s] at constant rates."""
    return [value + time * rate for value, rate in zip(y, rates, strict=True)]
