"""All that a bag tells of its climbers, read in one go."""

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
from climber_uk.bags.joints import Joints
from climber_uk.bags.recorded import Samples, in_order
from climber_uk.bags.reference import Points
from climber_uk.bags.restarts import are_copies, are_many, are_strays, disagreement, windows
from climber_uk.bags.taking import STRAY, TAKEN
from climber_uk.bags.topics import KNOWN, Topics
from climber_uk.messages import topics

T = TypeVar("T", Samples, Joints, Points)
PROGRESS_DELAY = 2.0  # [s] of reading, after which progress is shown


class Collected:
    """What was read so far of one climber."""

    def __init__(self) -> None:
        self.samples: dict[str, list[Samples]] = defaultdict(list)
        self.joints: dict[str, list[Joints]] = defaultdict(list)
        self.reference: list[Points] = []
        self.parameters: list[tuple[int, dict[str, Any]]] = []  # with the log time [ns]
        self.frames: dict[str, str] = {}  # of poses, by the topic's name
        self.lost_previews = 0
        self.begin, self.end = -math.inf, math.inf  # log times [ns] of its run

    def take(self, name: str, batch: Batch) -> None:
        """Take the numbers of a batch; `KeyError` or `ValueError` if it has not what it should."""
        if name == topics.REFERENCE:
            self.reference.append(points := Points.of(batch))
            self.lost_previews += len(batch) - len(points.arrivals)
        elif name == topics.PARAMETERS:
            self.parameters += _parameters(batch)
        elif name in (topics.TORQUES, topics.JOINTS):
            self.joints[name].append(Joints.of(batch))
        else:
            taken = TAKEN[name](batch)  # first, as what is of another type has no say in the frame
            frame = batch.strings["header.frame_id"]
            if frame != (first := self.frames.setdefault(name, frame)):
                raise ValueError(f"frame_id={frame!r}, others have {first!r}")
            self.samples[name].append(Samples(batch.stamps, batch.log_times, *taken))

    @property
    def first_parameters(self) -> dict[str, Any]:
        """Those that the controller told first; none if it did not."""
        return min(self.parameters, key=itemgetter(0), default=(0, {}))[1]

    def runs(self) -> list["Collected"]:
        """What belongs to each run: they differ where the odometry's time starts again."""
        odometry = self._fit_odometry()
        found = windows(odometry.stamps, odometry.arrivals)
        return [self.within(*window) for window in found] if len(found) > 1 else [self]

    def leave_out_strays(self) -> None:
        """Mark odometry whose stamp cannot be as unfit, unless there is so much of it."""
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
        """What is fit, each message once, in the order of log times."""
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
        run.parameters = [told for told in self.parameters if told[0] < end]
        return run


def collect(
    bag: Bag,
    names: Topics,
    namespaces: Sequence[str],
    of: Collection[str] = KNOWN,
    by_publishing: bool = False,
) -> tuple[dict[str, Collected], list[Event]]:
    """Return what a bag tells of the climbers in some namespaces, and all events.

    Of the topics with the names `of` only; `by_publishing` gives arrivals as the times of
    publishing, not of recording.
    """
    collected = {namespace: Collected() for namespace in namespaces}
    takers = {
        topic: (name, found)
        for namespace, found in collected.items()
        for topic, name in names.of(namespace)
        if name in of
    }
    texts = {
        names.full(name, ""): tell
        for name, tell in ((topics.DIAGNOSTICS, events.statuses), (topics.LOG, events.warnings))
        if name in of
    }
    wanted = [topic for topic in bag.types if topic in takers or topic in texts]
    told: list[Event] = []
    with tqdm(
        total=bag.count(wanted), unit=" messages", delay=PROGRESS_DELAY, leave=False, disable=None
    ) as progress:
        for topic, batch in read_batches(bag, wanted, by_publishing):
            progress.update(len(batch))
            try:
                if topic in texts:
                    told += texts[topic](batch)
                else:
                    name, found = takers[topic]
                    found.take(name, batch)
            except (KeyError, IndexError, ValueError) as error:
                bag.lose(f"{topic}: messages are not what they should be ({error})")
    for found in collected.values():
        found.leave_out_strays()
    return collected, told


def _parameters(batch: Batch) -> Iterator[tuple[int, dict[str, Any]]]:
    """Log time [ns] and values by name, of messages with all of a node's parameters."""
    for row, log_time in enumerate(batch.log_times.tolist()):
        told: dict[str, Any] = {}
        for i in range(batch.lengths["new_parameters"]):
            place = f"new_parameters.{i}"
            name, value = batch.strings[f"{place}.name"], f"{place}.value"
            match int(batch[f"{value}.type"][row]):
                case 1:
                    told[name] = bool(batch[f"{value}.bool_value"][row])
                case 2:
                    told[name] = int(batch[f"{value}.integer_value"][row])
                case 3:
                    told[name] = float(batch[f"{value}.double_value"][row])
                case 4:
                    told[name] = batch.strings[f"{value}.string_value"]
        yield log_time, told
