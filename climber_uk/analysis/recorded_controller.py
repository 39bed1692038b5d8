"""What a bag's controller told: its torques, its modes, and the parameters that were in force.

Times and stamps are integers in nanoseconds.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from climber_uk.analysis.joints import wheel_names
from climber_uk.analysis.publishing_order import read_published
from climber_uk.analysis.topics import TORQUES, types_of
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

    def __init__(self, bag: Path, namespace: str, file: Mapping[str, Any] | None = None) -> None:
        self.node = f"{namespace}/{NODE}"
        self.torques: dict[int, Array] = {}  # right, left [N m], by the stamp that they answer
        # new ones, with when the first torques under them were published
        self.settings: list[tuple[int, Setting]] = []
        self.modes: Modes = []
        self.parameters: Mapping[str, Any] | None = None  # those that were told first
        self.simulated = False  # whether there was a /clock
        self.published: dict[int, int] = {}  # when first, by that stamp
        self._efforts: list[tuple[int, dict[str, float]]] = []  # stamp, and torques by the joint
        self._setting = self._set_before = Setting()
        topic = f"{namespace}/{TORQUES}"
        takers = {
            topic: self._on_torques,
            f"{namespace}/{PARAMETERS}": self._on_parameters,
            CLOCK: self._on_clock,
            DIAGNOSTICS: self._on_diagnostics,
        }
        for name, at, message in read_published(bag, types_of(takers)):
            takers[name](at, message)
        if not self._efforts:
            raise ValueError(f"{bag} has no message on {topic}")
        try:
            self._take_torques(file or self.parameters or {})
        except ValueError as error:
            raise ValueError(f"{bag}: {topic}: {error}") from None

    def _on_torques(self, at: int, message: Any) -> None:
        stamp = reading.nanoseconds(message.header.stamp)
        self._efforts.append((stamp, dict(zip(message.name, message.effort, strict=False))))
        self.published.setdefault(stamp, at)
        if self._setting != self._set_before:
            self.settings.append((at, self._setting))
            self._set_before = self._setting

    def _take_torques(self, parameters: Mapping[str, Any]) -> None:
        """Take the two wheels' torques; raises `ValueError` if that cannot be."""
        joints = {joint for _, efforts in self._efforts for joint in efforts}
        wheels = wheel_names(joints, parameters)
        for stamp, efforts in self._efforts:
            torques = np.array([efforts.get(wheel, np.nan) for wheel in wheels])
            if np.isfinite(torques).all():  # what is no torque cannot be compared
                self.torques.setdefault(stamp, torques)

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
