"""The controller over a bag: what it would have answered to the recorded inputs.

After each answer its history of torques gets the recorded torques in place of its own, as it was
these that moved the climber: every answer is one to the run as it was, whatever the parameters are.
"""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields
from typing import Any

from climber_uk.bags.bag import Bag
from climber_uk.bags.publishing_order import read_published
from climber_uk.bags.topics import TYPES, Topics
from climber_uk.control.build import KINDS, build_controller, settings
from climber_uk.control.controller import Answer
from climber_uk.control.stops import Stops
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber, most_pressure
from climber_uk.mechanics.quantities import Torques
from climber_uk.messages import reading, references
from climber_uk.messages.names import Names
from climber_uk.messages.topics import CLOCK, ODOMETRY, PRESSURE, REFERENCE, TORQUES
from climber_uk.parameters.parameter_file import Values
from climber_uk.replay.recorded_controller import Modes, RecordedController

SHORTEST_LOOK = SECOND // 1000  # [ns] between two looks at whether inputs have stopped
MOST_LOOKS = 10_000  # at inputs that have stopped: by then nothing changes any more
DEFAULTS = {
    prefix + field.name: field.default
    for kind, prefix in [*KINDS, (Names, "")]
    for field in fields(kind)
}
Choose = Callable[[Mapping[str, Any]], Mapping[str, Any]]


class MisfitError(Exception):
    """A message has the name of a type, but not its fields."""


@contextmanager
def of_its_type() -> Iterator[None]:
    """Raise `MisfitError` where a message that is read in here has not the fields of its type."""
    try:
        yield
    except (AttributeError, TypeError) as error:
        raise MisfitError(str(error)) from None


class Replay:
    """A `Controller` with the inputs that the node had; times are integers in nanoseconds.

    `choose` returns the parameters to use, given those that were in force.
    """

    def __init__(self, recorded: RecordedController, namespace: str, choose: Choose) -> None:
        self.recorded, self.choose = recorded, choose
        self.parameters = Values(choose(recorded.parameters or {}))
        self.names = self.parameters.read(Names).within(namespace)
        self.pressure: float | None = None  # [Pa] as last measured
        self.controller = build_controller(self.parameters, None)
        self.controller.stops = Stops()  # the bag's modes tell when it was stopped
        self.settings = deque(recorded.settings)  # that are to come
        self.torques: dict[int, Array] = {}  # by stamp, right, left [N m]
        self.modes: Modes = []
        self.clock = self.looked = 0  # times of the node's clock, and of the wall clock
        shortest = self.controller.safety.shortest
        self.look_period = max(round(shortest / 2 * SECOND), SHORTEST_LOOK)

    @property
    def changed(self) -> dict[str, tuple[Any, Any]]:
        """Parameters that differ from those in the bag: the value there, and here."""
        there = self.recorded.parameters or {}
        here = self.choose(there)
        pairs = {
            name: (there.get(name), here.get(name, default)) for name, default in DEFAULTS.items()
        }
        return {name: (was, now) for name, (was, now) in pairs.items() if was != now}

    def run(self, bag: Bag, namespace: str, by_publishing: bool) -> None:
        """Answer all odometry of a bag; raises as `RecordedController` does.

        Messages, not arrays, are read: the functions that read them are those of the node.
        """
        callbacks = {
            CLOCK: self.on_clock,
            ODOMETRY: self.on_odometry,
            REFERENCE: self.on_reference,
            PRESSURE: self.on_pressure,
            TORQUES: self.on_torques,
        }
        names = {Topics().full(name, namespace): name for name in callbacks}
        missing = {topic for topic, name in names.items() if name in (ODOMETRY, REFERENCE)}
        types = {topic: TYPES[name] for topic, name in names.items()}
        for topic, at, message in read_published(bag, types, by_publishing):
            missing.discard(topic)
            self.look_until(at)
            self.pass_time(at)
            try:
                callbacks[names[topic]](at, message)
            except MisfitError as error:
                raise ValueError(f"{bag.path}: {topic} is not what it should be: {error}") from None
        if missing:
            said = " and ".join(bag.lacks(topic, types[topic]) for topic in sorted(missing))
            raise ValueError(f"{bag.path} has {said}")

    def pass_time(self, now: int) -> None:
        """Set the node's clock to a time of the wall clock, unless time is simulated or later."""
        if not self.recorded.simulated:
            self.clock = max(self.clock, now)

    def look_until(self, at: int) -> None:
        """Check whether inputs have stopped, as the node's timer does by the wall clock."""
        self.looked = max(self.looked or at, at - MOST_LOOKS * self.look_period)
        while self.looked + self.look_period <= at:
            self.looked += self.look_period
            self.pass_time(self.looked)
            self.record(self.controller.look(self.clock))

    def on_clock(self, _: int, message: Any) -> None:
        """Set the clock to the simulated time."""
        with of_its_type():
            self.clock = reading.nanoseconds(message.clock)

    def on_odometry(self, _: int, message: Any) -> None:
        """Answer an odometry."""
        with of_its_type():
            stamp = reading.nanoseconds(message.header.stamp)
        answered = self.recorded.published.get(stamp)
        if answered is not None:
            self.apply_settings(answered)
            self.pass_time(answered)  # the node reads its clock right before it publishes
        try:
            with of_its_type():
                motion = reading.motion(message, self.names.odom_frame, self.names.base_frame)
                aside = message.twist.twist.linear.y
        except ValueError as error:
            self.record(self.controller.on_bad_odometry(self.clock, str(error)))
            return
        self.record(self.controller.on_odometry(self.clock, stamp, motion, aside))

    def on_reference(self, _: int, message: Any) -> None:
        """Pass on a reference, unless the node refuses such a one."""
        try:
            with of_its_type():
                preview = references.preview(message, self.names.odom_frame)
            preview.check_heading()
        except ValueError:
            return
        self.record(self.controller.on_reference(self.clock, preview))

    def on_pressure(self, _: int, message: Any) -> None:
        """Put the measured pressure into the model, unless the node refuses such a one."""
        try:
            with of_its_type():
                expected = self.parameters.read(Climber).suction_pressure
                pressure = reading.pressure(message, most_pressure(expected))
        except ValueError:
            return
        if pressure != self.pressure:
            self.pressure = pressure
            self.retune()

    def on_torques(self, at: int, message: Any) -> None:
        """Check inputs when the node's timer did: torques that answer an odometry once more."""
        with of_its_type():
            stamp = reading.nanoseconds(message.header.stamp)
        if at != self.recorded.published.get(stamp):
            self.apply_settings(at)
            self.record(self.controller.look(self.clock))

    def apply_settings(self, at: int) -> None:
        """Apply the settings that were in force for the torques published at a time."""
        while self.settings and self.settings[0][0] <= at:
            _, setting = self.settings.popleft()
            self.controller.enable(setting.enabled)
            self.parameters = Values(self.choose(setting.parameters or {}))
            self.retune()

    def retune(self) -> None:
        """Give the controller the present parameters, and the measured pressure."""
        self.controller.retune(settings(self.parameters, self.pressure))

    def record(self, answer: Answer | None) -> None:
        """Record the mode, and the first answer to an odometry, which the sent torques replace."""
        mode = self.controller.mode.value
        if not self.modes or mode != self.modes[-1][1]:
            self.modes.append((self.clock, mode))
        if answer is None or answer.stamp == 0:  # to no odometry
            return
        if answer.stamp not in self.torques:
            self.torques[answer.stamp] = answer.torques
            sent = self.recorded.torques.get(answer.stamp)
            if sent is not None:
                self.controller.estimator.correct(Torques(*sent.tolist()))
