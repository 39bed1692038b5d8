"""`python bench/engine_localization.py`: the filter of wall_odometry on a robot in MuJoCo.

The robots of bench/physics.py in the engine, on its paths, with the sensors of config/field.yaml:
encoders, an IMU of what the engine's body does, and fixes; the controller is told nothing else.
True distance from the reference RMS, largest [mm]; output off RMS [mm], heading RMS [°]; NEES.
"""

import argparse
import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np
from localization import FILTER, MILLIMETRE, Case, Loop, Record, rms
from physics import PATHS, ROBOTS, ROOT, trajectory

from climber_uk.control.build import build_controller
from climber_uk.localization.localizer import Located
from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import Array
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.reference import tracking_error
from climber_uk.messages.topics import CONTROLLER, PLANT
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.ros import plant_parts

sys.path.insert(0, str(ROOT / "examples"))
# what wheels show while they scrub (bench/physics.py), and how far they slip
SCRUBS: dict[str, Any] = {
    "effective_half_track": 0.357,
    "scrub_deviation": 0.1,
    "creep_deviation": 0.0,
    "way_noise": 0.006,
    "scale_deviation": 0.06,
    "scale_time": 2.0,
    "acceleration_noise": 0.02,
    "output_frequency": 100.0,
}
SLIP = {"scrub_deviation": 0.02, "initial_scrub": 0.08, "initial_pivot": 0.027}
# rows: robot, and what the filter is told of it
TOLD: dict[str, tuple[str, dict[str, Any]]] = {
    "two wheels": ("two wheels", {"way_noise": 0.002}),
    "four wheels": ("four wheels", SCRUBS),
    "four wheels, λ and a told": ("four wheels", {**SCRUBS, **SLIP}),
}
# fixes move poses to a side as well: the controller learns its side slip the slower
GIVEN = {"two wheels": {}, "four wheels": {"observer.side_slip_bandwidth": 2.0}}


class EngineLoop(Loop):
    """The closed loop of a robot in the engine."""

    def __init__(self, robot: str, path: str, seed: int, options: LocalizationOptions) -> None:
        from mujoco_climber import MujocoClimber

        config, more = ROBOTS[robot]
        file, period = ROOT / "config" / config, 0.005
        parts = plant_parts.parts(Values({**read_file(file, f"/{PLANT}"), **more}))
        given = {**read_file(file, f"/{CONTROLLER}"), **GIVEN[robot]}
        self.controller = build_controller(Values(given), None)
        self.trajectory = trajectory(path)
        start = State(self.trajectory.at(0.0).pose, np.zeros(3))
        self.robot = MujocoClimber(parts, start, period)
        x, y, heading = start.pose.tolist()
        known = {"initial_x": x, "initial_y": y, "initial_heading": heading}
        self.case = Case(options=replace(options, **known), duration=PATHS[path][1])
        self.torques: Array = np.zeros(2)
        self.record, self.sent = Record(), []
        self.sense(start, seed)


class Watched(EngineLoop):
    """One that is told the truth, and whose side slip is watched."""

    def __init__(self, path: str) -> None:
        super().__init__("four wheels", path, 0, replace(FILTER, **SCRUBS))
        self.case = replace(self.case, believes_truth=True)
        self.states: list[State] = []

    def locate(self, stamp: int, now: float) -> Located | None:
        """Remember where it is."""
        self.states.append(self.robot.state)
        return super().locate(stamp, now)

    def slips(self) -> str:
        """Row: λ and a [m] that fit best; side slip, what they leave of it, and λ alone [mm/s]."""
        side = np.array([float(state.side_slip) for state in self.states])
        heading = np.array([float(state.heading) for state in self.states])
        rate = np.array([float(state.yaw_rate) for state in self.states])
        both = np.stack([-np.cos(heading) * np.abs(rate), np.sin(heading) * rate], axis=1)
        found, alone = (np.linalg.lstsq(part, side)[0] for part in (both, both[:, :1]))
        left = side, side - both @ found, side - both[:, :1] @ alone
        told = ", ".join(f"{rms(part) / MILLIMETRE:.1f}" for part in left)
        return f"{found[0]:.3f}, {found[1]:.3f} | {told}"


def row(name: str, path: str, seeds: int) -> str:
    """Row of the table."""
    robot, told = TOLD[name]
    options = replace(FILTER, **told)
    loops = [EngineLoop(robot, path, seed, options).run() for seed in range(seeds)]
    rows = np.array([loop.record.rows for loop in loops])
    now, pose, off = rows[0, :, 0], rows[..., 1:4], rows[..., 4:7]
    covariance = rows[..., 7:].reshape(*rows.shape[:2], 3, 3)
    nees = np.einsum("sni,snij,snj->sn", off, np.linalg.inv(covariance), off)
    along, across, _ = tracking_error(pose, loops[0].trajectory.at(now))
    away, distance = np.hypot(along, across), np.hypot(off[..., 0], off[..., 1])
    cells = [
        f"{rms(away) / MILLIMETRE:.1f}, {away.max() / MILLIMETRE:.1f}",
        f"{rms(distance) / MILLIMETRE:.1f}",
        f"{math.degrees(rms(off[..., 2])):.2f}",
        f"{nees.mean():.1f}",
    ]
    return f"| {name} | {path} | {' | '.join(cells)} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3, help="runs of each row (default: 3)")
    parser.add_argument("--only", default="", help="rows whose name and path contain this")
    parser.add_argument("--slip", action="store_true", help="how four wheels slip to a side")
    options = parser.parse_args()
    if options.slip:
        for path in PATHS:
            watched = Watched(path)
            watched.run()
            print(f"| {path} | {watched.slips()} |", flush=True)
        return
    for name in TOLD:
        for path in PATHS:
            if options.only in f"{name}, {path}":
                print(row(name, path, options.seeds), flush=True)


if __name__ == "__main__":
    main()
