"""Which parameters a motion does not determine, and why.

A parameter is determined if its interval is narrow and its value physically possible. If not, the
widest part of its interval says why: a model error, another parameter that it is collinear with,
noise, or too little excitation.
"""

from collections.abc import Iterator

import numpy as np

from climber_uk.identification.coefficients import FIRST
from climber_uk.identification.identified import (
    DRIVE,
    HEADING,
    KNOWN,
    NAMES,
    OF_TURNING,
    ROTORS,
    UNITS,
    WAY,
    WEIGHT,
    YAW,
    Identified,
    Reason,
)
from climber_uk.identification.integral_equations import Cut
from climber_uk.identification.recorded_motion import RecordedMotion
from climber_uk.mechanics.climber import Climber

TOGETHER = 0.95  # correlation above which two parameters are collinear
SURE = 2.0  # half widths of its interval below zero, above which a value is surely negative
NOISY = 3.0  # times the usual noise: 10 mm/s, 1 mm, 10 mrad/s, 1 mrad
USUAL = 1e-2  # [m/s], [rad/s]
SAME = 1e-5  # [m], [rad] and of a value: odometry that agrees so well is made of the wheel angles
MUCH = 0.05  # share of the drive that is unexplained, above which no parameter is determined
OFF = 0.2  # difference of the torques at the wheels from those commanded, above which none is
# of the speed: least difference of speeds that tells viscous friction from Coulomb's where wheels
# scrub. What they drive is off by some percent between straights and bends, for which less will do
SCRUBBED = 0.2
OF_DRIVING = ("mass", "seal_friction_coefficient", "viscous_friction")
OF_WHEELS = ("wheel_radius", "half_track")
OF_TORQUES = (*OF_DRIVING, ROTORS, *OF_TURNING)
OF_KIND = {
    DRIVE: (*OF_DRIVING, ROTORS),
    YAW: OF_TURNING,
    WAY: ("wheel_radius",),
    HEADING: ("half_track",),
}


def reasons(
    found: Identified, motion: RecordedMotion, climber: Climber, cut: Cut
) -> dict[str, Reason]:
    """Why each parameter is not determined, by name, of those that are not."""
    why = dict(_lacking(found)) | dict(_wide(found)) | dict(_absent(found, cut))
    why |= dict(_lumped(found))
    if motion.wheel_angles is not None:
        why |= dict(_made_of_wheels(found, climber))
    if abs(motion.torque_ratio - 1) > OFF:
        words = f"torques in joint_states are {motion.torque_ratio:.2g} times those commanded"
        why |= {name: Reason("torques", words) for name in OF_TORQUES}
    return why


def _lacking(found: Identified) -> Iterator[tuple[str, Reason]]:
    """Parameters of equations that do not fit, and the mass if the weight is not as assumed."""
    for lack in found.lacks:
        if lack.share > MUCH:
            words = f"the model does not fit: {lack.words}"
            yield from ((name, Reason("misfit", words)) for name in OF_KIND[lack.kind])
        elif lack.kind == DRIVE and lack.goes_with in WEIGHT and not lack.fits:
            yield "mass", Reason("misfit", f"the weight is not as assumed: {lack.words}")


def _wide(found: Identified) -> Iterator[tuple[str, Reason]]:
    """Parameters with too wide an interval, or with a value that is not possible."""
    columns = zip(NAMES, found.values, found.uncertainty, found.sought, strict=True)
    for name, value, share, sought in columns:
        if sought and not share <= KNOWN:
            yield name, _why(found, name)
        elif sought and _is_surely_negative(found, name):
            words = f"the model does not fit: it would be {value:.3g} {UNITS[name]}".rstrip()
            yield name, Reason("misfit", words)


def _why(found: Identified, name: str) -> Reason:
    """What makes a parameter's interval wide."""
    number, widths = NAMES.index(name), found.widths
    shown = f"{found[name]:.3g} ± {found.half_width(name):.2g} is all that shows"
    if widths.bias[number] > np.maximum(widths.spread, widths.white)[number]:
        return Reason("misfit", f"the model does not fit: {shown}")
    kind = max((kind for kind in found.fits if FIRST[kind] <= number), key=FIRST.__getitem__)
    fit, names = found.fits[kind], NAMES[FIRST[kind] : FIRST[kind] + len(OF_KIND[kind])]
    names = tuple(each for each in names if found.sought[NAMES.index(each)])
    own = names.index(name)
    scale = np.sqrt(np.diagonal(fit.covariance))
    goes_with = np.abs(fit.covariance[own] / (scale[own] * scale))
    goes_with[own] = 0.0
    other = int(np.argmax(goes_with))
    if goes_with[other] > TOGETHER:
        partner = (*names, "the delay of torques")[other].replace("_", " ")
        return Reason("collinear", f"not apart from {partner}: {shown}")
    if fit.noise[0] > NOISY * USUAL * (1.0 if len(fit.noise) > 1 else 0.1):
        return Reason("noise", f"odometry is noisy: {shown}")
    return Reason("not excited", f"the motion hardly shows it: {shown}")


def _absent(found: Identified, cut: Cut) -> Iterator[tuple[str, Reason]]:
    """Parameters that were not fitted, or not apart from another one."""
    if YAW not in found.fits:
        windows = f"{len(found.windows[YAW])} windows of {cut.window:g} s"
        words = f"it turns one way at more than {cut.least_yaw_rate:g} rad/s in only {windows}"
        yield from ((name, Reason("not excited", words)) for name in OF_TURNING)
    elif not found.sought[NAMES.index("turning_resistance")]:
        together = f"{found.turning_moment:.3g} N m at {found.extent.yaw_rate:.3g} rad/s"
        words = f"yaw rates hardly differ: together {together}"
        yield "turning_resistance", Reason("absent", words)
        yield "turning_friction", Reason("absent", words)
    if not found.sought[NAMES.index(ROTORS)]:
        yield (
            ROTORS,
            Reason("absent", "none shows beside the mass"),
        )
    if not found.sought[NAMES.index("viscous_friction")]:
        together = f"{found.friction:.3g} N at {found.extent.speed:.3g} m/s"
        words = f"speeds hardly differ: together {together}"
        yield "viscous_friction", Reason("absent", words)
        if found.uncertainty[1] <= KNOWN:
            yield "seal_friction_coefficient", Reason("absent", words)
    if WAY not in found.fits:
        words = "joint_states has no wheel angles"
        yield from ((name, Reason("absent", words)) for name in OF_WHEELS)
    elif found.has_effective_track and found.uncertainty[-1] <= KNOWN:
        is_clear = found.is_clear("turning_friction") or found.resisted[0] > found.resisted[1]
        scrub = "wheels scrub" if is_clear else "wheels may scrub"
        words = f"{scrub}: their angles show an effective one of {found['half_track']:.4g} m"
        yield "half_track", Reason("absent", words)
        if found.slips:
            words = (
                f"wheels slip: their angles show an effective one of {found['wheel_radius']:.4g} m"
            )
            yield "wheel_radius", Reason("absent", words)


def _lumped(found: Identified) -> Iterator[tuple[str, Reason]]:
    """Frictions of which only the sum is determined, as they are not Coulomb's and viscous."""
    groups = (
        (DRIVE, OF_DRIVING[1:], "speed", f"{found.friction:.3g} N"),
        (YAW, OF_TURNING[1:], "yaw rate", f"{found.turning_moment:.3g} N m"),
    )
    lacking = {lack.kind for lack in found.lacks if lack.size > 0}
    extent, scrubs = found.extent, found.resisted[0] > found.resisted[1]
    if scrubs and extent.speed_spread < SCRUBBED * extent.speed:
        words = f"speeds hardly differ, of wheels that scrub: together {found.friction:.3g} N"
        yield from ((name, Reason("absent", words)) for name in OF_DRIVING[1:])
    for kind, (coulomb, viscous), rate, together in groups:
        falls = found[viscous] < 0 and found.is_clear(viscous) and kind in lacking
        if falls or _is_surely_negative(found, viscous):
            words = f"it falls with the {rate}, as neither does; {together} in this motion"
            yield from ((name, Reason("misfit", words)) for name in (coulomb, viscous))
        elif kind == DRIVE and found.is_clear(viscous) and not found.is_clear(coulomb):
            words = f"friction grows with the {rate} from nothing on; {together} in this motion"
            yield coulomb, Reason("absent", words)


def _made_of_wheels(found: Identified, climber: Climber) -> Iterator[tuple[str, Reason]]:
    """Radius and track of odometry that follows the wheels to the last digit."""
    left = [found.fits[kind].residuals * found.fits[kind].noise[0] for kind in (WAY, HEADING)]
    values = [found[name] / getattr(climber, name) - 1 for name in OF_WHEELS]
    agrees = all(np.sqrt(np.mean(one**2)) < SAME for one in left)
    if agrees and found.sought[-1] and np.abs(values).max() < SAME:
        words = "odometry follows the wheel angles with the values of the nodes: made of them?"
        yield from ((name, Reason("absent", words)) for name in OF_WHEELS)


def _is_surely_negative(found: Identified, name: str) -> bool:
    return -found[name] > SURE * found.half_width(name)
