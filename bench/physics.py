"""`python bench/physics.py`: our plant beside MuJoCo, driven by the same controller over paths.

The robots of config/climber.yaml and four_wheels.yaml, by torques, the one of velocity.yaml on four
wheels, by speeds, and the magnetic crawler of magnetic.yaml on round walls, which the controller is
told; all with `slip: true`. Both are made from the same parameters. The distance from
the reference, RMS and largest [mm], the largest side slip [mm/s], and the half track that wheels
show while it turns [m]. MuJoCo is not installed with the package: `make physics` does it.
"""

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from climber_uk.closed_loop.simulate import Link, simulate
from climber_uk.control.active_reference import ActiveReference
from climber_uk.control.build import build_controller
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.mechanics.trajectory_parameters import build_trajectory
from climber_uk.messages.topics import CONTROLLER, PLANT
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.ros import plant_parts
from climber_uk.simulation.options import SimulationOptions
from climber_uk.simulation.simulated_robot import SimulatedRobot

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "examples"))
TURNING = 0.05  # [rad/s] from which on wheels show a half track
RAMPS: dict[str, Any] = {"time_law": "rest_to_rest", "rest_to_rest.ramp_time": 2.0}
PATHS: dict[str, tuple[dict[str, Any], float]] = {  # parameters of the planner, duration [s]
    "line, 2 m": (
        {"shape": "line", "line.length": 2.0, "line.direction": 0.7, "rest_to_rest.rate": 0.2},
        14.0,
    ),
    "circle, radius 0.5 m": (
        {"shape": "circle", "circle.radius": 0.5, "rest_to_rest.rate": 0.4},
        20.0,
    ),
    "sine, amplitude 0.2 m": (
        {
            "shape": "sine_wave",
            "sine_wave.length": 2.0,
            "sine_wave.amplitude": 0.2,
            "sine_wave.wavelength": 1.0,
            "rest_to_rest.rate": 0.15,
        },
        17.5,
    ),
    "eight, 1.6 m by 0.8 m": (
        {
            "shape": "lemniscate",
            "lemniscate.half_width": 0.8,
            "lemniscate.half_height": 0.4,
            "rest_to_rest.rate": 0.2,
        },
        34.0,
    ),
}
# rotors behind a gear: wheels that are much lighter chatter on the engine's contacts
TWO = {"slip": True, "wheel_inertia": 2e-4}
ROBOTS: dict[str, tuple[str, dict[str, Any]]] = {
    "two wheels": ("climber.yaml", TWO),
    "four wheels": ("four_wheels.yaml", {}),
    "four wheels, by speeds": ("velocity.yaml", {**TWO, "locomotion": "four_wheeled"}),
}


# the wall that plant and controller have in place of their file's
WALLS: dict[str, dict[str, Any]] = {
    "magnets, plane": {"wall": "plane"},
    "magnets, upright tank": {"wall": "tank", "tank.radius": -5.0},
    "magnets, inside it": {"wall": "tank", "tank.radius": 5.0},
    "magnets, lying tank": {"wall": "cylinder", "cylinder.radius": -5.0},
    "magnets, sphere": {"wall": "sphere", "sphere.radius": -5.0},
    "magnets, roof": {"wall": "cone", "cone.distance": 6.0, "inclination": 70.0},
}
ROBOTS |= {name: ("magnetic.yaml", {"wheel_inertia": 8e-4}) for name in WALLS}


class Row(NamedTuple):
    """A run: errors [mm], side slip [mm/s], half track [m]."""

    rms: float
    largest: float
    side_slip: float
    half_track: float


class Watched:
    """A robot whose turning and sagging are watched, and by how much its reference has waited."""

    def __init__(self, robot: Any, reference: ActiveReference) -> None:
        self.robot, self.shown, self.side_slip = robot, list[float](), 0.0
        self.reference, self.waited = reference, list[float]()  # [s]

    def __getattr__(self, name: str) -> Any:
        return getattr(self.robot, name)

    def measure(self) -> None:
        """Measure, and see what the wheels show."""
        self.robot.measure()
        self.waited.append(self.reference.waited)
        state, climber = self.robot.state, self.robot.plant.climber
        self.side_slip = max(self.side_slip, abs(float(state.side_slip)))
        if abs(state.yaw_rate) > TURNING:
            right, left = self.robot.rates.tolist()
            self.shown.append(climber.wheel_radius * (right - left) / 2 / float(state.yaw_rate))


def trajectory(path: str) -> Trajectory:
    """The reference of a path."""
    given, _ = PATHS[path]
    return build_trajectory(Values({**RAMPS, **given}).read)


def run(robot: str, path: str, kind: Any) -> Row:
    """A run of a kind of robot: our plant, or the engine's."""
    config, more = ROBOTS[robot]
    file, wall = ROOT / "config" / config, WALLS.get(robot, {})
    values = Values({**read_file(file, f"/{PLANT}"), **more, **wall})
    parts = plant_parts.parts(values)
    robots: list[Watched] = []

    def make(_: Any, start: State, period: float) -> Any:
        robots.append(Watched(kind(parts, start, period), controller.active))
        return robots[-1]

    reference, (_, duration) = trajectory(path), PATHS[path]
    controller = build_controller(Values({**read_file(file, f"/{CONTROLLER}"), **wall}), None)
    start = State(reference.at(0.0).pose, np.zeros(3))
    servo = parts.motors if parts.motors.take_speeds else None
    period = values.read(SimulationOptions).control_period
    link = replace(Link(), step=parts.plant.step, period=period, servo=servo)
    course = reference, start, duration, controller, parts.plant.climber, link
    driven = simulate(*course, robot_of=make)
    shown = float(np.median(robots[0].shown)) if robots[0].shown else float("nan")
    waited = np.array([*robots[0].waited, controller.active.waited])
    wanted = reference.at(driven.time - waited).pose
    distance = 1e3 * np.hypot(*(driven.pose - wanted)[:, :2].T)
    rms, most = float(np.sqrt(np.mean(distance**2))), float(distance.max())
    return Row(rms, most, 1e3 * robots[0].side_slip, shown)


def both(robot: str, path: str) -> str:
    """A row of the table."""
    from mujoco_climber import MujocoClimber

    ours, theirs = run(robot, path, SimulatedRobot), run(robot, path, MujocoClimber)
    cells = [
        f"{ours.rms:.2f}, {ours.largest:.2f}",
        f"{theirs.rms:.2f}, {theirs.largest:.2f}",
        f"{ours.side_slip:.1f}, {theirs.side_slip:.1f}",
        ", ".join(f"{row.half_track:.3f}" for row in (ours, theirs)).replace("nan, nan", ""),
    ]
    return f"| {robot} | {path} | {' | '.join(cells)} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    pairs = [(robot, path) for robot in ("two wheels", "four wheels") for path in PATHS]
    pairs += [("four wheels, by speeds", path) for path in ("circle, radius 0.5 m", "line, 2 m")]
    pairs += [(robot, "eight, 1.6 m by 0.8 m") for robot in WALLS]
    header = "robot", "path", "our plant", "MuJoCo", "side slip: ours, MuJoCo's", "half track"
    print(f"| {' | '.join(header)} |\n{'|---' * len(header)}|", flush=True)
    with ProcessPoolExecutor(2) as pool:
        found = [pool.submit(both, *pair) for pair in pairs]
        for row in found:
            print(row.result(), flush=True)


if __name__ == "__main__":
    main()
