"""Checks of rate, jitter, age and clock of odometry, by its stamps and arrivals."""

import numpy as np

from climber_uk.driver_check import thresholds
from climber_uk.driver_check.evidence import Evidence
from climber_uk.driver_check.report import Finding, failed, graded, passed, warned
from climber_uk.mechanics import SECOND


def rate(seen: Evidence) -> Finding:
    """The rate of odometry, by its stamps, is the controller's."""
    steps = np.diff(np.unique(seen.stamps)) / SECOND
    if len(steps) < thresholds.FEWEST:
        if seen.graph.has_clock:
            hint = "in lock-step torques must be answered: start the controller, or use --move"
        else:
            hint = "publish odometry all the time, each with a stamp of its own"
        return failed(f"{len(steps) + 1} different stamps in all", hint)
    period = float(np.median(steps))
    said, value = f"{1 / period:.1f} Hz", {"rate": 1 / period}
    if not thresholds.SLOWEST <= 1 / period <= thresholds.FASTEST:
        bounds = f"{thresholds.SLOWEST:g} to {thresholds.FASTEST:g} Hz"
        return failed(said, f"publish at {bounds}", **value)
    expected = seen.expected.control_period
    off = max(period / expected, expected / period)
    hint = f"set the controller's control_period to {period:.4g}, or the driver to that rate"
    said += f"; control_period says {1 / expected:.1f} Hz"
    return graded(off, (thresholds.RATE_OFF, np.inf), said, hint, **value)


def jitter(seen: Evidence) -> Finding:
    """Odometry is measured evenly, by its stamps: arrivals depend on the computer's load."""
    steps = np.diff(np.unique(seen.stamps))
    # neither a gap nor two kinds of steps shall decide
    period = float(np.mean(np.sort(steps)[len(steps) // 20 : -(len(steps) // 20) or None]))
    uneven = float(np.median(np.abs(steps.astype(float) - period))) / period
    gaps = np.diff([arrival.wall for arrival in seen.arrivals]) / SECOND
    late = float(np.median(np.abs(gaps - np.median(gaps))))
    bounds = thresholds.UNEVEN, thresholds.VERY_UNEVEN
    said = f"stamps are {uneven:.1%} of a period off, arrivals {1e3 * late:.2f} ms"
    hint = "measure by a timer of the motor board, and stamp the time of measuring"
    return graded(uneven, bounds, said, hint, stamps=uneven * period / SECOND, arrivals=late)


def clock(seen: Evidence) -> Finding:
    """Stamps are of the controller's clock."""
    stamps = seen.stamps
    if not stamps.any():
        return failed("stamps are zero", "stamp each odometry with the time of its measuring")
    times = {
        "the wall clock": [arrival.wall for arrival in seen.arrivals],
        "simulated time": [arrival.simulated for arrival in seen.arrivals],
        "time since boot": [arrival.boot for arrival in seen.arrivals],
    }
    ages = {name: float(np.median(np.array(t) - stamps)) / SECOND for name, t in times.items()}
    if not seen.graph.has_clock:
        del ages["simulated time"]
    source = min(ages, key=lambda name: abs(ages[name]))
    wanted = "simulated time" if seen.use_sim_time else "the wall clock"
    if wanted not in ages:
        return failed(
            "use_sim_time is true, but nobody publishes /clock",
            "start everything with use_sim_time:=false, as for a robot, or the simulation's clock",
        )
    if abs(ages[source]) > thresholds.NEAREST_CLOCK:
        age = ages[wanted]
        hint = "stamp with the ROS clock (node.now()); synchronise the computers' clocks"
        return failed(
            f"stamps are {abs(age):.3g} s {'behind' if age > 0 else 'ahead of'} {wanted}",
            hint,
            age=age,
        )
    if source == wanted:
        return passed(f"stamps are {source}", age=ages[source])
    if "time since boot" in source:
        hint = "stamp with the ROS clock (node.now()), not with a steady one"
    else:
        hint = f"start every node with use_sim_time:={str(source == 'simulated time').lower()}"
    return failed(f"stamps are {source}, not {wanted}", hint)


def order(seen: Evidence) -> Finding:
    """Stamps increase; only in lock-step an unanswered odometry is repeated."""
    steps, count = np.diff(seen.stamps), len(seen.stamps)
    backwards = int((steps < 0).sum())
    hint = "publish each measurement once, in order, with the time at which it was made"
    if backwards:
        return failed(f"{backwards} of {count} stamps are older than the one before", hint)
    again = 0 if seen.graph.has_clock else int((steps == 0).sum())
    if again:
        return failed(f"{again} of {count} stamps are the same as the one before", hint)
    return passed(f"increasing, all of {count}")


def age(seen: Evidence) -> Finding:
    """Odometry is fresh when it arrives."""
    now = [a.simulated if seen.use_sim_time else a.wall for a in seen.arrivals]
    ages = (np.array(now) - seen.stamps) / SECOND
    typical, timeout = float(np.median(ages)), seen.expected.odometry_timeout
    value = {"age": typical, "age_99": float(np.quantile(ages, 0.99))}
    said = f"{1e3 * typical:.2f} ms old when it comes (99 %: {1e3 * value['age_99']:.2f} ms)"
    # /clock comes after the odometry, and not at each one
    ahead = thresholds.AHEAD + 2 * seen.expected.control_period * seen.use_sim_time
    if typical < -ahead:
        hint = "stamp the time of measuring; synchronise the computers' clocks"
        verdict = failed if -typical > timeout else warned
        return verdict(f"{-typical:.3g} s ahead of the clock", hint, **value)
    bounds = thresholds.OLD * timeout, timeout
    hint = "publish at once, and stamp the time of measuring; synchronise the computers' clocks"
    return graded(typical, bounds, said, hint, **value)
