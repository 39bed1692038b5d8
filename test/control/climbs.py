"""The climber of config/climber.yaml in lock-step with its controller, and what may go wrong."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from climber_uk.closed_loop.simulate import sampled
from climber_uk.control.build import build_controller
from climber_uk.control.safety import Mode
from climber_uk.mechanics import SECOND
from climber_uk.mechanics import trajectory_parameters as plan
from climber_uk.mechanics.contact import Contact, Tracked
from climber_uk.mechanics.quantities import State
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.simulation.inputs import NO_PUSH
from climber_uk.simulation.plant import Plant

CONFIG = Path(__file__).parents[2] / "config" / "climber.yaml"
STEP = 0.0025  # [s] of the plant
PERIOD = 0.005  # [s] from one odometry to the next
LIMIT = 4.0  # [N m] of the configuration
SCRUB = Contact(locomotion=Tracked(scrub_friction_coefficient=0.8, length=0.44))


def as_it_is(_, value):
    return value


class Climb:
    """Odometry every 5 ms, torques that act at once; what spoils either is given by the time.

    `truth` makes the true climber from the one that is believed in; `scrubs` may be its contact.
    """

    def __init__(
        self,
        *,
        planner=None,
        offset=(0.0, 0.0, 0.0),
        scrubs=False,
        truth=lambda it: it,
        **parameters,
    ):
        build_trajectory = {**read_file(CONFIG, "/trajectory_publisher"), **(planner or {})}
        self.trajectory = plan.build_trajectory(Values(build_trajectory).read)
        given = {**read_file(CONFIG, "/uk_torque_controller"), **parameters}
        self.controller = build_controller(Values(given), None)
        climber = replace(truth(self.controller.law.climber), max_wheel_torque=100.0)
        contact = scrubs if isinstance(scrubs, Contact) else SCRUB
        slips = {"contact": contact, "slip": True} if scrubs else {}
        self.plant = Plant(climber, STEP, **slips)
        reference = self.trajectory.at(0.0)
        self.state = State(reference.pose + np.array(offset), reference.velocity)
        self.time, self.torques = 0.0, np.zeros(2)
        self.angles = np.zeros(2)  # of the wheels [rad]
        self.times, self.states, self.modes, self.sent = [], [], [], []
        self.controller.on_reference(SECOND, sampled(self.trajectory, 60.0))

    def run(self, seconds, odometry=as_it_is, motors=as_it_is, push=NO_PUSH, clock=0.0):
        """Go on; `odometry` may be None for one that is lost, `clock` [s] is what stamps lack."""
        for _ in range(round(seconds / PERIOD)):
            now = SECOND + round(self.time * SECOND)
            told = odometry(self.time, self.state)
            answer = None
            if self.controller.guard.options.encoder_distance > 0:
                self.controller.on_encoders(*self.angles)
            if told is not None:
                answer = self.controller.on_odometry(now, now - round(clock * SECOND), told.motion)
            answer = answer or self.controller.look(now)
            if answer is not None:
                self.torques = answer.torques
            self.times.append(self.time)
            self.states.append(self.state)
            self.modes.append(self.controller.mode)
            self.sent.append(self.torques)
            acting = motors(self.time, self.torques)
            self.state = self.plant.advance(self.state, acting, round(PERIOD / STEP), push)
            self.angles = self.angles + PERIOD * self.plant.climber.wheel_rates(self.state)
            self.time += PERIOD
        return self

    # What happened since some time [s]

    def since(self, time, values):
        return [value for at, value in zip(self.times, values, strict=True) if at >= time - 1e-9]

    def fastest(self, since=0.0):
        return max(abs(state.forward_speed) for state in self.since(since, self.states))

    def fastest_turn(self, since=0.0):
        return max(abs(state.yaw_rate) for state in self.since(since, self.states))

    def faulty_after(self, time):
        """Seconds from `time` until the first fault."""
        for at, mode in zip(self.times, self.modes, strict=True):
            if at >= time and mode.is_fault:
                return at - time
        return np.inf

    def harmless(self, since):
        """Seconds for which the climber stays within 1 cm of its path, as a curve."""
        path = self.trajectory.at(np.arange(0.0, 57.0, 0.01)).pose[:, :2]
        for time, state in zip(self.times, self.states, strict=True):
            if time >= since and np.hypot(*(path - state.pose[:2]).T).min() > 0.01:
                return time - since
        return np.inf

    def off_the_path(self, since=0.0):
        """Largest distance [m] from the path as a curve."""
        path = self.trajectory.at(np.arange(0.0, 57.0, 0.01)).pose[:, :2]
        places = np.array([state.pose[:2] for state in self.since(since, self.states)[::10]])
        return max(np.hypot(*(path - place).T).min() for place in places)

    @property
    def reference_speed(self):
        """Fastest of the whole trajectory [m/s]."""
        velocity = self.trajectory.at(np.arange(0.0, 57.0, 0.01)).velocity
        return np.hypot(velocity[:, 0], velocity[:, 1]).max()

    @property
    def position(self):
        """Time of the trajectory [s] that the climber has come to."""
        controller = self.controller
        return (controller.active.position(controller.stamp) - SECOND) / SECOND

    def follows(self):
        return self.controller.mode is Mode.FOLLOWING
