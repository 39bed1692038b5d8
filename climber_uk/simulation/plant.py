"""The climber on its wall: the corrected integration (30) of given torques, without side slip.

    q̇ = v + M^(-1/2) B⁺ (b_q - A v),   v̇ = a + M^(-1/2) B⁺ (b - A a)

(30) alone lets v drift away from q̇, because b depends on the velocity. Here b is taken at the
corrected velocity q̇, and after each step v is replaced by q̇: the rows then hold for both.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from climber_uk.mechanics import Array, unpack
from climber_uk.mechanics.climber import Climber, State
from climber_uk.mechanics.elementary import cos, sin

# More changes between sticking and sliding than this within one step are not followed.
MAX_CHANGES_IN_A_STEP = 8


@dataclass(frozen=True)
class Plant:
    """A climber integrated in steps of fixed length by the classic Runge-Kutta method.

    Coulomb friction of the seal is exact: it slides at f against the motion or, at rest, takes
    whatever value up to f holds the climber still; the instant of change is located within the
    step. One climber at a time. Raises `ValueError` if `step` is not positive.
    """

    climber: Climber
    step: float  # [s]

    def __post_init__(self) -> None:
        if not self.step > 0:
            raise ValueError(f"step={self.step!r} must be > 0 [s]")

    def advance(self, state: State, torques: Array, steps: int) -> State:
        """State after `steps` steps under constant wheel torques (2,) (right, left) [N m]."""
        y = np.concatenate([state.pose, state.velocity])
        for _ in range(steps):
            y = self._one_step(y, torques)
        return State(y[:3], y[3:])

    def _one_step(self, y: Array, torques: Array) -> Array:
        left_over = self.step
        direction = self._direction(y, torques)
        for _ in range(MAX_CHANGES_IN_A_STEP):
            end = self._runge_kutta(y, torques, direction, left_over)
            if self._margin(end, torques, direction) >= 0:
                return end
            y, until = self._until_change(y, torques, direction, left_over)
            left_over -= until
            gave_way = direction == 0
            push = self._push(y, torques)
            direction = float(np.sign(push)) if gave_way else self._direction(y, torques)
        return self._runge_kutta(y, torques, direction, left_over)

    def _direction(self, y: Array, torques: Array) -> float:
        """Way the seal slides: 1 forwards, -1 backwards, 0 where friction holds it."""
        speed, push = _forward_speed(y), self._push(y, torques)
        if speed == 0 and abs(push) <= self.climber.seal_friction:
            return 0.0
        return float(np.sign(speed or push))

    def _margin(self, y: Array, torques: Array, direction: float) -> float:
        """Falls below 0 where sliding in `direction` ends or, for 0, where friction gives way."""
        if direction == 0:
            return self.climber.seal_friction - abs(self._push(y, torques))
        return direction * _forward_speed(y)

    def _push(self, y: Array, torques: Array) -> float:
        """Force along the climber that friction is up against [N]."""
        drive, _ = self.climber.drive_and_turn(torques)
        return float(drive - self.climber.weight_along_wall * sin(float(y[2])))

    def _until_change(
        self, y: Array, torques: Array, direction: float, step: float
    ) -> tuple[Array, float]:
        """State at the instant within `step` at which `_margin` reaches 0, and that instant."""

        def margin(duration: float) -> float:
            end = self._runge_kutta(y, torques, direction, duration)
            return self._margin(end, torques, direction)

        until = brentq(margin, 0.0, step, xtol=1e-15) if margin(0.0) > 0 else 0.0
        changed = self._runge_kutta(y, torques, direction, until)
        changed[3:5] = 0.0  # not merely small: at rest is what friction can hold
        return changed, until

    def _runge_kutta(self, y: Array, torques: Array, direction: float, h: float) -> Array:
        k1 = self._derivative(y, torques, direction)
        k2 = self._derivative(y + h / 2 * k1, torques, direction)
        k3 = self._derivative(y + h / 2 * k2, torques, direction)
        k4 = self._derivative(y + h * k3, torques, direction)
        end = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        end[3:] = self._derivative(end, torques, direction)[:3]
        return end

    def _derivative(self, y: Array, torques: Array, direction: float) -> Array:
        """(q̇, v̇) of (30) at y = (q, v), both (3,).

        A = [sinθ -cosθ 0] has unit length and M weighs x and y alike, so that M^(-1/2) B⁺ = Aᵀ.
        While friction holds the climber, [cosθ sinθ 0] is a second such row with b_q = b = 0.
        """
        climber = self.climber
        _, _, heading, v_x, v_y, yaw_rate = unpack(y)
        cosine, sine = cos(heading), sin(heading)
        drive, turn = climber.drive_and_turn(torques)
        yaw_acceleration = turn / climber.yaw_inertia
        if direction == 0:
            return np.array([0.0, 0.0, yaw_rate, 0.0, 0.0, yaw_acceleration])

        A_v = sine * v_x - cosine * v_y
        x_dot, y_dot = v_x - sine * A_v, v_y + cosine * A_v

        force = drive - climber.seal_friction * direction
        a_x = force * cosine / climber.mass
        a_y = (force * sine - climber.weight_along_wall) / climber.mass
        b = -yaw_rate * (x_dot * cosine + y_dot * sine)
        b_minus_A_a = b - (sine * a_x - cosine * a_y)
        return np.array(
            [
                *(x_dot, y_dot, yaw_rate),
                *(a_x + sine * b_minus_A_a, a_y - cosine * b_minus_A_a, yaw_acceleration),
            ]
        )


def _forward_speed(y: Array) -> float:
    _, _, heading, v_x, v_y, _ = unpack(y)
    return float(v_x * cos(heading) + v_y * sin(heading))
