"""What a bag has of its climbers, read in one pass over its messages."""

import math
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from operator import itemgetter
from typing import Any, TypeVar

import numpy as np
from tqdm import tqdm

from climber_uk.bags import events
from climber_uk.bags.bag import Bag
from climber_uk.bags.batches import Batch, read_batches
from climber_uk.bags.events import Event
from climber_uk.bags.extraction import EXTRACTORS, STRAY
from climber_uk.bags.joints import Joints
from climber_uk.bags.reference import Previews
from climber_uk.bags.restarts import are_copies, are_many, are_strays, disagreement, windows
from climber_uk.bags.time_series import Samples, in_order
from climber_uk.bags.topics import KNOWN, NAMES, Topics
from climber_uk.messages import topics

T = TypeVar("T", Samples, Joints, Previews)
PROGRESS_DELAY = 2.0  # [s] of reading, after which progress is shown


class Collected:
    """What was read of one climber: arrays, by the names of its topics."""

    def __init__(self) -> None:
        self.samples: dict[str, list[Samples]] = defaultdict(list)
        self.joints: dict[str, list[Joints]] = defaultdict(list)
        self.reference: list[Previews] = []
        self.parameters: list[tuple[int, dict[str, Any]]] = []  # with the log time [ns]
        self.frames: dict[str, str] = {}  # of poses, by the topic's name
        self.lost_previews = 0  # with an unfit point
        self.begin, self.end = -math.inf, math.inf  # log times [ns] of its run

    def add(self, name: str, batch: Batch) -> None:
        """Add the numbers of a batch; raises `KeyError` or `ValueError` if a field is not right."""
        if name == topics.REFERENCE:
            previews = Previews.of(batch)
            self._check_frame(name, batch)
            self.reference.append(previews)
            self.lost_previews += len(batch) - len(previews.arrivals)
        elif name == topics.PARAMETERS:
            self.parameters += _parameters(batch)
        elif name in (topics.TORQUES, topics.JOINTS):
            self.joints[name].append(Joints.of(batch))
        else:
            extracted = EXTRACTORS[name](batch)  # raises, if the type is another, before `frames`
            self._check_frame(name, batch)
            self.samples[name].append(Samples(batch.stamps, batch.log_times, *extracted))

    def _check_frame(self, name: str, batch: Batch) -> None:
        frame = batch.strings["header.frame_id"]
        if frame != (first := self.frames.setdefault(name, frame)):
            raise ValueError(f"frame_id={frame!r}, others have {first!r}")

    @property
    def first_parameters(self) -> dict[str, Any]:
        """Parameters of the controller as they were first recorded; empty if they were not."""
        return min(self.parameters, key=itemgetter(0), default=(0, {}))[1]

    def runs(self) -> list["Collected"]:
        """The same for each run: a new one begins where the odometry's stamps start again."""
        odometry = self._fit_odometry()
        spans = windows(odometry.stamps, odometry.arrivals)
        return [self.within(*span) for span in spans] if len(spans) > 1 else [self]

    def leave_out_strays(self) -> None:
        """Mark odometry with a stamp far off its neighbours' as unfit, if it is an accident."""
        if parts := self.samples[topics.ODOMETRY]:
            samples = in_order(parts)
            fit = np.flatnonzero(samples.faults == 0)
            if not are_many(strays := are_strays(samples.stamps[fit])):
                samples.faults[fit[strays]] = STRAY
            self.samples[topics.ODOMETRY] = [samples]

    @property
    def disagreement(self) -> str:
        """Why the odometry is not of one run, in words; empty if it may be."""
        odometry = self._fit_odometry()
        return disagreement(odometry.stamps, odometry.values[:, :2])

    @property
    def contradictions(self) -> int:
        """How many messages of odometry have the stamp of another, but not its values."""
        stamps = self._fit_odometry().stamps
        return len(stamps) - len(np.unique(stamps))

    def _fit_odometry(self) -> Samples:
        """The fit messages, each once, in the order of log times."""
        odometry = in_order(self.samples[topics.ODOMETRY])
        return odometry.where(~are_copies(odometry.stamps, odometry.values)).fit

    def within(self, begin: float, end: float) -> "Collected":
        """What was recorded between two log times [ns], with the parameters known by the end."""

        def chosen(parts: list[T]) -> list[T]:
            return [p.where((begin <= p.arrivals) & (p.arrivals < end)) for p in parts]

        run = Collected()
        run.begin, run.end = begin, end
        run.frames, run.lost_previews = self.frames, self.lost_previews
        run.samples |= {name: chosen(parts) for name, parts in self.samples.items()}
        run.joints |= {name: chosen(parts) for name, parts in self.joints.items()}
        run.reference = chosen(self.reference)
        run.parameters = [(at, values) for at, values in self.parameters if at < end]
        return run


def collect(
    bag: Bag,
    names: Topics,
    namespaces: Sequence[str],
    of: Collection[str] = KNOWN,
    by_publishing: bool = False,
) -> tuple[dict[str, Collected], list[Event]]:
    """Return what a bag has of the climbers in some namespaces, by namespace, and all events.

    Only topics with the names `of` are read. `by_publishing` has times of publishing in place of
    log times. What cannot be read is noted in the bag's losses.
    """
    collected = {namespace: Collected() for namespace in namespaces}
    receivers = {
        names.full(name, namespace): (name, climber)
        for namespace, climber in collected.items()
        for name in NAMES
        if name in of
    }
    event_readers = {
        names.full(name, ""): read
        for name, read in ((topics.DIAGNOSTICS, events.statuses), (topics.LOG, events.warnings))
        if name in of
    }
    wanted = [topic for topic in bag.types if topic in receivers or topic in event_readers]
    found: list[Event] = []
    with tqdm(
        total=bag.count(wanted), unit=" messages", delay=PROGRESS_DELAY, leave=False, disable=None
    ) as progress:
        for topic, batch in read_batches(bag, wanted, by_publishing):
            progress.update(len(batch))
            try:
                if topic in event_readers:
                    found += event_readers[topic](batch)
                else:
                    name, climber = receivers[topic]
                    climber.add(name, batch)
            except (KeyError, IndexError, ValueError) as error:
                bag.lose(f"{topic}: messages are not what they should be ({error})")
    for climber in collected.values():
        climber.leave_out_strays()
    return collected, found


def _parameters(batch: Batch) -> Iterator[tuple[int, dict[str, Any]]]:
    """Log time [ns] and values by name, of each message with all of a node's parameters."""
    for row, log_time in enumerate(batch.log_times.tolist()):
        values: dict[str, Any] = {}
        for i in range(batch.lengths["new_parameters"]):
            place = f"new_parameters.{i}"
            name, value = batch.strings[f"{place}.name"], f"{place}.value"
            match int(batch[f"{value}.type"][row]):
                case 1:
                    values[name] = bool(batch[f"{value}.bool_value"][row])
                case 2:
                    values[name] = int(batch[f"{value}.integer_value"][row])
                case 3:
                    values[name] = float(batch[f"{value}.double_value"][row])
                case 4:
                    values[name] = batch.strings[f"{value}.string_value"]
        yield log_time, values
