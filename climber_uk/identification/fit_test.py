"""The test of fit: what the equations do not explain, how much it is, and what it goes with.

`Misfit` is the test. What is beyond noise is correlated, window by window, with quantities that may
explain it, after what the equations can explain themselves has been projected out of both.
"""

from collections.abc import Iterator

import numpy as np

from climber_uk.identification.identified import (
    DRIVE,
    HEADING,
    NOTHING,
    WAY,
    WEIGHT,
    YAW,
    Identified,
    Lack,
)
from climber_uk.identification.recorded_motion import RecordedMotion
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber

ROUNDING = 1e-9
LEAST_SHARE = 0.3  # of the misfits' squares, below which a quantity does not explain them


def lacks(found: Identified, motion: RecordedMotion, climber: Climber) -> Iterator[Lack]:
    """Test each kind of equations; masses that were not found are those of `climber`."""
    extent = found.extent
    scales = {
        DRIVE: (_found(found, "mass", climber.mass), extent.force),
        YAW: (_found(found, "yaw_inertia", climber.yaw_inertia), extent.moment),
        WAY: (1.0, extent.speed),
        HEADING: (1.0, extent.yaw_rate),
    }
    for kind, fit in found.fits.items():
        scale, whole = scales[kind]
        size = scale * float(np.hypot(*fit.misfit.excess))
        goes_with = _explained(found, kind, motion) if size > 0 else ""
        share = size / max(whole, NOTHING)
        yield Lack(kind, fit.misfit.ratio, size, share, goes_with)


def _found(found: Identified, name: str, otherwise: float) -> float:
    return found[name] if found[name] > found.half_width(name) else otherwise


def _explained(found: Identified, kind: str, motion: RecordedMotion) -> str:
    """Name of the quantity that explains most of the misfits; '' if none does."""
    windows = found.windows[kind]
    x, y, heading = motion.pose.T
    speed, yaw_rate = motion.smooth_rates.T
    quantities = {
        WEIGHT[0]: np.cos(heading),
        WEIGHT[1]: (y - y.mean()) * np.sin(heading),
        "the place": x,
        "the yaw rate": np.abs(yaw_rate),
        "the speed": np.abs(speed),
        "the side it turns to": np.sign(yaw_rate) if kind == DRIVE else np.ones_like(yaw_rate),
        "the time": motion.time,
    }
    means = {name: np.array([q[w].mean() for w in windows]) for name, q in quantities.items()}
    side = 1.0 if kind == DRIVE else -1.0
    own, torques = (speed if kind == DRIVE else yaw_rate), motion.torques @ [1.0, side]
    known = np.array([[own[w].mean(), np.sign(own[w].mean()), torques[w].mean()] for w in windows])
    misfits = found.fits[kind].misfit.found[:, 0]
    shares = {name: _explained_share(misfits, mean, known) for name, mean in means.items()}
    best = max(shares, key=shares.__getitem__)
    return best if shares[best] > LEAST_SHARE else ""


def _explained_share(values: Array, other: Array, known: Array) -> float:
    """Share of the squares of `values` (n,) that `other` (n,) explains beyond `known` (n, k)."""
    both = np.column_stack([values, other])
    values, left = (both - known @ np.linalg.lstsq(known, both, rcond=None)[0]).T
    if left @ left <= ROUNDING * (other @ other):
        return 0.0
    return float((values @ left) ** 2 / max(values @ values * (left @ left), NOTHING))
