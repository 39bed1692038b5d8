"""A climber with its pump, motors and sensors, from one odometry to the next."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.adhesion import ADHESION, Suction
from climber_uk.mechanics.contact import LOCOMOTION
from climber_uk.mechanics.friction import FRICTION
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.wall import WALLS
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.simulation.inputs import NO_PUSH
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Odometer, Sensors

VARIANTS: dict[str, dict[str, Any]] = {
    "friction": FRICTION,
    "adhesion": ADHESION,
    "locomotion": LOCOMOTION,
    "wall": WALLS,
}


@parameters
class Physics:
    """Which of everything the plant is made of, and what happens to it."""

    friction: str = parameter("coulomb", "", "law of the seal", choices=tuple(FRICTION))
    adhesion: str = parameter("suction", "", "what holds the climber", choices=tuple(ADHESION))
    locomotion: str = parameter("wheeled", "", "what it runs on", choices=tuple(LOCOMOTION))
    wall: str = parameter("plane", "", "what it runs along", choices=tuple(WALLS))
    slip: bool = parameter(False, "", "whether wheels slip where their load does not suffice")
    pressure_loss_time: float = parameter(
        0.0, "s", "since the start, at which the pump's pressure drops; 0: never", at_least=0
    )
    pressure_loss_level: float = parameter(0.0, "Pa", "to which it drops then", at_least=0)


class Push(NamedTuple):
    """A wrench on the climber's centre of mass."""

    wrench: Array  # (3,) force x, y [N], moment about z [N m]
    in_body: bool = False  # whether it turns with the climber

    def on(self, state: State) -> Array:
        """Wrench (3,) in the wall's frame."""
        if not self.in_body:
            return self.wrench
        x, y, moment = self.wrench.tolist()
        cosine, sine = np.cos(state.heading), np.sin(state.heading)
        return np.array([x * cosine - y * sine, x * sine + y * cosine, moment])


NONE = Push(NO_PUSH)


class Parts(NamedTuple):
    """What a machine is made of; its plant's pressure is the one that the pump is set to."""

    plant: Plant
    motors: Motors
    sensors: Sensors
    physics: Physics


class SimulatedRobot:
    """The state of all of it; `advance` raises what `Plant.advance` does, and changes nothing."""

    def __init__(self, parts: Parts, start: State, period: float) -> None:
        self.parts, self.period = parts, period
        self.state, self.steps = start, 0
        self.torques: Array = np.zeros(2)  # [N m] at the wheels: right, left
        self.angles: Array = np.zeros(2)  # [rad] of the wheels: right, left
        self.push = NONE
        self.plant = self._at_pressure(parts.plant, self._final_pressure())
        self.rates = self.plant.wheel_rates(start)  # [rad/s] of the wheels: right, left
        self.odometer = Odometer(parts.sensors, parts.plant.climber, period, start)

    @property
    def pressure(self) -> float:
        """Of the suction, now [Pa]."""
        return self.plant.climber.suction_pressure

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return self.steps * self.plant.step

    def take(self, parts: Parts) -> None:
        """Go on with changed parts; the pressure takes its time."""
        self.parts = parts
        self.plant = self._at_pressure(parts.plant, self.pressure)

    def advance(self, commanded: Array, push: Push = NONE) -> None:
        """Go on by one step of the integrator."""
        step, motors = self.parts.plant.step, self.parts.motors
        plant = self._at_pressure(self.plant, self._next_pressure(step))
        wheels = plant.as_wheels_tell(self.state)
        torques = motors.torques(plant.climber, wheels, self.torques, commanded, step)
        state = plant.advance(self.state, torques, 1, push.on(self.state))
        rates = plant.wheel_rates(state)
        self.angles, self.rates = self.angles + (self.rates + rates) * step / 2, rates
        self.state, self.torques, self.push, self.plant = state, torques, push, plant
        self.steps += 1

    def measure(self) -> None:
        """Take an odometry."""
        wheels = self.plant.as_wheels_tell(self.state)
        self.odometer.measure(self.state, wheels, self.angles)

    def margins(self) -> tuple[float, float]:
        """Slip and tip margin, now."""
        return self.plant.margins(self.state, self.torques, self.push.on(self.state))

    def _pump(self) -> float:
        physics = self.parts.physics
        lost = 0 < physics.pressure_loss_time <= self.time + 1e-9
        return physics.pressure_loss_level if lost else self.parts.plant.climber.suction_pressure

    def _final_pressure(self) -> float:
        adhesion, pump = self.parts.plant.contact.adhesion, self.parts.plant.climber
        if isinstance(adhesion, Suction):
            return float(adhesion.final_pressure(pump.suction_pressure))
        return pump.suction_pressure

    def _next_pressure(self, step: float) -> float:
        adhesion = self.parts.plant.contact.adhesion
        if isinstance(adhesion, Suction):
            return float(adhesion.pressure(self.pressure, self._pump(), step))
        return self.pressure

    @staticmethod
    def _at_pressure(plant: Plant, pressure: float) -> Plant:
        if plant.climber.suction_pressure == pressure:
            return plant
        return replace(plant, climber=replace(plant.climber, suction_pressure=pressure))
