"""One climber's run, as arrays, from the messages of a bag."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from climber_uk.analysis.bag import read_messages
from climber_uk.control.constraints import tracking_error
from climber_uk.mechanics import Array
from climber_uk.mechanics.preview import SECOND, joined
from climber_uk.messages import reading

ODOMETRY, REFERENCE, TORQUES = "odom", "reference", "wheel_torques"
FORCE = "uk_torque_controller/constraint_force"
MARGINS = "plant_simulator/margins"


@dataclass(frozen=True)
class RecordedRun:
    """What happened at each of n odometry messages that have a reference."""

    time: Array  # (n,) [s] since the first of them, by their stamps
    pose: Array  # (n, 3) x [m], y [m], θ [rad]
    reference: Array  # (n, 3) the pose there should have been
    error: Array  # (n, 3) along-track [m], cross-track [m], heading [rad]
    side_slip: Array  # (n,) [m/s]
    torque_time: Array  # (m,) [s]
    torques: Array  # (m, 2) right, left [N m]
    force_time: Array  # (k,) [s]
    constraint_force: Array  # (k, 3) drive [N], lateral [N], about z [N m]
    margins: Array  # (j, 2) slip margin, tip margin, as the plant knows them
    latency: Array  # (m,) [s] from an odometry's arrival at the recorder to that of its torque

    @property
    def distance(self) -> Array:
        """Distance from the reference (n,) [m]."""
        return np.hypot(self.error[:, 0], self.error[:, 1])


def read_run(bag: str | Path, namespace: str = "") -> RecordedRun:
    """Run of the climber in `namespace`; a message that was sent twice counts once.

    Raises `FileNotFoundError` or `ValueError` naming the bag and what it lacks.
    """
    prefix = f"/{namespace}/".replace("//", "/")
    topics = {prefix + name: name for name in (ODOMETRY, REFERENCE, TORQUES, FORCE, MARGINS)}
    found: dict[str, dict[int, tuple[int, Any]]] = {name: {} for name in topics.values()}
    previews = []
    for topic, arrival, message in read_messages(bag, topics):
        stamp = reading.nanoseconds(message.header.stamp)
        found[topics[topic]].setdefault(stamp, (arrival, message))
        if topics[topic] == REFERENCE:
            previews.append(reading.preview(message, message.header.frame_id))
    for name in (ODOMETRY, REFERENCE, TORQUES):
        if not found[name]:
            raise ValueError(f"{bag} has no message on {prefix}{name}")

    preview = joined(previews)
    odometry = {
        stamp: (reading.state(message, message.header.frame_id, message.child_frame_id), desired)
        for stamp, (_, message) in sorted(found[ODOMETRY].items())
        if (desired := preview.at(stamp)) is not None
    }
    if not odometry:
        raise ValueError(f"{bag} has no odometry at a time that its reference covers")
    start = next(iter(odometry))
    torques = {stamp: m for stamp, m in sorted(found[TORQUES].items()) if stamp in odometry}
    forces = {stamp: m for stamp, (_, m) in sorted(found[FORCE].items())}
    return RecordedRun(
        time=_seconds(odometry, start),
        pose=np.array([state.pose for state, _ in odometry.values()]),
        reference=np.array([desired.pose for _, desired in odometry.values()]),
        error=np.array([tracking_error(state.pose, at) for state, at in odometry.values()]),
        side_slip=np.array([state.side_slip for state, _ in odometry.values()]),
        torque_time=_seconds(torques, start),
        torques=np.array(
            [reading.wheel_torques(m, m.name[0], m.name[-1]) for _, m in torques.values()]
        ).reshape(-1, 2),
        force_time=_seconds(forces, start),
        constraint_force=np.array(
            [[m.wrench.force.x, m.wrench.force.y, m.wrench.torque.z] for m in forces.values()]
        ).reshape(-1, 3),
        margins=np.array(
            [[m.vector.x, m.vector.y] for stamp, (_, m) in found[MARGINS].items() if stamp >= start]
        ).reshape(-1, 2),
        latency=np.array(
            [arrival - found[ODOMETRY][stamp][0] for stamp, (arrival, _) in torques.items()]
        )
        / SECOND,
    )


def _seconds(stamps: Iterable[int], start: int) -> Array:
    return np.array([stamp - start for stamp in stamps]) / SECOND
