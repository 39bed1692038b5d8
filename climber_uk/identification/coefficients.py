"""Parameters and their intervals, from the coefficients that were fitted.

a = (1/(m' r), μ/m', c/m', m/m' - 1)   b = (d/(J' r), C/J', D/J')   and by wheel angles  r  and  r/d

m' = m + 2 I/r² and J' = J + 2 I d²/r² with the inertia I of rotors, which have no weight.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from climber_uk.identification.identified import (
    DRIVE,
    HEADING,
    KNOWN,
    NAMES,
    NOTHING,
    OF_TURNING,
    ROTORS,
    WAY,
    YAW,
    Choice,
    Identified,
    Widths,
)
from climber_uk.identification.integral_equations import Equations
from climber_uk.identification.lateness import Columns
from climber_uk.identification.window_fit import WindowFit
from climber_uk.mechanics import Array
from climber_uk.mechanics.climber import Climber

FIRST = {DRIVE: 0, YAW: 4, WAY: 7, HEADING: 8}  # of the coefficients of each kind of equation
COULOMB, VISCOUS, LATE = 1, 2, 3  # columns of (11) and (15)
WEIGHTLESS = 4  # of (11)
QUANTILE = 0.975  # of intervals of 95 %
DOUBT = 0.5  # share by which an inertia that is taken as assumed may be off
SURE = 2.0  # half widths of its interval from zero, above which a friction is significant


class Given(NamedTuple):
    """What the motion does not tell."""

    track: float | None = None  # half track of the contacts [m]
    radius: float | None = None  # [m]
    rotors: float | None = None  # their inertia [kg m²]


NONE = Given()


def parameters(
    fits: Mapping[str, WindowFit], columns: Columns, climber: Climber, given: Given = NONE
) -> tuple[Array, Widths, Choice]:
    """Values (9,), half widths, and which were sought, from the fits by kind of equation.

    What is `given` is not taken from the wheel angles.
    """
    r, d = climber.wheel_radius, climber.half_track
    coefficients = np.array([np.nan, 0, 0, 0, np.nan, 0, 0, r, r / d])
    sought, chosen = np.zeros(len(NAMES), bool), {}
    for kind, fit in fits.items():
        chosen[kind] = [
            FIRST[kind] + (3 if column == WEIGHTLESS else column)
            for column in columns[kind]
            if column != LATE
        ]
        coefficients[chosen[kind]] = fit.coefficients[: len(chosen[kind])]
        sought[chosen[kind]] = True
    if not sought[NAMES.index(ROTORS)]:
        given = given._replace(rotors=climber.rotor_inertia)
    values, slopes = _parameters(coefficients, given), _slopes(coefficients, given)
    squares, white, bias = [], np.zeros(len(NAMES)), np.zeros(len(NAMES))
    freedom = np.full(len(NAMES), np.inf)  # windows more than coefficients
    for kind, fit in fits.items():
        own = np.zeros((len(NAMES), fit.design.shape[1]))
        own[:, : len(chosen[kind])] = slopes[:, chosen[kind]]
        count, spare = len(fit.ends), max(1, len(fit.ends) - fit.design.shape[1])
        freedom = np.where(own.any(axis=1), np.minimum(freedom, spare), freedom)
        squares.append((count - 1) / count * (fit.changes @ own.T) ** 2)
        white += np.einsum("pi,ij,pj->p", own, fit.covariance, own)
        bias += fit.bias(own)
    spread = _interval(np.concatenate(squares), freedom)
    widths = spread, stdtrit(freedom, QUANTILE) * np.sqrt(white), bias
    known = np.isfinite(values)
    return values, Widths(*(np.where(known, width, np.inf) for width in widths)), sought


def resisted(equations: Sequence[Equations], climber: Climber, noise: Array) -> tuple[float, float]:
    """Moment [N m] that resists turning, and its half width, with the inertia of `climber`.

    Where that moment is most of what motors give, it hides the inertia, which then hardly matters:
    its half width contains what `DOUBT` of it would make. Its yaw rates are those of `equations`.
    """
    found = []
    for inertia in (climber.driven_inertia, (1 + DOUBT) * climber.driven_inertia):
        turned = climber.half_track / (inertia * climber.wheel_radius)
        left = [one._replace(target=one.target - turned * one.design[:, 0]) for one in equations]
        fit = WindowFit.of(left, (COULOMB,), noise)
        found.append(inertia * float(fit.coefficients[0]))
    spread = float(stdtrit(len(fit.ends) - 1, QUANTILE)) * fit.deviation(0)
    half_width = inertia * (spread + float(fit.bias(np.eye(1))[0])) + abs(found[1] - found[0])
    return found[0], half_width


def with_scrub(found: Identified, columns: Columns, climber: Climber, slips: bool) -> Identified:
    """The same, corrected where wheels scrub, or may: their angles show too wide a track.

    Inertia and moments need the track of the contacts: that of `climber` is taken, and its
    difference from the one that the angles show is added to their intervals. Where the wheels'
    way does not fit that of the odometry, it `slips`: angles show no radius then, and that of
    `climber` is taken for all that is made of torques.
    """
    number = NAMES.index("turning_friction")
    moment, half_width = found.resisted
    scrubs = found.values[number] > SURE * found.half_widths[number] or moment > SURE * half_width
    is_told = YAW in found.fits and found.uncertainty[number] <= KNOWN
    if HEADING not in found.fits or (is_told and not scrubs):
        return found
    track, effective = climber.half_track, found["half_track"]
    given = Given(track, climber.wheel_radius if slips else None)
    values, widths, _ = parameters(found.fits, columns, climber, given)
    effective = float(values[-1])
    known = np.isin(NAMES, OF_TURNING) & np.isfinite(values) & np.isfinite(effective)
    bias = widths.bias.copy()
    bias[known] += abs(effective / track - 1) * np.abs(values[known])
    wider = widths._replace(bias=bias)
    return replace(found, values=values, widths=wider, has_effective_track=True, slips=slips)


def _parameters(coefficients: Array, given: Given) -> Array:
    """Parameters (9,) of coefficients (9,)."""
    a_1, a_2, a_3, a_4, b_1, b_2, b_3, r, per_track = coefficients
    with np.errstate(all="ignore"):  # what was not fitted is not finite
        lever = given.radius or r
        d = lever / per_track
        track = given.track or d
        m, J = 1 / (lever * a_1), track / (lever * b_1)  # with rotors
        inertia = -a_4 * m * lever**2 / 2 if given.rotors is None else given.rotors
        rotors = 2 * inertia / lever**2  # [kg] at the rims
        own = m - rotors, J - rotors * track**2
        return np.array([own[0], a_2 * m, a_3 * m, inertia, own[1], b_2 * J, b_3 * J, r, d])


def _slopes(coefficients: Array, given: Given) -> Array:
    """Derivatives of the parameters by the coefficients (9, 9); exact, by a complex step."""
    step = 1e-20
    moved = [coefficients + 1j * step * unit for unit in np.eye(len(NAMES))]
    found = [_parameters(each, given) for each in moved]
    slopes = np.stack(found, axis=1).imag / step
    return np.where(np.isfinite(slopes), slopes, 0.0)


def _interval(squares: Array, most: Array) -> Array:
    """Half widths (p,) of 95 % intervals, from squares (n, p) that sum up to variances.

    By Student's t. Its degrees of freedom, at most `most` (p,), are those of normal numbers each
    with a variance of its own, for which E x⁴ = 3 (E x²)².
    """
    variance = squares.sum(axis=0)
    ratio = variance**2 / np.maximum((squares**2).sum(axis=0), NOTHING)
    freedom = np.clip(3 * ratio - 2, 1, most)
    return stdtrit(freedom, QUANTILE) * np.sqrt(variance)
