"""`python bench/jobs.py`: jobs of a climber on four wheels in MuJoCo, whose turns scrub.

The lanes of config/lanes.yaml, paths from outside, what an operator asks for at random times, the
fastest law, a lost stick: each by the controller of config/four_wheels.yaml, which is told nothing
of the engine's contacts. What is within its bound, or not, is in the last column.
"""

import argparse
import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from climber_uk.control.safety import Mode
from climber_uk.mechanics import Array
from climber_uk.mechanics.area import read_area
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Line
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.messages.topics import PLANT
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.path_check.check_path import read
from climber_uk.path_check.path_limits import Limits
from climber_uk.path_check.time_optimal import time_optimal
from climber_uk.planning.given_path import planned
from climber_uk.ros import plant_parts

ROOT = Path(__file__).parents[1]
for folder in ("examples", "test/planning", "test/mechanics"):
    sys.path.insert(0, str(ROOT / folder))
FILE, LANES = (ROOT / "config" / f"{name}.yaml" for name in ("four_wheels", "lanes"))
LIMIT = 4.0  # [N m] of a wheel's torque, in that file
STANDS = 1e-3  # [m/s]


class Found(NamedTuple):
    """A number that was measured, and the bound it is to keep."""

    what: str
    value: float
    bound: float | None
    unit: str
    is_least: bool = False  # whether the bound is the least, not the largest

    def __str__(self) -> str:
        told = f"{self.value:.4g} {self.unit}".strip()
        if self.bound is None:
            return f"{self.what} | {told} | | |"
        above = self.value - self.bound
        holds = (above if self.is_least else -above) >= -1e-9 * abs(self.bound)
        sign, word = "≥" if self.is_least else "≤", "holds" if holds else "NOT"
        return f"{self.what} | {told} | {sign} {self.bound:g} | {word} |"


class Engine:
    """A climber in MuJoCo, in the place of a plant."""

    def __init__(self, start: State) -> None:
        from mujoco_climber import MujocoClimber
        from under_way import PERIOD

        parts = plant_parts.parts(Values(read_file(FILE, f"/{PLANT}")))
        self.robot = MujocoClimber(parts, start, PERIOD)
        self.slip = 0.0  # [m/s] most of late, of rims over the wall

    def advance(self, _: State, torques: Array, steps: int) -> State:
        """State some steps later; raises `FellOff`."""
        for _ in range(steps):
            self.robot.advance(torques)
        state, wheels = self.robot.state, self.robot.as_wheels_tell()
        off = wheels.forward_speed - state.forward_speed, state.side_slip
        self.slip = max(self.slip, float(np.hypot(*off)))
        return self.robot.state


def under_way(trajectory: Trajectory, kind: Any = None, **how: Any) -> Any:
    """A climber at the begin of a trajectory, at rest."""
    from under_way import UnderWay

    state = State(trajectory.at(0.0).pose, np.zeros(3))
    return (kind or UnderWay)(trajectory, state=state, config=FILE, plant_of=Engine, **how)


def torques(climber: Any, jump: float | None) -> Iterator[Found]:
    """What is told of a climber's torques."""
    yield Found("torque", np.abs(climber.sent).max(), LIMIT, "N m")
    if jump is not None:
        yield Found("its change in 5 ms", climber.largest_jump, jump, "N m")


# A climber that scrubs sags some millimetres where it turns: its centre keeps as much further off,
# it goes up from lane to lane, and it turns back to its path at once, not the whole way along
CLEARANCE = 0.2  # [m] that it is to keep
BY_LANES = {
    "lanes.clearance": CLEARANCE + 0.006,
    "lanes.max_acceleration": 0.1,
    "lanes.descent": 4.0,
    "lanes.reversal_angle": 0.6,
}
IN_LANES = {
    "observer.side_slip_bandwidth": 0.0,
    "guidance.fade_speed": 0.01,
    "guidance.turn_radius": 0.02,
}


def lanes(_: argparse.Namespace) -> Iterator[Found]:
    """Lanes around a window, by lanes.yaml but for what suits a climber that scrubs."""
    from test_lanes import covered, distance

    trajectory, *_ = read(LANES, BY_LANES, [])
    climber = under_way(trajectory, **IN_LANES)
    climber.run(trajectory.duration + 2.0)
    places, shape = climber.places, trajectory.shape
    path = trajectory.at(np.arange(0.0, trajectory.duration, 0.005)).pose[:, :2]
    area = read_area(shape.area, shape.clearance)
    yield Found("from the path", 1e3 * cKDTree(path).query(places)[0].max(), 10, "mm")
    yield Found("path from it", 1e3 * cKDTree(places).query(path)[0].max(), 10, "mm")
    short = CLEARANCE - distance(places[::4], area).min()
    yield Found("nearer to an edge than the clearance", 1e3 * short, 2, "mm")
    yield Found("covered", 100 * covered(area, places[::4], shape.width), 99, "%", True)
    other = sum(mode is not Mode.FOLLOWING for mode in climber.modes)
    yield Found("periods of another mode", other, 0, "")
    yield from torques(climber, 0.4)


def paths(options: argparse.Namespace) -> Iterator[Found]:
    """Random paths of a planner, each in the midst of the one before."""
    from random_paths import random_path
    from test_given_path import MANNER, RATE, TOLERANCE, Sent, distance

    random, climber, refused = np.random.default_rng(4), None, 0
    worst, fastest, other, unbegun = [0.0], 0.0, 0, 0
    for _ in range(options.paths):
        name, places = random_path(random)
        if climber is not None:
            places = places - places[0] + climber.places[-1] + random.normal(0, 0.3, 2)
        try:
            trajectory, _ = planned(places, MANNER)
        except ValueError:
            refused += 1
            continue
        if climber is None:
            climber = under_way(trajectory, Sent)
        else:
            climber.send(trajectory)
        first = len(climber.times)
        whole = random.random() < 0.5
        climber.drive(min(trajectory.duration if whole else random.uniform(5, 12), 60))
        modes = np.array(climber.modes[first:])
        follows = modes == Mode.FOLLOWING
        other += int(np.sum(~np.isin(modes, [Mode.FOLLOWING, Mode.APPROACHING])))
        begun = follows & (np.array(climber.positions[first:]) >= 3.5)
        if begun.any():
            worst.append(float(distance(climber.places[first:][begun][::20], places).max()))
        speeds = np.array([abs(state.forward_speed) for state in climber.states[first:]])
        fastest = max(fastest, speeds[follows].max(initial=0.0))
        unbegun += not follows.any()
        if options.verbose:
            print(f"  {name}: {1e3 * worst[-1]:.1f} mm, {fastest:.3f} m/s, {other}", flush=True)
    assert climber is not None
    yield Found(f"refused, of {options.paths}", refused, None, "")
    yield Found("driven, but not reached within 30 s", unbegun, None, "")
    yield Found("from the path", 1e3 * max(worst), 2e3 * (TOLERANCE + 5e-3), "mm")
    yield Found("fastest, by the speed asked for", fastest / RATE, 1.26, "")
    yield Found("periods of another mode", other, 0, "")
    yield from torques(climber, 0.4)


SHARES = {  # of what is asked for
    **{"pause": 0.2, "go on": 0.3, "speed": 0.1},
    **{"another path": 0.15, "start": 0.1, "stick": 0.15},
}


def at_random_times(options: argparse.Namespace) -> Iterator[Found]:
    """Pauses, starts, speeds, other paths and a stick, at random times."""
    from moments import moments, off_line, some_path
    from under_way import Travelling

    random, back = np.random.default_rng(1), 0.0
    climber = under_way(some_path(random), Travelling).run(5.0)
    for what, first, went_back in moments(climber, random, options.times, SHARES):
        back = max(back, went_back)
        if options.verbose:
            off = (
                off_line(climber, Mode.FOLLOWING, first),
                off_line(climber, Mode.APPROACHING, first),
            )
            jump = np.abs(np.diff(climber.sent[first - 1 :], axis=0)).max()
            print(f"  {what}: {off[0]:.1f}, {off[1]:.1f} mm, {jump:.2f} N m", flush=True)
    other = sum(mode not in (Mode.FOLLOWING, Mode.APPROACHING) for mode in climber.modes)
    yield Found(f"from its path, asked {options.times} times", off_line(climber), 20, "mm")
    yield Found("from its way to the path", off_line(climber, Mode.APPROACHING), None, "mm")
    yield Found("progress backwards", back, 1e-9, "s")
    yield Found("periods of another mode", other, 0, "")
    yield from torques(climber, 0.4)


def fastest(_: argparse.Namespace) -> Iterator[Found]:
    """The fastest law on the file's circle."""
    from moments import off_line

    trajectory, climber, held, wall = read(FILE, {}, [])
    limits = Limits(margin=1.2, yaw_rate=0.6, acceleration=0.2)  # what scrubs takes a part of it
    law = time_optimal(trajectory, climber, held, limits, wall=wall).trajectory
    driven = under_way(law)
    driven.run(law.duration + 1.0)
    yield Found("duration", law.duration, trajectory.duration, "s")
    yield Found("from the path", off_line(driven), 20, "mm")
    yield from torques(driven, None)


def stick(_: argparse.Namespace) -> Iterator[Found]:
    """A stick that is silent at full speed, facing down, up and across."""
    from under_way import Travelling

    for name, heading in (("down", -np.pi / 2), ("up", np.pi / 2), ("across", 0.0)):
        line = Trajectory(Line(length=1.0, direction=heading), RestToRest(rate=0.1))
        climber = under_way(line, Travelling)
        climber.run(0.1)
        for _ in range(80):
            climber.stick(1.0, 0.0)
        speed, end = abs(climber.state.forward_speed), len(climber.times)
        climber.plant.slip = 0.0
        climber.run(4.0)
        moves = np.array([state.forward_speed for state in climber.states[end:]])
        at_rest = 0.005 * (np.flatnonzero(np.abs(moves) > STANDS).max() + 1)
        yield Found(f"{name}: speed when it is lost", speed, 0.196, "m/s", True)
        yield Found(f"{name}: at rest after", at_rest, 2.1, "s")
        yield Found(f"{name}: slip", 1e3 * climber.plant.slip, 4, "mm/s")
        yield from torques(climber, 0.4)


JOBS: dict[str, Callable[[argparse.Namespace], Iterator[Found]]] = {
    "lanes": lanes,
    "paths from outside": paths,
    "at random times": at_random_times,
    "fastest law": fastest,
    "stick lost": stick,
}


def rows(name: str, options: argparse.Namespace) -> list[str]:
    """Rows of a job's table."""
    return [f"| {name} | {found}" for found in JOBS[name](options)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=JOBS, default=list(JOBS))
    parser.add_argument("--paths", type=int, default=100, help="that are driven (default: 100)")
    parser.add_argument("--times", type=int, default=200, help="asked (default: 200)")
    parser.add_argument("--verbose", action="store_true", help="tell each path and moment")
    options = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    print("| job | what | measured | bound | |\n|---|---|---|---|---|", flush=True)
    with ProcessPoolExecutor(2) as pool:
        for found in [pool.submit(rows, name, options) for name in options.only]:
            print("\n".join(found.result()), flush=True)


if __name__ == "__main__":
    main()
