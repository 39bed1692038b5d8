"""The wheels of both sides among the joints that messages name.

Their names are parameters of the controller, of the bag or of a file. Where neither has them, they
are the one with "left" and the one with "right" in it, if there is one of each.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from climber_uk.bags.batches import Batch
from climber_uk.bags.extraction import are_sound
from climber_uk.bags.time_series import Samples, TimeSeries
from climber_uk.mechanics import Array, Stamps
from climber_uk.messages.names import Names, WheelJoints, wheel_joints

WHEELS = "right", "left"
Side = tuple[str, ...]  # joints of its wheels


@dataclass(frozen=True)
class Joints:
    """n messages with the same k joints; nan for what a message leaves out."""

    stamps: Stamps  # (n,) [ns]
    arrivals: Stamps  # (n,) log times [ns]
    names: tuple[str, ...]
    rates: Array  # (n, k) [rad/s]
    torques: Array  # (n, k) [N m]
    angles: Array  # (n, k) [rad]

    @classmethod
    def of(cls, batch: Batch) -> "Joints":
        """Messages of a batch; raises `ValueError` unless it has a value for each of its names."""
        names = tuple(batch.strings[f"name.{i}"] for i in range(batch.lengths["name"]))
        if len(set(names)) < len(names):
            raise ValueError(f"{', '.join(names)}: a name twice")
        rates, torques = (_each(batch, field, len(names)) for field in ("velocity", "effort"))
        angles = batch["position"]
        if angles.shape != rates.shape:
            angles = _missing(batch, len(names))
        return cls(batch.stamps, batch.log_times, names, rates, torques, angles)

    def where(self, chosen: Any) -> "Joints":
        """Those that a mask chooses."""
        arrays = {f.name: getattr(self, f.name)[chosen] for f in fields(self) if f.name != "names"}
        return replace(self, **arrays)

    def samples(self, quantity: str, sides: Sequence[Side]) -> Samples:
        """The `rates`, `torques` or `angles` (n, j) of j sides: sums of torques, else means."""
        values = np.stack([self._of_side(quantity, side) for side in sides], axis=1)
        faults = np.where(are_sound(values).all(axis=1), 0, 1)
        return Samples(self.stamps, self.arrivals, values, faults)

    def _of_side(self, quantity: str, side: Side) -> Array:
        values = getattr(self, quantity)[:, [self.names.index(joint) for joint in side]]
        return values.sum(axis=1) if quantity == "torques" else values.mean(axis=1)

    def have(self, sides: Sequence[Side]) -> bool:
        """Whether all joints of some sides are among these."""
        return {joint for side in sides for joint in side} <= set(self.names)


def _each(batch: Batch, field: str, count: int) -> Array:
    values = batch[field]
    if values.shape[1] == 0:
        return _missing(batch, count)
    if values.shape[1] != count:
        raise ValueError(f"{field} has {values.shape[1]} values for {count} names")
    return values


def _missing(batch: Batch, count: int) -> Array:
    return np.broadcast_to(np.nan, (len(batch), count))


def wheel_names(parts: Sequence[Joints], parameters: Mapping[str, Any]) -> tuple[Side, Side]:
    """Joints of the right and the left wheels; `ValueError` if they are not among the joints."""
    present, usual = sorted({name for part in parts for name in part.names}), vars(Names())
    keys = [f"{side}_wheel_joint" for side in WHEELS]
    right, left = (str(parameters.get(key, usual[key])) for key in keys)
    joints = wheel_joints(left, right)
    if not set(keys) & parameters.keys() and not set(joints.all) <= set(present):
        by_side = [[name for name in present if side in name.lower()] for side in WHEELS]
        if [len(names) for names in by_side] == [1, 1] and by_side[0] != by_side[1]:
            joints = WheelJoints(right=(by_side[0][0],), left=(by_side[1][0],))
    wanted = joints.right + joints.left
    if missing := [name for name in wanted if name not in present]:
        raise ValueError(
            f"no {' and no '.join(missing)} among the joints {', '.join(present) or '(no names)'}: "
            f"{' and '.join(keys)} in a --params file say what they are called"
        )
    return joints.right, joints.left


def torques_and_angles(parts: Sequence[Joints], parameters: Mapping[str, Any]) -> TimeSeries:
    """Torques right, left [N m] and angles right, left [rad] (n, 4); nan where there are none.

    Of messages that name both wheels. Raises `ValueError` as `wheel_names` does.
    """
    wheels = wheel_names(parts, parameters)
    both = []
    for part in (part for part in parts if part.have(wheels)):
        torques, angles = (part.samples(quantity, wheels) for quantity in ("torques", "angles"))
        values = np.hstack([torques.values, angles.values])
        both.append(torques._replace(values=values, faults=0 * torques.faults))
    return TimeSeries.of(both)


def commanded_torques(parts: Sequence[Joints], parameters: Mapping[str, Any]) -> TimeSeries:
    """Torques right, left (n, 2) [N m] of messages that name both wheels.

    Raises `ValueError` if there are none, and as `wheel_names` does.
    """
    wheels = wheel_names(parts, parameters)
    both = [part.samples("torques", wheels) for part in parts if part.have(wheels)]
    with_torques = [samples for samples in both if np.isfinite(samples.values).any()]
    if not with_torques:
        joints = " and ".join(joint for side in wheels for joint in side)
        raise ValueError(f"no message has {'effort' if both else joints}")
    return TimeSeries.of(with_torques)


def rates_and_torques(
    parts: Sequence[Joints], parameters: Mapping[str, Any]
) -> tuple[TimeSeries, TimeSeries]:
    """Rate [rad/s] and torque [N m] (n, 2) of the right and of the left wheel.

    A message may name one wheel only. Publishers of positions alone do not count; raises
    `ValueError` if there are no others, and as `wheel_names` does.
    """
    right, left = (_of_one(parts, wheel) for wheel in wheel_names(parts, parameters))
    return right, left


def _of_one(parts: Sequence[Joints], wheel: Side) -> TimeSeries:
    own = [
        [part.samples(quantity, [wheel]) for quantity in ("rates", "torques")]
        for part in parts
        if part.have([wheel])
    ]
    for i, field in enumerate(("velocity", "effort")):
        own = [pair for pair in own if np.isfinite(pair[i].values).any()]
        if not own:
            raise ValueError(f"no {field} of {' and '.join(wheel)}")
    return TimeSeries.of(
        [
            rates._replace(
                values=np.hstack([rates.values, torques.values]),
                faults=rates.faults | torques.faults,
            )
            for rates, torques in own
        ]
    )
