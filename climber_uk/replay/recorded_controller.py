"""What a bag has of its controller: torques, modes, and the parameters that were in force.

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
from climber_uk.control.stops import STOPS
from climber_uk.mechanics import Array, Stamps
from climber_uk.messages import topics
from climber_uk.messages.topics import CLOCK, CONTROLLER, TORQUES

# inputs and outputs of the controller
INPUTS = topics.ODOMETRY, topics.REFERENCE, topics.PRESSURE
TOPICS = *INPUTS, TORQUES, topics.PARAMETERS, topics.DIAGNOSTICS
# as which a replay, which has neither buttons nor batteries, gives the safe output
NOT_ENABLED = {mode.value for mode in (Mode.DISABLED, *STOPS)}
Modes = list[tuple[int, str]]  # with the time of the node's clock at which each began


@dataclass(frozen=True)
class Setting:
    """What is set from outside: parameters, and whether the controller is enabled."""

    parameters: Mapping[str, Any] | None = None  # by name; None: not published yet
    enabled: bool = True


class RecordedController:
    """The controller in a namespace, '' or '/name'.

    Times are those of publishing with `by_publishing`, else log times. `file` has the controller's
    parameters, if they are not those of the bag. Raises `ValueError` naming the bag and what it
    lacks.
    """

    def __init__(
        self, bag: Bag, namespace: str, by_publishing: bool, file: Mapping[str, Any] | None = None
    ) -> None:
        topic = f"{namespace}/{TORQUES}"
        collected, events = collect(bag, Topics(), [namespace], TOPICS, by_publishing)
        found = collected[namespace]
        if not (efforts := found.joints[TORQUES]):
            raise ValueError(f"{bag.path} has {bag.lacks(topic, TYPES[TORQUES])}")
        RunReader(bag, Topics(), namespace).check_one_run(found)
        # those published first
        self.parameters: Mapping[str, Any] | None = found.first_parameters or None
        # whether there was a /clock
        self.simulated = any(c.msgtype == TYPES[CLOCK] for c, *_ in bag.recorded([CLOCK]))
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
        modes = [event for event in events if event.kind == "mode" and event.text]
        modes = [event for event in modes if event.node == f"{namespace}/{CONTROLLER}"]
        self.modes: Modes = [(event.stamp or 0, event.text) for event in changes(modes)]
        self.settings = _settings(found.parameters, modes, arrivals)


def _settings(
    parameters: Iterable[tuple[int, dict[str, Any]]], modes: Iterable[Event], torques: Stamps
) -> list[tuple[int, Setting]]:
    """Changes of the setting, with the time [ns] of the first torques under each.

    `torques` (n,) are the times [ns] at which torques were published.
    """
    news: list[tuple[int, dict[str, Any]]] = [(at, {"parameters": new}) for at, new in parameters]
    news += [(mode.arrival, {"enabled": mode.text not in NOT_ENABLED}) for mode in modes]
    setting, found = Setting(), dict[int, Setting]()
    for at, change in sorted(news, key=itemgetter(0)):
        setting = replace(setting, **change)
        i = np.searchsorted(torques, at, "right")
        found |= dict.fromkeys(torques[i : i + 1].tolist(), setting)
    pairs = zip(found.items(), [Setting(), *found.values()], strict=False)
    return [new for new, before in pairs if new[1] != before]
