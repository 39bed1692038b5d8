"""`python bench/fastest.py`: the law `fastest` beside the optimum, constant speed, and a plant.

The optimum is that of a general solver (IPOPT, by CasADi) on the same problem, written down anew:
least time over X = ṡ² and U = s̈, with all limits, and without our smoothing. Constant speed is the
highest at which the same limits hold all along, with the fastest ramps up to it and down. The
highest rate is that of `rest_to_rest`. The plant's wheels may slip.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from climber_uk.closed_loop.simulate import simulate
from climber_uk.control.build import build_controller
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber
from climber_uk.mechanics.contact import Contact
from climber_uk.mechanics.quantities import State
from climber_uk.mechanics.shapes import Ellipse
from climber_uk.mechanics.time_laws import RestToRest
from climber_uk.mechanics.trajectory import Trajectory
from climber_uk.parameters.parameter_file import Values, read_file
from climber_uk.path_check.check_path import read
from climber_uk.path_check.demands import demands, reserves
from climber_uk.path_check.fastest import fastest
from climber_uk.path_check.path_limits import Limits
from climber_uk.path_check.time_optimal import time_optimal
from climber_uk.simulation.plant import Plant

if TYPE_CHECKING:
    import casadi as ca

CONFIG = Path(__file__).parents[1] / "config"
NODES = {"ellipse": 1500, "eight": 1500, "lanes": 5000}
LIMITS = Limits()


class Problem(NamedTuple):
    """A path, its climber, and what is to be kept."""

    trajectory: Trajectory
    climber: Climber
    contact: Contact
    limits: Limits


def problems() -> dict[str, Problem]:
    """The paper's ellipse and climber.yaml's eight by the climber of climber.yaml; its lanes."""
    eight, climber, held, _ = read(CONFIG / "climber.yaml", {}, [])
    lanes, *_ = read(CONFIG / "lanes.yaml", {}, [])
    ellipse = Trajectory(Ellipse(), RestToRest(rate=1.0))
    paths = {"ellipse": ellipse, "eight": eight, "lanes": lanes}
    return {
        name: Problem(path, climber, held, LIMITS.with_those_of(path.shape))
        for name, path in paths.items()
    }


def optimum(problem: Problem, ours: Trajectory, nodes: int) -> float:
    """Least time [s] by IPOPT, at places that are even in the time of our law."""
    import casadi as ca

    s = ours.law.progress(np.linspace(0.0, ours.duration, nodes), ours.course)[0]
    rests = np.concatenate([[0.0], ours.course.rests[0], [ours.course.length]])
    s = np.union1d(s, rests)
    s = s[np.diff(s, prepend=-1.0) > 1e-7 * s[-1]]
    s[-1] = rests[-1]
    step, middle = np.diff(s), (s[1:] + s[:-1]) / 2
    X, U = ca.MX.sym("X", len(s)), ca.MX.sym("U", len(step))
    held, low, high = limits(problem, ours, middle, (X[1:] + X[:-1]) / 2, U)
    held = ca.vertcat(held, X[1:] - X[:-1] - 2 * step * U)
    low, high = np.append(low, 0 * step), np.append(high, 0 * step)
    root = ca.sqrt(X + 1e-12)
    duration = ca.sum1(2 * step / (root[1:] + root[:-1]))
    is_rest = np.abs(s[:, None] - rests).min(axis=1) < 1e-7 * s[-1]
    guess = ours.course.length / ours.duration
    program = {"x": ca.vertcat(X, U), "f": duration, "g": held}
    quiet = {"print_level": 0, "sb": "yes", "max_iter": 1000, "tol": 1e-6}
    quiet["bound_relax_factor"] = 0.0  # no X below 0
    solver = ca.nlpsol("solver", "ipopt", program, {"print_time": False, "ipopt": quiet})
    found = solver(
        x0=np.concatenate([np.where(is_rest, 0.0, (0.3 * guess) ** 2), 0 * step]),
        lbx=np.concatenate([0 * s, np.full(len(step), -np.inf)]),
        ubx=np.concatenate([np.where(is_rest, 0.0, np.inf), np.full(len(step), np.inf)]),
        lbg=low,
        ubg=high,
    )
    if not solver.stats()["success"]:
        print(f"  IPOPT: {solver.stats()['return_status']}")
    return float(found["f"])


def limits(
    problem: Problem, ours: Trajectory, s: Array, X: ca.MX, U: ca.MX
) -> tuple[ca.MX, Array, Array]:
    """What is to lie between two bounds, by (11), (15) and §4 of docs/theory.md."""
    import casadi as ca

    _, climber, held, limits = problem
    _, p_1, p_2, p_3 = (np.asarray(of) for of in ours.course.derivatives(s))
    square = (p_1**2).sum(axis=1)
    size = np.sqrt(square)  # of p'
    size_1 = (p_1 * p_2).sum(axis=1) / size
    cross = p_1[:, 0] * p_2[:, 1] - p_1[:, 1] * p_2[:, 0]
    turn = cross / square  # dθ/ds
    turn_1 = (p_1[:, 0] * p_3[:, 1] - p_1[:, 1] * p_3[:, 0]) / square - 2 * turn * size_1 / size
    gear = np.asarray(ours.course.gear(s)) + 0 * s
    cosine, sine = (gear * part / size for part in p_1.T)
    m, radius, half = climber.mass, climber.wheel_radius, climber.half_track
    weight = m * 9.81
    along = gear * (size * U + size_1 * X)
    force = m * along + gear * climber.seal_friction + weight * sine
    moment = climber.yaw_inertia * (turn * U + turn_1 * X)
    lateral = m * gear * size * turn * X + weight * cosine
    load = climber.wheel_load_share * climber.suction_pressure * climber.suction_area
    shift = -weight * cosine * held.grip.centre_height / (2 * half)
    friction = held.grip.wheel_friction_coefficient / limits.margin
    rows, most = [], []
    for side in (1, -1):
        wheel = (force + side * moment / half) / 2
        own = load / 2 - side * shift
        rows += [wheel * radius / climber.max_wheel_torque]
        rows += [((wheel / own) ** 2 + (lateral / load) ** 2) / friction**2]
        most += [np.ones_like(s)] * 2
    rows += [X * (size / limits.speed) ** 2, X * (turn / limits.yaw_rate) ** 2]
    rows += [((along / limits.acceleration) ** 2 + (size * turn * X / limits.acceleration) ** 2)]
    most += [np.ones_like(s)] * 3
    used = [(row, top) for row, top in zip(rows, most, strict=True) if isinstance(row, ca.MX)]
    bound = np.concatenate([top for _, top in used])
    return ca.vertcat(*(row for row, _ in used)), -bound, bound


def constant_speed(problem: Problem, ours: Trajectory) -> float:
    """Time [s] at the highest speed that is the same all along, from rest to rest."""
    s = ours.law.progress(np.linspace(0.0, ours.duration, 20_000)[1:-1], ours.course)[0]
    s = np.unique(s)
    _, p_1, p_2, _ = ours.course.derivatives(s)
    square = (p_1**2).sum(axis=1)
    low, high = 0.0, problem.limits.speed
    for _ in range(40):
        speed = (low + high) / 2
        X = speed**2 / square
        U = -(p_1 * p_2).sum(axis=1) / square * X
        at = ours.at_progress((s, np.sqrt(X), U, 0 * s))
        left = reserves(at, problem.climber, problem.contact)
        of = problem.limits
        bend = np.abs(speed * at.yaw_rate).max()
        holds = (left.slip >= of.margin).all() and (left.torque >= 1).all()
        holds &= np.abs(at.yaw_rate).max() <= of.yaw_rate and bend <= of.acceleration
        low, high = (speed, high) if holds else (low, speed)
    ramped = time_optimal(*problem[:3], replace(problem.limits, speed=low))
    return ramped.trajectory.duration


def in_the_plant(problem: Problem, ours: Trajectory) -> str:
    """How far off it is, and what is left of margin and torque, where wheels may slip."""
    file = CONFIG / "climber.yaml"
    given = {**read_file(file, "/uk_torque_controller"), "learn_delay": False}
    controller = build_controller(Values(given), None)
    contact = Contact(grip=problem.contact.grip)

    def plant_of(climber: Climber, step: float) -> Plant:
        return Plant(climber, step, contact, slip=True)

    at = ours.at(0.0)
    start = State(at.pose, at.velocity)
    truth = replace(problem.climber, max_wheel_torque=100.0)
    run = simulate(
        ours, start, ours.duration, controller, truth, plant_of=plant_of, point_period=0.01
    )
    plant = plant_of(truth, 0.0025)
    margins = [
        plant.margins(State(pose, velocity), torques)[0]
        for pose, velocity, torques in zip(run.pose, run.velocity, run.torques, strict=True)
    ]
    slip = np.abs(
        run.velocity[:, 1] * np.cos(run.pose[:, 2]) - run.velocity[:, 0] * np.sin(run.pose[:, 2])
    ).max()
    late = np.quantile(margins, 0.01)
    return (
        f"at most {1e3 * run.distance.max():.2f} mm off; margin {min(margins):.3f} "
        f"(1 %: {late:.3f}); {np.abs(run.torques).max():.2f} N m; side slip {1e3 * slip:.2g} mm/s"
    )


def main() -> None:
    """Print a row for each path."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=NODES, default=list(NODES))
    options = parser.parse_args()
    for name, problem in problems().items():
        if name not in options.only:
            continue
        begin = time.perf_counter()
        found = time_optimal(*problem[:3], problem.limits)
        took = time.perf_counter() - begin
        ours = found.trajectory
        begin = time.perf_counter()
        best = optimum(problem, ours, NODES[name])
        solving = time.perf_counter() - begin
        constant = constant_speed(problem, ours)
        highest = fastest(*problem[:3], problem.limits.margin)
        least = min(limit.reserve for limit in demands(ours, *problem[1:3], 1.5).least())
        print(f"{name}: {ours.duration:.3f} s in {took:.2f} s; least reserve {least:.4f}")
        print(f"  optimum {best:.3f} s in {solving:.1f} s: {ours.duration / best - 1:+.2%}")
        print(f"  before smoothing {found.abrupt:.3f} s: {found.abrupt / best - 1:+.2%}")
        print(f"  constant speed {constant:.3f} s: {constant / ours.duration:.2f} times ours")
        if highest:
            print(
                f"  highest rate {highest.duration:.3f} s: {highest.duration / ours.duration:.2f}"
            )
        print(f"  plant: {in_the_plant(problem, ours)}", flush=True)


if __name__ == "__main__":
    main()
