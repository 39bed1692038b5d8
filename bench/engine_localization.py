"""`python bench/engine_localization.py`: the filter of wall_odometry on a robot in MuJoCo.

The robots of bench/physics.py in the engine, on its paths, with the sensors of config/field.yaml:
encoders, an IMU of what the engine's body does, and fixes; the controller is told nothing else.
True distance from the reference RMS, largest [mm]; output off RMS [mm], heading RMS [°]; NEES.
"""

import argparse
import math
import sys
from dataclasses import replace

import numpy as np
from localization import FILTER, MILLIMETRE, Case, Loop, Record, rms
from physics import PATHS, ROBOTS, ROOT, trajectory

from climber_uk.control.build import build_controller
from climber_uk.localization.options import LocalizationOptions
from climber_uk.mechanics import Array
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.reference import tracking_error
from climber_uk.messages.topics import CONTROLLER, PLANT
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.ros import plant_parts

sys.path.insert(0, str(ROOT / "examples"))
# what wheels show while they scrub (bench/physics.py), and how far they slip
SCRUBS = {
    "effective_half_track": 0.357,
    "scrub_deviation": 0.1,
    "creep_deviation": 0.0,
    "way_noise": 0.006,
    "scale_deviation": 0.06,
    "scale_time": 2.0,
    "acceleration_noise": 0.02,
}
TOLD = {"two wheels": {"way_noise": 0.002}, "four wheels": {**SCRUBS, "output_frequency": 100.0}}


class EngineLoop(Loop):
    """The closed loop of a robot in the engine."""

    def __init__(self, robot: str, path: str, seed: int, options: LocalizationOptions) -> None:
        from mujoco_climber import MujocoClimber

        config, more = ROBOTS[robot]
        file, period = ROOT / "config" / config, 0.005
        parts = plant_parts.parts(Values({**read_file(file, f"/{PLANT}"), **more}))
        given = read_file(file, f"/{CONTROLLER}")
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


def row(robot: str, path: str, seeds: int) -> str:
    """Row of the table."""
    options = replace(FILTER, **TOLD[robot])
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
    return f"| {robot} | {path} | {' | '.join(cells)} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3, help="runs of each row (default: 3)")
    parser.add_argument("--only", default="", help="rows whose robot and path contain this")
    options = parser.parse_args()
    for robot in TOLD:
        for path in PATHS:
            if options.only in f"{robot}, {path}":
                print(row(robot, path, options.seeds), flush=True)


if __name__ == "__main__":
    main()
