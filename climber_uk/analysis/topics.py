"""Which topics are a climber's, and the numbers that are taken from their messages."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from climber_uk.analysis.batches import Batch
from climber_uk.mechanics import Array
from climber_uk.messages.reading import LARGEST

ODOMETRY, REFERENCE, TORQUES = "odom", "reference", "wheel_torques"
JOINTS, PRESSURE, PARAMETERS = "joint_states", "suction_pressure", "uk_torque_controller/parameters"
FORCE = "uk_torque_controller/constraint_force"
MARGINS = "plant_simulator/margins", "uk_torque_controller/margins"  # the plant knows better
DIAGNOSTICS, LOG = "/diagnostics", "/rosout"
NAMES = (ODOMETRY, REFERENCE, TORQUES, JOINTS, PRESSURE, PARAMETERS, FORCE, *MARGINS)
KNOWN = {*NAMES, DIAGNOSTICS, LOG}


@dataclass(frozen=True)
class Topics:
    """Topics by the names that the nodes give them, some of them remapped."""

    remapped: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def parse(cls, rules: Sequence[str]) -> "Topics":
        """Topics by rules such as odom:=/robot/odom; raises `ValueError` naming a wrong one."""
        pairs = [rule.partition(":=") for rule in rules]
        for rule, (name, sign, other) in zip(rules, pairs, strict=True):
            if not (name and sign and other):
                raise ValueError(f"remapping {rule!r} must be FROM:=TO")
            if name not in KNOWN:
                raise ValueError(
                    f"remapping {rule!r}: {name} is none of {', '.join(sorted(KNOWN))}"
                )
        return cls({name: other for name, _, other in pairs})

    def full(self, name: str, namespace: str) -> str:
        """Full name of a topic of the climber in `namespace`."""
        name = self.remapped.get(name, name)
        return name if name.startswith("/") else f"/{namespace}/{name}".replace("//", "/")

    def of(self, namespace: str) -> Iterator[tuple[str, str]]:
        """Full name, and name, of the topics of one climber."""
        for name in NAMES:
            yield self.full(name, namespace), name

    def namespaces(self, types: Mapping[str, str]) -> list[str]:
        """Those of the climbers that have odometry in a bag with topics of some types."""
        name = self.full(ODOMETRY, "")
        if name in types and ODOMETRY in self.remapped and self.remapped[ODOMETRY][0] == "/":
            return [""]
        return sorted(
            topic.removesuffix(name).strip("/")
            for topic, kind in types.items()
            if kind == "nav_msgs/msg/Odometry" and topic.endswith(name)
        )


def heading(batch: Batch, path: str) -> Array:
    """Headings (n,) [rad] of orientations at `path`; nan unless they are unit turns about z."""
    x, y, z, w = batch.columns(*(f"{path}.{axis}" for axis in "xyzw")).T
    is_planar = (np.abs(np.hypot(z, w) - 1) < 1e-3) & (np.hypot(x, y) < 0.1)
    return np.where(is_planar, np.arctan2(2 * w * z, w * w - z * z), np.nan)


def _odometry(batch: Batch) -> Array:
    """Pose x, y, θ and twist forwards, to the left, about z, (n, 6)."""
    position, twist = "pose.pose.position", "twist.twist"
    return np.column_stack(
        [
            batch.columns(f"{position}.x", f"{position}.y"),
            heading(batch, "pose.pose.orientation"),
            batch.columns(f"{twist}.linear.x", f"{twist}.linear.y", f"{twist}.angular.z"),
        ]
    )


def _torques(batch: Batch) -> Array:
    """Torques right, left (n, 2) [N m]."""
    return batch["effort"][:, _wheels(batch)]


def _joints(batch: Batch) -> Array:
    """Rates right, left [rad/s] and torques right, left [N m], (n, 4)."""
    wheels = _wheels(batch)
    return np.column_stack([batch["velocity"][:, wheels], batch["effort"][:, wheels]])


def _wheels(batch: Batch) -> list[int]:
    """Places of the right and the left wheel: by their names, else left comes first."""
    names = [batch.strings[f"name.{i}"] for i in range(batch.lengths["name"])]
    wheels = [i for side in ("right", "left") for i, name in enumerate(names) if side in name]
    return wheels if len(wheels) == 2 else [1, 0]


def _vector(batch: Batch) -> Array:
    return batch.columns("vector.x", "vector.y", "vector.z")


def _wrench(batch: Batch) -> Array:
    return batch.columns("wrench.force.x", "wrench.force.y", "wrench.torque.z")


def _pressure(batch: Batch) -> Array:
    return batch.columns("fluid_pressure")


WIDEST = 6  # values of a message
TAKEN: dict[str, Callable[[Batch], Array]] = {
    ODOMETRY: _odometry,
    TORQUES: _torques,
    JOINTS: _joints,
    PRESSURE: _pressure,
    FORCE: _wrench,
    **dict.fromkeys(MARGINS, _vector),
}


@dataclass(frozen=True)
class Recorded:
    """The n messages of one topic, each stamp once, in the order of the stamps."""

    stamps: NDArray[np.int64]  # (n,) [ns]
    arrivals: NDArray[np.int64]  # (n,) log times [ns]
    values: Array  # (n, k)
    unfit: int = 0  # messages left out: not finite, or absurd
    repeated: int = 0  # with a stamp that one before had
    late: int = 0  # recorded after one with a later stamp

    @classmethod
    def of(
        cls, parts: Collection[tuple[NDArray[np.int64], NDArray[np.int64], Array]]
    ) -> "Recorded":
        """Stamps, log times and values in parts; of those sent twice the first counts."""
        if not parts:
            return cls(np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, WIDEST)))
        stamps, arrivals, values = (np.concatenate(part) for part in zip(*parts, strict=True))
        order = np.argsort(arrivals, kind="stable")
        stamps, arrivals, values = stamps[order], arrivals[order], values[order]
        with np.errstate(invalid="ignore"):
            fit = (np.abs(values) <= LARGEST).all(axis=1)
        stamps, arrivals, values = stamps[fit], arrivals[fit], values[fit]
        late = int(np.sum(np.diff(stamps) < 0))
        found, first = np.unique(stamps, return_index=True)
        return cls(
            *(found, arrivals[first], values[first]),
            unfit=int(np.sum(~fit)),
            repeated=len(stamps) - len(found),
            late=late,
        )

    def __len__(self) -> int:
        return len(self.stamps)

    def where(self, chosen: Any) -> "Recorded":
        """Those that a mask or a slice chooses."""
        return replace(
            self,
            stamps=self.stamps[chosen],
            arrivals=self.arrivals[chosen],
            values=self.values[chosen],
        )

    def within(self, first: int, last: int) -> "Recorded":
        """Those with a stamp from `first` to `last`."""
        return self.where((self.stamps >= first) & (self.stamps <= last))
