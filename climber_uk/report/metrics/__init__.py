"""A run in numbers: `GROUPS` has all metrics, with their definitions."""

from climber_uk.report.metrics import effort, safety, timing, tracking, wall
from climber_uk.report.metrics.metric import NAN, Case, Metric, prefix

RUN = (
    Metric("duration", "s", "from the first odometry to the last", lambda c: float(c.run.time[-1])),
    Metric(
        "travelled",
        "m",
        "way of the centre, by the speed in the odometry, or by its poses if it has no twist, "
        "or one that contradicts them; straight over gaps in the recording",
        lambda case: case.run.travelled,
    ),
)
GROUPS: dict[str, tuple[Metric, ...]] = {
    "Run": RUN,
    "Tracking": tracking.METRICS,
    "Motors and constraint forces": effort.METRICS,
    "Hold on the wall": wall.METRICS,
    "Timing": timing.METRICS,
    "Safety": safety.METRICS,
}
METRICS = {metric.name: metric for group in GROUPS.values() for metric in group}


def evaluate(case: Case) -> dict[str, float]:
    """All metrics of a run, by their names, in SI units; nan for those that are unknown."""
    return {
        name: float(metric.of(case)) if metric.concerns(case) else NAN
        for name, metric in METRICS.items()
    }


__all__ = ["GROUPS", "METRICS", "Case", "Metric", "evaluate", "prefix"]
