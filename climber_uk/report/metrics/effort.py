"""Torques, powers and energies of the motors, and constraint forces.

P = τ φ̇,   φ̇ = (v ± d ω)/r
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from climber_uk.bags.joints import WHEELS
from climber_uk.mechanics import SECOND, Array
from climber_uk.mechanics.quantities import State
from climber_uk.messages import topics
from climber_uk.report.metrics.metric import GAP, NAN, Case, Metric, largest, mean, rms, share

NEGLIGIBLE = 0.01  # of the largest torque: the sign of less does not count
FORCES = (("drive", "N", "forwards"), ("lateral", "N", "to the left"), ("moment", "N m", "about z"))


def saturated(case: Case) -> float:
    """Share of answers with a torque at its limit [%]."""
    if (climber := case.run.climber) is None:
        return NAN
    limit = climber.max_wheel_torque * (1 - 1e-9)
    return share((np.abs(case.run.torques) >= limit).any(axis=1))


def power(case: Case, wheel: int) -> tuple[Array, Array]:
    """Times (n,) [s] and power (n,) [W] of a motor: rate of joint_states, else of odometry."""
    run = case.run
    joint = run.wheels[wheel]
    if len(joint):
        return run.seconds(joint), joint.values[:, 0] * joint.values[:, 1]
    if (climber := run.climber) is None or not len(run.commands):
        return np.empty(0), np.empty(0)
    speed, _, yaw_rate = run.rates[run.is_answered].T
    state = State.rolling(run.pose[run.is_answered], speed, yaw_rate)
    return run.seconds(run.commands), (climber.wheel_rates(state) * run.torques)[:, wheel]


def energy(case: Case, wheel: int) -> float:
    """Work of a motor [J], by the trapezoidal rule."""
    time, values = power(case, wheel)
    return float(np.trapezoid(values, time)) if len(time) > 1 else NAN


def reversals(case: Case) -> float:
    """Sign changes of a wheel's torque by second [1/s], of the wheel that has more of them."""
    run = case.run
    if len(run.commands) < 2:
        return NAN
    climber, peak = run.climber, np.abs(run.torques).max()
    least = NEGLIGIBLE * (climber.max_wheel_torque if climber else peak)
    signs = (np.sign(wheel[np.abs(wheel) > least]) for wheel in run.torques.T)
    duration = np.ptp(run.commands.stamps) / SECOND
    return max(float(np.sum(np.diff(sign) != 0)) for sign in signs) / duration


def changes(case: Case) -> Array:
    """Changes of torque (k, 2) [N m] between answers to odometry one period apart."""
    apart = np.diff(case.run.commands.stamps)
    usual = apart <= GAP * np.median(apart) if len(apart) else []
    return np.diff(case.run.torques, axis=0)[usual]


def energy_per_metre(case: Case) -> float:
    """Work of both motors by distance travelled [J/m]."""
    distance = case.run.travelled
    return (energy(case, 0) + energy(case, 1)) / distance if distance > 0 else NAN


def _of_power(statistic: Callable[[Array], float], wheel: int, case: Case) -> float:
    return statistic(power(case, wheel)[1])


def _of_force(statistic: Callable[[Array], float], component: int, case: Case) -> float:
    force = case.run.recorded[topics.FORCE]
    return statistic(force.values[:, component]) if len(force) else NAN


def _of_wheel(wheel: int, side: str) -> tuple[Metric, ...]:
    meaning = f"power of the {side} motor: torque times rate, negative where it brakes"
    peak, average = partial(_of_power, largest, wheel), partial(_of_power, mean, wheel)
    work = f"work of the {side} motor, less what it took in by braking"
    return (
        Metric(f"peak_power_{side}", "W", f"largest size of the {meaning}", peak),
        Metric(f"mean_power_{side}", "W", f"mean {meaning}", average),
        Metric(f"energy_{side}", "J", work, partial(energy, wheel=wheel)),
    )


def _of_constraint(place: int, name: str, unit: str, direction: str) -> tuple[Metric, ...]:
    meaning = f"of the Udwadia-Kalaba force {direction}"
    root, peak = partial(_of_force, rms, place), partial(_of_force, largest, place)
    return (
        Metric(f"rms_constraint_{name}", unit, f"root mean square {meaning}", root),
        Metric(f"peak_constraint_{name}", unit, f"largest size {meaning}", peak),
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
    Metric(
        "torque_reversals",
        "1/s",
        "how often a second a wheel's torque changes its sign, of the wheel that does it more: "
        "above a few it chatters; what is below 1 % of `max_wheel_torque` (if that is not known, "
        "of the largest torque) does not count",
        reversals,
    ),
    Metric(
        "rms_torque_change",
        "N m",
        "root mean square of what a wheel's torque changes from one answer to the next",
        lambda case: rms(changes(case)),
    ),
    Metric("saturation", "%", "share of answers with a wheel at `max_wheel_torque`", saturated),
    *(metric for wheel, side in enumerate(WHEELS) for metric in _of_wheel(wheel, side)),
    Metric("energy_per_metre", "J/m", "work of both motors by metre of the way", energy_per_metre),
    *(metric for place, force in enumerate(FORCES) for metric in _of_constraint(place, *force)),
)
