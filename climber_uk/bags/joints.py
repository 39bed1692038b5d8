"""The two wheels among the joints that messages name.

Their names are parameters of the controller: as the bag tells them, or as a file says. Where
neither does they are the one with "left" and the one with "right" in it, if that is clear.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from climber_uk.bags.batches import Batch
from climber_uk.bags.recorded import FilePart, TimeSeries
from climber_uk.bags.taking import are_sound
from climber_uk.mechanics import Array, Stamps
from climber_uk.messages.names import Names

SIDES = "right", "left"


@dataclass(frozen=True)
class Joints:
    """n messages about the same k joints; nan where they do not say."""

    stamps: Stamps  # (n,) [ns]
    arrivals: Stamps  # (n,) log times [ns]
    names: tuple[str, ...]
    rates: Array  # (n, k) [rad/s]
    torques: Array  # (n, k) [N m]
    angles: Array  # (n, k) [rad]

    @classmethod
    def of(cls, batch: Batch) -> "Joints":
        """Those of a batch; `ValueError` if it has not a value for each name."""
        names = tuple(batch.strings[f"name.{i}"] for i in range(batch.lengths["name"]))
        if len(set(names)) < len(names):
            raise ValueError(f"{', '.join(names)}: a name twice")
        rates, torques = (_each(batch, field, len(names)) for field in ("velocity", "effort"))
        angles = batch["position"]
        if angles.shape != rates.shape:
            angles = _untold(batch, len(names))
        return cls(batch.stamps, batch.log_times, names, rates, torques, angles)

    def where(self, chosen: Any) -> "Joints":
        """Those that a mask chooses."""
        arrays = {f.name: getattr(self, f.name)[chosen] for f in fields(self) if f.name != "names"}
        return replace(self, **arrays)

    def part(self, quantity: str, joints: Sequence[str]) -> FilePart:
        """The `rates`, `torques` or `angles` of some of the joints, in their order."""
        columns = [self.names.index(joint) for joint in joints]
        values = getattr(self, quantity)[:, columns]
        return self.stamps, self.arrivals, values, np.where(are_sound(values).all(axis=1), 0, 1)


def _each(batch: Batch, field: str, count: int) -> Array:
    values = batch[field]
    if values.shape[1] == 0:
        return _untold(batch, count)
    if values.shape[1] != count:
        raise ValueError(f"{field} has {values.shape[1]} values for {count} names")
    return values


def _untold(batch: Batch, count: int) -> Array:
    return np.broadcast_to(np.nan, (len(batch), count))


def wheel_names(joints: Iterable[str], parameters: Mapping[str, Any]) -> tuple[str, str]:
    """Names of the right and the left wheel; `ValueError` if they are not among the joints."""
    present, usual = sorted(set(joints)), vars(Names())
    keys = [f"{side}_wheel_joint" for side in SIDES]
    wanted = [str(parameters.get(key, usual[key])) for key in keys]
    if not set(keys) & parameters.keys() and not set(wanted) <= set(present):
        found = [[name for name in present if side in name.lower()] for side in SIDES]
        if [len(names) for names in found] == [1, 1] and found[0] != found[1]:
            wanted = [names[0] for names in found]
    if missing := [name for name in wanted if name not in present]:
        raise ValueError(
            f"no {' and no '.join(missing)} among the joints {', '.join(present) or '(no names)'}: "
            f"{' and '.join(keys)} in a --params file say what they are called"
        )
    return wanted[0], wanted[1]


def torques_and_angles(parts: Sequence[Joints], wheels: tuple[str, str]) -> TimeSeries:
    """Torques right, left [N m] and angles right, left [rad] (n, 4); nan where not told."""
    told = [part for part in parts if set(wheels) <= set(part.names)]
    return TimeSeries.of(
        [
            (
                part.stamps,
                part.arrivals,
                np.hstack([part.part(quantity, wheels)[2] for quantity in ("torques", "angles")]),
                np.zeros(len(part.stamps), np.intp),
            )
            for part in told
        ]
    )


def of_both(parts: Sequence[Joints], wheels: tuple[str, str]) -> TimeSeries:
    """Torques (n, 2) right, left [N m] of messages with both wheels; `ValueError` without any."""
    both = [part for part in parts if set(wheels) <= set(part.names)]
    told = [part for part in both if np.isfinite(part.part("torques", wheels)[2]).any()]
    if not told:
        raise ValueError(f"no message has {'effort' if both else ' and '.join(wheels)}")
    return TimeSeries.of([part.part("torques", wheels) for part in told])


def of_one(parts: Sequence[Joints], wheel: str) -> TimeSeries:
    """Rates [rad/s] and torques [N m] (n, 2) of one wheel, which may be told without the other.

    Publishers that tell positions only do not count; `ValueError` if there are no others.
    """
    own = [part for part in parts if wheel in part.names]
    quantities = {"velocity": "rates", "effort": "torques"}
    for field, quantity in quantities.items():
        own = [part for part in own if np.isfinite(part.part(quantity, [wheel])[2]).any()]
        if not own:
            raise ValueError(f"no {field} of {wheel}")
    both = []
    for part in own:
        (stamps, arrivals, rates, slow), (*_, torques, weak) = (
            part.part(quantity, [wheel]) for quantity in quantities.values()
        )
        both.append((stamps, arrivals, np.hstack([rates, torques]), slow | weak))
    return TimeSeries.of(both)
