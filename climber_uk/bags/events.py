"""What happened when: modes of the controller, states of the nodes, warnings in the log."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from climber_uk.bags.batches import Batch
from climber_uk.control.safety import Mode

OK, WARNING, ERROR = range(3)
LOG_LEVELS = {30: WARNING, 40: ERROR, 50: ERROR}


@dataclass(frozen=True)
class Event:
    """Something that a node reported."""

    arrival: int  # log time [ns]
    stamp: int | None  # [ns]; None: a line of the log, which has none
    node: str
    kind: str  # mode, state or log
    level: int
    text: str


def statuses(batch: Batch) -> Iterator[Event]:
    """States of the nodes and modes of the controller, of all diagnostic messages.

    Most repeat the one before: see `changes`.
    """
    for i in range(batch.lengths["status"]):
        place = f"status.{i}"
        node, text = batch.strings[f"{place}.name"], batch.strings[f"{place}.message"]
        values = {
            batch.strings[f"{place}.values.{k}.key"]: batch.strings[f"{place}.values.{k}.value"]
            for k in range(batch.lengths[f"{place}.values"])
        }
        mode = values.get("mode")
        levels = batch[f"{place}.level"].clip(max=ERROR).astype(int).tolist()  # 3 is "stale"
        for arrival, stamp, level in zip(
            batch.log_times.tolist(), batch.stamps.tolist(), levels, strict=True
        ):
            yield Event(arrival, stamp, node, "state", level, text)
            if mode is not None:
                yield Event(arrival, stamp, node, "mode", ERROR if is_fault(mode) else OK, mode)


def warnings(batch: Batch) -> Iterator[Event]:
    """Lines of the log that are warnings or errors."""
    node = "/" + batch.strings["name"].replace(".", "/")
    for arrival, level in zip(batch.log_times.tolist(), batch["level"], strict=True):
        if int(level) in LOG_LEVELS:
            yield Event(arrival, None, node, "log", LOG_LEVELS[int(level)], batch.strings["msg"])


def changes(events: Iterable[Event]) -> list[Event]:
    """Events, by arrival, with another mode or level than before; all lines of the log."""
    last: dict[tuple[str, str], object] = {}
    changed = []
    for event in sorted(events, key=lambda event: event.arrival):
        key = event.node, event.kind
        value = event.text if event.kind == "mode" else event.level
        usual = OK if event.kind == "state" else None
        if event.kind == "log" or value != last.get(key, usual):
            changed.append(event)
        last[key] = value
    return changed


def is_of(event: Event, namespace: str) -> bool:
    """Whether an event is of a node in `namespace`."""
    return event.node.split(":")[0].rsplit("/", 1)[0].strip("/") == namespace.strip("/")


def is_fault(mode: str) -> bool:
    """Whether a mode of the controller is a fault; one that is unknown counts as such."""
    return mode not in {known.value for known in Mode if not known.is_fault}
