"""What a bag's controller told: its torques, its modes, and the parameters that were in force.

Times and stamps are integers in nanoseconds.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from climber_uk.analysis.publishing_order import read_published
from climber_uk.analysis.topics import TORQUES
from climber_uk.control.safety import Mode
from climber_uk.mechanics import Array
from climber_uk.messages import reading

NODE = "uk_torque_controller"
PARAMETERS = f"{NODE}/parameters"
CLOCK, DIAGNOSTICS = "/clock", "/diagnostics"
Modes = list[tuple[int, str]]  # each with the time of the node's clock from which on it was


@dataclass(frozen=True)
class Setting:
    """What others set."""

    parameters: Mapping[str, Any] | None = None  # by name; None: not told yet
    enabled: bool = True


class RecordedController:
    """The controller in a namespace, '' or '/name'.

    Raises `FileNotFoundError` or `ValueError` naming the bag and what it lacks.
    """

    def __init__(self, bag: Path, namespace: str) -> None:
        self.node = f"{namespace}/{NODE}"
        self.torques: dict[int, Array] = {}  # right, left [N m], by the stamp that they answer
        # new ones, with when the first torques under them were published
        self.settings: list[tuple[int, Setting]] = []
        self.modes: Modes = []
        self.parameters: Mapping[str, Any] | None = None  # those that were told first
        self.simulated = False  # whether there was a /clock
        self.published: dict[int, int] = {}  # when first, by that stamp
        self._setting = self._set_before = Setting()
        takers = {
            f"{namespace}/{TORQUES}": self._on_torques,
            f"{namespace}/{PARAMETERS}": self._on_parameters,
            CLOCK: self._on_clock,
            DIAGNOSTICS: self._on_diagnostics,
        }
        for topic, at, message in read_published(bag, takers):
            takers[topic](at, message)
        if not self.torques:
            raise ValueError(f"{bag} has no message on {namespace}/{TORQUES}")

    def _on_torques(self, at: int, message: Any) -> None:
        stamp = reading.nanoseconds(message.header.stamp)
        with suppress(ValueError):  # what is no torque cannot be compared
            left, right, *_ = [*list(message.name), "", ""]
            torques = reading.wheel_torques(message, left, right)
            self.torques.setdefault(stamp, torques)
        self.published.setdefault(stamp, at)
        if self._setting != self._set_before:
            self.settings.append((at, self._setting))
            self._set_before = self._setting

    def _on_parameters(self, _: int, message: Any) -> None:
        told = reading.parameters(message)
        self._setting = replace(self._setting, parameters=told)
        self.parameters = self.parameters or told

    def _on_clock(self, *_: Any) -> None:
        self.simulated = True

    def _on_diagnostics(self, _: int, message: Any) -> None:
        for status in message.status:
            told = {value.key: value.value for value in status.values}
            if status.name == self.node and (mode := told.get("mode")):
                self._setting = replace(self._setting, enabled=mode != Mode.DISABLED.value)
                if not self.modes or mode != self.modes[-1][1]:
                    self.modes.append((reading.nanoseconds(message.header.stamp), mode))
