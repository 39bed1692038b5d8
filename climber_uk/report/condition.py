"""Conditions such as rms_cross_track>0.01; if one holds, a run has failed."""

import math
from dataclasses import dataclass

from climber_uk.report.comparison import OPERATORS, parse
from climber_uk.report.metrics import METRICS
from climber_uk.report.tables import Column


@dataclass(frozen=True)
class Condition:
    """A metric's name, a comparison and a number in SI units."""

    name: str
    comparison: str
    bound: float

    @classmethod
    def parse(cls, text: str) -> "Condition":
        """Condition of a text; raises `ValueError` saying what is wrong with it."""
        return cls(*parse(text, METRICS))

    def failure(self, column: Column) -> str:
        """What failed, in words, or ''; a metric that is not known has failed."""
        value = column.values[self.name]
        if math.isnan(value):
            return f"{column.label}: {self.name} is not known from what was recorded"
        if not OPERATORS[self.comparison](value, self.bound):
            return ""
        return f"{column.label}: {self.name} is {value:g} {self.comparison} {self.bound:g}"
