"""Runs of climbers, as arrays, from the messages of a bag."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from climber_uk.analysis import events, topics
from climber_uk.analysis.bag import Bag, open_bag
from climber_uk.analysis.collecting import Collected, collect
from climber_uk.analysis.events import Event
from climber_uk.analysis.joints import Joints, of_both, of_one, wheel_names
from climber_uk.analysis.parameter_file import Values
from climber_uk.analysis.recorded import Recorded
from climber_uk.analysis.reference import poses_at
from climber_uk.analysis.run import RecordedRun
from climber_uk.analysis.taking import TAKEN
from climber_uk.analysis.topics import Topics
from climber_uk.mechanics import SECOND
from climber_uk.mechanics.climber import Climber

TOLERANCE = 1.0  # [s] by which a stamp may be off the odometry's and still be of its clock
NOTHING = Recorded.of([])
NAMES = "left_wheel_joint", "right_wheel_joint", "adhesion"
Told = Mapping[str, Any]  # parameters of a controller, by name


def read_run(bag: str | Path, namespace: str = "") -> RecordedRun:
    """The one run of the climber in `namespace`; raises as `read_runs` does, and if it has more."""
    runs, _ = read_runs(bag, Topics(), [namespace])
    if len(runs) > 1:
        raise ValueError(f"{bag} has {len(runs)} runs of one climber: its time starts again")
    return runs[0]


def read_runs(
    path: str | Path,
    names: Topics,
    namespaces: Sequence[str] = (),
    parameters: Callable[[str], Told] | None = None,
    all_of_them: bool = False,
) -> tuple[list[RecordedRun], list[str]]:
    """Runs of the climbers in some namespaces (default: all), and what is to be said of the bag.

    `parameters` gives those of the controller in a namespace, else they are as the bag tells them.
    Raises `FileNotFoundError` or `ValueError` naming the bag and what it lacks: any climber of
    `namespaces`, and with `all_of_them` any one that has a topic of odometry.
    """
    with open_bag(path) as bag:
        chosen = [name.strip("/") for name in namespaces] or names.namespaces(bag.types)
        collected, told = collect(bag, names, chosen)
        runs: list[RecordedRun] = []
        for namespace, found in collected.items():
            try:
                runs += Reading(bag, names, namespace, parameters).runs(found, told)
            except NoRunError as nothing:
                bag.lose(str(nothing))
                if namespaces or all_of_them:
                    raise ValueError(f"{path}: {'; '.join(bag.losses)}") from None
        if not runs:
            lost = "; ".join(bag.losses) or f"no odometry on a topic {topics.ODOMETRY}"
            raise ValueError(f"{path}: {lost}")
        return runs, bag.losses


class NoRunError(ValueError):
    """There is not enough odometry of a climber, and why."""


@dataclass(frozen=True)
class Reading:
    """Makes runs of one climber from what was collected, and says what of it is of no use."""

    bag: Bag
    names: Topics
    namespace: str
    parameters: Callable[[str], Told] | None  # of a namespace, in place of those in the bag

    def topic(self, name: str) -> str:
        """Full name of one of the climber's topics."""
        return self.names.full(name, self.namespace)

    def runs(self, found: Collected, told: Collection[Event]) -> list[RecordedRun]:
        """All runs; raises `NoRunError`."""
        topic = self.topic(topics.ODOMETRY)
        if not found.parts[topics.ODOMETRY]:
            raise NoRunError(f"no odometry on {topic}")
        if found.lost_previews:
            self.bag.lose(f"{self.topic(topics.REFERENCE)}: {found.lost_previews} left out: unfit")
        self.check_truth(found)
        parts = found.runs()
        if len(parts) > 1:
            self.bag.lose(f"{topic}: time starts again, there are {len(parts)} runs")
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

    def check_truth(self, found: Collected) -> None:
        """Do not use poses of which it is not known where they are to the odometry's."""
        here, there = (found.frames.get(name) for name in (topics.ODOMETRY, topics.TRUTH))
        if there not in (None, here):
            del found.parts[topics.TRUTH]
            topic = self.topic(topics.TRUTH)
            self.bag.lose(f"{topic}: not used, frame_id={there!r} is not the odometry's, {here!r}")

    def run(self, found: Collected, told: Collection[Event], part: str) -> RecordedRun:
        """One run; raises `NoRunError`."""
        whole = odometry = self.recorded(found, topics.ODOMETRY)
        reference = poses_at(found.reference, odometry.stamps)
        known = np.flatnonzero(np.isfinite(reference[:, 0]))
        if len(known):
            first, last = known[0], known[-1]
            odometry = odometry.within(whole.stamps[first], whole.stamps[last])
            reference = reference[first : last + 1]
        if len(odometry) < 2:
            raise NoRunError(self.too_few(whole))
        start, end = int(odometry.stamps[0]), int(odometry.stamps[-1])
        parameters = self.known(found)
        recorded = {name: self.recorded(found, name) for name in TAKEN.keys() - {topics.ODOMETRY}}
        commands = self.commands(found, parameters)
        right, left = self.wheels(found, parameters)

        def at_its_times(recorded: Recorded, name: str) -> Recorded:
            within = recorded.within(start, end)
            if len(recorded) and not len(within):
                self.bag.lose(f"{self.topic(name)}: no message has a time of the odometry's")
            return within

        recorded = {name: at_its_times(told, name) for name, told in recorded.items()}
        commands = at_its_times(commands, topics.TORQUES)
        own = [
            event
            for event in told
            if events.is_of(event, self.namespace) and found.begin <= event.arrival < found.end
        ]
        news = [(_seconds(event, whole, start), event) for event in events.changes(own)]
        return RecordedRun(
            name=self.namespace,
            start=start,
            odometry=odometry,
            reference=reference,
            commands=commands.where(np.isin(commands.stamps, odometry.stamps)),
            wheels=(at_its_times(right, topics.JOINTS), at_its_times(left, topics.JOINTS)),
            truth_reference=poses_at(found.reference, recorded[topics.TRUTH].stamps),
            recorded=recorded,
            events=sorted(news, key=itemgetter(0)),
            is_diagnosed=any(event.kind == "state" for event in own),
            parameters=parameters,
            part=part,
        )

    def recorded(self, found: Collected, name: str) -> Recorded:
        """The messages of a topic; says how many are left out, and why."""
        return self.judged(Recorded.of(found.parts[name]), name)

    def judged(self, recorded: Recorded, name: str) -> Recorded:
        """The same; says how many messages are left out, and why."""
        if recorded.unfit:
            count, repeated = sum(recorded.unfit.values()), recorded.repeated
            of = count + len(recorded) + repeated
            why = ", ".join(f"{reason} ({n})" for reason, n in recorded.unfit.items())
            self.bag.lose(f"{self.topic(name)}: {count} of {of} messages left out: {why}")
        return recorded

    def too_few(self, odometry: Recorded) -> str:
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

    def commands(self, found: Collected, parameters: Told) -> Recorded:
        """Torques right, left that were commanded; says why there are none."""
        parts = found.joints[topics.TORQUES]
        if not parts:
            return NOTHING
        try:
            return self.judged(
                of_both(parts, wheel_names(_names(parts), parameters)), topics.TORQUES
            )
        except ValueError as error:
            self.bag.lose(f"{self.topic(topics.TORQUES)}: not used, {error}")
            return NOTHING

    def wheels(self, found: Collected, parameters: Told) -> tuple[Recorded, Recorded]:
        """What joint_states tell of the right and the left wheel; says why they do not."""
        parts = found.joints[topics.JOINTS]
        if not parts:
            return NOTHING, NOTHING
        try:
            right, left = (of_one(parts, name) for name in wheel_names(_names(parts), parameters))
            return self.judged(right, topics.JOINTS), self.judged(left, topics.JOINTS)
        except ValueError as error:
            self.bag.lose(f"{self.topic(topics.JOINTS)}: not used, {error}")
            return NOTHING, NOTHING


def _names(parts: Iterable[Joints]) -> set[str]:
    return {name for part in parts for name in part.names}


def _seconds(event: Event, odometry: Recorded, start: int) -> float:
    """Time of an event [s]: its stamp, if it is of the odometry's clock, else by its arrival."""
    stamps, arrivals = odometry.stamps, odometry.arrivals
    tolerance = TOLERANCE * SECOND
    stamp = event.stamp
    if stamp is not None and stamps[0] - tolerance <= stamp <= stamps[-1] + tolerance:
        return (stamp - start) / SECOND
    i = int(np.clip(np.searchsorted(arrivals, event.arrival), 1, len(stamps)) - 1)
    return (int(stamps[i]) - start + event.arrival - int(arrivals[i])) / SECOND
