"""Runs of climbers, as arrays, from the messages of a bag."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from operator import itemgetter
from pathlib import Path

import numpy as np

from climber_uk.analysis import events, topics
from climber_uk.analysis.bag import open_bag
from climber_uk.analysis.collecting import Collected, collect
from climber_uk.analysis.events import Event
from climber_uk.analysis.recorded import Recorded
from climber_uk.analysis.reference import poses_at
from climber_uk.analysis.taking import TAKEN
from climber_uk.analysis.topics import Topics
from climber_uk.control.constraints import tracking_error
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.reference import Reference

TOLERANCE = 1.0  # [s] by which a stamp may be off the odometry's and still be of its clock


@dataclass(frozen=True)
class RecordedRun:
    """What happened from the first odometry that has a reference to the last, or to all odometry.

    Times are stamps, in seconds since the first of these odometry messages.
    """

    name: str  # the climber's namespace
    start: int  # [ns] stamp of time 0
    odometry: Recorded  # n messages: x [m], y [m], θ [rad], forwards, to the left [m/s], ω [rad/s]
    reference: Array  # (n, 3) the pose there should have been; nan where there is no reference
    commands: Recorded  # torques right, left [N m] that answer these odometry messages
    recorded: dict[str, Recorded]  # all else, by the topic's name
    events: list[tuple[float, Event]]  # [s] and what was told that is news
    is_diagnosed: bool  # whether its nodes told their states
    climber: Climber | None  # its parameters, if the bag tells them

    @cached_property
    def time(self) -> Array:
        """(n,) [s]."""
        return self.seconds(self.odometry)

    @property
    def pose(self) -> Array:
        """(n, 3) x [m], y [m], θ [rad]."""
        return self.odometry.values[:, :3]

    @property
    def side_slip(self) -> Array:
        """(n,) [m/s]."""
        return self.odometry.values[:, 4]

    @cached_property
    def error(self) -> Array:
        """(n, 3) along-track [m], cross-track [m], heading [rad]; nan without a reference."""
        nothing = np.zeros_like(self.reference)
        at = Reference(self.reference, nothing, nothing, nothing[:, :2])
        return np.stack(tracking_error(self.pose, at), axis=-1)

    @cached_property
    def distance(self) -> Array:
        """Distance from the reference (n,) [m]."""
        return np.hypot(self.error[:, 0], self.error[:, 1])

    @property
    def torques(self) -> Array:
        """(m, 2) right, left [N m]."""
        return self.commands.values.reshape(-1, 2)

    @cached_property
    def answered(self) -> Recorded:
        """(m,) the odometry messages that have an answer."""
        return self.odometry.where(np.isin(self.odometry.stamps, self.commands.stamps))

    @property
    def hold(self) -> Recorded:
        """(k,) slip margin, tip margin, load on the wheels [N]: the plant's, else estimates."""
        told = [self.recorded[name] for name in topics.MARGINS]
        return next((recorded for recorded in told if len(recorded)), told[0])

    @property
    def margins(self) -> Array:
        """(k, 2) slip margin, tip margin."""
        return self.hold.values[:, :2]

    @cached_property
    def latency(self) -> Array:
        """(m,) [s] from an odometry's arrival at the recorder to that of its torque."""
        return (self.commands.arrivals - self.answered.arrivals) / SECOND

    @cached_property
    def modes(self) -> list[tuple[Event, float, float]]:
        """Modes of the controller, as far as they are known, with begin and end [s]."""
        told = [(time, event) for time, event in self.events if event.kind == "mode"]
        end = float(self.time[-1])
        times = [min(max(time, 0.0), end) for time, _ in told] + [end]
        return [(event, *span) for (_, event), span in zip(told, pairwise(times), strict=True)]

    def seconds(self, recorded: Recorded) -> Array:
        """Times of some messages [s]."""
        return (recorded.stamps - self.start) / SECOND


def read_run(bag: str | Path, namespace: str = "") -> RecordedRun:
    """Run of the climber in `namespace`; raises as `read_runs` does."""
    return read_runs(bag, Topics(), [namespace])[0][0]


def read_runs(
    path: str | Path, names: Topics, namespaces: Sequence[str] = ()
) -> tuple[list[RecordedRun], list[str]]:
    """Runs of the climbers in some namespaces (default: all), and what of the bag was lost.

    Raises `FileNotFoundError` or `ValueError` naming the bag and what it lacks.
    """
    with open_bag(path) as bag:
        chosen = [name.strip("/") for name in namespaces] or names.namespaces(bag.types)
        collected, told = collect(bag, names, chosen)
        runs = []
        for namespace, found in collected.items():
            if len(odometry := Recorded.of(found.parts[topics.ODOMETRY])):
                runs.append(_run(namespace, found, odometry, told))
            else:
                bag.lose(f"no odometry on {names.full(topics.ODOMETRY, namespace)}")
        if not runs:
            lost = "; ".join(bag.losses) or f"no odometry on a topic {topics.ODOMETRY}"
            raise ValueError(f"{path}: {lost}")
        return runs, bag.losses


def _run(
    namespace: str, found: Collected, odometry: Recorded, told: Collection[Event]
) -> RecordedRun:
    """Run of a climber from what was collected."""
    reference = poses_at(found.reference, odometry.stamps)
    known = np.flatnonzero(np.isfinite(reference[:, 0]))
    whole = odometry
    if len(known):
        first, last = known[0], known[-1]
        odometry = odometry.within(whole.stamps[first], whole.stamps[last])
        reference = reference[first : last + 1]
    recorded = {
        name: Recorded.of(found.parts[name]).within(odometry.stamps[0], odometry.stamps[-1])
        for name in TAKEN
    }
    commands = recorded[topics.TORQUES]
    own = [event for event in told if events.is_of(event, namespace)]
    news = [(_seconds(e, whole, int(odometry.stamps[0])), e) for e in events.changes(own)]
    return RecordedRun(
        name=namespace,
        start=int(odometry.stamps[0]),
        odometry=odometry,
        reference=reference,
        commands=commands.where(np.isin(commands.stamps, odometry.stamps)),
        recorded=recorded,
        events=sorted(news, key=itemgetter(0)),
        is_diagnosed=any(event.kind == "state" for event in own),
        climber=found.climber,
    )


def _seconds(event: Event, odometry: Recorded, start: int) -> float:
    """Time of an event [s]: its stamp, if it is of the odometry's clock, else by its arrival."""
    stamps, arrivals = odometry.stamps, odometry.arrivals
    tolerance = TOLERANCE * SECOND
    stamp = event.stamp
    if stamp is not None and stamps[0] - tolerance <= stamp <= stamps[-1] + tolerance:
        return (stamp - start) / SECOND
    i = int(np.clip(np.searchsorted(arrivals, event.arrival), 1, len(stamps)) - 1)
    return (int(stamps[i]) - start + event.arrival - int(arrivals[i])) / SECOND
