"""State and reference in, wheel torques out: the path as a constraint, solved by Udwadia-Kalaba.

The rows of `constraints.rows` are orthonormal and M weighs x and y alike, so that the force of the
constraints (8) is M Aᵀ b - Q. It splits uniquely into the wheels' lateral reaction and the two
torques that make the climber obey: τR,L = r (F ± N/d) / 2.
"""

from dataclasses import dataclass

from climber_uk.control.constraints import ConstraintSet
from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.climber import Climber, State
from climber_uk.mechanics.elementary import clipped, cos, select, sign, sin, tanh
from climber_uk.mechanics.parameter import check, parameter
from climber_uk.mechanics.trajectory import Reference


@dataclass(frozen=True)
class Timing:
    """When a torque acts: half a period after the state it answers, in the mean, plus a delay.

    The torque is held from one odometry to the next, so it is computed for the middle of that
    time, from the state that the model predicts there.
    """

    control_period: float = parameter(
        0.005, "s", "time from one odometry to the next", above=0, at_most=1
    )
    transport_delay: float = parameter(
        0.0, "s", "from an odometry's stamp to its torque at the wheels", at_least=0, runtime=True
    )
    predict: bool = parameter(
        True, "", "aim at the middle of the period in which the torque acts", runtime=True
    )

    def __post_init__(self) -> None:
        check(self)

    @property
    def lookahead(self) -> float:
        """From the odometry's stamp to the time that torque and reference are for [s]."""
        return self.transport_delay + self.half_period

    @property
    def half_period(self) -> float:
        """From when a torque acts to the time it is computed for [s]."""
        return self.control_period / 2 if self.predict else 0.0


@dataclass(frozen=True)
class Command:
    """What the controller answers to a state."""

    torques: Array  # (..., 2) right, left [N m], within the limit
    constraint_force: Array  # (..., 3) drive [N], lateral [N], about z [N m], in the body's frame
    saturated: Array  # (...) whether the limit cut the torques


@dataclass(frozen=True)
class Controller:
    """The control law: a model of the climber, a constraint set and the loop's timing.

    `friction_speed` [m/s] is where feed-forward of Coulomb friction fades to 0 around rest.
    """

    climber: Climber
    constraints: ConstraintSet
    timing: Timing
    friction_speed: float = 0.01

    def command(self, state: State, reference: Reference, held: Array) -> Command:
        """Torques to answer `state` with.

        `reference` is the one `timing.lookahead` after the state, `held` (..., 2) the torques
        acting until the answer does. The answer itself acts on the state it is for: it is
        computed twice, the second time knowing what it will be.
        """
        arrived = self._rolled_on(state, held, self.timing.transport_delay)
        torques = held
        for _ in range(2 if self.timing.predict else 1):
            aim = self._rolled_on(arrived, torques, self.timing.half_period)
            command = self._law(aim, reference)
            torques = command.torques
        return command

    def _law(self, state: State, reference: Reference) -> Command:
        climber, heading = self.climber, state.heading
        direction = tanh(self.constraints.speed(state, reference) / self.friction_speed)
        v_1, turning = self.constraints.demand(state, reference)
        weight = climber.weight_along_wall
        # M Aᵀ b - Q in the climber's frame: forward, to the left, about z
        drive = climber.mass * v_1 + climber.seal_friction * direction + weight * sin(heading)
        lateral = climber.mass * state.forward_speed * state.yaw_rate + weight * cos(heading)
        turn = climber.yaw_inertia * turning
        wanted = climber.wheel_torques(drive, turn)
        torques = limited(wanted, climber.max_wheel_torque)
        return Command(
            torques=torques,
            constraint_force=pack(drive, lateral, turn),
            saturated=(torques != wanted).any(axis=-1),
        )

    def _rolled_on(self, state: State, torques: Array, h: float) -> State:
        """State after `h` [s] as the model rolls on under `torques`, to second order."""
        if h == 0:
            return state
        drive, _ = self.climber.drive_and_turn(torques)
        push = drive - self.climber.weight_along_wall * sin(state.heading)
        held = clipped(push / max(self.climber.seal_friction, 1e-9), 1)
        speed = state.forward_speed
        direction = select(abs(speed) > self.friction_speed, sign(speed), held)
        acceleration = self.climber.rolling_acceleration(state, torques, direction)
        return State(
            state.pose + h * state.velocity + h**2 / 2 * acceleration,
            state.velocity + h * acceleration,
        )

    def holding(self, state: State, braking_rate: float) -> Array:
        """Torques (..., 2) that carry the weight and brake what moves, at `braking_rate` [1/s]."""
        climber = self.climber
        weight = climber.weight_along_wall * sin(state.heading)
        drive = weight - climber.mass * braking_rate * state.forward_speed
        turn = -climber.yaw_inertia * braking_rate * state.yaw_rate
        return limited(climber.wheel_torques(drive, turn), climber.max_wheel_torque)


def limited(torques: Array, limit: float) -> Array:
    """Torques (..., 2) within ±`limit` [N m], turning served before driving."""
    right, left = unpack(torques)
    turn = clipped((right - left) / 2, limit)
    drive = clipped((right + left) / 2, limit - abs(turn))
    return pack(drive + turn, drive - turn)
