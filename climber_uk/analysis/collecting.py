"""All that a bag tells of its climbers, read in one go."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from tqdm import tqdm

from climber_uk.analysis import events, topics
from climber_uk.analysis.bag import Bag
from climber_uk.analysis.batches import Batch, read_batches
from climber_uk.analysis.events import Event
from climber_uk.analysis.reference import Points
from climber_uk.analysis.taking import TAKEN
from climber_uk.analysis.topics import Topics
from climber_uk.mechanics.climber import Climber

PATIENCE = 2.0  # [s] after which progress is told


class Collected:
    """What was read so far of one climber."""

    def __init__(self) -> None:
        self.parts: dict[str, list[tuple[Any, Any, Any]]] = defaultdict(list)
        self.reference: list[Points] = []
        self.climber: Climber | None = None

    def take(self, name: str, batch: Batch) -> None:
        """Take the numbers of a batch; `KeyError` or `ValueError` if it has not what it should."""
        if name == topics.REFERENCE:
            self.reference.append(Points.of(batch))
        elif name == topics.PARAMETERS:
            self.climber = _climber(batch)
        else:
            self.parts[name].append((batch.stamps, batch.log_times, TAKEN[name](batch)))


def collect(
    bag: Bag, names: Topics, namespaces: Sequence[str]
) -> tuple[dict[str, Collected], list[Event]]:
    """Return what a bag tells of the climbers in some namespaces, and all events."""
    collected = {namespace: Collected() for namespace in namespaces}
    takers = {
        topic: (name, found)
        for namespace, found in collected.items()
        for topic, name in names.of(namespace)
    }
    texts = {
        names.full(topics.DIAGNOSTICS, ""): events.statuses,
        names.full(topics.LOG, ""): events.warnings,
    }
    wanted = [topic for topic in bag.types if topic in takers or topic in texts]
    told: list[Event] = []
    with tqdm(
        total=bag.count(wanted), unit=" messages", delay=PATIENCE, leave=False, disable=None
    ) as progress:
        for topic, batch in read_batches(bag, wanted):
            progress.update(len(batch))
            try:
                if topic in texts:
                    told += texts[topic](batch)
                else:
                    name, found = takers[topic]
                    found.take(name, batch)
            except (KeyError, IndexError, ValueError) as error:
                bag.lose(f"{topic}: messages are not what they should be ({error})")
    return collected, told


def _climber(batch: Batch) -> Climber:
    """Parameters of a climber, from the last of the messages with all of a node's parameters."""
    told = {
        batch.strings[f"new_parameters.{i}.name"]: batch[f"new_parameters.{i}.value.double_value"]
        for i in range(batch.lengths["new_parameters"])
    }
    return Climber(**{field.name: float(told[field.name][-1]) for field in fields(Climber)})
