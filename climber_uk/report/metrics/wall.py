"""Margins of slipping and tipping, slip, and the friction of the wall.

m Δv = ∫ (τR + τL)/r dt - m g_t ∫ sinθ dt - f ∫ σ dt        (11), integrated

with the weight as it pulls there, on a wall that the controller was told.
"""

from dataclasses import replace

import numpy as np

from climber_uk.control.build import known_wall
from climber_uk.mechanics import Array
from climber_uk.mechanics.quantities import Motion
from climber_uk.mechanics.wall import weight
from climber_uk.messages import topics
from climber_uk.parameters.parameter_file import Values
from climber_uk.report.metrics.metric import NAN, Case, Metric, largest, lowest, share

WINDOW = 0.5  # [s] over which momentum is balanced
MOVING = 0.01  # [m/s] above which friction is that of sliding
ASIDE, ASKEW = 0.02, 0.05  # [m/s] to a side, and share of the speed, above which it slips
SUCTION = "suction"  # of the controller's `adhesion`


def friction(case: Case) -> float:
    """Coulomb friction f [N]: least squares over windows in which it moves one way."""
    run, climber = case.run, case.run.climber
    if climber is None or len(run.commands) < 2:
        return NAN
    time, speed = run.seconds(run.commands), run.rates[run.is_answered, 0]
    drive, _ = climber.force_and_moment(run.torques)
    x, y, heading = run.pose[run.is_answered].T
    there = Motion.at(x, y, heading, 0.0, 0.0)
    push = drive + weight(known_wall(Values(run.parameters)), climber, there)[0]
    pushed = np.concatenate([[0.0], np.cumsum(push[:-1] * np.diff(time))])
    directions = np.sign(speed) * (np.abs(speed) > MOVING)
    summed = np.concatenate([[0], np.cumsum(directions)])

    ends = np.flatnonzero(np.diff(time // WINDOW, prepend=-1))
    begin, end = ends[:-1], ends[1:]  # of windows, the last of which is not whole
    duration, direction = time[end] - time[begin], (summed[end] - summed[begin]) / (end - begin)
    chosen = (np.abs(direction) == 1) & (duration < 1.5 * WINDOW)
    lost = pushed[end] - pushed[begin] - climber.driven_mass * (speed[end] - speed[begin])  # [N s]
    opposed = (direction * duration)[chosen]
    return float(lost[chosen] @ opposed / (opposed @ opposed)) if chosen.any() else NAN


def _margin(case: Case, column: int) -> Array:
    return case.run.margins.values[:, column]


def slip_share(case: Case) -> float:
    """Share of time in which it slips [%], by the margin or by its poses, whichever is more.

    nan if there is only odometry that shows none: that of wheels does not see their slip.
    """
    run = case.run
    aside = np.abs(run.path_rates[:, 1]) > np.maximum(ASIDE, ASKEW * np.abs(run.path_rates[:, 0]))
    if not (len(run.margins) or len(run.recorded[topics.TRUTH]) or aside.any()):
        return NAN
    return largest(np.array([share(_margin(case, 0) < 1), share(aside)]))


def max_side_slip(case: Case) -> float:
    """Largest speed to either side [m/s], by the twist or by the poses, whichever is more."""
    return largest(np.concatenate([case.run.side_slip, case.run.path_rates[:, 1]]))


def has_suction(case: Case) -> bool:
    """Whether the climber has suction; so it is taken, if its parameters are unknown."""
    return case.run.parameters.get("adhesion", SUCTION) == SUCTION


def is_saved(case: Case) -> bool:
    """Whether less than the full suction was asked of the pump, as far as is known."""
    return has_suction(case) and len(case.run.recorded[topics.SETPOINT]) > 0


def pressure(case: Case) -> Array:
    """Pressure (n,) [Pa] at the stamps of the odometry, nan if it was not measured."""
    run, measured = case.run, case.run.recorded[topics.PRESSURE]
    if not len(measured):
        return np.full(len(run.time), NAN)
    return np.interp(run.time, run.seconds(measured), measured.values[:, 0])


def full_pressure(case: Case) -> float:
    """Pressure [Pa] of the controller's parameters, nan if they are unknown."""
    return NAN if case.run.climber is None else case.run.climber.suction_pressure


def mean_suction(case: Case) -> float:
    """Mean of the pressure over time, by the full one [%]."""
    return 100 * _integral(case, pressure(case)) / _integral(case, full_pressure(case))


def seal_work(case: Case) -> float:
    """Work of the seal's friction [J], ∫ (1 - k) μ P S |v| dt."""
    climber, speed = case.run.climber, np.abs(case.run.rates[:, 0])
    if climber is None:
        return NAN
    return _integral(
        case, replace(climber, suction_pressure=1.0).seal_friction * pressure(case) * speed
    )


def seal_work_share(case: Case) -> float:
    """The same, by what it were at the full pressure [%]."""
    speed = np.abs(case.run.rates[:, 0])
    whole = _integral(case, full_pressure(case) * speed)
    return 100 * _integral(case, pressure(case) * speed) / whole if whole > 0 else NAN


def _integral(case: Case, values: Array | float) -> float:
    return float(np.trapezoid(values + 0 * case.run.time, case.run.time))


METRICS = (
    Metric(
        "lowest_slip_margin",
        "",
        "grip of the wheels over what is asked of it, at worst; below 1 they slip. As the "
        "simulator publishes it, else as the controller estimates it",
        lambda case: lowest(_margin(case, 0)),
    ),
    Metric(
        "slip_share",
        "%",
        "share of time with a slip margin below 1, or in which it goes to a side at more than "
        "2 cm/s and 5 % of its speed, whichever is more: by the poses over 0.5 s, those of "
        "`ground_truth` if it was recorded",
        slip_share,
    ),
    Metric(
        "lowest_tip_margin",
        "",
        "hold against tipping over what is asked of it, at worst; below 1 it tips",
        lambda case: lowest(_margin(case, 1)),
    ),
    Metric(
        "lowest_wheel_load", "N", "least load on the wheels", lambda case: lowest(_margin(case, 2))
    ),
    Metric(
        "lowest_pressure",
        "Pa",
        "least pressure difference of the suction",
        lambda case: lowest(case.run.recorded[topics.PRESSURE].values),
        has_suction,
    ),
    Metric(
        "mean_suction",
        "%",
        "mean of the measured pressure over time, by `suction_pressure`, where the pump was given "
        "a setpoint; of the pump's power no more than this is known: a leak's flow is not measured",
        mean_suction,
        is_saved,
    ),
    Metric(
        "seal_work",
        "J",
        "work of the seal's friction, by the measured pressure and the parameters, where the pump "
        "was given a setpoint: what wears the seal",
        seal_work,
        is_saved,
    ),
    Metric(
        "seal_work_share",
        "%",
        "the same, by what it were at `suction_pressure` throughout",
        seal_work_share,
        is_saved,
    ),
    Metric(
        "max_side_slip",
        "m/s",
        "largest speed to a side, by the twist of the odometry or by the poses, as `slip_share`",
        max_side_slip,
    ),
    Metric(
        "friction",
        "N",
        "Coulomb friction against its motion: least squares of the momentum's balance over windows "
        "of 0.5 s in which the climber moves one way; `identify` does it with care",
        friction,
    ),
)
