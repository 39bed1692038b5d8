"""Inputs and states of a plant, and the exceptions that end a simulation."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from climber_uk.mechanics import Array, unpack
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State

NO_PUSH = np.zeros(3)


class FellOff(Exception):  # noqa: N818 - it is what happened, not a mistake
    """The climber has come off its wall: `what` is below its bound, and by which value."""

    def __init__(self, what: str, value: float, bound: float, unit: str) -> None:
        super().__init__(f"{what} {value:.4g} is below {bound:g}{unit and f' [{unit}]'}")
        self.what, self.value, self.bound = what, value, bound


class NotFinite(ArithmeticError):  # noqa: N818
    """A state that is not finite, or arithmetic that failed on the way to it."""


class Inputs(NamedTuple):
    """Forces and moments on a climber, constant during a step [N, N m]."""

    force: float  # of the wheels, along the climber
    moment: float  # of the wheels, about its vertical
    push_x: float  # external, in the wall's frame
    push_y: float
    push_moment: float

    @classmethod
    def of(cls, climber: Climber, torques: Array, push: Array) -> "Inputs":
        """Inputs of wheel torques (2,) (right, left) [N m] and a push (3,) in the wall's frame."""
        force: Any
        moment: Any
        force, moment = climber.force_and_moment(torques)
        if push is NO_PUSH:
            return cls(force, moment, 0.0, 0.0, 0.0)
        return cls(force, moment, *unpack(push))


@dataclass(frozen=True)
class PlantState(State):
    """State of a plant: pose, velocity, and the memory of its contacts."""

    deflection: Array  # (3,) bristles of the seal: forward, to the left, around the ring [m]
    slip: Array  # (2,) forward speed of the right and left wheel's rim over the wall [m/s]

    @classmethod
    def of(cls, state: State) -> "PlantState":
        """`state` if it is a `PlantState`, else with bristles at rest and wheels that roll."""
        if isinstance(state, cls):
            return state
        return cls(state.pose, state.velocity, np.zeros(3), np.zeros(2))
