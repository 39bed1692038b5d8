"""`python bench/engine_identification.py`: identify, on a robot in MuJoCo whose wheels scrub.

The four wheels of bench/physics.py in the engine, mass, inertia and friction each 20 % more or less
than the controller believes, with the odometry's noise of bench/identify.py; another noise and
another truth with each seed. What resists turning and the half track that wheels show are not
parameters of the engine: they are those that fit best to what moved there, without noise, in the
windows that `identify` uses, with the true inertia. What is not told counts as neither right nor
wrong; why is printed. The engine's tyres are pressed in less while they scrub, so that torques have
a lever that is longer by some percent, printed as well: what is made of torques is right anywhere
between both scales.
"""

import argparse
import os
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from identification_experiments import NOISE, OFF, Ear
from physics import PATHS, ROBOTS, ROOT, trajectory

from climber_uk.closed_loop.simulate import Run, simulate
from climber_uk.control.build import build_controller
from climber_uk.identification.estimation import identify
from climber_uk.identification.excitation import ExcitationLimits, plan
from climber_uk.identification.identified import HEADING, YAW, Identified
from climber_uk.identification.integral_equations import Site
from climber_uk.identification.recorded_motion import RecordedMotion
from climber_uk.mechanics import Array
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.messages.topics import CONTROLLER, PLANT
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.ros import plant_parts

sys.path.insert(0, str(ROOT / "examples"))
PLAN = "plan"  # of identify
COURSES = [*(path for path in PATHS if not path.startswith("line")), PLAN]  # all that turn
COUNT = 2 * np.pi / 4096  # [rad] of the encoders
SHARE = 0.2  # by which the truth is off what is believed
TURNING = 0.1  # [rad/s]
COLUMNS = *OFF, "turning_moment", "effective_half_track", "lever of the torques"


@dataclass
class Counted:
    """A robot whose wheels' angles are counted at each odometry."""

    robot: Any
    angles: list[Array] = field(default_factory=lambda: [np.zeros(2)])
    levers: list[float] = field(default_factory=list)  # [m] of torques, to the middle of contacts

    def __getattr__(self, name: str) -> Any:
        return getattr(self.robot, name)

    def measure(self) -> None:
        """Measure, and count."""
        self.robot.measure()
        self.angles.append(COUNT * np.floor(self.robot.angles / COUNT))
        radius = float(self.robot.model.geom("left_0").size[0])
        self.levers.append((radius + self.robot.height) / 2)


def driven(path: str, seed: int) -> tuple[Any, Any, Ear, Run, Counted]:
    """Climbers that is and that is believed; what the controller heard, the run, and the robot."""
    from mujoco_climber import MujocoClimber

    config, more = ROBOTS["four wheels"]
    file = ROOT / "config" / config
    values = {**read_file(file, f"/{PLANT}"), **more}
    parts = plant_parts.parts(Values(values))
    believed = parts.plant.climber
    shares = 1 + SHARE * np.random.default_rng(1000 + seed).choice([-1, 1], len(OFF))
    off = {name: share * getattr(believed, name) for name, share in zip(OFF, shares, strict=True)}
    parts = plant_parts.parts(Values({**values, **off}))
    reference, duration = course(path, believed)
    ear = Ear(build_controller(Values(read_file(file, f"/{CONTROLLER}")), None))
    robots: list[Counted] = []

    def make(_: Any, start: State, period: float) -> Any:
        robots.append(Counted(MujocoClimber(parts, start, period)))
        return robots[-1]

    start = State(reference.at(0.0).pose, np.zeros(3))
    link = replace(NOISE, step=parts.plant.step, period=0.005)
    run = simulate(
        reference, start, duration, ear, parts.plant.climber, link, seed=seed, robot_of=make
    )
    return parts.plant.climber, believed, ear, run, robots[0]


def course(path: str, believed: Any) -> tuple[Trajectory, float]:
    """A path of bench/physics.py, or the plan of `identify`, and how long that takes [s]."""
    if path != PLAN:
        return trajectory(path), PATHS[path][1]
    best = plan(believed, ExcitationLimits(duration=30.0), site=Site(scrubs=True)).trajectory
    return best, best.duration + 1.0


def shown(run: Run, angles: Array, true: Any, found: Identified) -> tuple[float, float]:
    """What resists turning [N m] and the half track [m], as they show without noise."""
    heading, time = np.unwrap(run.pose[:, 2]), run.time
    moment = true.half_track * (run.torques @ [1.0, -1.0]) / true.wheel_radius
    resisted, turning = 0.0, 0.0
    for window in found.windows.get(YAW, []):
        ends, inner = window[[0, -1]], window[1:]
        sign = np.sign(heading[ends[1]] - heading[ends[0]])
        pushed = float(moment[inner].sum()) * (time[1] - time[0])
        speeds = np.diff(run.velocity[ends, 2])[0]
        resisted += sign * (pushed - true.yaw_inertia * speeds)
        turning += float(time[ends[1]] - time[ends[0]])
    sides, turned = [], []
    for window in found.windows.get(HEADING, []):
        rims = true.wheel_radius * (angles[window] @ [0.5, -0.5])
        sides.append(rims - rims.mean())
        turned.append(heading[window] - heading[window].mean())
    by, of = np.concatenate(sides), np.concatenate(turned)
    return resisted / turning, float(by @ by / (by @ of))


def trial(path: str, seed: int) -> tuple[Array, Array, dict[str, str]]:
    """Relative errors (6,) of a seed, nan if not told; by the half width (6,); and why not."""
    true, believed, ear, run, robot = driven(path, seed)
    angles, turning = np.array(robot.angles), np.abs(run.velocity[1:, 2]) > TURNING
    longer = float(np.mean(np.array(robot.levers)[turning])) / true.wheel_radius
    motion: RecordedMotion = replace(ear.motion(true.suction_pressure), wheel_angles=angles)
    found = identify(motion, believed)
    moment, track = shown(run, angles, true, found)
    why = {name: reason.words.split(":")[0] for name, reason in found.reasons.items()}
    told = [(found[name], found.half_width(name), name not in why) for name in OFF]
    told.append((*found.resisted, found.tells_resisted))
    told.append((found["half_track"], found.half_width("half_track"), found.tells_effective_track))
    values, widths, known = map(np.array, zip(*told, strict=True))
    right = np.array([*(getattr(true, name) for name in OFF), moment, track])
    values = np.where(known, values, np.nan)
    off = np.append(values / right - 1, longer - 1)
    nearest = np.clip(values, right, right * [longer, longer, longer, 1.0, 1.0])
    return off, np.append(np.abs(values - nearest) / widths, 0.0), why


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="how many (default: 20)")
    parser.add_argument("--only", default="", help="paths whose name contains this")
    parser.add_argument("--cores", type=int, default=2, help="processes (default: 2)")
    options = parser.parse_args()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with ProcessPoolExecutor(options.cores) as pool:
        for path in COURSES:
            if options.only not in path:
                continue
            results = list(pool.map(partial(trial, path), range(options.seeds)))
            off, ratio = (np.array([result[n] for result in results]) for n in (0, 1))
            for number, name in enumerate(COLUMNS):
                told = np.isfinite(off[:, number])
                print(f"{path:24}{name:28}{said(off[told, number], ratio[told, number])}")
            why = Counter(f"{n}: {w}" for *_, reasons in results for n, w in reasons.items())
            for words, count in why.most_common():
                print(f"{path:24}{count} x {words}", flush=True)


def said(off: Array, ratio: Array) -> str:
    """How well it was told, and in how many seeds the interval was right."""
    if not len(off):
        return "never told"
    size = f"error rms {np.sqrt(np.mean(off**2)):.2%}, mean {off.mean():.2%}"
    return (
        f"{size}, largest {np.abs(off).max():.2%}, interval right {sum(ratio <= 1)} of {len(off)}"
    )


if __name__ == "__main__":
    main()
