"""State and reference in, wheel torques out: the path as a constraint, solved by Udwadia-Kalaba.

The rows of `constraints.rows` are orthonormal and M weighs x and y alike, so that the force of the
constraints (8) is M Aᵀ b - Q. It splits uniquely into the wheels' lateral reaction and the two
torques that make the climber obey: τR,L = r (F ± N/d) / 2.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from climber_uk.control.constraint_set import ConstraintSet
from climber_uk.control.model import predict
from climber_uk.mechanics import Array, pack
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.elementary import clipped, everywhere, tanh
from climber_uk.mechanics.quantities import (
    Bounds,
    DesiredAcceleration,
    Motion,
    ReferencePoint,
    Torques,
    Wrench,
)
from climber_uk.parameters.declaration import parameter, parameters

NOTHING = Wrench(0.0, 0.0)


@parameters
class ControlOptions:
    """How the torques are computed; see `ControlLaw`."""

    predict: bool = parameter(
        True, "", "aim at the middle of the period in which the torque acts", runtime=True
    )
    friction_speed: float = parameter(
        0.001, "m/s", "wanted speed below which friction's share fades", above=0, runtime=True
    )
    max_torque_rate: float = parameter(
        0.0, "N m/s", "fastest change of a torque; 0: none too fast", at_least=0, runtime=True
    )

    def lookahead(self, period: float) -> float:
        """From the begin of a torque's action of `period` [s] to the time it is computed for."""
        return 0.5 * period if self.predict else 0.0


class ControlInput(NamedTuple):
    """What the controller answers: the motion at which its torques will begin to act, and more."""

    motion: Motion
    held: Torques  # that act until then
    disturbance: Wrench  # see `Observer`
    period: float  # [s] for which the answer is going to act


class Command(NamedTuple):
    """What the controller answers; a wrench and a reaction in the body's frame."""

    wheels: Torques  # within the limits
    demanded: Wrench
    lateral: Any  # [N] reaction of the wheels
    lost: Wrench  # what the limits took away; of many, `NOTHING` if nothing from any of them

    @property
    def torques(self) -> Array:
        """Torques (..., 2) right, left [N m]."""
        return pack(*self.wheels)

    @property
    def constraint_force(self) -> Array:
        """Drive [N], lateral [N], about z [N m], (..., 3)."""
        return pack(self.demanded.drive, self.lateral, self.demanded.turn)

    @property
    def missing(self) -> Array:
        """Drive [N] and turn [N m] that the limits took away, (..., 2)."""
        return np.broadcast_to(pack(*self.lost), self.torques.shape)


@dataclass(frozen=True)
class ControlLaw:
    """The control law: a model of the climber and a constraint set."""

    climber: Climber
    constraints: ConstraintSet
    options: ControlOptions = field(default_factory=ControlOptions)

    def command(self, situation: ControlInput, target: ReferencePoint) -> Command:
        """Torques for a situation; `target` is that of half a period after it begins.

        The answer itself acts on the state it is for: it is computed twice, the second time
        knowing what it will be.
        """
        climber, (motion, held, (r_drive, r_turn), period) = self.climber, situation
        ahead = self.options.lookahead(period)
        prepared = self.constraints.prepare(target)
        right, left = self._fixed_bounds or self._bounds(situation)
        drive, turn = climber.wrench(held.right, held.left)
        for _ in range(2 if ahead else 1):
            aim = predict(climber, motion, drive + r_drive, turn + r_turn, ahead)
            wanted, turned, lateral = self.force(
                self.constraints.desired_acceleration(prepared, aim), aim
            )
            wanted, turned = wanted - r_drive, turned - r_turn
            drive, turn, one, other = climber.saturate(wanted, turned, right, left)
        wheels, demanded = Torques(one, other), Wrench(wanted, turned)
        fits = drive is wanted and turn is turned
        lost = NOTHING if fits else Wrench(wanted - drive, turned - turn)
        return Command(wheels, demanded, lateral, lost)

    def force(self, demand: DesiredAcceleration, motion: Motion) -> tuple[Any, Any, Any]:
        """M Aᵀ b - Q in the climber's frame: forward [N], about z [N m] and to the left [N]."""
        v_1, turning, speed = demand
        mass, inertia, friction, weight = self.climber.inertial
        friction = friction * tanh(speed / self.options.friction_speed)
        drive = mass * v_1 + friction + weight * motion.sine
        return drive, inertia * turning, self.climber.lateral_reaction(motion)

    def holding(self, situation: ControlInput, braking_rate: float) -> Torques:
        """Torques that carry the weight and brake what moves, at `braking_rate` [1/s]."""
        climber, motion = self.climber, situation.motion
        weight = climber.weight_along_wall * motion.sine
        drive = weight - climber.mass * braking_rate * motion.speed
        turn = -climber.yaw_inertia * braking_rate * motion.yaw_rate
        return Torques(*climber.saturate(drive, turn, *self._bounds(situation))[2:])

    @cached_property
    def _fixed_bounds(self) -> tuple[Bounds, Bounds] | None:
        """Those of `_bounds`, unless they depend on the situation."""
        climber = self.climber
        if not everywhere((climber.no_load_wheel_rate == 0) & (self.options.max_torque_rate == 0)):
            return None
        bounds = -climber.max_wheel_torque, climber.max_wheel_torque
        return bounds, bounds

    def _bounds(self, situation: ControlInput) -> tuple[Bounds, Bounds]:
        right, left = self.climber.bounds(situation.motion)
        if everywhere(self.options.max_torque_rate == 0):
            return right, left
        change = self.options.max_torque_rate * situation.period
        held = situation.held
        return _near(right, held.right, change), _near(left, held.left, change)


def _near(bounds: Bounds, torque: Any, change: Any) -> Bounds:
    lowest, highest = bounds
    return clipped(torque - change, lowest, highest), clipped(torque + change, lowest, highest)
