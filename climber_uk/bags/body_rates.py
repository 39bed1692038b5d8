"""Speeds of a body in its own frame, by its poses alone.

The step from a pose to the next is resolved along the heading midway between the two, which is
exact on an arc of a circle.
"""

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.quantities import across, along


def body_rates(time: Array, pose: Array, reach: float) -> Array:
    """Mean speeds (n, 3) forwards, to the left [m/s], and about z [rad/s] over ± `reach` [s].

    `time` (n,) [s] rises, `pose` (n, 3) is x [m], y [m], θ [rad] in the wall's frame. nan for a
    single pose.
    """
    if len(time) < 2:
        return np.full((len(time), 3), np.nan)
    heading = np.unwrap(pose[:, 2])
    step, midway = np.diff(pose[:, :2], axis=0), (heading[:-1] + heading[1:]) / 2
    distances = (np.cumsum(component(midway, step)) for component in (along, across))
    travelled = [*(np.concatenate([[0.0], distance]) for distance in distances), heading]
    first, last = np.maximum(time - reach, time[0]), np.minimum(time + reach, time[-1])
    moved = [np.interp(last, time, each) - np.interp(first, time, each) for each in travelled]
    return np.column_stack(moved) / (last - first)[:, None]
