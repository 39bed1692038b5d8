"""The simulated robot: plant, pump, motors and sensors, stepped together."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.adhesion import ADHESION
from climber_uk.mechanics.contact import LOCOMOTION
from climber_uk.mechanics.friction import FRICTION
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.wall import WALLS
from climber_uk.parameters.declaration import parameter, parameters
from climber_uk.simulation.inputs import NO_PUSH
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import SOURCES, Odometer, OdometrySource, Sensors

VARIANTS: dict[str, Mapping[str, Any]] = {
    "friction": FRICTION,
    "adhesion": ADHESION,
    "locomotion": LOCOMOTION,
    "wall": WALLS,
    "odometry_source": SOURCES,
}


@parameters
class Physics:
    """The physics that the plant has, by name, and when its pump fails."""

    friction: str = parameter("coulomb", "", "law of the seal", choices=FRICTION)
    adhesion: str = parameter("suction", "", "what holds the climber", choices=ADHESION)
    locomotion: str = parameter("wheeled", "", "what the climber runs on", choices=LOCOMOTION)
    wall: str = parameter("plane", "", "shape of the wall", choices=WALLS)
    slip: bool = parameter(False, "", "whether wheels slip where their load does not suffice")
    creep: float = parameter(
        0.0, "", "what the climber sags on a vertical wall, by the way that it rolls", at_least=0
    )
    pressure_loss_time: float = parameter(
        0.0, "s", "time after the start at which the pump's pressure drops; 0: never", at_least=0
    )
    pressure_loss_level: float = parameter(
        0.0, "Pa", "pressure to which the pump's drops", at_least=0
    )


class Push(NamedTuple):
    """An external force and moment on the climber's centre of mass."""

    wrench: Array  # (3,) force x, y [N], moment about z [N m]
    in_body: bool = False  # whether it is in the body's frame, else in the wall's

    def on(self, state: State) -> Array:
        """Wrench (3,) in the wall's frame."""
        if not self.in_body:
            return self.wrench
        x, y, moment = self.wrench.tolist()
        cosine, sine = np.cos(state.heading), np.sin(state.heading)
        return np.array([x * cosine - y * sine, x * sine + y * cosine, moment])


OF_SLIPPING = 0.25  # eagerness of a servo, as wheels that slip carry little
UNPUSHED = Push(NO_PUSH)


class Parts(NamedTuple):
    """What a simulated robot is made of; the plant's pressure is the one the pump is set to."""

    plant: Plant
    motors: Motors
    sensors: Sensors
    physics: Physics
    source: OdometrySource | None = None  # None: that of the sensors, with its defaults


class SimulatedRobot:
    """State of plant, pump, motors and sensors.

    `advance` raises as `Plant.advance` does, and then leaves the state as it was.
    """

    def __init__(self, parts: Parts, start: State, period: float) -> None:
        self.parts, self.period = parts, period
        self.state, self.steps = start, 0
        self.torques: Array = np.zeros(2)  # [N m] at the wheels: right, left
        self.angles: Array = np.zeros(2)  # [rad] of the wheels: right, left
        self.push = UNPUSHED
        self.setpoint: float | None = None  # [Pa] of the pump, from outside; None: that of `parts`
        self.plant = self._at_pressure(parts.plant, self._final_pressure())
        self.rates = self.plant.wheel_rates(start)  # [rad/s] of the wheels: right, left
        self.rates_before = self.rates  # a step ago
        climber = parts.plant.climber
        self.odometer = Odometer(parts.sensors, climber, period, start, parts.source)

    @property
    def pressure(self) -> float:
        """Pressure difference of the suction, now [Pa]."""
        return self.plant.climber.suction_pressure

    @property
    def time(self) -> float:
        """Time since the start [s]."""
        return self.steps * self.plant.step

    def take(self, parts: Parts) -> None:
        """Go on with changed parts; the pressure goes on from where it is."""
        self.parts = parts
        self.plant = self._at_pressure(parts.plant, self.pressure)

    def advance(self, commanded: Array, push: Push = UNPUSHED) -> None:
        """Go on by one step under a push and a command: torques (2,) (right, left) [N m].

        Of motors that take speeds, the wheels' rates (2,) [rad/s].
        """
        step, motors = self.parts.plant.step, self.parts.motors
        plant = self._at_pressure(self.plant, self._next_pressure(step))
        wheels = plant.as_wheels_tell(self.state)
        if motors.take_speeds:
            last = self.torques, self.rates_before
            eagerness = OF_SLIPPING if plant.slip else 1.0
            torques = motors.servo(plant.climber, wheels, last, commanded, step, eagerness)
        else:
            torques = motors.torques(plant.climber, wheels, self.torques, commanded, step)
        state = plant.advance(self.state, torques, 1, push.on(self.state))
        rates = plant.wheel_rates(state)
        turned = (self.rates + rates) * step / 2
        self.angles, self.rates_before, self.rates = self.angles + turned, self.rates, rates
        if self.parts.physics.creep > 0:
            state = self._sagged(state, turned)
        self.state, self.torques, self.push, self.plant = state, torques, push, plant
        self.steps += 1

    def measure(self) -> None:
        """Take an odometry of the present state; once in a period."""
        wheels = self.plant.as_wheels_tell(self.state)
        self.odometer.measure(self.state, wheels, self.angles)

    def margins(self) -> tuple[float, float]:
        """Slip and tip margin (§7), now."""
        return self.plant.margins(self.state, self.torques, self.push.on(self.state))

    def _sagged(self, state: State, turned: Array) -> State:
        """State a little down the wall: wheels under load give way as they turn (2,) [rad]."""
        climber, creep = self.plant.climber, self.parts.physics.creep
        right, left = turned.tolist()
        way = creep * climber.wheel_radius * (abs(right) + abs(left)) / 2
        at_x, at_y, _ = state.pose.tolist()
        x, y = self.plant.wall.along(climber.inclination, at_x, at_y)
        return replace(state, pose=state.pose + way * np.array([x, y, 0.0]))

    def _pump(self) -> float:
        """Pressure that the pump could reach without a leak, now [Pa]."""
        physics = self.parts.physics
        full = self.parts.plant.climber.suction_pressure
        pump = full if self.setpoint is None else min(self.setpoint, full)
        lost = 0 < physics.pressure_loss_time <= self.time + 1e-9
        return physics.pressure_loss_level if lost else pump

    def _final_pressure(self) -> float:
        plant = self.parts.plant
        return float(plant.contact.adhesion.final_pressure(plant.climber.suction_pressure))

    def _next_pressure(self, step: float) -> float:
        adhesion = self.parts.plant.contact.adhesion
        return float(adhesion.pressure(self.pressure, self._pump(), step))

    @staticmethod
    def _at_pressure(plant: Plant, pressure: float) -> Plant:
        if plant.climber.suction_pressure == pressure:
            return plant
        return replace(plant, climber=replace(plant.climber, suction_pressure=pressure))
