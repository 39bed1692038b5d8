"""Elementary functions of one number or of many: floats stay floats.

numpy's functions turn a float into a numpy scalar, and arithmetic on those takes three times as
long. So one formula serves a controller's tick and a batch of a million.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from climber_uk.mechanics import Array


def _either(of_float: Callable[[float], float], of_array: Callable[[Array], Array]) -> Any:
    return lambda x: of_float(x) if isinstance(x, float) else of_array(x)


cos = _either(math.cos, np.cos)
sin = _either(math.sin, np.sin)
arctan = _either(math.atan, np.arctan)
tanh = _either(math.tanh, np.tanh)
sqrt = _either(math.sqrt, np.sqrt)
exp = _either(math.exp, np.exp)
sign = _either(lambda x: float((x > 0) - (x < 0)), np.sign)


def wrapped(angle: Any) -> Any:
    """The same angle in [-π, π)."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


def clipped(value: Any, lowest: Any, highest: Any) -> Any:
    """`value` within its bounds; `highest` if they contradict each other."""
    if isinstance(value, float):
        return min(max(value, lowest), highest)
    return np.clip(value, lowest, highest)


def select(condition: Any, this: Any, that: Any) -> Any:
    """`this` where `condition` holds, else `that`."""
    if isinstance(condition, bool | np.bool):
        return this if condition else that
    return np.where(condition, this, that)
