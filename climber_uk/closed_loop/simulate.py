"""One closed loop in one process: controller, plant, and the link between them, in lock-step.

The same `Controller` and `SimulatedRobot` that the nodes run, on a grid of the plant's step. All
noise comes from one seed.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from climber_uk.control.controller import Answer
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import Motion, State
from climber_uk.mechanics.reference import tracking_error
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.simulation.motors import Motors
from climber_uk.simulation.plant import Plant
from climber_uk.simulation.sensors import Sensors
from climber_uk.simulation.simulated_robot import Parts, Physics, SimulatedRobot

POINT_PERIOD = 0.05  # [s] of a reference, as trajectory_publisher's


@dataclass(frozen=True)
class Link:
    """Delays, losses and noise between climber and controller; times are multiples of `step`."""

    step: float = 0.0025  # [s] of the plant

    period: float = 0.005  # [s] from one odometry to the next
    delay: float = 0.0  # [s] of a torque on its way to the wheels: no clock shows it
    jitter: float = 0.0  # [s] most that an odometry is late; none overtakes another
    loss: float = 0.0  # share of odometry messages that never arrive
    sensors: Sensors = field(default_factory=Sensors)  # their noise is of the run's seed
    with_twist: bool = True
    torque_lag: float = 0.0  # [s] of the motors, of first order
    servo: Motors | None = None  # that takes speeds; None: motors that take torques

    def parts(self, plant: Plant) -> Parts:
        """The plant with such motors, and sensors without the errors that `measured` adds."""
        motors = self.servo or Motors(torque_lag=self.torque_lag)
        return Parts(plant, motors, self.sensors.ideal, Physics())

    def command(self, answer: Answer, climber: Climber) -> Array:
        """What the motors take of an answer (2,): torques [N m], or the wheels' rates [rad/s]."""
        if self.servo is None:
            return answer.torques
        return np.array(climber.rim_rates(answer.speeds))


class Controlling(Protocol):
    """What answers odometry with torques: a `Controller`, or another one to compare with."""

    def on_reference(self, now: int, preview: Preview) -> Answer | None:
        """Take a reference, at `now` [ns]."""

    def on_odometry(self, now: int, stamp: int, motion: Motion) -> Answer | None:
        """Answer an odometry, at `now` [ns]; `stamp` [ns] is when `motion` was measured."""


def as_commanded(state: State, command: Array) -> Array:
    """Torques of ideal motors: those commanded."""
    return command


@dataclass(frozen=True)
class Run:
    """History of a closed loop, at the n times at which odometry was due."""

    time: Array  # (n,) [s]
    pose: Array  # (n, 3) true, [m], [rad]
    velocity: Array  # (n, 3) true, in the wall's frame
    error: Array  # (n, 3) along-track [m], cross-track [m], heading [rad]
    torques: Array  # (n, 2) that acted, right, left [N m]

    @property
    def distance(self) -> Array:
        """Distance from the reference (n,) [m]."""
        return np.hypot(self.error[:, 0], self.error[:, 1])

    def rms(self, after: float = 0.0) -> float:
        """Root mean square [m] of the distance from the reference, from `after` [s] on."""
        return float(np.sqrt(np.mean(self.distance[self.time >= after] ** 2)))

    def chatter(self, after: float = 0.0) -> float:
        """Root mean square [N m] of the torques' change in a period, from `after` [s] on."""
        return float(np.sqrt(np.mean(np.diff(self.torques[self.time >= after], axis=0) ** 2)))


def simulate(
    trajectory: Trajectory,
    start: State,
    duration: float,
    controlling: Controlling,
    climber: Climber | Callable[[float], Climber],
    link: Link = Link(),
    motors: Callable[[State, Array], Array] = as_commanded,
    seed: int = 0,
    plant_of: Callable[[Climber, float], Plant] = Plant,
    robot_of: Callable[[Parts, State, float], SimulatedRobot] = SimulatedRobot,
    point_period: float = POINT_PERIOD,
) -> Run:
    """Run of `duration` [s] from `start`; `climber` may change with time.

    The reference has points every `point_period` [s].
    `plant_of` makes a plant from a climber and a step [s], `robot_of` the robot from parts, start
    and period [s]. `motors` makes torques (2,) [N m] from the state and the command in force, at
    every step. No torque acts before the first command, unless the climber starts in motion: then
    that one does.
    """
    random = np.random.default_rng(seed)
    climber_at = climber if callable(climber) else lambda _: climber
    controlling.on_reference(0, sampled(trajectory, duration, point_period))
    arriving: deque[tuple[int, int, Motion]] = deque()  # step of arrival, stamp, odometry
    commanded: deque[tuple[int, Array]] = deque()  # step from which they act, torques
    acting: Array | None = None
    rows, current = [], climber_at(0.0)
    robot = robot_of(link.parts(plant_of(current, link.step)), start, link.period)
    every, late = round(link.period / link.step), round(link.delay / link.step)
    for step in range(round(duration / link.step) + 1):
        now = SECOND + round(step * link.step * SECOND)
        if step % every == 0:
            state = robot.state
            rows.append([step * link.step, *state.pose, *state.velocity, *robot.torques])
            if step > 0:
                robot.measure()
            if random.random() >= link.loss:
                arrival = step + round(random.uniform(0, link.jitter) / link.step)
                arrival = max(arrival, arriving[-1][0]) if arriving else arrival
                _, seen = robot.odometer.latest()
                arriving.append((arrival, now, measured(seen, link, random)))
        while arriving and arriving[0][0] <= step:
            _, stamp, odometry = arriving.popleft()
            answer = controlling.on_odometry(now, stamp, odometry)
            if answer is not None:
                command = link.command(answer, current)
                acting = command if acting is None and start.velocity.any() else acting
                commanded.append((step + late, command))
        while commanded and commanded[0][0] <= step:
            _, acting = commanded.popleft()
        before, current = current, climber_at(step * link.step)
        if current is not before:
            robot.take(link.parts(plant_of(current, link.step)))
        robot.advance(np.zeros(2) if acting is None else motors(robot.state, acting))
    time, pose, velocity, torques = np.split(np.array(rows), (1, 4, 7), axis=1)
    error = np.stack(tracking_error(pose, trajectory.at(time[:, 0])), axis=-1)
    return Run(time[:, 0], pose, velocity, error, torques)


def sampled(trajectory: Trajectory, duration: float, point_period: float = POINT_PERIOD) -> Preview:
    """Preview of a whole trajectory that starts at 1 s, with points every `point_period` [s]."""
    times = np.arange(0.0, duration + 2.0, point_period)
    reference = trajectory.at(times)
    stamps = SECOND + np.round(times * SECOND).astype(np.int64)
    return Preview(stamps, reference.pose, reference.velocity, reference.acceleration)


def measured(state: State, link: Link, random: np.random.Generator) -> Motion:
    """Motion as odometry measures it, with its errors."""
    motion = link.sensors.corrupted(state.motion, random.normal(size=5).tolist())
    return motion if link.with_twist else motion._replace(speed=0.0, yaw_rate=0.0)
