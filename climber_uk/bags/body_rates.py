"""How fast a body moves in its own frame, by its poses alone.

Each step between two poses is turned by the heading midway, which is exact on an arc of a circle.
"""

import numpy as np

from climber_uk.mechanics import Array
from climber_uk.mechanics.quantities import across, along


def body_rates(time: Array, pose: Array, reach: float) -> Array:
    """Rates (n, 3) forwards, to the left [m/s], about z [rad/s], over ± `reach` [s].

    `time` (n,) [s] rises, `pose` (n, 3) is x [m], y [m], θ [rad]; nan if there is one only.
    """
    if len(time) < 2:
        return np.full((len(time), 3), np.nan)
    turn = np.unwrap(pose[:, 2])
    step, midway = np.diff(pose[:, :2], axis=0), (turn[:-1] + turn[1:]) / 2
    ways = (np.cumsum(part(midway, step)) for part in (along, across))
    gone = [*(np.concatenate([[0.0], way]) for way in ways), turn]
    first, last = np.maximum(time - reach, time[0]), np.minimum(time + reach, time[-1])
    moved = [np.interp(last, time, way) - np.interp(first, time, way) for way in gone]
    return np.column_stack(moved) / (last - first)[:, None]
