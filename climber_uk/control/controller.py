"""State and reference in, wheel torques out: the path as a constraint, solved by Udwadia-Kalaba.

The rows of `constraints.rows` are orthonormal and M weighs x and y alike, so that the force of the
constraints (8) is M Aᵀ b - Q. It splits uniquely into the wheels' lateral reaction and the two
torques that make the climber obey: τR,L = r (F ± N/d) / 2.
"""

from dataclasses import dataclass

from climber_uk.control.constraints import ConstraintSet
from climber_uk.control.model import rolled
from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.climber import Bounds, Climber, State
from climber_uk.mechanics.elementary import clipped, cos, sin, tanh
from climber_uk.mechanics.parameter import check, parameter
from climber_uk.mechanics.trajectory import Reference


@dataclass(frozen=True)
class Law:
    """How the torques are computed; see `Controller`."""

    predict: bool = parameter(
        True, "", "aim at the middle of the period in which the torque acts", runtime=True
    )
    friction_speed: float = parameter(
        0.002, "m/s", "wanted speed below which friction's share fades", above=0, runtime=True
    )
    max_torque_rate: float = parameter(
        0.0, "N m/s", "fastest change of a torque; 0: none too fast", at_least=0, runtime=True
    )

    def __post_init__(self) -> None:
        check(self)

    def lookahead(self, period: float) -> float:
        """From the begin of a torque's action of `period` [s] to the time it is computed for."""
        return period / 2 if self.predict else 0.0


@dataclass(frozen=True)
class Situation:
    """What the controller answers: the state at which its torques will begin to act, and more."""

    state: State
    held: Array  # (..., 2) torques acting until then, right, left [N m]
    disturbance: Array  # (..., 2) on drive [N] and turn [N m]; see `Observer`
    period: float  # [s] for which the answer is going to act


@dataclass(frozen=True)
class Command:
    """What the controller answers to a state."""

    torques: Array  # (..., 2) right, left [N m], within the limits
    constraint_force: Array  # (..., 3) drive [N], lateral [N], about z [N m], in the body's frame
    missing: Array  # (..., 2) drive [N] and turn [N m] that the limits took away


@dataclass(frozen=True)
class Controller:
    """The control law: a model of the climber and a constraint set."""

    climber: Climber
    constraints: ConstraintSet
    law: Law

    def command(self, situation: Situation, reference: Reference) -> Command:
        """Torques for a situation; `reference` is that of half a period after it begins.

        The answer itself acts on the state it is for: it is computed twice, the second time
        knowing what it will be.
        """
        ahead = self.law.lookahead(situation.period)
        torques = situation.held
        for _ in range(2 if ahead else 1):
            aim = rolled(self.climber, situation.state, torques, situation.disturbance, ahead)
            command = self._command(situation, aim, reference)
            torques = command.torques
        return command

    def _command(self, situation: Situation, state: State, reference: Reference) -> Command:
        climber, heading = self.climber, state.heading
        direction = tanh(self.constraints.speed(state, reference) / self.law.friction_speed)
        v_1, turning = self.constraints.demand(state, reference)
        weight, (r_drive, r_turn) = climber.weight_along_wall, unpack(situation.disturbance)
        # M Aᵀ b - Q in the climber's frame: forward, to the left, about z
        drive = climber.mass * v_1 + climber.seal_friction * direction + weight * sin(heading)
        drive = drive - r_drive
        lateral = climber.mass * state.forward_speed * state.yaw_rate + weight * cos(heading)
        turn = climber.yaw_inertia * turning - r_turn
        torques = self.limited(climber.wheel_torques(drive, turn), situation)
        got_drive, got_turn = climber.drive_and_turn(torques)
        return Command(
            torques=torques,
            constraint_force=pack(drive, lateral, turn),
            missing=pack(drive - got_drive, turn - got_turn),
        )

    def holding(self, situation: Situation, braking_rate: float) -> Array:
        """Torques (..., 2) that carry the weight and brake what moves, at `braking_rate` [1/s]."""
        climber, state = self.climber, situation.state
        weight = climber.weight_along_wall * sin(state.heading)
        drive = weight - climber.mass * braking_rate * state.forward_speed
        turn = -climber.yaw_inertia * braking_rate * state.yaw_rate
        return self.limited(climber.wheel_torques(drive, turn), situation)

    def limited(self, torques: Array, situation: Situation) -> Array:
        """Torques (..., 2) as near as the limits allow, turning served before driving."""
        right, left = self.climber.torque_bounds(situation.state)
        if self.law.max_torque_rate > 0:
            change = self.law.max_torque_rate * situation.period
            right_was, left_was = unpack(situation.held)
            right, left = _near(right, right_was, change), _near(left, left_was, change)
        return limited(torques, right, left)


def _near(bounds: Bounds, torque: Array, change: float) -> Bounds:
    return clipped(torque - change, *bounds), clipped(torque + change, *bounds)


def limited(torques: Array, right_bounds: Bounds, left_bounds: Bounds) -> Array:
    """Torques (..., 2) within each wheel's bounds, the turn served before the drive."""
    right, left = unpack(torques)
    (right_low, right_high), (left_low, left_high) = right_bounds, left_bounds
    turn = clipped((right - left) / 2, (right_low - left_high) / 2, (right_high - left_low) / 2)
    lowest, highest = right_low - turn, right_high - turn
    lowest = lowest + clipped(left_low + turn - lowest, 0.0, float("inf"))
    highest = highest - clipped(highest - (left_high + turn), 0.0, float("inf"))
    drive = clipped((right + left) / 2, lowest, highest)
    return pack(drive + turn, drive - turn)
