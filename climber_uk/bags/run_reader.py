"""Runs of one climber from what a bag tells of it, and what of that is of no use, in words."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from climber_uk.bags import events
from climber_uk.bags.bag import Bag, open_bag
from climber_uk.bags.collecting import Collected, collect
from climber_uk.bags.events import Event
from climber_uk.bags.joints import Joints, commanded_torques, rates_and_torques
from climber_uk.bags.recorded import TimeSeries
from climber_uk.bags.reference import poses_at
from climber_uk.bags.run import RecordedRun
from climber_uk.bags.taking import TAKEN
from climber_uk.bags.topics import KNOWN, Topics
from climber_uk.mechanics import SECOND, Array, Stamps
from climber_uk.mechanics.climber import Climber
from climber_uk.messages import topics
from climber_uk.parameters.parameter_file import Values

TOLERANCE = 1.0  # [s] by which a stamp may be off the odometry's and still be of its clock
NOTHING = TimeSeries.of([])
NAMES = "left_wheel_joint", "right_wheel_joint", "adhesion"
Told = Mapping[str, Any]  # parameters of a controller, by name


class NoRunError(ValueError):
    """There is not enough odometry of a climber, and why."""


@dataclass(frozen=True)
class RunReader:
    """Makes runs of one climber from what was collected, and says what of it is of no use."""

    bag: Bag
    names: Topics
    namespace: str
    parameters: Callable[[str], Told] | None = None  # of a namespace, in place of those in the bag

    def topic(self, name: str) -> str:
        """Full name of one of the climber's topics."""
        return self.names.full(name, self.namespace)

    @classmethod
    def read(
        cls, path: Path, names: Topics, namespace: str, of: Collection[str] = KNOWN
    ) -> tuple["RunReader", Collected]:
        """Read what a bag tells on the topics `of` of one climber; raises as `open_bag` does."""
        with open_bag(path) as bag:
            reader = cls(bag, names, namespace)
            return reader, collect(bag, names, [namespace], of)[0][namespace]

    def runs(self, found: Collected, told: Collection[Event]) -> list[RecordedRun]:
        """All runs; raises `NoRunError`."""
        if not found.samples[topics.ODOMETRY]:
            raise NoRunError(f"no odometry on {self.topic(topics.ODOMETRY)}")
        if found.lost_previews:
            topic = self.topic(topics.REFERENCE)
            self.bag.lose(f"{topic}: {found.lost_previews} messages left out: a point is unfit")
        self.check_truth(found)
        parts = self.split(found)
        runs, reasons = [], []
        for number, part in enumerate(parts, start=1):
            try:
                name = f"run {number} of {len(parts)}" if len(parts) > 1 else ""
                runs.append(self.run(part, told, name))
            except NoRunError as nothing:
                reasons.append(str(nothing))
        if not runs:
            raise NoRunError("; ".join(reasons))
        for reason in reasons:
            self.bag.lose(reason)
        return runs

    def split(self, found: Collected) -> list[Collected]:
        """What belongs to each run; says if there are several."""
        parts = found.runs()
        if len(parts) > 1:
            topic = self.topic(topics.ODOMETRY)
            self.bag.lose(f"{topic}: time starts again, there are {len(parts)} runs")
        return parts

    def check_one_run(self, found: Collected) -> None:
        """Raise `ValueError` if there are several runs, one after the other or at once."""
        if not found.samples[topics.ODOMETRY]:
            return
        path, topic, count = self.bag.path, self.topic(topics.ODOMETRY), len(found.runs())
        if count > 1:
            said = f"time starts again, there are {count} runs: want one"
            raise ValueError(f"{path}: {topic}: {said}")
        if found.disagreement:
            raise ValueError(f"{path}: no run on {topic}: {found.disagreement}")

    def check_truth(self, found: Collected) -> None:
        """Do not use poses of which it is not known where they are to the odometry's."""
        here, there = (found.frames.get(name, "") for name in (topics.ODOMETRY, topics.TRUTH))
        if here and there and here != there:
            del found.samples[topics.TRUTH]
            topic = self.topic(topics.TRUTH)
            self.bag.lose(f"{topic}: not used, frame_id={there!r} is not the odometry's, {here!r}")

    def check_agreement(self, found: Collected) -> None:
        """Raise `NoRunError` if what is read as one run cannot be."""
        if found.disagreement:
            raise NoRunError(f"no run on {self.topic(topics.ODOMETRY)}: {found.disagreement}")
        if count := found.contradictions:
            self.bag.lose(
                f"{self.topic(topics.ODOMETRY)}: {count} messages have the stamp of another, but "
                "not its values: the first one counts"
            )

    def run(self, found: Collected, told: Collection[Event], part: str) -> RecordedRun:
        """One run; raises `NoRunError`."""
        whole = odometry = self.recorded(found, topics.ODOMETRY)
        reference = self.reference(found, odometry.stamps)
        known = np.flatnonzero(np.isfinite(reference[:, 0]))
        if len(known):
            first, last = known[0], known[-1]
            odometry = odometry.within(whole.stamps[first], whole.stamps[last])
            reference = reference[first : last + 1]
        if len(odometry) < 2:
            raise NoRunError(self.too_few(whole))
        self.check_agreement(found)
        start, parameters = int(odometry.stamps[0]), self.known(found)
        recorded = {
            name: self.within(self.recorded(found, name), name, odometry)
            for name in TAKEN.keys() - {topics.ODOMETRY}
        }
        commands = self.within(self.commands(found, parameters), topics.TORQUES, odometry)
        right, left = (
            self.within(wheel, topics.JOINTS, odometry) for wheel in self.wheels(found, parameters)
        )
        own = [
            event
            for event in told
            if events.is_of(event, self.namespace) and found.begin <= event.arrival < found.end
        ]
        news = [(_seconds(event, whole, start), event) for event in events.changes(own)]
        run = RecordedRun(
            name=self.namespace,
            start=start,
            odometry=odometry,
            reference=reference,
            commands=commands.where(np.isin(commands.stamps, odometry.stamps)),
            wheels=(right, left),
            truth_reference=self.reference(found, recorded[topics.TRUTH].stamps),
            recorded=recorded,
            events=sorted(news, key=itemgetter(0)),
            is_diagnosed=any(event.kind == "state" for event in own),
            parameters=parameters,
            part=part,
        )
        if run.contradiction:
            self.bag.lose(f"{self.topic(topics.ODOMETRY)}: {run.contradiction}")
        return run

    def reference(self, found: Collected, stamps: Stamps) -> Array:
        """Reference (n, 3) at stamps (n,) [ns]: where it waited for the climber, that place.

        The controller tells 20 times a second; between, its reference went on evenly.
        """
        told = TimeSeries.of(found.samples[topics.REFERENCE_TIME])
        if len(told):
            begin = told.stamps[0]
            behind = np.interp(stamps - begin, told.stamps - begin, told.values[:, 0])
            stamps = stamps - np.round(behind * SECOND).astype(np.int64)
        return poses_at(found.reference, stamps)

    def recorded(self, found: Collected, name: str) -> TimeSeries:
        """The messages of a topic; says how many are left out, and why."""
        return self.judged(TimeSeries.of(found.samples[name]), name)

    def judged(self, recorded: TimeSeries, name: str) -> TimeSeries:
        """The same; says how many messages are left out, and why."""
        if recorded.unfit:
            count, repeated = sum(recorded.unfit.values()), recorded.repeated
            of = count + len(recorded) + repeated
            why = ", ".join(f"{reason} ({n})" for reason, n in recorded.unfit.items())
            self.bag.lose(f"{self.topic(name)}: {count} of {of} messages left out: {why}")
        return recorded

    def within(self, recorded: TimeSeries, name: str, odometry: TimeSeries) -> TimeSeries:
        """The messages of a topic in the time of the odometry; says if there are none."""
        within = recorded.within(int(odometry.stamps[0]), int(odometry.stamps[-1]))
        if len(recorded) and not len(within):
            self.bag.lose(f"{self.topic(name)}: no message has a time of the odometry's")
        return within

    def too_few(self, odometry: TimeSeries) -> str:
        """Why there is no run."""
        topic, count = self.topic(topics.ODOMETRY), len(odometry)
        if count > 1:
            return f"no run on {topic}: one message only has a reference"
        others = f", {odometry.repeated} with the stamp of another" if odometry.repeated else ""
        return f"no run on {topic}: {count or 'no'} message of use{others}"

    def known(self, found: Collected) -> Told:
        """The parameters of the controller: as given, but names may be those that it told."""
        told = self.told(found)
        if self.parameters is None:
            return told
        names = {name: told[name] for name in NAMES if name in told}
        return names | dict(self.parameters(self.namespace))

    def told(self, found: Collected) -> Told:
        """The parameters of the controller, as it told them last; says what is wrong with them."""
        told = max(found.parameters, key=itemgetter(0), default=(0, {}))[1]
        try:
            Values(told).read(Climber)
        except (ValueError, TypeError) as error:
            self.bag.lose(f"{self.topic(topics.PARAMETERS)}: not used, {error}")
            return {}
        return told

    def commands(self, found: Collected, parameters: Told) -> TimeSeries:
        """Torques right, left (n, 2) [N m] that were commanded; notes why there are none."""
        (torques,) = self.of_wheels(
            found, topics.TORQUES, lambda parts: [commanded_torques(parts, parameters)]
        ) or [NOTHING]
        return torques

    def wheels(self, found: Collected, parameters: Told) -> tuple[TimeSeries, TimeSeries]:
        """Rate and torque (n, 2) of the right and the left wheel; notes why there are none."""
        right, left = self.of_wheels(
            found, topics.JOINTS, lambda parts: rates_and_torques(parts, parameters)
        ) or [NOTHING, NOTHING]
        return right, left

    def of_wheels(
        self, found: Collected, name: str, read: Callable[[Sequence[Joints]], Sequence[TimeSeries]]
    ) -> Sequence[TimeSeries]:
        """What `read` makes of a topic's joints; nothing, and a note why, if it raises."""
        parts = found.joints[name]
        try:
            return [self.judged(series, name) for series in read(parts)] if parts else []
        except ValueError as error:
            self.bag.lose(f"{self.topic(name)}: not used, {error}")
            return []


def _seconds(event: Event, odometry: TimeSeries, start: int) -> float:
    """Time of an event [s]: its stamp, if it is of the odometry's clock, else by its arrival."""
    stamps, arrivals = odometry.stamps, odometry.arrivals
    tolerance = TOLERANCE * SECOND
    stamp = event.stamp
    if stamp is not None and stamps[0] - tolerance <= stamp <= stamps[-1] + tolerance:
        return (stamp - start) / SECOND
    i = int(np.clip(np.searchsorted(arrivals, event.arrival), 1, len(stamps)) - 1)
    return (int(stamps[i]) - start + event.arrival - int(arrivals[i])) / SECOND
