"""Many climbers along the paper's ellipse, open loop: MuJoCo's rollout, and how true it is.

All get the same torques, those that keep a climber on the ellipse, held for each step.
"""

import os
import time
from functools import partial

import numpy as np
from peers import mujoco_climber
from side_by_side import in_turns, rate, table, timed

from climber_uk.closed_loop.unicycle import UnicycleModel, advanced
from climber_uk.mechanics import Array
from climber_uk.mechanics.quantities import Motion, State, Wrench, across
from climber_uk.paper.consistent import PAPER_PATH, ConsistentSystem
from climber_uk.paper.motion import DURATION, START
from climber_uk.simulation.plant import Plant

CONSISTENT = ConsistentSystem()
CLIMBER = CONSISTENT.climber
STEP = 0.0025  # [s]
WORK = 200_000  # climber-steps in a measurement
COUNTS = 1, 100, 10_000
SLOW = 3  # of the rounds asked for, one in so many
TIMES = 1.0, DURATION  # [s] after which distances are told
MODELS = [
    *(("reaction given", integrator) for integrator in ("Euler", "RK4")),
    *(("stiff damper", integrator) for integrator in ("implicitfast", "implicit")),
]
LIKE_OURS, MOST = ("reaction given", "RK4"), 1e-5  # [m] after 1 s: the reaction is held


def inputs(steps: int) -> Array:
    """Torques τR, τL and the lateral reaction in the middle of each step, (steps, 3)."""
    middles = (np.arange(steps) + 0.5) * STEP
    reference = PAPER_PATH.at(middles)
    state = State(reference.pose, reference.velocity)
    reaction = across(state.heading, CONSISTENT.constraint_force(middles, state))
    return np.column_stack([CONSISTENT.torques(middles, state), reaction])


def by_plant(given: Array) -> Array:
    """Poses (steps, 3) of the simulated climber."""
    plant, states = Plant(CLIMBER, STEP), [State(START[:3], START[3:])]
    for torques in given[:, :2]:
        states.append(plant.advance(states[-1], torques, steps=1))
    return np.array([state.pose for state in states[1:]])


def by_mujoco(model: tuple[str, str], climbers: int, given: Array, threads: int) -> Array:
    """Poses and velocities (climbers, steps, 6) by MuJoCo."""
    built = mujoco_climber.model(CLIMBER, *model, STEP)
    return mujoco_climber.rolled_out(built, np.tile(START, (climbers, 1)), given, threads)


def by_us(climbers: int, given: Array) -> Motion:
    """The last motion of so many climbers, all at once."""
    body, motion = UnicycleModel.of(CLIMBER), State(START[:3], START[3:]).motion
    if climbers > 1:
        motion = Motion(*(np.full(climbers, part) for part in motion))
    for torques in given[:, :2].tolist():
        motion = advanced(body, motion, Wrench(*CLIMBER.wrench(*torques)), STEP)
    return motion


def after(seconds: float, poses: Array) -> Array:
    """Position (2,) after so many seconds, of poses (steps, 3 or more)."""
    position: Array = poses[round(seconds / STEP) - 1, :2]
    return position


def truth() -> None:
    """Print how far from ours are the ellipse, ours by many at once, and MuJoCo's climbers."""
    given = inputs(round(DURATION / STEP))
    ours = by_plant(given)
    ellipse = PAPER_PATH.at((np.arange(len(ours)) + 1) * STEP).pose
    title = f"distance from `Plant`, steps of {STEP} s"
    print(f"\n{title:<54}{'1 s [m]':>10}{'20 s [m]':>20}{'slip [m/s]':>14}")
    _tell("the ellipse", [after(time, ellipse) - after(time, ours) for time in TIMES])
    ends = [(time, by_us(2, given[: round(time / STEP)])) for time in TIMES]
    _tell("this project, numpy", [[end.x[1], end.y[1]] - after(time, ours) for time, end in ends])
    for model in MODELS:
        (motion,) = by_mujoco(model, 1, given, threads=1)
        slip = np.abs(State(motion[:, :3], motion[:, 3:]).side_slip).max()
        off = _tell(named(model), [after(t, motion) - after(t, ours) for t in TIMES], slip)
        if model == LIKE_OURS and not off <= MOST:
            raise SystemExit(f"{named(model)}: {off:g} off after 1 s, must be <= {MOST:g} [m]")


def _tell(name: str, offsets: list[Array], slip: float = 0.0) -> float:
    """Print a row; return the first distance [m]."""
    first, last = (float(np.hypot(*offset)) for offset in offsets)
    print(f"{name:<54}{first:>10.2g}{last:>20.2g}{slip:>14.2g}")
    return first


def named(model: tuple[str, str]) -> str:
    """What a row is called."""
    return f"MuJoCo, {', '.join(model)}"


def compare(rounds: int) -> None:
    """Check and print the tables."""
    truth()
    rounds = -(-rounds // SLOW)
    for climbers in COUNTS:
        given = inputs(WORK // climbers)
        ways = {"this project, numpy": timed(partial(by_us, climbers, given))}
        for model in MODELS:
            ways[named(model)] = timed(partial(by_mujoco, model, climbers, given, 1))
        times = {name: t / WORK for name, t in in_turns(ways, rounds).items()}
        table(f"open loop, N = {climbers}", times, "M/s", rate)
    ways = {}
    for threads in (1, os.cpu_count() or 1):
        run = partial(by_mujoco, MODELS[0], climbers, given, threads)
        ways[f"{named(MODELS[0])}, threads: {threads}"] = timed(run, time.perf_counter)
    times = {name: t / WORK for name, t in in_turns(ways, rounds).items()}
    table(f"open loop, N = {climbers}, on the wall's clock", times, "M/s", rate)
