"""Recorded torques compared with those of a replay, in numbers."""

import csv
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from climber_uk.bags.connection import one_line
from climber_uk.bags.joints import WHEELS
from climber_uk.mechanics import SECOND, Array
from climber_uk.replay.recorded_controller import Modes, RecordedController
from climber_uk.replay.replay import Replay

ROUNDING = 1e-9  # [N m] within which a torque is at its limit


@dataclass(frozen=True)
class Comparison:
    """Torques for the n odometry messages that both have answered; (n, 2) are right, left [N m]."""

    stamps: NDArray[np.int64]  # (n,) [ns]
    recorded: Array  # (n, 2)
    replayed: Array  # (n, 2)
    limit: float  # of the replayed torques [N m]
    answers: dict[str, int]  # of the recorded run, and of the replay
    modes: dict[str, Modes]  # likewise
    changed: dict[str, tuple[Any, Any]]  # parameters by name, likewise

    @property
    def time(self) -> Array:
        """Time since the first of the odometry [s]."""
        return (self.stamps - self.stamps[0]) / SECOND

    @property
    def difference(self) -> Array:
        """Replayed minus recorded torques (n, 2) [N m]."""
        return self.replayed - self.recorded

    @property
    def largest(self) -> float:
        """Largest difference of a torque [N m]."""
        return float(np.abs(self.difference).max())


def compare(recorded: RecordedController, replay: Replay) -> Comparison:
    """Compare what both have answered; `ValueError` if that is nothing."""
    stamps = sorted(recorded.torques.keys() & replay.torques.keys())
    if not recorded.torques:
        raise ValueError("no torques of the bag are finite")
    if not stamps:
        mode, detail = replay.controller.mode.value, replay.controller.detail
        said = f"{mode} ({detail})" if detail else mode
        raise ValueError(
            f"no odometry is answered both in the bag and in the replay, which ends with {said}"
        )
    return Comparison(
        stamps=np.array(stamps, np.int64),
        recorded=np.array([recorded.torques[stamp] for stamp in stamps]),
        replayed=np.array([replay.torques[stamp] for stamp in stamps]),
        limit=replay.controller.law.climber.max_wheel_torque,
        answers={"recorded": len(recorded.torques), "replayed": len(replay.torques)},
        modes={"recorded": recorded.modes, "replayed": replay.modes},
        changed=replay.changed,
    )


def summary(found: Comparison) -> dict[str, Any]:
    """All numbers, as for JSON: [right, left] of the wheels, times since the first stamp."""

    def rms(torques: Array) -> list[float]:
        return np.sqrt(np.mean(torques**2, axis=0)).tolist()

    def at_limit(torques: Array) -> list[float]:
        return (100 * np.mean(np.abs(torques) >= found.limit - ROUNDING, axis=0)).tolist()

    size = np.abs(found.difference)
    return {
        "changed": found.changed,
        "wheels": {
            "difference, RMS [N m]": rms(found.difference),
            "difference, largest [N m]": size.max(axis=0).tolist(),
            "largest at [s]": found.time[size.argmax(axis=0)].tolist(),
            "recorded, RMS [N m]": rms(found.recorded),
            "replayed, RMS [N m]": rms(found.replayed),
            "recorded at the limit [%]": at_limit(found.recorded),
            "replayed at the limit [%]": at_limit(found.replayed),
        },
        "answers": {**found.answers, "in both": len(found.stamps)},
        "modes": {
            whose: [[(since - int(found.stamps[0])) / SECOND, mode] for since, mode in modes]
            for whose, modes in found.modes.items()
        },
    }


def table(numbers: dict[str, Any]) -> str:
    """Return a `summary` as lines of text."""
    lines = [
        f"{name}: {was} recorded, {now} here" for name, (was, now) in numbers["changed"].items()
    ]
    lines.append(f"{'':<28} {'right':>12} {'left':>12}")
    lines += [
        f"{name:<28} {right:>12.6g} {left:>12.6g}"
        for name, (right, left) in numbers["wheels"].items()
    ]
    lines += [f"answers, {name:<19} {count:>12}" for name, count in numbers["answers"].items()]
    changes = [
        (since, whose, mode) for whose, modes in numbers["modes"].items() for since, mode in modes
    ]
    lines += [
        f"{since:>10.3f} s  {whose}: {one_line(mode)}"
        for since, whose, mode in sorted(changes, key=itemgetter(0))
    ]
    return "\n".join(lines)


def write_csv(found: Comparison, path: Path) -> None:
    """Write all torques, a line for each odometry."""
    names = [f"{whose}_{wheel} [N m]" for whose in ("recorded", "replayed") for wheel in WHEELS]
    with path.open("w", newline="") as file:
        lines = csv.writer(file)
        lines.writerow(["stamp [ns]", *names])
        rows = np.hstack([found.recorded, found.replayed]).tolist()
        lines.writerows(
            [stamp, *row] for stamp, row in zip(found.stamps.tolist(), rows, strict=True)
        )
