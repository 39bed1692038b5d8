"""Steps of a climber whose wheels do not slip: its seal sticks, slides, and changes between them.

Friction of a seal without radius is exact: it slides against the motion or, at rest, takes whatever
value up to its stiction holds the climber still; the instant of change is located in the step.
"""

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.simulation.inputs import Inputs
from climber_uk.simulation.rigid_body import SETTLED, RigidBody, forward_speed

# More changes between sticking and sliding than this within one step are not followed.
MAX_CHANGES_IN_A_STEP = 8
# Rate of friction times a part of a step, at most: Runge-Kutta is stable up to 2.8.
STIFF = 0.5
MAX_PARTS = 100  # of a step; stiffer friction is left to an implicit method


class NoSlipStepper:
    """Steps of a rigid body without side slip; y as in `RigidBody`."""

    def __init__(self, body: RigidBody) -> None:
        self.body = body

    @cached_property
    def sticks(self) -> bool:
        """Whether the friction law has stiction."""
        return bool(self.body.contact.friction.stiction(1.0) > 0)

    def step(self, y: Array, inputs: Inputs) -> Array | None:
        """y after a step; None if a ring comes to rest or starts, or friction is too stiff."""
        if not self.sticks:
            return self._in_parts(y, inputs)
        if self.body.contact.grip.seal_radius == 0:
            return self.exact_step(y, inputs) if self.is_soft else None
        rests = not y[3:6].any()
        if rests and self._ring_sticks(y, inputs):
            return y
        if rests or self._creeps(y):
            return None
        end = self._in_parts(y, inputs)
        return None if end is None or self._creeps(end) else end

    def accelerations(self, y: Array, inputs: Inputs) -> tuple[float, float]:
        """Forward acceleration v̇ [m/s²] and yaw acceleration ω̇ [rad/s²] at y."""
        radius = self.body.contact.grip.seal_radius
        if self.sticks and radius > 0 and not y[3:6].any():
            return 0.0, 0.0
        direction = self._direction(y, inputs) if self.sticks and radius == 0 else None
        *_, v_x_1, v_y_1, omega_1 = self.body.derivative(y.tolist(), inputs, direction)[:6]
        return v_x_1 * math.cos(y[2]) + v_y_1 * math.sin(y[2]), omega_1

    # A seal without radius

    def exact_step(self, y: Array, inputs: Inputs) -> Array:
        """y after a step, in which a seal without radius may stick and slide."""
        for _ in range(self._steep_parts):
            y = self._exact_part(y, inputs, self.body.step / self._steep_parts)
        return y

    @cached_property
    def _steep_parts(self) -> int:
        """Parts of a step that are short enough for the friction's slope over speed."""
        steepness = self.body.contact.friction.steepness(self.body.friction)
        parts = math.ceil(
            min(self.body.step * steepness / self.body.climber.driven_mass / STIFF, 1e9)
        )
        return max(1, parts)

    @property
    def is_soft(self) -> bool:
        """Whether `MAX_PARTS` are enough for a seal without radius."""
        return self._steep_parts <= MAX_PARTS

    def _exact_part(self, y: Array, inputs: Inputs, left_over: float) -> Array:
        """y after `left_over` [s], with each change between sticking and sliding located."""
        direction = self._direction(y, inputs)
        for _ in range(MAX_CHANGES_IN_A_STEP):
            end = self.body.runge_kutta(y, inputs, direction, left_over)
            if self._margin(end, inputs, direction) >= 0:
                return end
            y, until = self._until_change(y, inputs, direction, left_over)
            left_over -= until
            gave_way = direction == 0
            push = self.body.push(y, inputs)
            direction = float(np.sign(push)) if gave_way else self._direction(y, inputs)
        return self.body.runge_kutta(y, inputs, direction, left_over)

    def _direction(self, y: Array, inputs: Inputs) -> float:
        """Direction in which the seal slides: 1 forwards, -1 backwards, 0 where it sticks."""
        speed = forward_speed(y)
        if speed != 0:
            return 1.0 if speed > 0 else -1.0
        push = self.body.push(y, inputs)
        return 0.0 if abs(push) <= self.body.stiction else float(np.sign(push))

    def _margin(self, y: Array, inputs: Inputs, direction: float) -> float:
        """Below 0 once sliding in `direction` has ended [m/s] or, for 0, sticking has [N]."""
        if direction == 0:
            return self.body.stiction - abs(self.body.push(y, inputs))
        return direction * forward_speed(y)

    def _until_change(
        self, y: Array, inputs: Inputs, direction: float, step: float
    ) -> tuple[Array, float]:
        """y at the instant within `step` [s] at which `_margin` reaches 0, and that instant [s]."""

        def margin(duration: float) -> float:
            end = self.body.runge_kutta(y, inputs, direction, duration)
            return self._margin(end, inputs, direction)

        until = _zero(margin, 0.0, step) if margin(0.0) > 0 else 0.0
        changed = self.body.runge_kutta(y, inputs, direction, until)
        changed[3:5] = 0.0  # not merely small: at rest is what friction can hold
        return changed, until

    # A ring, or friction without an edge

    def _ring_sticks(self, y: Array, inputs: Inputs) -> bool:
        """Whether stiction of a ring holds the climber against force and moment."""
        around = (inputs.moment + inputs.push_moment) / self.body.contact.grip.seal_radius
        return math.hypot(self.body.push(y, inputs), around) <= self.body.stiction

    def _sliding_speed(self, y: Array) -> float:
        return math.hypot(forward_speed(y), self.body.contact.grip.seal_radius * float(y[5]))

    @cached_property
    def _lightest(self) -> float:
        """Least mass that the seal's friction acts on: m, or J/R² of a ring, with rotors [kg]."""
        mass, inertia, *_ = self.body.climber.inertial
        radius = self.body.contact.grip.seal_radius
        return min(mass, inertia / radius**2) if radius > 0 else mass

    def _creeps(self, y: Array) -> bool:
        """Whether a ring slides so slowly that its friction changes direction within a step."""
        fastest = self.body.stiction * self.body.step
        return fastest > STIFF * self._lightest * self._sliding_speed(y)

    def _in_parts(self, y: Array, inputs: Inputs) -> Array | None:
        """y after a step, in as many parts as friction is stiff; None if it is too stiff."""
        body, bristles = self.body, self.body.bristles
        rate = body.contact.friction.steepness(body.friction) / self._lightest
        if bristles is not None:
            stiffness = bristles.stiffness(body.friction) / self._lightest
            rate += math.sqrt(stiffness) + bristles.damping_time * stiffness
            rate += min(bristles.relaxation(self._sliding_speed(y)), SETTLED / body.step)
        parts = max(1, math.ceil(min(body.step * rate / STIFF, 1e9)))
        if parts > MAX_PARTS:
            return None
        for _ in range(parts):
            y = body.runge_kutta(y, inputs, None, body.step / parts)
        speed = self._sliding_speed(y)
        if bristles is not None and body.has_settled(speed):
            around = body.contact.grip.seal_radius * float(y[5])
            y[6:] = np.array([forward_speed(y), 0.0, around]) / bristles.relaxation(speed)
        return y


def _zero(function: Callable[[float], float], low: float, high: float) -> float:
    """Root of `function` between `low` and `high`, by the Illinois method (doi 10.1007/BF01934364).

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
