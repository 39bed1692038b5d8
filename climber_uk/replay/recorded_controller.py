"""What a bag's controller told: its torques, its modes, and the parameters that were in force.

Times and stamps are integers in nanoseconds.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import Any

import numpy as np

from climber_uk.bags.bag import Bag
from climber_uk.bags.collecting import collect
from climber_uk.bags.events import Event, changes
from climber_uk.bags.joints import commanded_torques
from climber_uk.bags.run_reader import RunReader
from climber_uk.bags.topics import TYPES, Topics
from climber_uk.control.safety import Mode
from climber_uk.mechanics import Array, Stamps
from climber_uk.messages import topics
from climber_uk.messages.topics import CLOCK, CONTROLLER, TORQUES

# inputs and outputs of the controller
INPUTS = topics.ODOMETRY, topics.REFERENCE, topics.PRESSURE
TOPICS = *INPUTS, TORQUES, topics.PARAMETERS, topics.DIAGNOSTICS
Modes = list[tuple[int, str]]  # each with the time of the node's clock from which on it was


@dataclass(frozen=True)
class Setting:
    """What others set."""

    parameters: Mapping[str, Any] | None = None  # by name; None: not told yet
    enabled: bool = True


class RecordedController:
    """The controller in a namespace, '' or '/name'.

    `is_published` says whether the bag tells when messages were published: those are the times
    then, not the log times. Raises `ValueError` naming the bag and what it lacks.
    """

    def __init__(
        self, bag: Bag, namespace: str, is_published: bool, file: Mapping[str, Any] | None = None
    ) -> None:
        topic = f"{namespace}/{TORQUES}"
        collected, told = collect(bag, Topics(), [namespace], TOPICS, is_published)
        found = collected[namespace]
        if not (efforts := found.joints[TORQUES]):
            raise ValueError(f"{bag.path} has no message on {topic}")
        RunReader(bag, Topics(), namespace).check_one_run(found)
        # those that were told first
        self.parameters: Mapping[str, Any] | None = found.first_parameters or None
        # whether there was a /clock
        self.simulated = any(told.msgtype == TYPES[CLOCK] for told, *_ in bag.recorded([CLOCK]))
        stamps = np.concatenate([part.stamps for part in efforts])
        arrivals = np.concatenate([part.arrivals for part in efforts])
        order = np.argsort(arrivals, kind="stable")
        stamps, arrivals = stamps[order], arrivals[order]
        # when the torques that answer a stamp were published first
        self.published = dict(zip(stamps[::-1].tolist(), arrivals[::-1].tolist(), strict=True))
        try:
            torques = commanded_torques(efforts, file or self.parameters or {})
        except ValueError as error:
            raise ValueError(f"{bag.path}: {topic}: {error}") from None
        # right, left [N m], by the stamp that they answer
        self.torques: dict[int, Array] = dict(
            zip(torques.stamps.tolist(), torques.values, strict=True)
        )
        modes = [event for event in told if event.kind == "mode" and event.text]
        modes = [event for event in modes if event.node == f"{namespace}/{CONTROLLER}"]
        news = [(event.stamp or 0, event.text) for event in changes(modes)]
        self.modes: Modes = news
        self.settings = _settings(found.parameters, modes, arrivals)


def _settings(
    parameters: Iterable[tuple[int, dict[str, Any]]], modes: Iterable[Event], torques: Stamps
) -> list[tuple[int, Setting]]:
    """New ones, with when the first torques under them were published, of `torques` (n,) [ns]."""
    told: list[tuple[int, dict[str, Any]]] = [(at, {"parameters": new}) for at, new in parameters]
    told += [(mode.arrival, {"enabled": mode.text != Mode.DISABLED.value}) for mode in modes]
    setting, found = Setting(), dict[int, Setting]()
    for at, change in sorted(told, key=itemgetter(0)):
        setting = replace(setting, **change)
        i = np.searchsorted(torques, at, "right")
        found |= dict.fromkeys(torques[i : i + 1].tolist(), setting)
    pairs = zip(found.items(), [Setting(), *found.values()], strict=False)
    return [new for new, before in pairs if new[1] != before]
