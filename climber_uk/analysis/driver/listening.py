"""Checks of what a driver publishes, however it moves: topics, stamps and contents."""

from collections import Counter

import numpy as np

from climber_uk.analysis.driver import thresholds
from climber_uk.analysis.driver.evidence import Evidence
from climber_uk.analysis.driver.report import Finding, failed, graded, passed, warned
from climber_uk.mechanics.preview import SECOND

ODOMETRY, TORQUES = "nav_msgs/msg/Odometry", "sensor_msgs/msg/JointState"


def topic(seen: Evidence) -> Finding:
    """Odometry comes, on the topic and of the type that the controller listens to."""
    graph, kinds = seen.graph, {end.kind for end in seen.graph.odometry}
    if not kinds:
        there = f"; there is {', '.join(graph.elsewhere)}" if graph.elsewhere else ""
        hint = "start the driver in this ROS domain, or remap its topic, or set the namespace"
        return failed(f"nobody publishes {graph.topic}{there}", hint)
    if kinds != {ODOMETRY}:
        wrong = ", ".join(sorted(kinds - {ODOMETRY}))
        return failed(f"{graph.topic} is {wrong}", f"publish {ODOMETRY} there, and nothing else")
    if not seen.arrivals:
        return failed(f"nothing comes on {graph.topic}", "publish odometry all the time")
    return passed(f"{graph.topic} is {ODOMETRY}")


def publishers(seen: Evidence) -> Finding:
    """One publishes odometry."""
    nodes = [end.node for end in seen.graph.odometry]
    if len(nodes) > 1:
        hint = "stop all but one, or remap the topics of the others"
        return failed(f"{len(nodes)} publish odometry: {', '.join(sorted(nodes))}", hint)
    return passed(f"one: {nodes[0]}")


def qos(seen: Evidence) -> Finding:
    """Who wants to receive odometry does."""
    if not all(end.fits for end in seen.graph.odometry):
        hint = "publish with the default QoS: reliable, volatile, keep last, no deadline"
        return failed("the controller's subscription does not match", hint)
    if not all(end.reliable for end in seen.graph.odometry):
        return warned(
            "best effort: the controller gets it, a reliable subscriber (RViz) does not",
            "publish reliably if anybody else is to get it",
        )
    return passed("reliable: the controller and every other subscriber get it")


def commands(seen: Evidence) -> Finding:
    """Torques are listened to."""
    ends = seen.graph.commanded
    if not ends:
        return failed("nobody subscribes wheel_torques", f"subscribe it, as {TORQUES}")
    kinds = {end.kind for end in ends}
    if kinds != {TORQUES}:
        return failed(f"wheel_torques is {', '.join(sorted(kinds))}", f"subscribe {TORQUES}")
    unfit = [end.node for end in ends if not end.fits]
    if unfit:
        hint = "subscribe with the default QoS: volatile, no deadline"
        return failed(f"{', '.join(unfit)} would not get the controller's torques", hint)
    return passed(f"subscribed by {', '.join(sorted({end.node for end in ends}))}")


def rate(seen: Evidence) -> Finding:
    """Odometry comes as often as the controller expects, by its stamps."""
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
    """Odometry is measured evenly, by its stamps; how evenly it comes is the machine's affair."""
    steps = np.diff(np.unique(seen.stamps))
    period = float(np.mean(steps))
    uneven = float(np.median(np.abs(steps.astype(float) - period))) / period
    gaps = np.diff([arrival.wall for arrival in seen.arrivals]) / SECOND
    late = float(np.median(np.abs(gaps - np.median(gaps))))
    bounds = thresholds.UNEVEN, thresholds.VERY_UNEVEN
    said = f"stamps are {uneven:.1%} of a period off, arrivals {1e3 * late:.2f} ms"
    hint = "measure by a timer of the motor board, and stamp the time of measuring"
    return graded(uneven, bounds, said, hint, stamps=uneven * period / SECOND, arrivals=late)


def clock(seen: Evidence) -> Finding:
    """Stamps are of the clock that the controller uses."""
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
    """Stamps increase. In lock-step an odometry that was not answered comes again."""
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
    """Odometry is fresh when it comes."""
    now = [a.simulated if seen.use_sim_time else a.wall for a in seen.arrivals]
    ages = (np.array(now) - seen.stamps) / SECOND
    typical, timeout = float(np.median(ages)), seen.expected.odometry_timeout
    value = {"age": typical, "age_99": float(np.quantile(ages, 0.99))}
    said = f"{1e3 * typical:.2f} ms old when it comes (99 %: {1e3 * value['age_99']:.2f} ms)"
    # simulated time is told after the odometry, and not at each one
    ahead = thresholds.AHEAD + 2 * seen.expected.control_period * seen.use_sim_time
    if typical < -ahead:
        hint = "stamp the time of measuring; synchronise the computers' clocks"
        verdict = failed if -typical > timeout else warned
        return verdict(f"{-typical:.3g} s ahead of the clock", hint, **value)
    bounds = thresholds.OLD * timeout, timeout
    hint = "publish at once, and stamp the time of measuring; synchronise the computers' clocks"
    return graded(typical, bounds, said, hint, **value)


def frames(seen: Evidence) -> Finding:
    """Pose and twist are in the frames that the controller knows."""
    found = Counter((a.message.header.frame_id, a.message.child_frame_id) for a in seen.arrivals)
    wrong = [frames for frames in found if frames != seen.frames]
    if wrong:
        pose, twist = wrong[0]
        hint = "fill header.frame_id and child_frame_id, or set odom_frame and base_frame"
        return failed(
            f"pose in {pose!r}, twist in {twist!r}; should be {seen.frames[0]!r}, "
            f"{seen.frames[1]!r}",
            hint,
        )
    return passed(f"pose in {seen.frames[0]}, twist in {seen.frames[1]}")


def finite(seen: Evidence) -> Finding:
    """Numbers are numbers, and turns are turns about z."""
    if seen.errors:
        share = f"{len(seen.errors)} of {len(seen.arrivals)} messages"
        if "orientation" in seen.errors[0]:
            hint = "orientation is (0, 0, sin(θ/2), cos(θ/2)) of the heading θ in radians"
        else:
            hint = "do not publish what was not measured"
        return failed(f"{share}: {seen.errors[0]}", hint)
    return passed("all numbers are finite, and orientations turn about z")


def covariance(seen: Evidence) -> Finding:
    """Uncertainties are told."""
    found = seen.covariances
    hint = "fill the diagonals for x, y, yaw: in m², rad², (m/s)², (rad/s)²; 1e-12 for exact ones"
    if not np.isfinite(found).all():
        return failed("not finite", hint)
    if (found < 0).any():
        return failed(f"negative: {found.min():.3g}", hint)
    if (found == 0).all():
        return failed("all zero", hint)
    if (found[:, [0, 1, 2, 3, 5]] == 0).any():  # wheels do not go sideways
        return warned("zero for some of x, y, yaw", hint)
    return passed(f"filled: deviations from {found.min() ** 0.5:.3g} to {found.max() ** 0.5:.3g}")
