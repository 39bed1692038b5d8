"""Whether the controller followed, or had to give its safe output."""

from climber_uk.analysis.events import ERROR
from climber_uk.analysis.metrics.metric import NAN, Case, Metric
from climber_uk.control.safety import Mode


def following(case: Case) -> float:
    """Share of the time of which the mode is known [%]."""
    spans = case.run.modes
    known = sum(end - begin for _, begin, end in spans)
    followed = sum(end - begin for m, begin, end in spans if m.text == Mode.FOLLOWING.value)
    return 100 * followed / known if known > 0 else NAN


def stops(case: Case) -> float:
    """How often a fault began, once it had followed or in the time of the run.

    Before that it is how nodes start up, and so is a simulated clock that is not there yet.
    """
    modes, count, followed = case.run.modes, 0, False
    for mode, begin, end in modes:
        followed = followed or mode.text == Mode.FOLLOWING.value
        is_starting = begin == end or mode.text == Mode.NO_CLOCK.value
        count += mode.level == ERROR and (followed or not is_starting)
    return float(count) if modes else NAN


def errors(case: Case) -> float:
    """How often a node came to say ERROR."""
    if not case.run.is_diagnosed:
        return NAN
    return float(sum(e.kind == "state" and e.level == ERROR for _, e in case.run.events))


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
    Metric("errors", "", "how often a node came to be in the state ERROR, by /diagnostics", errors),
)
