"""Batches of closed loops, made from the parameters of the nodes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from climber_uk.campaign.names import REQUIRED, SEED, WITHOUT
from climber_uk.closed_loop.batch import Change, Loops
from climber_uk.closed_loop.node_parameters import PARAMETERS
from climber_uk.closed_loop.period import BatchRun
from climber_uk.closed_loop.start import begun_there
from climber_uk.control.build import settings
from climber_uk.mechanics.adhesion import Grip
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.quantities import Motion
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.mechanics.wall import told
from climber_uk.messages.topics import CONTROLLER, PLANNER, PLANT
from climber_uk.parameters.parameter_file import Values
from climber_uk.simulation.options import SimulationOptions
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import Physics

T = TypeVar("T")
GAUGE = 0.05  # [s] period of `suction_pressure`


@dataclass(frozen=True)
class Node:
    """Parameters of one node, among those of all."""

    name: str
    values: Mapping[str, Any]  # by full name, of all nodes

    def read(self, kind: type[T], prefix: str = "") -> T:
        """Instance of `kind`; raises `ValueError` naming parameter, value and bound."""
        return Values(self.values).read(kind, f"{self.name}.{prefix}")


@dataclass(frozen=True)
class Scenario:
    """Values that all runs share; raises `ValueError` for one that a campaign cannot have."""

    values: Mapping[str, Any]  # of parameters, by full name
    duration: float  # [s]
    backend: str = "numpy"  # see `BatchRun`

    def __post_init__(self) -> None:
        defaults = {name: PARAMETERS[name].default for name in REQUIRED} | WITHOUT
        for name, wanted in (REQUIRED | WITHOUT).items():
            value = self.values.get(name, defaults[name])
            if value != wanted:
                raise ValueError(f"{name}={value!r} must be {wanted!r} in a campaign")

    def course(self) -> BatchRun:
        """Trajectory, duration and timing of all runs; raises as `Node.read` does."""
        options = Node(PLANT, self.values).read(SimulationOptions)
        trajectory = begun_there(build_trajectory(Node(PLANNER, self.values).read), options)
        period, steps = options.control_period, options.steps
        return BatchRun(trajectory, self.duration, period, steps, backend=self.backend)

    def loops(self, own: Mapping[str, Any]) -> Loops:
        """Loops of runs with `own` values (n,) of parameters; raises as `Node.read` does."""
        values = {**self.values, **own}
        plant = Node(PLANT, values)
        climber, number = plant.read(Climber), len(own[SEED])
        law, observer, timing, *_ = settings(Node(CONTROLLER, values), pressure=None)
        return Loops(
            start=_start(plant.read(SimulationOptions), number),
            climber=climber,
            law=law,
            observer=observer,
            sensors=plant.read(Sensors),
            seeds=own[SEED],
            changes=_changes(climber, plant.read(Physics), number),
            timing=timing,
            contact=Contact(grip=plant.read(Grip)),
            gauge=GAUGE,
            wall=told(plant.read, plant.read(Physics).wall),
        )


def _start(options: SimulationOptions, number: int) -> Motion:
    names = "x", "y", "heading", "speed", "yaw_rate"
    return Motion.at(*(np.zeros(number) + getattr(options, f"initial_{name}") for name in names))


def _changes(climber: Climber, physics: Physics, number: int) -> tuple[Change, ...]:
    time = np.zeros(number) + physics.pressure_loss_time
    if not time.any():
        return ()
    lost = replace(climber, suction_pressure=physics.pressure_loss_level)
    return (Change(np.where(time == 0, math.inf, time), lost),)
