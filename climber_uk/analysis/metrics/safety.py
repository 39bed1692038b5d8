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
    """How often a fault began."""
    modes = case.run.modes
    return float(sum(mode.level == ERROR for mode, _, _ in modes)) if modes else NAN


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
        "how often the controller gave its safe output because of a fault, by /diagnostics",
        stops,
    ),
    Metric("errors", "", "how often a node came to be in the state ERROR, by /diagnostics", errors),
)
