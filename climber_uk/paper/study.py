"""The computations of the paper as independent jobs, which run in parallel processes."""

import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from climber_uk.paper import attempts, closed_loop, drift, motion
from climber_uk.paper.consistent import ConsistentSystem
from climber_uk.paper.printed import PrintedSystem

Key = tuple[Any, ...]
Jobs = dict[Key, tuple[Callable[..., Any], tuple[Any, ...]]]
Results = dict[Key, Any]

PRINTED, CONSISTENT = PrintedSystem(), ConsistentSystem()
BOTH = {"(26)": False, "(30)": True}
# 0.1 m across the path and 0.05 rad off, rolling along its heading
OFF_CONSTRAINT = np.array([0.0, 6.1, 0.05, 10 * np.cos(0.05), 10 * np.sin(0.05), -0.6])
OFF_STEP, OFF_DURATION = 0.005, 20.0  # [s]


@dataclass(frozen=True)
class StudyExtent:
    """Extent of the computations: tolerances, steps and durations."""

    tolerance: tuple[float, float]
    step: float  # [s] under the torques (25)
    drift_time: float  # [s]
    drift_steps: tuple[float, ...]  # [s]
    drift_tolerances: tuple[float, ...]
    attempts: tuple[str, ...]
    default: bool  # the printed system at the default tolerance, half a minute until it is stuck
    nodes: bool


FULL = StudyExtent(
    tolerance=motion.PRINTED_TOLERANCE,
    step=0.001,
    drift_time=1000.0,
    drift_steps=(0.001, 0.005, 0.01),
    drift_tolerances=tuple(10.0**-n for n in range(12, 2, -1)),
    attempts=tuple(attempts.ATTEMPTS),
    default=True,
    nodes=True,
)
QUICK = StudyExtent(
    tolerance=(1e-6, 1e-9),
    step=0.01,
    drift_time=20.0,
    drift_steps=(0.005, 0.01),
    drift_tolerances=(1e-3, 1e-6),
    attempts=("gain Aᵀ (A M⁻¹ Aᵀ)⁺",),
    default=False,
    nodes=False,
)


def printed(corrected: bool, tolerance: tuple[float, float]) -> motion.PaperMotion:
    """Motion of the printed system, by Dormand and Prince."""
    return _printed(corrected, partial(motion.dormand_prince, tolerance=tolerance))


def _printed(corrected: bool, integrate: attempts.Integrator) -> motion.PaperMotion:
    derivative = PRINTED.corrected if corrected else PRINTED.uncorrected
    return motion.printed_motion(PRINTED, corrected, *integrate(derivative))


def coarse(corrected: bool) -> motion.PaperMotion | str:
    """The same at the default tolerance, or a message why not: rounding may spoil such steps."""
    try:
        return printed(corrected, motion.DEFAULT_TOLERANCE)
    except RuntimeError as why:
        return str(why).split(":")[0]


def euler(corrected: bool) -> motion.PaperMotion:
    """Motion of the printed system, by semi-implicit Euler steps of 10 ms."""
    return _printed(corrected, partial(motion.semi_implicit_euler, step=0.01))


def consistent(corrected: bool, tolerance: tuple[float, float]) -> motion.PaperMotion:
    """Motion of the consistent system, by Dormand and Prince."""
    derivative = CONSISTENT.corrected if corrected else CONSISTENT.uncorrected
    times, y = motion.dormand_prince(derivative, tolerance)
    return motion.consistent_motion(CONSISTENT, corrected, times, y)


def jobs(extent: StudyExtent) -> Jobs:
    """All jobs by key, the longest first."""
    return twenty_seconds(extent) | drifts(extent)


def twenty_seconds(extent: StudyExtent) -> Jobs:
    """Jobs of the comparison over 20 s, and the attempts."""
    tight = extent.tolerance
    todo: Jobs = {}
    if extent.nodes:
        todo["nodes",] = closed_loop.record, ()
    for name, corrected in BOTH.items():
        todo["as printed", name] = printed, (corrected, tight)
    for name, corrected in BOTH.items():
        todo["consistent", name] = consistent, (corrected, tight)
        if extent.default:
            todo["default", name] = coarse, (corrected,)
        todo["euler", name] = euler, (corrected,)
    todo["open loop",] = motion.open_loop, (CONSISTENT, 0.005)
    for name in extent.attempts:
        todo["attempt", name] = attempts.attempt, (name,)
    return todo


def drifts(extent: StudyExtent) -> Jobs:
    """Jobs of the drift study."""
    todo: Jobs = {}
    for step in extent.drift_steps:
        for method in drift.COMPARED:
            todo["step", method, step] = drift.runge_kutta, (method, step, extent.drift_time)
    for tolerance in extent.drift_tolerances:
        for method in drift.WITHOUT_PROJECTION:
            long = method, tolerance, extent.drift_time
            todo["tolerance", method, tolerance] = drift.dormand_prince, long
    for method in list(drift.METHODS)[len(drift.COMPARED) :]:
        coarsest = max(extent.drift_steps)
        long = method, coarsest, extent.drift_time
        todo["variant", method, coarsest] = drift.runge_kutta, long
    for method in drift.COMPARED:
        off = method, OFF_STEP, OFF_DURATION, OFF_CONSTRAINT
        todo["start", method] = drift.runge_kutta, off
    return todo


def compute(pool: ProcessPoolExecutor, todo: Jobs) -> Results:
    """Results of jobs by key; prints each key as it is finished."""
    begin = time.monotonic()
    keys = {pool.submit(function, *arguments): key for key, (function, arguments) in todo.items()}
    results: Results = {}
    for future in as_completed(keys):
        key = keys[future]
        results[key] = future.result()
        said = ", ".join(str(part) for part in key)
        passed = time.monotonic() - begin
        print(f"[{len(results):3}/{len(keys)}] {passed:5.1f} s  {said}", flush=True)
    return results
