"""Checks of topics and contents, for which the climber need not move."""

from collections import Counter

import numpy as np

from climber_uk.driver_check.evidence import Evidence
from climber_uk.driver_check.report import Finding, failed, passed, skipped, warned

ODOMETRY, TORQUES = "nav_msgs/msg/Odometry", "sensor_msgs/msg/JointState"


def topic(seen: Evidence) -> Finding:
    """Odometry comes, on the topic and of the type that the controller subscribes."""
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
    """Odometry has one publisher."""
    nodes = [end.node for end in seen.graph.odometry]
    if len(nodes) > 1:
        hint = "stop all but one, or remap the topics of the others"
        return failed(f"{len(nodes)} publish odometry: {', '.join(sorted(nodes))}", hint)
    return passed(f"one: {nodes[0]}")


def qos(seen: Evidence) -> Finding:
    """The QoS of odometry fits that of its subscribers."""
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
    """The driver subscribes torques."""
    drivers = {end.node for end in seen.graph.odometry}
    if not drivers:
        return skipped("first mend topic")
    ends = seen.graph.commanded
    # a recorder, too, subscribes: it is no driver
    ends = [end for end in ends if end.node in drivers] or ends
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


def frames(seen: Evidence) -> Finding:
    """Pose and twist are in the controller's frames."""
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
    """All numbers are finite, and orientations are rotations about z."""
    if seen.errors:
        share = f"{len(seen.errors)} of {len(seen.arrivals)} messages"
        if "orientation" in seen.errors[0]:
            hint = "orientation is (0, 0, sin(θ/2), cos(θ/2)) of the heading θ in radians"
        else:
            hint = "do not publish what was not measured"
        return failed(f"{share}: {seen.errors[0]}", hint)
    return passed("all numbers are finite, and orientations turn about z")


def covariance(seen: Evidence) -> Finding:
    """Covariances are filled, and sound."""
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
