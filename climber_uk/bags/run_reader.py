"""Runs of one climber, made of the arrays that were collected of it.

What of them is left out, and why, is noted in the bag's losses.
"""

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
from climber_uk.bags.extraction import EXTRACTORS
from climber_uk.bags.joints import Joints, commanded_torques, rates_and_torques
from climber_uk.bags.reference import poses_at
from climber_uk.bags.run import RecordedRun
from climber_uk.bags.time_series import TimeSeries
from climber_uk.bags.topics import KNOWN, REMAP_HINT, TYPES, Topics
from climber_uk.control.build import ControllerChoice
from climber_uk.mechanics import SECOND, Array, Stamps
from climber_uk.mechanics.climber import Climber
from climber_uk.messages import topics
from climber_uk.messages.names import Names
from climber_uk.parameters.parameter_file import Values

TOLERANCE = 1.0  # [s] by which a stamp may be off the odometry's and still be of its clock
FAR = 0.05  # [m] that is not driven without a reference unless somebody else drives
NOTHING = TimeSeries.of([])
# parameters that are taken from the bag if those that are given in their place have none
RECORDED_DEFAULTS = "left_wheel_joint", "right_wheel_joint", "adhesion"
Parameters = Mapping[str, Any]  # by name


class NoRunError(ValueError):
    """There is too little odometry of a climber to make a run of; the message says why."""


@dataclass(frozen=True)
class RunReader:
    """Makes runs of the climber in `namespace`; notes in `bag` what is left out, and why."""

    bag: Bag
    names: Topics
    namespace: str
    parameters: Callable[[str], Parameters] | None = None  # of a namespace, in place of the bag's

    def topic(self, name: str) -> str:
        """Full name of one of the climber's topics."""
        return self.names.full(name, self.namespace)

    @classmethod
    def read(
        cls, path: Path, names: Topics, namespace: str, of: Collection[str] = KNOWN
    ) -> tuple["RunReader", Collected]:
        """Reader of one climber, and what its topics `of` have; raises as `open_bag` does."""
        with open_bag(path) as bag:
            reader = cls(bag, names, namespace)
            return reader, collect(bag, names, [namespace], of)[0][namespace]

    def runs(self, collected: Collected, reported: Collection[Event]) -> list[RecordedRun]:
        """All runs, with those of the `reported` events that are theirs; raises `NoRunError`."""
        if not collected.samples[topics.ODOMETRY]:
            lacking = self.bag.lacks(
                self.topic(topics.ODOMETRY), TYPES[topics.ODOMETRY], REMAP_HINT
            )
            raise NoRunError(f"no odometry: {lacking}")
        if collected.lost_previews:
            topic = self.topic(topics.REFERENCE)
            self.bag.lose(f"{topic}: {collected.lost_previews} messages left out: a point is unfit")
        self.check_frames(collected)
        parts = self.split(collected)
        runs, reasons = [], []
        for number, part in enumerate(parts, start=1):
            try:
                name = f"run {number} of {len(parts)}" if len(parts) > 1 else ""
                runs.append(self.run(part, reported, name))
            except NoRunError as nothing:
                reasons.append(str(nothing))
        if not runs:
            raise NoRunError("; ".join(reasons))
        for reason in reasons:
            self.bag.lose(reason)
        return runs

    def split(self, collected: Collected) -> list[Collected]:
        """What was collected, for each run; notes if there are several."""
        parts = collected.runs()
        if len(parts) > 1:
            topic = self.topic(topics.ODOMETRY)
            self.bag.lose(f"{topic}: time starts again, there are {len(parts)} runs")
        return parts

    def check_one_run(self, collected: Collected) -> None:
        """Raise `ValueError` if there are several runs, one after the other or at once."""
        if not collected.samples[topics.ODOMETRY]:
            return
        path, topic, count = self.bag.path, self.topic(topics.ODOMETRY), len(collected.runs())
        if count > 1:
            raise ValueError(
                f"{path}: {topic}: time starts again, there are {count} runs: want one"
            )
        if collected.disagreement:
            raise ValueError(f"{path}: no run on {topic}: {collected.disagreement}")

    def check_frames(self, collected: Collected) -> None:
        """Drop the ground truth or the reference, and note it, if it is not in odometry's frame."""
        here = collected.frames.get(topics.ODOMETRY, "")
        for name in topics.TRUTH, topics.REFERENCE:
            there = collected.frames.get(name, "")
            if not (here and there) or here == there:
                continue
            collected.samples.pop(name, None)
            if name == topics.REFERENCE:
                collected.reference.clear()
            topic = self.topic(name)
            self.bag.lose(f"{topic}: not used, frame_id={there!r} is not the odometry's, {here!r}")

    def check_agreement(self, collected: Collected) -> None:
        """Raise `NoRunError` if the odometry cannot be of one run; note stamps with two values."""
        if collected.disagreement:
            raise NoRunError(f"no run on {self.topic(topics.ODOMETRY)}: {collected.disagreement}")
        if count := collected.contradictions:
            self.bag.lose(
                f"{self.topic(topics.ODOMETRY)}: {count} messages have the stamp of another, but "
                "not its values: the first one counts"
            )

    def run(self, collected: Collected, reported: Collection[Event], part: str) -> RecordedRun:
        """One run, called `part` if the bag has several of the climber; raises `NoRunError`."""
        whole = odometry = self.series(collected, topics.ODOMETRY)
        reference = self.reference(collected, odometry.stamps)
        known = np.flatnonzero(np.isfinite(reference[:, 0]))
        if len(known):
            first, last = known[0], known[-1]
            self.note_without_reference(whole, int(first), int(last))
            odometry = odometry.within(whole.stamps[first], whole.stamps[last])
            reference = reference[first : last + 1]
        elif self.topic(topics.REFERENCE) not in self.bag.types:
            self.note_other_references()
        elif len(whole) > 1 and any(len(part.arrivals) for part in collected.reference):
            topic = self.topic(topics.REFERENCE)
            self.bag.lose(f"{topic}: no message has a time of the odometry's")
        if len(odometry) < 2:
            raise NoRunError(self.too_few(whole))
        self.check_agreement(collected)
        start, parameters = int(odometry.stamps[0]), self.parameters_of(collected)
        recorded = {
            name: self.within(self.series(collected, name), name, odometry)
            for name in EXTRACTORS.keys() - {topics.ODOMETRY}
        }
        commands = self.within(self.commands(collected, parameters), topics.TORQUES, odometry)
        wheels = self.wheels(collected, parameters)
        right, left = (self.within(wheel, topics.JOINTS, odometry) for wheel in wheels)
        begin, end = collected.begin, collected.end
        own = [e for e in reported if begin <= e.arrival < end and events.is_of(e, self.namespace)]
        news = [(_seconds(event, whole, start), event) for event in events.changes(own)]
        run = RecordedRun(
            name=self.namespace,
            start=start,
            odometry=odometry,
            reference=reference,
            commands=commands.where(np.isin(commands.stamps, odometry.stamps)),
            unanswerable=np.setdiff1d(commands.stamps, whole.stamps),
            wheels=(right, left),
            truth_reference=self.reference(collected, recorded[topics.TRUTH].stamps),
            recorded=recorded,
            events=sorted(news, key=itemgetter(0)),
            is_diagnosed=any(event.kind == "state" for event in own),
            parameters=parameters,
            part=part,
        )
        for said in filter(None, (run.contradiction, *run.wrong_twist)):
            self.bag.lose(f"{self.topic(topics.ODOMETRY)}: {said}")
        return run

    def reference(self, collected: Collected, stamps: Stamps) -> Array:
        """Poses of the reference (n, 3) at stamps (n,) [ns]; nan where there is none.

        Where the reference waited for the climber, that is counted in: `reference_time` has the
        delay 20 times a second, which is interpolated linearly.
        """
        delays = TimeSeries.of(collected.samples[topics.REFERENCE_TIME])
        if len(delays):
            begin = delays.stamps[0]
            behind = np.interp(stamps - begin, delays.stamps - begin, delays.values[:, 0])
            stamps = stamps - np.round(behind * SECOND).astype(np.int64)
        return poses_at(collected.reference, stamps)

    def note_without_reference(self, odometry: TimeSeries, first: int, last: int) -> None:
        """Note how far it went before the first and after the last message with a reference."""
        places = odometry.values[:, :2]
        for number, when, there, way in (
            (first, "before", first, places[:first]),
            (len(places) - 1 - last, "after", last, places[last:]),
        ):
            far = max(np.hypot(*(way - places[there]).T), default=0.0)
            if far > FAR:
                self.bag.lose(
                    f"{self.topic(topics.ODOMETRY)}: {number} of {len(places)} messages left out, "
                    f"{when} those with a reference: it went {far:.3g} m away in them"
                )

    def note_other_references(self) -> None:
        """Note references that are of no climber with odometry: topics were renamed."""
        types, kind, name = self.bag.types, TYPES[topics.REFERENCE], topics.REFERENCE
        own = self.names.full(name, "")
        there = [topic for topic, of in types.items() if of == kind and topic.endswith(own)]
        climbers = [topic.removesuffix(own) for topic in there]
        if any(self.names.full(topics.ODOMETRY, climber) not in types for climber in climbers):
            how = REMAP_HINT.replace(topics.ODOMETRY, topics.REFERENCE)
            self.bag.lose(self.bag.lacks(self.topic(topics.REFERENCE), kind, how))

    def series(self, collected: Collected, name: str) -> TimeSeries:
        """The fit messages of a topic; notes how many are left out, and why."""
        return self.noted(TimeSeries.of(collected.samples[name]), name)

    def noted(self, recorded: TimeSeries, name: str) -> TimeSeries:
        """The same series; notes how many messages of its topic are left out, and why."""
        if recorded.unfit:
            count, repeated = sum(recorded.unfit.values()), recorded.repeated
            total = count + len(recorded) + repeated
            why = ", ".join(f"{reason} ({n})" for reason, n in recorded.unfit.items())
            self.bag.lose(f"{self.topic(name)}: {count} of {total} messages left out: {why}")
        return recorded

    def within(self, recorded: TimeSeries, name: str, odometry: TimeSeries) -> TimeSeries:
        """The messages of a topic in the time of the odometry; notes if there are none."""
        within = recorded.within(int(odometry.stamps[0]), int(odometry.stamps[-1]))
        if len(recorded) and not len(within):
            self.bag.lose(f"{self.topic(name)}: no message has a time of the odometry's")
        return within

    def too_few(self, odometry: TimeSeries) -> str:
        """Why there is no run, in words."""
        topic, count = self.topic(topics.ODOMETRY), len(odometry)
        if count > 1:
            return f"no run on {topic}: one message only has a reference"
        others = f", {odometry.repeated} with the stamp of another" if odometry.repeated else ""
        return f"no run on {topic}: {count or 'no'} message of use{others}"

    def parameters_of(self, collected: Collected) -> Parameters:
        """Parameters of the controller: those given; of the bag, what these leave open."""
        recorded = self.recorded_parameters(collected)
        if self.parameters is None:
            return recorded
        defaults = {name: recorded[name] for name in RECORDED_DEFAULTS if name in recorded}
        return defaults | dict(self.parameters(self.namespace))

    def recorded_parameters(self, collected: Collected) -> Parameters:
        """Parameters of the controller as last recorded; none, and a note why, if one is wrong."""
        _, values = max(collected.parameters, key=itemgetter(0), default=(0, {}))
        try:
            for kind in Climber, ControllerChoice, Names:
                Values(values).read(kind)
        except (ValueError, TypeError) as error:
            self.bag.lose(f"{self.topic(topics.PARAMETERS)}: not used, {error}")
            return {}
        return values

    def commands(self, collected: Collected, parameters: Parameters) -> TimeSeries:
        """Torques right, left (n, 2) [N m] that were commanded; notes why there are none."""
        return self.of_wheels(
            collected, topics.TORQUES, lambda parts: [commanded_torques(parts, parameters)]
        )[0]

    def wheels(self, collected: Collected, parameters: Parameters) -> tuple[TimeSeries, TimeSeries]:
        """Rate and torque (n, 2) of the right and the left wheel; notes why there are none."""
        right, left = self.of_wheels(
            collected, topics.JOINTS, lambda parts: rates_and_torques(parts, parameters)
        )
        return right, left

    def of_wheels(
        self,
        collected: Collected,
        name: str,
        read: Callable[[Sequence[Joints]], Sequence[TimeSeries]],
    ) -> Sequence[TimeSeries]:
        """What `read` makes of a topic's joints; empty ones, and a note why, if it raises."""
        try:
            if parts := collected.joints[name]:
                return [self.noted(series, name) for series in read(parts)]
        except ValueError as error:
            self.bag.lose(f"{self.topic(name)}: not used, {error}")
        return [NOTHING, NOTHING]


def _seconds(event: Event, odometry: TimeSeries, start: int) -> float:
    """Time of an event [s]: its stamp, if it is of the odometry's clock, else by its arrival."""
    stamps, arrivals = odometry.stamps, odometry.arrivals
    tolerance = TOLERANCE * SECOND
    stamp = event.stamp
    if stamp is not None and stamps[0] - tolerance <= stamp <= stamps[-1] + tolerance:
        return (stamp - start) / SECOND
    i = int(np.clip(np.searchsorted(arrivals, event.arrival), 1, len(stamps)) - 1)
    since = event.arrival - int(arrivals[i])
    if i + 1 < len(stamps):  # in lock-step, time may have stood still since then
        since = min(since, int(stamps[i + 1] - stamps[i]))
    return (int(stamps[i]) - start + since) / SECOND
