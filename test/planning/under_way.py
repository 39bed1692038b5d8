"""A course, its controller and the climber of config/climber.yaml, in lock-step."""

from pathlib import Path

import numpy as np

from climber_uk.control.build import build_controller
from climber_uk.control.safety import Mode
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.preview import Preview
from climber_uk.mechanics.quantities import State
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.planning.by_hand import HandOptions
from climber_uk.planning.course import Course, CourseOptions
from climber_uk.planning.journey import HAND, PATH, Journey
from climber_uk.simulation.plant import Plant

CONFIG = Path(__file__).parents[2] / "config" / "climber.yaml"
STEP, PERIOD = 0.0025, 0.005  # [s] of the plant, and from one odometry to the next
TOLD_EVERY, PUBLISHED_EVERY = 10, 20  # [periods], as the nodes do


def preview(rows):
    """Preview of points (time [ns], reference)."""
    times, references = zip(*rows, strict=True)
    parts = (
        np.array([getattr(r, part) for r in references])
        for part in ("pose", "velocity", "acceleration")
    )
    return Preview(np.array(times, np.int64), *parts)


class UnderWay:
    """Odometry every 5 ms, torques that act at once, previews every 0.1 s."""

    def __init__(
        self, trajectory, *, state=None, options=None, config=CONFIG, plant_of=None, **parameters
    ):
        self.options = options or CourseOptions()
        given = {**read_file(config, "/uk_torque_controller"), **parameters}
        self.controller = build_controller(Values(given), None)
        self.now, self.torques = SECOND, np.zeros(2)
        self.times, self.states, self.sent, self.positions, self.modes = [], [], [], [], []
        self.targets = []  # where it should have been, None while nothing is followed
        self.begin(trajectory)
        reference = trajectory.at(0.0)
        self.state = state or State(reference.pose, reference.velocity)
        own = Plant(self.controller.law.climber, STEP)
        self.plant = plant_of(self.state) if plant_of else own

    def begin(self, trajectory, **how):
        start = self.now
        make = lambda reference, time: (start + round(time * SECOND), reference)  # noqa: E731
        self.course = Course(trajectory, start, self.options, make, **how)
        self.position, self.period = start, 0

    @property
    def time(self):
        """Seconds since the course was begun."""
        return self.course.time(self.now)

    def run(self, seconds, until=lambda: False):
        """Go on for some time, or until something holds."""
        for _ in range(round(seconds / PERIOD)):
            if self.period % PUBLISHED_EVERY == 0:
                self.controller.on_reference(self.now, preview(self.course.preview(self.position)))
            answer = self.controller.on_odometry(self.now, self.now, self.state.motion)
            self.targets.append(self.controller.active.at(self.now))
            if answer is not None:
                self.torques = answer.torques
            if self.period % TOLD_EVERY == 0:
                position = self.controller.active.position(self.controller.stamp)
                self.position = self.position if position is None else position
            self.times.append(self.now)
            self.states.append(self.state)
            self.sent.append(self.torques)
            self.positions.append(self.course.own_time(self.position)[0])
            self.modes.append(self.controller.mode)
            self.state = self.plant.advance(self.state, self.torques, round(PERIOD / STEP))
            self.now += round(PERIOD * SECOND)
            self.period += 1
            if until():
                break
        return self

    @property
    def places(self):
        return np.array([state.pose[:2] for state in self.states])

    @property
    def largest_jump(self):
        """Largest change [N m] of a wheel's torque from one odometry to the next."""
        return np.abs(np.diff(self.sent, axis=0)).max()


class Travelling(UnderWay):
    """The same with a stick, paths from outside and starts in mid-course, as the planner has it."""

    def __init__(self, trajectory, **how):
        hand = HandOptions(input="twist", speed=0.2)
        make = lambda reference, time: (time, reference)  # noqa: E731
        self.journey = Journey(trajectory, CourseOptions(), hand, make)
        super().__init__(trajectory, **how)

    def begin(self, trajectory, **_):
        self.position, self.period, self.course = 0, 0, self
        self.replace(trajectory)

    # what `UnderWay` asks of its course

    def preview(self, position):
        under_way = self.journey.under_way
        rows = under_way.preview(position, self.now)
        return [(under_way.start + round(time * SECOND), reference) for time, reference in rows]

    def own_time(self, position):
        return (np.nan, 0.0) if self.journey.hand else self.journey.course.own_time(position)

    # what an operator asks for

    def ask(self, what):
        self.journey.begin(what, self.position, self.is_driven)

    @property
    def is_driven(self):
        return self.modes[-1:] in ([], [Mode.FOLLOWING])

    def replace(self, trajectory):
        self.journey.planned = trajectory
        self.start()

    def start(self):
        self.journey.is_paused = False
        self.ask(PATH)

    def go_on(self):
        self.journey.go_on(self.position, self.is_driven)

    def pause(self):
        self.journey.pause(self.position, self.is_driven)

    def retreat(self):
        self.journey.retreat(self.position, self.is_driven)

    def set_speed(self, speed):
        self.journey.set_speed(speed, self.position, self.is_driven)

    def stick(self, speed, yaw_rate):
        if self.journey.takes_over(speed, yaw_rate, self.now):
            self.ask(HAND)
        self.run(0.1)

    def run(self, seconds, until=lambda: False):
        journey = self.journey
        for _ in range(round(seconds / PERIOD)):
            if journey.waits_for_rest and self.period % PUBLISHED_EVERY == 0:
                self.ask(journey.next)
            if journey.is_due:
                coasts = 0.4 if self.modes[-1:] == [Mode.APPROACHING] else 0.0  # as the node has it
                pose = self.state.pose + coasts * self.state.velocity
                journey.start(self.now, pose, self.position)
            self.position = max(self.position, journey.under_way.start)
            super().run(PERIOD)
            if until():
                break
        return self
