"""A climber whose wheels do not slip, over one step: sticking, sliding, and from one to the other.

Friction of a seal without radius is exact: it slides against the motion or, at rest, takes whatever
value up to its stiction holds the climber still; the instant of change is located in the step.
"""

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.friction import LuGre
from climber_uk.simulation.inputs import Inputs
from climber_uk.simulation.rigid_body import SETTLED, RigidBody, forward_speed

# More changes between sticking and sliding than this within one step are not followed.
MAX_CHANGES_IN_A_STEP = 8
# Rate of friction times a part of a step, at most: Runge-Kutta is stable up to 2.8.
STIFF = 0.5
MAX_PARTS = 100  # beyond that, what is stiff is left to an implicit method


class NoSlipStepper:
    """One step of a body without side slip."""

    def __init__(self, body: RigidBody) -> None:
        self.body = body

    @cached_property
    def sticks(self) -> bool:
        """Whether friction has an edge at rest, however small it may be."""
        return bool(self.body.contact.friction.stiction(1.0) > 0)

    def step(self, y: Array, given: Inputs) -> Array | None:
        """y after a step; None if a ring comes to rest or starts, or friction is too stiff."""
        if not self.sticks:
            return self._in_parts(y, given)
        if self.body.contact.grip.seal_radius == 0:
            return self.exact_step(y, given) if self.is_soft else None
        rests = not y[3:6].any()
        if rests and self._ring_holds(y, given):
            return y
        if rests or self._creeps(y):
            return None
        end = self._in_parts(y, given)
        return None if end is None or self._creeps(end) else end

    def accelerations(self, y: Array, given: Inputs) -> tuple[float, float]:
        """v̇ [m/s²] and ω̇ [rad/s²]."""
        radius = self.body.contact.grip.seal_radius
        if self.sticks and radius > 0 and not y[3:6].any():
            return 0.0, 0.0
        direction = self._direction(y, given) if self.sticks and radius == 0 else None
        *_, v_x_1, v_y_1, omega_1 = self.body.derivative(y, given, direction)[:6].tolist()
        return v_x_1 * math.cos(y[2]) + v_y_1 * math.sin(y[2]), omega_1

    # A seal without radius

    def exact_step(self, y: Array, given: Inputs) -> Array:
        """y after a step, in which a seal without radius may stick and slide."""
        for _ in range(self._steep_parts):
            y = self._exact_part(y, given, self.body.step / self._steep_parts)
        return y

    @cached_property
    def _steep_parts(self) -> int:
        """In which friction's change with speed is followed."""
        steepness = self.body.contact.friction.steepness(self.body.friction)
        parts = math.ceil(min(self.body.step * steepness / self.body.climber.mass / STIFF, 1e9))
        return max(1, parts)

    @property
    def is_soft(self) -> bool:
        """Whether a seal without radius is not too stiff for steps in parts."""
        return self._steep_parts <= MAX_PARTS

    def _exact_part(self, y: Array, given: Inputs, left_over: float) -> Array:
        direction = self._direction(y, given)
        for _ in range(MAX_CHANGES_IN_A_STEP):
            end = self.body.runge_kutta(y, given, direction, left_over)
            if self._margin(end, given, direction) >= 0:
                return end
            y, until = self._until_change(y, given, direction, left_over)
            left_over -= until
            gave_way = direction == 0
            push = self.body.push(y, given)
            direction = float(np.sign(push)) if gave_way else self._direction(y, given)
        return self.body.runge_kutta(y, given, direction, left_over)

    def _direction(self, y: Array, given: Inputs) -> float:
        """Way the seal slides: 1 forwards, -1 backwards, 0 where friction holds it."""
        speed = forward_speed(y)
        if speed != 0:
            return 1.0 if speed > 0 else -1.0
        push = self.body.push(y, given)
        return 0.0 if abs(push) <= self.body.stiction else float(np.sign(push))

    def _margin(self, y: Array, given: Inputs, direction: float) -> float:
        """Falls below 0 where sliding in `direction` ends or, for 0, where friction gives way."""
        if direction == 0:
            return self.body.stiction - abs(self.body.push(y, given))
        return direction * forward_speed(y)

    def _until_change(
        self, y: Array, given: Inputs, direction: float, step: float
    ) -> tuple[Array, float]:
        """State at the instant within `step` at which `_margin` reaches 0, and that instant."""

        def margin(duration: float) -> float:
            end = self.body.runge_kutta(y, given, direction, duration)
            return self._margin(end, given, direction)

        until = _zero(margin, 0.0, step) if margin(0.0) > 0 else 0.0
        changed = self.body.runge_kutta(y, given, direction, until)
        changed[3:5] = 0.0  # not merely small: at rest is what friction can hold
        return changed, until

    # A ring, or friction without an edge

    def _ring_holds(self, y: Array, given: Inputs) -> bool:
        around = (given.moment + given.push_moment) / self.body.contact.grip.seal_radius
        return math.hypot(self.body.push(y, given), around) <= self.body.stiction

    def _sliding_speed(self, y: Array) -> float:
        return math.hypot(forward_speed(y), self.body.contact.grip.seal_radius * float(y[5]))

    @cached_property
    def _lightest(self) -> float:
        """Mass that a ring's friction moves most easily [kg]."""
        climber, radius = self.body.climber, self.body.contact.grip.seal_radius
        return min(climber.mass, climber.yaw_inertia / radius**2) if radius > 0 else climber.mass

    def _creeps(self, y: Array) -> bool:
        """Whether a ring slides so slowly that its friction turns too fast for the step."""
        fastest = self.body.stiction * self.body.step
        return fastest > STIFF * self._lightest * self._sliding_speed(y)

    def _in_parts(self, y: Array, given: Inputs) -> Array | None:
        """y after a step, in as many parts as friction is stiff; None if it is too stiff."""
        body, law = self.body, self.body.contact.friction
        rate = law.steepness(body.friction) / self._lightest
        if isinstance(law, LuGre):
            stiffness = law.stiffness(body.friction) / self._lightest
            rate += math.sqrt(stiffness) + law.damping_time * stiffness
            rate += min(law.relaxation(self._sliding_speed(y)), SETTLED / body.step)
        parts = max(1, math.ceil(min(body.step * rate / STIFF, 1e9)))
        if parts > MAX_PARTS:
            return None
        for _ in range(parts):
            y = body.runge_kutta(y, given, None, body.step / parts)
        speed = self._sliding_speed(y)
        if isinstance(law, LuGre) and body.has_settled(speed):
            around = body.contact.grip.seal_radius * float(y[5])
            y[6:] = np.array([forward_speed(y), 0.0, around]) / law.relaxation(speed)
        return y


def _zero(function: Callable[[float], float], low: float, high: float) -> float:
    """Where `function` changes its sign, by the Illinois method (doi 10.1007/BF01934364).

    `scipy.optimize` finds it too, but takes longer to import than the rest of a node to start.
    """
    at_low, at_high = function(low), function(high)
    moved = None
    for _ in range(100):
        middle = low + (high - low) * at_low / (at_low - at_high)
        value = function(middle) if low < middle < high else 0.0
        if value == 0.0:
            break
        if (value > 0) == (at_low > 0):
            low, at_low = middle, value
            at_high /= 2 if moved == "low" else 1
            moved = "low"
        else:
            high, at_high = middle, value
            at_low /= 2 if moved == "high" else 1
            moved = "high"
    return middle
