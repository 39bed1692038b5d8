"""A metric compared with a number, as users write it: rms_cross_track>0.01."""

import math
import operator
import re
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any, ClassVar, Self

OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "<=": operator.le,
    ">=": operator.ge,
    "<": operator.lt,
    ">": operator.gt,
    "==": operator.eq,
    "!=": operator.ne,
}
FORM = re.compile(r"\s*(\w+)\s*([<>=!]+)\s*(\S+)\s*")


@dataclass(frozen=True)
class MetricBound:
    """A metric's name, an operator and a finite number in SI units."""

    metric: str
    operator: str
    bound: float

    metrics: ClassVar[Collection[str]]  # names that there are

    @classmethod
    def read(cls, text: str) -> Self:
        """Bound of a text; raises `ValueError` saying what is wrong with it."""
        match = FORM.fullmatch(text)
        if match is None or match[2] not in OPERATORS:
            raise ValueError(f"{text!r} must be a metric, one of {' '.join(OPERATORS)}, a number")
        name, sign, number = match.groups()
        if name not in cls.metrics:
            raise ValueError(f"{text!r}: {name} is none of {', '.join(cls.metrics)}")
        try:
            bound = float(number)
        except ValueError:
            bound = math.nan
        if not math.isfinite(bound):  # with nan every comparison fails, so that nothing would
            raise ValueError(f"{text!r}: {number} must be a finite number")
        return cls(name, sign, bound)

    def holds(self, values: Any) -> Any:
        """Whether values of the metric (...) compare so, which nan does by != only."""
        return OPERATORS[self.operator](values, self.bound)
