"""How hard motors and constraints worked.

P = τ φ̇,   φ̇ = (v ± d ω)/r
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from climber_uk.analysis import topics
from climber_uk.analysis.metrics.metric import NAN, Case, Metric, largest, mean, rms, share
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import State

WHEELS = "right", "left"
FORCES = (
    ("drive", "N", "forwards"),
    ("lateral", "N", "to the left"),
    ("moment", "N m", "about z"),
)


def saturated(case: Case) -> float:
    """Share of answers with a torque at its limit [%]."""
    if (climber := case.known_climber) is None:
        return NAN
    limit = climber.max_wheel_torque * (1 - 1e-9)
    return share((np.abs(case.run.torques) >= limit).any(axis=1))


def powers(case: Case) -> tuple[Array, Array]:
    """Times (n,) [s] and powers (n, 2) right, left [W]: of joint_states, else of the odometry."""
    run = case.run
    joints = run.recorded[topics.JOINTS]
    if len(joints):
        return run.seconds(joints), joints.values[:, :2] * joints.values[:, 2:]
    if (climber := case.known_climber) is None or not len(run.commands):
        return np.empty(0), np.empty((0, 2))
    values = run.answered.values
    state = State.rolling(values[:, :3], values[:, 3], values[:, 5])
    return run.seconds(run.commands), climber.wheel_rates(state) * run.torques


def energy(case: Case, wheel: int) -> float:
    """Work of a motor [J], by the trapezoidal rule."""
    time, power = powers(case)
    return float(np.trapezoid(power[:, wheel], time)) if len(time) > 1 else NAN


def energy_per_metre(case: Case) -> float:
    """Work of both motors on each metre of the way [J/m]."""
    way = travelled(case)
    return (energy(case, 0) + energy(case, 1)) / way if way > 0 else NAN


def travelled(case: Case) -> float:
    """Way of the centre [m], from the speed, which noise makes no longer."""
    speed = np.abs(case.run.odometry.values[:, 3])
    return float(np.trapezoid(speed, case.run.time)) if len(speed) > 1 else NAN


def _of_power(statistic: Callable[[Array], float], wheel: int, case: Case) -> float:
    return statistic(powers(case)[1][:, wheel])


def _of_force(statistic: Callable[[Array], float], component: int, case: Case) -> float:
    force = case.run.recorded[topics.FORCE]
    return statistic(force.values[:, component]) if len(force) else NAN


def _of_wheel(wheel: int, side: str) -> tuple[Metric, ...]:
    said = f"power of the {side} motor: torque times rate, negative where it brakes"
    peak, average = partial(_of_power, largest, wheel), partial(_of_power, mean, wheel)
    work = f"work of the {side} motor, less what it took in by braking"
    return (
        Metric(f"peak_power_{side}", "W", f"largest size of the {said}", peak),
        Metric(f"mean_power_{side}", "W", f"mean {said}", average),
        Metric(f"energy_{side}", "J", work, partial(energy, wheel=wheel)),
    )


def _of_constraint(place: int, name: str, unit: str, way: str) -> tuple[Metric, ...]:
    said = f"of the Udwadia-Kalaba force {way}"
    root, peak = partial(_of_force, rms, place), partial(_of_force, largest, place)
    return (
        Metric(f"rms_constraint_{name}", unit, f"root mean square {said}", root),
        Metric(f"peak_constraint_{name}", unit, f"largest size {said}", peak),
    )


METRICS = (
    Metric(
        "rms_torque",
        "N m",
        "root mean square of both wheels' torques",
        lambda case: rms(case.run.torques),
    ),
    Metric(
        "peak_torque", "N m", "largest torque of a wheel", lambda case: largest(case.run.torques)
    ),
    Metric("saturation", "%", "share of answers with a wheel at `max_wheel_torque`", saturated),
    *(metric for wheel, side in enumerate(WHEELS) for metric in _of_wheel(wheel, side)),
    Metric("energy_per_metre", "J/m", "work of both motors by metre of the way", energy_per_metre),
    *(metric for place, force in enumerate(FORCES) for metric in _of_constraint(place, *force)),
)
