"""State and reference in, wheel torques out: the path as a constraint, solved by Udwadia-Kalaba.

The rows of `constraint_set.rows` are orthonormal and M weighs x and y alike, so that the force of
the constraints (8) is M Aᵀ b - Q. It splits uniquely into the wheels' lateral reaction and the two
torques that make the climber obey: τR,L = r (F ± N/d) / 2.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from climber_uk.control.constraint_set import ConstraintSet, rows
from climber_uk.control.model import predict
from climber_uk.control.side_slip import Course
from climber_uk.mechanics import SECOND, Array, pack, unpack
from climber_uk.mechanics.climber import GRAVITY, Climber
from climber_uk.mechanics.elementary import clipped, everywhere, tanh
from climber_uk.mechanics.quantities import (
    Bounds,
    DesiredAcceleration,
    Motion,
    ReferencePoint,
    State,
    Torques,
    Wrench,
    along,
)
from climber_uk.mechanics.udwadia_kalaba import constraint_force
from climber_uk.mechanics.wall import Wall, gravity, weight, weight_beyond
from climber_uk.parameters.declaration import parameter, parameters

NOTHING = Wrench(0.0, 0.0)
CUT = 1e-9  # [N, N m] of a demand that limits have taken away
CLEARLY = 8.0  # as many times `friction_speed` is a speed whose friction is overcome in full
SLOPE = 0.8  # of friction's share by relative speed: steeper, and torques change faster
RESTS = 5.0  # of `friction_speed`: speed of a reference that may as well rest
TURN_SPEED = 0.05  # [rad/s] of a wanted yaw rate below which what resists turning fades
Ways = tuple[Any, Any]  # how clearly a reference `comes`, and stiction's share
Solve = Callable[..., tuple[Any, Any, Any, Any]]  # force, moment, v̇, yaw rate wanted


@parameters(slots=True)
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

    solver: str = parameter(
        "closed_form",
        "",
        "how the Udwadia-Kalaba equation is solved; generic: by matrices, the same to rounding, "
        "and slower",
        choices=("closed_form", "generic"),
    )

    def lookahead(self, period: float) -> float:
        """From the begin of a torque's action of `period` [s] to the time it is computed for."""
        return 0.5 * period if self.predict else 0.0


class ControlInput(NamedTuple):
    """What a command is computed for: the motion when its torques will begin to act, and more."""

    motion: Motion
    held: Torques  # [N m] of before, that act until then
    disturbance: Wrench  # without friction; see `Observer`
    period: float  # [s] for which the answer is going to act
    begins: int = 0  # [ns] when that begins
    friction: Any = 0.0  # [N] of the seal beyond the climber's
    turning: Any = 0.0  # [N m] that resists turning
    aside: Any = 0.0  # [m/s] at which wheels give way to the left
    course: Course | None = None  # None: where its heading is
    stiction: Any = 0.0  # share (-1 to 1) of friction that held it: see `DisturbanceEstimate`


class Braking(NamedTuple):
    """How what moves is braked; rates below 0 are for speeds that have the wrong sign."""

    drive: float  # [1/s]
    yaw: float  # [1/s]
    carries: float = 1.0  # share of the weight; -1 by motors that turn the wrong way round
    shaking: tuple[float, float] = (0.0, 0.0)  # [m/s²] beside that: of the speed, of a rim by yaw


class Command(NamedTuple):
    """What the controller answers; a wrench and a reaction in the body's frame."""

    wheels: Torques  # within the limits
    demanded: Wrench
    lateral: Any  # [N] reaction of the wheels
    lost: Wrench  # drive and moment that limits took away; of many, `NOTHING` if none of any
    motion: Motion  # for which it is computed
    forward: Any  # acceleration [m/s²] along it that was asked for
    yaw_rate: Any = 0.0  # wanted [rad/s]

    @property
    def torques(self) -> Array:
        """Torques (..., 2) right, left [N m]."""
        return pack(*self.wheels)

    @property
    def constraint_force(self) -> Array:
        """Drive [N], lateral [N], about z [N m], (..., 3): x, y, z of a wrench's message."""
        return pack(self.demanded.force, self.lateral, self.demanded.moment)

    @property
    def fits(self) -> Any:
        """Whether no limit took anything away: a bool, or an array (N,) of them."""
        force, moment = self.lost
        return (abs(force) <= CUT) & (abs(moment) <= CUT)


class ForceLaw(Protocol):
    """A control law in the place of the constraints: force and moment, whatever it is made of.

    A frozen dataclass of parameters, without a memory: it is asked twice for each answer, first
    for a guess of the motion. What is around the constraints stays around it: the prediction to
    where the torques act, the observer, whose disturbance is taken off what it asks for, the
    wheels' limits, time scaling, and the guard, which allows the speeds that the `constraints` may
    ask for. A way to the reference (`Approach`) is left to them, too.
    """

    def wrench(self, climber: Climber, target: ReferencePoint, motion: Motion) -> Wrench:
        """Drive [N] and yaw moment [N m] wanted of the wheels of a climber in `motion`.

        Numbers of any kind, or arrays where those of the motion are. They include what carries the
        climber's weight and overcomes its friction. `target` is the reference at the time of
        `motion`, both in the wall's frame. What is not finite, or raises `ValueError` or
        `ArithmeticError`, gives the safe output.
        """


@dataclass(frozen=True)
class ControlLaw:
    """The control law: a model of the climber and a constraint set, or another law. No memory.

    What it has to know of before comes in a `ControlInput`, from the `Estimator`.
    """

    climber: Climber
    constraints: ConstraintSet
    options: ControlOptions = field(default_factory=ControlOptions)
    other: ForceLaw | None = None  # in the constraints' place
    wall: Wall | None = None  # None: a plane that is not tilted

    def target_time(self, situation: ControlInput) -> int:
        """Time [ns] for which a situation's torques are computed: that of its `target`."""
        return situation.begins + round(self.options.lookahead(situation.period) * SECOND)

    def command(self, situation: ControlInput, target: ReferencePoint) -> Command:
        """Torques for a situation; `target` is that of `target_time`. May be not finite.

        A fixed-point iteration of two passes: the answer itself moves the state to the time that it
        is computed for, so the first pass predicts with `held`, the second with the first's result.
        """
        motion, held, (r_F, r_N), period, _, friction, turning, aside, course, stiction = situation
        climber = self.climber
        ahead = self.options.lookahead(period)
        prepared = self.constraints.prepare(target) if self.other is None else target
        bounds = self._fixed_bounds or climber.bounds(motion)
        near = None if everywhere(self.options.max_torque_rate == 0) else self._bounds(situation)
        solve, ways = self._solve, (self.comes(target), stiction)
        is_one = isinstance(motion.speed, float)
        drive, yaw_moment = climber.wrench(held.right, held.left)
        wall, push, left_pull = self.wall, r_F, 0.0
        if wall is not None:
            push = r_F + weight_beyond(wall, climber, motion, ahead)[0]
        for _ in range(2 if ahead else 1):
            force, moment = drive + push, yaw_moment + r_N
            predicted = motion
            if ahead:
                given = force, moment, ahead, friction, turning, aside
                predicted = predict(climber, motion, *given)
            answer = solve(prepared, predicted, ways, friction, turning, course)
            # a law of somebody else's may answer with numbers of another kind
            force, moment, v_1, yaw_rate = map(float, answer) if is_one else answer
            if wall is not None:
                forward_pull, left_pull = weight_beyond(wall, climber, predicted)
                force = force - forward_pull
            force, moment = force - r_F, moment - r_N
            drive, yaw_moment, tau_r, tau_l, fits = climber.saturate(force, moment, *bounds)
            lost = NOTHING if fits else Wrench(force - drive, moment - yaw_moment)
            if near is not None:  # a change that is yet to come is not lost
                drive, yaw_moment, tau_r, tau_l, _ = climber.saturate(drive, yaw_moment, *near)
        lateral = climber.lateral_reaction(predicted) - left_pull
        demanded, wheels = Wrench(force, moment), Torques(tau_r, tau_l)
        return Command(wheels, demanded, lateral, lost, predicted, v_1, yaw_rate)

    def direction(self, speed: Any, comes: Any, stiction: Any = 0.0) -> Any:
        """Friction's share and sign (-1 to 1) of a wanted speed [m/s], with a reference's `comes`.

        Along a reference that comes it is 1 until the reference rests, 0 well ahead of it; at rest
        it fades below `friction_speed`, but for the share that held the climber there.
        """
        relative = clipped(speed / self.options.friction_speed, -CLEARLY, CLEARLY)
        waits = clipped(1.0 + relative * comes / CLEARLY, 0.0, 1.0)
        return stiction + (1.0 - abs(stiction)) * tanh(SLOPE * waits * (relative + comes))

    def comes(self, target: ReferencePoint) -> Any:
        """How clearly a reference moves: ±`CLEARLY` forwards, backwards, and 0 at rest."""
        v = target.speed
        return CLEARLY * v / (abs(v) + RESTS * self.options.friction_speed)

    def closed_form(
        self,
        prepared: Any,
        motion: Motion,
        ways: Ways,
        friction: Any = 0.0,
        turning: Any = 0.0,
        course: Course | None = None,
    ) -> tuple[Any, Any, Any, Any]:
        """Qc = M Aᵀ b - Q (docs/theory.md, §4.2) in the climber's frame.

        Forward [N] and about z [N m]; and what is wanted: v̇ [m/s²] and the yaw rate [rad/s].
        Floats, or arrays (N,) of many climbers. `friction` [N] is that beyond the climber's, and
        `turning` [N m] resists.
        """
        v_1, yaw_acceleration, speed, yaw_rate = self._desired(prepared, motion, course)
        sideways = 0.0 if course is None else motion.yaw_rate * motion.speed * course.slope
        mass, inertia, modelled, weight = self.climber.inertial
        rubbing = (modelled + friction) * self.direction(speed, *ways)
        scrubbing = turning * tanh(yaw_rate / TURN_SPEED)
        force = mass * (v_1 - sideways) + rubbing + weight * motion.sine
        return force, inertia * yaw_acceleration + scrubbing, v_1, yaw_rate

    def _desired(self, prepared: Any, motion: Motion, course: Course | None) -> DesiredAcceleration:
        """What constraints ask of a climber on its `course`, which they take for its heading.

        What goes along it at V = v / cosβ is, to them, a climber whose wheels hold.
        """
        constraints = self.constraints
        if course is None:
            return constraints.desired_acceleration(prepared, motion)
        along = course.motion(motion)
        desired = constraints.desired_acceleration(prepared, along)
        forward = desired.forward * course.cosine - along.speed * course.sine * course.rate
        yaw, yaw_rate = desired.yaw - course.acceleration, desired.yaw_rate - course.rate
        return DesiredAcceleration(forward, yaw, desired.speed, yaw_rate)

    def generic(
        self,
        prepared: Any,
        motion: Motion,
        ways: Ways,
        friction: Any = 0.0,
        turning: Any = 0.0,
        course: Course | None = None,
    ) -> tuple[Any, Any, Any, Any]:
        """The same by its definition (8): Qc of M, Q and the rows A q̈ = b, split along the climber.

        Rows that constraints give themselves need no closed form; they know of no side slip.
        """
        heading, constraints, yaw_rate = motion.heading, self.constraints, 0.0
        ratio = 0.0 if course is None else course.slope
        state = State.moving(motion, ratio * motion.speed)
        if hasattr(constraints, "rows"):
            A, b, speed = constraints.rows(prepared, state)
        else:
            desired = self._desired(prepared, motion, course)
            speed, yaw_rate = desired.speed, desired.yaw_rate
            A, b = rows(state, desired, ratio, 0.0 if course is None else course.rate)
        direction = self.direction(speed, *ways)
        Q = self.climber.applied_force(heading, direction)
        Qc = constraint_force(self.climber.mass_matrix_at(heading), Q, A, b)
        scrubbing = turning * tanh(yaw_rate / TURN_SPEED)
        v_1 = (
            along(heading, Q + Qc) / self.climber.driven_mass
            + ratio * motion.speed * motion.yaw_rate
        )
        force, moment = along(heading, Qc) + friction * direction, unpack(Qc)[2] + scrubbing
        return force, moment, v_1, yaw_rate

    def of_forces(
        self,
        target: ReferencePoint,
        motion: Motion,
        ways: Ways,
        friction: Any = 0.0,
        *_unknown: Any,
    ) -> tuple[Any, Any, Any, Any]:
        """Force and moment of another law, which knows the climber's friction only, and v̇."""
        assert self.other is not None
        force, moment = self.other.wrench(self.climber, target, motion)
        mass, _, rubbing, weight = self.climber.inertial
        direction = self.direction(target.speed, *ways)
        v_1 = (force - rubbing * direction - weight * motion.sine) / mass
        return force + friction * direction, moment, v_1, 0.0

    def braking(self, situation: ControlInput, braking: Braking) -> Torques:
        """Torques that carry the weight and what else pushes or turns, and brake what moves."""
        climber, motion = self.climber, situation.motion
        weight = braking.carries * self.weight(motion)
        shaken, shaken_yaw = braking.shaking
        force = weight + climber.driven_mass * (shaken - braking.drive * motion.speed)
        turning = shaken_yaw / climber.half_track - braking.yaw * motion.yaw_rate
        push, turn = situation.disturbance
        moment = climber.driven_inertia * turning - turn
        return self.torques(force - push, moment, situation)

    def torques(self, force: Any, moment: Any, situation: ControlInput) -> Torques:
        """Those that give a force [N] and a moment [N m], or as much as limits leave of them."""
        return Torques(*self.climber.saturate(force, moment, *self._bounds(situation))[2:4])

    def weight(self, motion: Motion) -> Any:
        """Drive [N] that carries the weight."""
        return -weight(self.wall, self.climber, motion)[0]

    def gravity(self, motion: Motion) -> tuple[Any, Any, Any]:
        """Into the wall and along it [m/s²], and what the weight pulls to the left [N]."""
        wall, climber = self.wall, self.climber
        return *gravity(wall, climber, motion), weight(wall, climber, motion)[1]

    @property
    def falls(self) -> bool:
        """Whether its weight may be more than its seal holds."""
        climber = self.climber
        if self.wall is None:
            return climber.falls
        return climber.seal_friction < climber.mass * GRAVITY

    @cached_property
    def _solve(self) -> Solve:
        if self.other is not None:
            return self.of_forces
        return self.generic if self.options.solver == "generic" else self.closed_form

    @cached_property
    def _fixed_bounds(self) -> tuple[Bounds, Bounds] | None:
        """Those of `_bounds`, unless they depend on the situation."""
        climber = self.climber
        if not everywhere(climber.no_load_wheel_rate == 0):
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


def check_finite(torques: Torques) -> None:
    """Raise `ValueError` if a climber's torques are not finite; of many, each has its own."""
    right, left = torques
    is_one = isinstance(right, float) or np.ndim(right) == 0
    if is_one and not math.isfinite(right + left):
        raise ValueError(f"torques {torques} are not finite")
