"""`python bench/engine_localization.py`: the filter of wall_odometry on a robot in MuJoCo.

The robots of bench/physics.py in the engine, on its paths, with the sensors of config/field.yaml:
encoders, an IMU of what the engine's body does, and fixes; the controller is told nothing else.
True distance from the reference RMS, largest [mm]; output off RMS [mm], heading RMS [°]; NEES.
"""

import argparse
import math
import sys
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from localization import FILTER, MILLIMETRE, PERIOD, Case, Loop, Record, print_faults, rms
from physics import PATHS, ROBOTS, ROOT, trajectory

from climber_uk.control.build import build_controller
from climber_uk.localization.localizer import Located
from climber_uk.localization.scrubbing import DRAGGED
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import GRAVITY
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.reference import tracking_error
from climber_uk.messages.topics import CONTROLLER, PLANT
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.ros import plant_parts
from climber_uk.simulation.simulated_robot import Parts

sys.path.insert(0, str(ROOT / "examples"))
# what wheels show while they scrub (bench/physics.py), and how far they slip
SCRUBS: dict[str, Any] = {
    "effective_half_track": 0.357,
    "scrub_deviation": 0.04,
    "slip_deviation": 0.15,
    "creep_deviation": 0.0,
    "way_noise": 0.003,
    "acceleration_noise": 0.02,
    "output_frequency": 100.0,
}
# of plants that neither filter nor controller are told of
UNSEEN: dict[str, dict[str, float]] = {
    "four wheels": {},
    "four wheels, 0.4 m from front to rear": {"four_wheeled.wheelbase": 0.4},
    "four wheels, 8 kg": {"mass": 8.0, "yaw_inertia": 0.5},
}
# rows: robot, its plant's parameters, and what the filter is told of it
TOLD: dict[str, tuple[str, dict[str, float], dict[str, Any]]] = {
    "two wheels": ("two wheels", {}, {"way_noise": 0.002}),
    **{name: ("four wheels", more, SCRUBS) for name, more in UNSEEN.items()},
}


class EngineLoop(Loop):
    """The closed loop of a robot in the engine."""

    def __init__(self, name: str, path: str, seed: int, is_told: bool = False) -> None:
        """Of a robot on a path; whether its controller is told the truth."""
        from mujoco_climber import MujocoClimber

        robot, unseen, told = TOLD[name]
        config, more = ROBOTS[robot]
        file, period = ROOT / "config" / config, 0.005
        plant = {**read_file(file, f"/{PLANT}"), **more}
        parts = plant_parts.parts(Values({**plant, **unseen}))
        known = scrubs(plant_parts.parts(Values(plant))) if told == SCRUBS else {}
        source = {} if is_told or told != SCRUBS else {"observer.side_slip_source": "odometry"}
        given = {**read_file(file, f"/{CONTROLLER}"), **source}
        self.controller = build_controller(Values(given), None)
        self.trajectory = trajectory(path)
        start = State(self.trajectory.at(0.0).pose, np.zeros(3))
        self.robot = MujocoClimber(parts, start, period)
        x, y, heading = start.pose.tolist()
        known |= {"initial_x": x, "initial_y": y, "initial_heading": heading}
        options = replace(FILTER, **told, **known)
        self.case = Case(options=options, duration=PATHS[path][1], believes_truth=is_told)
        self.torques: Array = np.zeros(2)
        self.record, self.sent = Record(), []
        self.sense(start, seed)


def scrubs(parts: Parts) -> dict[str, float]:
    """What is expected of λ, a [m], ζ and ξ: weight, drag, by the moment that turns the wheels."""
    climber, contact = parts.plant.climber, parts.plant.contact
    load = climber.wheel_load_share * contact.adhesion.force(climber)
    moment, d = contact.locomotion.turning_resistance(load), climber.half_track
    length = max(contact.locomotion.footholds) - min(contact.locomotion.footholds)
    weight, height = climber.mass * GRAVITY, contact.grip.centre_height
    return {
        "initial_scrub": weight * length**2 / moment,
        "initial_pivot": weight * height * (1 + (2 * d / length) ** 2) / load,
        "initial_drag_slip": contact.seal_friction(climber) * d / moment,
        "initial_weight_slip": weight * d / moment,
    }


class Watched(EngineLoop):
    """One whose controller is told the truth, and whose slip is watched."""

    def __init__(self, name: str, path: str) -> None:
        super().__init__(name, path, 0, is_told=True)
        self.states: list[State] = []
        self.angles: list[Array] = []

    def locate(self, stamp: int, now: float) -> Located | None:
        """Remember where it is."""
        self.states.append(self.robot.state)
        self.angles.append(self.robot.angles)
        return Located(stamp, self.robot.state.motion, np.eye(3), (1.0, 1.0))

    def slips(self) -> str:
        """Row, of means over 0.1 s [m], [mm/s].

        λ and a; side slip, what λ alone and both leave. ζ and ξ; by how much wheels are too fast,
        what shares of |ω| in their place leave, what ζ and ξ do.
        """
        poses = np.array([state.pose for state in self.states])
        climber, heading = self.robot.plant.climber, (poses[1:, 2] + poses[:-1, 2]) / 2
        cosine, sine = np.cos(heading), np.sin(heading)
        x, y, turned = np.diff(poses, axis=0).T
        rims = climber.wheel_radius * np.diff(self.angles, axis=0)
        means = (rims.mean(axis=1), x * cosine + y * sine, y * cosine - x * sine, turned)
        rolled, forwards, aside, rate = (mean(part) / PERIOD for part in means)
        sides = mean(rims[:, 0] - rims[:, 1]) / 2 / PERIOD
        slipping = np.abs(sides) - climber.half_track * rate * np.sign(sides)
        dragged = rolled / np.hypot(rolled, DRAGGED)
        side = fits(aside, [-cosine * np.abs(rate)], [-cosine * np.abs(rate), sine * rate])
        plain = [np.abs(rate) * dragged, np.abs(rate) * sine]
        along = fits(rolled - forwards, plain, [slipping * dragged, slipping * sine])
        return f"{side} | {along}"


def mean(values: Array) -> Array:
    """Mean (n,) over 0.1 s."""
    return np.convolve(values, np.full(20, 1 / 20), "same")


def fits(shown: Array, *models: list[Array]) -> str:
    """What fits best in the last of some models; RMS of what is shown, and of what each leaves."""
    left = [rms(shown)]
    for model in models:
        found, *_ = np.linalg.lstsq(np.stack(model, axis=1), shown)
        left.append(rms(shown - np.stack(model, axis=1) @ found))
    told = ", ".join(f"{part / MILLIMETRE:.1f}" for part in left)
    return f"{', '.join(f'{part:.3f}' for part in found)} | {told}"


def row(name: str, path: str, loops: list[Loop]) -> str:
    """Row of the table, of one run for each seed."""
    rows = np.array([loop.record.rows for loop in loops])
    now, pose, off = rows[0, :, 0], rows[..., 1:4], rows[..., 4:7]
    covariance = rows[..., 7:].reshape(*rows.shape[:2], 3, 3)
    nees = np.einsum("sni,snij,snj->sn", off, np.linalg.inv(covariance), off)
    waited = np.array([loop.record.waited for loop in loops])
    along, across, _ = tracking_error(pose, loops[0].trajectory.at(now - waited))
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
    parser.add_argument("--truth", action="store_true", help="the controller gets the true motion")
    parser.add_argument("--slip", action="store_true", help="how four wheels slip")
    options = parser.parse_args()
    if options.slip:
        for name, path in product(UNSEEN, PATHS):
            if options.only in f"{name}, {path}":
                watched = Watched(name, path)
                watched.run()
                print(f"| {name} | {path} | {watched.slips()} |", flush=True)
        return
    for name, path in product(TOLD, PATHS):
        if options.only in f"{name}, {path}":
            runs = [EngineLoop(name, path, seed, options.truth) for seed in range(options.seeds)]
            loops = [loop.run() for loop in runs]
            print(row(name, path, loops), flush=True)
            print_faults(loops)


if __name__ == "__main__":
    main()
