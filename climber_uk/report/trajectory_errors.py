"""Absolute and relative pose errors of a planar trajectory (Sturm et al. 2012).

    absolute: Qᵢ⁻¹ Pᵢ        relative: (Qᵢ⁻¹ Qⱼ)⁻¹ (Pᵢ⁻¹ Pⱼ)

P is the pose x [m], y [m], θ [rad], and Q the reference at the same time; doi
10.1109/IROS.2012.6385773. Of each error, its length and its angle, as evo has them.
"""

import numpy as np

from climber_uk.mechanics import Array, pack, unpack
from climber_uk.mechanics.elementary import wrapped
from climber_uk.mechanics.quantities import across, along

ROUNDING = 1e-9  # [s, m] by which a pair may fall short: stamps are nanoseconds


def absolute_errors(reference: Array, pose: Array) -> Array:
    """Distances [m] and angles [rad] (n, 2) between poses (n, 3) and their references (n, 3)."""
    return _sizes(pose - reference)


def relative_errors(reference: Array, pose: Array, progress: Array, delta: float) -> Array:
    """Drifts [m] and [rad] (k, 2) over k stretches of `delta`, each from where the last one ended.

    `progress` (n,) rises: the time [s], or the way gone [m]; `delta` is in its unit.
    """
    ends = [0]
    while (end := np.searchsorted(progress, progress[ends[-1]] + delta - ROUNDING)) < len(pose):
        ends.append(int(end))
    return _sizes(_moves(pose[ends]) - _moves(reference[ends]))


def _moves(pose: Array) -> Array:
    """From each pose to the next, (n - 1, 3), in the frame of the first."""
    heading, move = pose[:-1, 2], np.diff(pose, axis=0)
    return pack(along(heading, move), across(heading, move), move[:, 2])


def _sizes(error: Array) -> Array:
    x, y, angle = unpack(error)
    return pack(np.hypot(x, y), np.abs(wrapped(angle)))
