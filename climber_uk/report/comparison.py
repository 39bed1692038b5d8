"""A metric compared with a number, as users write it: rms_cross_track>0.01."""

import math
import operator
import re
from collections.abc import Callable, Collection
from typing import Any

OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "<=": operator.le,
    ">=": operator.ge,
    "<": operator.lt,
    ">": operator.gt,
    "==": operator.eq,
    "!=": operator.ne,
}
FORM = re.compile(r"\s*(\w+)\s*([<>=!]+)\s*(\S+)\s*")


def parse(text: str, metrics: Collection[str]) -> tuple[str, str, float]:
    """Name of a metric, operator and bound; raises `ValueError` saying what is wrong."""
    match = FORM.fullmatch(text)
    if match is None or match[2] not in OPERATORS:
        raise ValueError(f"{text!r} must be a metric, one of {' '.join(OPERATORS)}, a number")
    name, sign, number = match.groups()
    if name not in metrics:
        raise ValueError(f"{text!r}: {name} is none of {', '.join(metrics)}")
    try:
        bound = float(number)
    except ValueError:
        bound = math.nan
    if not math.isfinite(bound):  # with nan every comparison fails, so that nothing would
        raise ValueError(f"{text!r}: {number} must be a finite number")
    return name, sign, bound
