"""Whether the controller followed, or had to give its safe output."""

import math
from collections.abc import Callable

from climber_uk.bags.events import ERROR, Event
from climber_uk.control.safety import Mode
from climber_uk.report.metrics.metric import NAN, Case, Metric

ARRIVED = 0.1  # [s] later than it was said, at most: of a line of the log only its arrival is known


def following(case: Case) -> float:
    """Share of the time of which the mode is known [%]."""
    spans = case.run.modes
    known = sum(end - begin for _, begin, end in spans)
    followed = sum(end - begin for m, begin, end in spans if m.text == Mode.FOLLOWING.value)
    return 100 * followed / known if known > 0 else NAN


def stops(case: Case) -> float:
    """Number of faults that began after the controller had followed, or while the run lasted.

    Faults before that belong to the start of the nodes, as does a missing simulated clock.
    """
    modes, count, followed = case.run.modes, 0, False
    for mode, begin, end in modes:
        followed = followed or mode.text == Mode.FOLLOWING.value
        is_starting = begin == end or _waits_for_clock(mode)
        count += mode.level == ERROR and (followed or not is_starting)
    return float(count) if modes else NAN


def errors(case: Case) -> float:
    """Number of changes of a node's state to ERROR, with those in force when the run began.

    A missing simulated clock does not count before the controller follows: that is the start.
    """
    if not case.run.is_diagnosed:
        return NAN
    states = [(time, event) for time, event in case.run.events if event.kind == "state"]
    at_begin = {event.node: event for time, event in states if time < 0}.values()
    is_start = is_start_of(case)
    within = [event for time, event in states if time >= 0 and not is_start(time, event)]
    begun = [event for event in at_begin if not _waits_for_clock(event)]
    return float(sum(event.level == ERROR for event in [*begun, *within]))


def is_start_of(case: Case) -> Callable[[float, Event], bool]:
    """Whether an event, at a time [s], is that the clock was waited for until it followed."""
    follows = [t for t, e in case.run.events if e.kind == "mode" and e.text == Mode.FOLLOWING.value]
    first = min(follows, default=math.inf)

    def is_start(time: float, event: Event) -> bool:
        arrived = ARRIVED if event.kind == "log" else 0.0
        return _waits_for_clock(event) and time <= first + arrived

    return is_start


def _waits_for_clock(event: Event) -> bool:
    return Mode.NO_CLOCK.value in event.text


METRICS = (
    Metric(
        "following",
        "%",
        "share of time in which the controller followed, by /diagnostics",
        following,
    ),
    Metric(
        "safety_stops",
        "",
        "how often the controller gave its safe output because of a fault, by /diagnostics; not "
        "as it starts up",
        stops,
    ),
    Metric(
        "errors",
        "",
        "how often a node came to be in the state ERROR, by /diagnostics; not as it starts up",
        errors,
    ),
)
