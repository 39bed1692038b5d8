"""Conditions such as rms_cross_track>0.01; if one holds, a run has failed."""

import math

from climber_uk.report.comparison import MetricBound
from climber_uk.report.metrics import METRICS
from climber_uk.report.tables import Column


class Condition(MetricBound):
    """A comparison by which a run fails."""

    metrics = METRICS

    def failure(self, column: Column) -> str:
        """What failed, in words, or ''; a metric that is not known has failed."""
        value = column.values[self.metric]
        if math.isnan(value):
            return f"{column.label}: {self.metric} is not known from what was recorded"
        if not self.holds(value):
            return ""
        return f"{column.label}: {self.metric} is {value:g} {self.operator} {self.bound:g}"
