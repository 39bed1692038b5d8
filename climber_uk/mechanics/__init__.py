"""The mechanics of the climber and its paths: pure numerics, no ROS."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]


def unpack(array: Array) -> tuple[Any, ...]:
    """Components along the last axis: floats of one vector, arrays (...) of many.

    Arithmetic on floats is several times faster than on arrays without axes.
    """
    return tuple(array.tolist() if array.ndim == 1 else np.moveaxis(array, -1, 0))


def pack(*components: Array | float) -> Array:
    """Vector (..., n) of n components: the inverse of `unpack`."""
    if any(isinstance(component, np.ndarray) for component in components):
        return np.stack(np.broadcast_arrays(*components), axis=-1)
    return np.array(components)
