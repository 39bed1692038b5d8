"""Conditions such as rms_cross_track>0.01, under which a run has failed."""

import math
import operator
import re
from collections.abc import Callable
from dataclasses import dataclass

from climber_uk.report.metrics import METRICS
from climber_uk.report.tables import Column

COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "<=": operator.le,
    ">=": operator.ge,
    "<": operator.lt,
    ">": operator.gt,
    "==": operator.eq,
    "!=": operator.ne,
}
FORM = re.compile(rf"\s*(\w+)\s*({'|'.join(COMPARISONS)})\s*(\S+)\s*")


@dataclass(frozen=True)
class Condition:
    """A metric's name, a comparison and a number in SI units."""

    name: str
    comparison: str
    bound: float

    @classmethod
    def parse(cls, text: str) -> "Condition":
        """Condition as it is written; raises `ValueError` with what is wrong."""
        if (match := FORM.fullmatch(text)) is None:
            raise ValueError(f"{text!r} must be a metric, one of {' '.join(COMPARISONS)}, a number")
        name, comparison, bound = match.groups()
        if name not in METRICS:
            raise ValueError(f"{text!r}: {name} is none of {', '.join(METRICS)}")
        try:
            number = float(bound)
        except ValueError:
            number = math.nan
        if math.isnan(number):  # with which every comparison fails, so that nothing would
            raise ValueError(f"{text!r}: {bound} must be a number")
        return cls(name, comparison, number)

    def failure(self, column: Column) -> str:
        """What failed, or ''; a metric that is not known has failed."""
        value = column.values[self.name]
        if math.isnan(value):
            return f"{column.label}: {self.name} is not known from what was recorded"
        if not COMPARISONS[self.comparison](value, self.bound):
            return ""
        return f"{column.label}: {self.name} is {value:g} {self.comparison} {self.bound:g}"
