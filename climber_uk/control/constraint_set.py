"""The reference as a constraint on the climber: the accelerations with which it is met.

A constraint set says what forward acceleration v̇ and yaw acceleration θ̈ it asks for. As rows of
A q̈ = b these are [cosθ sinθ 0] q̈ = v̇ and [0 0 1] q̈ = θ̈; the wheels' no-slip row is the third.
"""

import dataclasses
from typing import Any, Protocol

import numpy as np

from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.climber import no_slip
from climber_uk.mechanics.quantities import DesiredAcceleration, Motion, ReferencePoint, State
from climber_uk.mechanics.reference import Reference


class ConstraintSet(Protocol):
    """What makes the climber follow a reference, with gains as fields.

    The fields are numbers: where gains change while it runs, old and new ones are blended.

    A set that is not of this form has, in the place of `desired_acceleration`, a method
    `rows(prepared, state)` that gives A (p, 3), b (p,), no-slip included, and the speed wanted
    [m/s]; the option `solver` must be `generic` for it.
    """

    def prepare(self, target: ReferencePoint) -> Any:
        """All that can be computed of a reference before the climber's motion is known.

        It is done once for an answer, or for many climbers.
        """

    def desired_acceleration(self, prepared: Any, motion: Motion) -> DesiredAcceleration:
        """Accelerations that the constraints ask of a climber in `motion`.

        Floats of one, or arrays (N,) of many, go through the same lines: no `if` on numbers, but
        `select`, `either` and `everywhere` of `mechanics.elementary`. The `speed` is that whose
        sign friction will have.
        """

    def fastest(self, speed: float, yaw_rate: float) -> tuple[float, float]:
        """Largest speed [m/s] and yaw rate [rad/s] asked for on a reference with these at most."""


def blended(before: ConstraintSet, after: ConstraintSet, share: float) -> ConstraintSet:
    """`after`, with gains `share` (0 to 1) of the way from those of `before` to its own."""
    gains = {
        field.name: (1 - share) * getattr(before, field.name) + share * getattr(after, field.name)
        for field in dataclasses.fields(after)  # type: ignore[arg-type]
        if isinstance(field.default, float)
    }
    return dataclasses.replace(after, **gains)  # type: ignore[type-var]


def demanded(constraints: ConstraintSet, state: State, reference: Reference) -> DesiredAcceleration:
    """Accelerations (...) that constraints ask of a climber in `state` (...)."""
    return constraints.desired_acceleration(constraints.prepare(reference.target), state.motion)


def rows(
    state: State, desired: DesiredAcceleration, slip: float = 0.0, rate: float = 0.0
) -> tuple[Array, Array]:
    """A (..., 3, 3) and b (..., 3) of desired accelerations and of no-slip (18); A Aᵀ = 1.

    Wheels that give way sideways at v_y = `slip` v, of a course that turns from the heading at
    `rate` [rad/s], have [sinθ -cosθ 0] q̇ = -v_y in the place of (17).
    """
    slip_row, slip_b = no_slip(state)
    v, omega = state.forward_speed, state.yaw_rate
    slip_b = slip_b - slip * desired.forward - v * (1 + slip * slip) * rate
    forward = desired.forward - omega * slip * v
    sine, minus_cosine, zero = unpack(slip_row)
    A = np.stack([pack(-minus_cosine, sine, zero), pack(zero, zero, zero + 1), slip_row], axis=-2)
    return A, pack(forward, desired.yaw, slip_b)
