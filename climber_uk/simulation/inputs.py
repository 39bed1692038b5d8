"""What goes into a plant and what comes out of it, or does not."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from climber_uk.mechanics import Array, unpack
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.quantities import State

NO_PUSH = np.zeros(3)


class FellOff(Exception):  # noqa: N818 - it is what happened, not a mistake
    """Nothing holds the climber on its wall any more: what, its value and its bound."""

    def __init__(self, what: str, value: float, bound: float, unit: str) -> None:
        super().__init__(f"{what} {value:.4g} is below {bound:g}{unit and f' [{unit}]'}")
        self.what, self.value, self.bound = what, value, bound


class NotFinite(ArithmeticError):  # noqa: N818
    """The numbers of a plant have come to their end."""


class Inputs(NamedTuple):
    """What acts on a climber whatever it does [N, N m]."""

    force: float  # of the motors, along the climber
    moment: float  # of the motors, about it
    push_x: float  # in the wall's frame
    push_y: float
    push_moment: float

    @classmethod
    def of(cls, climber: Climber, torques: Array, push: Array) -> "Inputs":
        """Of wheel torques (2,) right, left, and a push (3,) in the wall's frame."""
        force: Any
        moment: Any
        force, moment = climber.force_and_moment(torques)
        if push is NO_PUSH:
            return cls(force, moment, 0.0, 0.0, 0.0)
        return cls(force, moment, *unpack(push))


@dataclass(frozen=True)
class PlantState(State):
    """Where a climber is, how it moves, and what else its contacts remember."""

    deflection: Array  # (3,) bristles of the seal: forward, to the left, around the ring [m]
    slip: Array  # (2,) forward speed of the right and left wheel's rim over the wall [m/s]

    @classmethod
    def of(cls, state: State) -> "PlantState":
        """`state`, with nothing bent and nothing slipping unless it says so."""
        if isinstance(state, cls):
            return state
        return cls(state.pose, state.velocity, np.zeros(3), np.zeros(2))
