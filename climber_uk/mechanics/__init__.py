"""The mechanics of the climber and its paths: pure numerics, no ROS.

The climber: `quantities` (what is told of it), `climber` (its equations), `adhesion`, `friction`,
`contact`, `wall`; `udwadia_kalaba` for any system. Its path: `shapes`, or `waypoints` of a file
(`waypoint_file`, `rounding`, `slowing`), or `lanes` over an `area`, by `time_laws`
(`fastest_law`) is a `trajectory` (from parameters: `trajectory_parameters`; in numbers:
`summary`). Its points are each a `reference`, which asks a `demand` of the wheels, and sent ahead a
`preview`.
Arithmetic of one number or of many: `elementary`, `many`; see docs/architecture.md for its rules.
"""

from typing import Any

import numpy as np

# NDArray of numpy.typing, written out: numpy does not import that module itself, nor do nodes
Array = np.ndarray[tuple[Any, ...], np.dtype[np.floating[Any]]]
Stamps = np.ndarray[tuple[Any, ...], np.dtype[np.int64]]  # [ns]
SECOND = 1_000_000_000  # [ns]


def namespace(array: Any) -> Any:
    """The library of an array: numpy, also of a number; else what has the same functions (JAX)."""
    if isinstance(array, np.ndarray):
        return np
    return getattr(array, "__array_namespace__", lambda: np)()


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


def transpose(matrix: Array) -> Array:
    """Matrices (..., m, n) as (..., n, m)."""
    return matrix.swapaxes(-1, -2)


def times(matrix: Array, vector: Array) -> Array:
    """Matrices (..., m, n) times vectors (..., n)."""
    return (matrix @ vector[..., None])[..., 0]


def cross(u: Array, v: Array) -> Array:
    """Cross products (...) of vectors (..., 2)."""
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def solve(matrix: Array, vector: Array) -> Array:
    """Solutions (..., n) of matrices (..., n, n) for right-hand sides (..., n)."""
    return np.linalg.solve(matrix, vector[..., None])[..., 0]
