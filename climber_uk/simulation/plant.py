"""The climber on its wall: state and wheel torques in, state out, in steps of fixed length (§11).

Smooth motion is integrated by Runge-Kutta (`rigid_body`), sticking and sliding of the seal are
exact (`rolling`), and contacts that stick and slip in several directions are implicit (`sliding`).
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact, is_pulled_off
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.wall import Plane, Wall
from climber_uk.simulation.inputs import NO_PUSH, FellOff, Inputs, NotFinite, PlantState
from climber_uk.simulation.rigid_body import RigidBody, forward_speed
from climber_uk.simulation.rolling import NoSlipStepper
from climber_uk.simulation.sliding import ContactStepper

CONTACT, UPRIGHT = Contact(), Plane()
SIDEWAYS = 1e-9  # of the speed, and of 1 m/s: side slip that is more than rounding


@dataclass(frozen=True)
class Plant:
    """A climber with its contacts and its wall; keeps no state, and takes one climber at a time.

    Raises `ValueError` if `step` is not positive, or a wheel has more inertia than the climber.
    """

    climber: Climber
    step: float  # [s]
    contact: Contact = CONTACT
    wall: Wall = UPRIGHT
    slip: bool = False  # whether wheels slip where their load does not suffice

    def __post_init__(self) -> None:
        if not self.step > 0:
            raise ValueError(f"step={self.step!r} must be > 0 [s]")
        if self.slip:
            _ = self._sliding  # raises if wheels are too heavy

    def advance(self, state: State, torques: Array, steps: int, push: Array = NO_PUSH) -> State:
        """State after `steps` steps under constant wheel torques (2,) (right, left) [N m].

        `push` (3,) acts on the centre of mass, in the wall's frame [N, N, N m]. Raises `FellOff`
        where the climber comes off its wall, `NotFinite` where the state is not finite.
        """
        inputs = Inputs.of(self.climber, torques, push)
        try:
            end = self._advance(state, inputs, steps)
        except (ValueError, ArithmeticError, RuntimeWarning) as error:  # numpy warns, or raises
            raise NotFinite(f"{error} in {steps} steps from {state}") from None
        if not math.isfinite(sum(end.pose.tolist()) + sum(end.velocity.tolist())):
            raise NotFinite(f"{end} after {steps} steps from {state}")
        return end

    def _advance(self, state: State, inputs: Inputs, steps: int) -> State:
        y = np.concatenate([state.pose, state.velocity])
        if self._is_plain:
            step, attached = self._rolling.exact_step, self._is_attached_everywhere
            for _ in range(steps):
                if not attached:
                    self._check_attached_at(y)
                y = step(y, inputs)
            return State(y[:3], y[3:])
        more = PlantState.of(state)
        y, slip = np.concatenate([y, more.deflection]), more.slip
        for _ in range(steps):
            self._check_attached(y)
            y, slip = self._step(y, slip, inputs)
        return PlantState(y[:3], y[3:6], y[6:], slip)

    def wheel_rates(self, state: State) -> Array:
        """Rates (2,) of the wheels (right, left) [rad/s], their slip included."""
        rates = self.climber.wheel_rates(state)
        if isinstance(state, PlantState):
            rates = rates + state.slip / self.climber.wheel_radius
        return rates

    def as_wheels_tell(self, state: State) -> State:
        """State that odometry from the wheels would show: rolling as they rotate."""
        if not (isinstance(state, PlantState) and state.slip.any()):
            return state
        climber = self.climber
        right, left = (climber.wheel_radius * self.wheel_rates(state)).tolist()
        yaw_rate = (right - left) / (2 * climber.half_track)
        return State.rolling(state.pose, (right + left) / 2, yaw_rate)

    def wheel_load(self, state: State) -> float:
        """Load N_w on the wheels [N]."""
        return self._load(np.concatenate([state.pose, state.velocity]))

    def margins(self, state: State, torques: Array, push: Array = NO_PUSH) -> tuple[float, float]:
        """Slip and tip margin (§7) under wheel torques (2,) [N m] and a push (3,) [N, N, N m]."""
        climber, inputs = self.climber, Inputs.of(self.climber, torques, push)
        y = np.concatenate([state.pose, state.velocity])
        into, along = self._body.gravity(y)
        lateral = self._body.lateral(y, inputs, climber.mass)
        yaw_force = inputs.moment / climber.half_track
        forces = (inputs.force + yaw_force) / 2, (inputs.force - yaw_force) / 2
        across = self._body.across(y, inputs)
        return (
            float(self.contact.slip_margin(climber, into, forces, lateral, across)),
            float(self.contact.tip_margin(climber, into, along)),
        )

    @cached_property
    def _body(self) -> RigidBody:
        return RigidBody(self.climber, self.contact, self.wall, self.step)

    @cached_property
    def _rolling(self) -> NoSlipStepper:
        return NoSlipStepper(self._body)

    @cached_property
    def _sliding(self) -> ContactStepper:
        return ContactStepper(self._body, self.slip)

    @cached_property
    def _is_plain(self) -> bool:
        """Whether seal friction along the climber is all that may stick."""
        is_plain = self.contact.grip.seal_radius == 0
        is_plain &= self.contact.locomotion.turning_resistance(1.0) == 0
        is_plain &= self._rolling.is_soft
        return self._rolling.sticks and is_plain and not self.slip

    def _load(self, y: Array) -> float:
        return float(self.contact.wheel_load(self.climber, self._body.into_wall(y)))

    def _step(self, y: Array, slip: Array, inputs: Inputs) -> tuple[Array, Array]:
        """(y, rims' slip) after a step, implicit if a contact may change in it."""
        is_regular = not (slip.any() or (self.slip and self._sliding.scrubs))
        end = self._regular_step(y, inputs) if is_regular else None
        if end is not None:
            return end, slip
        return self._sliding.advance(y, slip, inputs, self._load(y))

    def _regular_step(self, y: Array, inputs: Inputs) -> Array | None:
        """y after a step in which no contact changes between sticking and slipping; else None."""
        load, moment = self._load(y), inputs.moment + inputs.push_moment
        resistance = float(self.contact.locomotion.turning_resistance(load))
        direction = float(np.sign(y[5]))  # of the resistance, against the yaw rate or the moment
        if direction == 0 and resistance > 0:
            if abs(moment) > resistance:
                return None
            direction = moment / resistance
        resisted = inputs._replace(push_moment=inputs.push_moment - resistance * direction)
        if not self._wheels_stick(y, inputs, resisted):
            return None
        end = self._rolling.step(y, resisted)
        if end is None or (resistance > 0 and y[5] != 0 and end[5] * direction <= 0):
            return None
        return end if self._wheels_stick(end, inputs, resisted) else None

    def _wheels_stick(self, y: Array, inputs: Inputs, resisted: Inputs) -> bool:
        """Whether no wheel slips at y; `resisted` are the inputs with the tracks' resistance."""
        if not self.slip:
            return True
        if abs(State(y[:3], y[3:6]).side_slip) > SIDEWAYS * (1 + abs(forward_speed(y))):
            return False
        rates = self._rolling.accelerations(y, resisted)
        return self._sliding.wheels_stick(y, inputs, rates, self._load(y))

    @cached_property
    def _is_attached_everywhere(self) -> bool:
        if self.wall.flat:
            self._check_attached_at(np.zeros(6))
        return self.wall.flat

    def _check_attached(self, y: Array) -> None:
        if not self._is_attached_everywhere:
            self._check_attached_at(y)

    def _check_attached_at(self, y: Array) -> None:
        """Raise `FellOff` where the climber is pulled off its wall, or tipped off it."""
        normal = float(self.contact.normal_force(self.climber, self._body.into_wall(y)))
        if is_pulled_off(self.climber, normal):
            raise FellOff("force onto the wall", normal, 0.0, "N")
        _, tip = self.margins(State(y[:3], y[3:6]), np.zeros(2))
        if tip < 1:
            raise FellOff("tip margin", tip, 1.0, "")
