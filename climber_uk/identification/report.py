"""The result of an identification as a table, as remarks and as parameters of the nodes."""

from collections.abc import Iterator
from typing import Any

from climber_uk.identification.identified import IN_TIME, NAMES, ROTORS, UNITS, Identified
from climber_uk.identification.integral_equations import Site
from climber_uk.mechanics.climber import Climber
from climber_uk.messages.topics import CONTROLLER, PLANT
from climber_uk.report.tables import markdown

COLUMNS = ("parameter", "estimate", "± 95 %", "unit", "nodes now", "")
EFFECTIVE = "effective_half_track"  # that the wheels show while they scrub
MOMENT = "turning_moment"  # friction and viscous resistance together, at the bag's yaw rates
COULOMB = "seal_friction_coefficient"
WITHOUT_SEAL = {COULOMB: ("rolling_friction", "N")}  # what that coefficient is then
ADVICE = {
    (
        "mass",
        COULOMB,
        ROTORS,
    ): "drive up, down and across the wall; on a floor, change speed",
    ("yaw_inertia",): "drive bends to both sides",
    ("wheel_radius", "half_track"): "drive further, and turn",
}
DIGITS = 6  # of a parameter that is written


def label_of(name: str, site: Site) -> tuple[str, str]:
    """Name and unit of a parameter on this site: without a seal, that of rolling friction."""
    return (name, UNITS[name]) if site.has_seal else WITHOUT_SEAL.get(name, (name, UNITS[name]))


def rows(found: Identified, assumed: Climber) -> Iterator[dict[str, Any]]:
    """Row of each parameter, as in the JSON file; a reason in place of an undetermined value.

    Rotors have one only where some show.
    """
    columns = zip(NAMES, found.values, found.half_widths, found.sought, strict=True)
    for name, value, half_width, sought in columns:
        if name == ROTORS and not sought:
            continue
        label, unit = label_of(name, found.site)
        reason = found.reasons.get(name)
        row = {
            "parameter": label,
            "estimate": None if reason else float(value),
            "half_width": None if reason else float(half_width),
            "unit": unit,
            "nodes_now": float(getattr(assumed, label, 0.0)),
            "known": reason is None,
            "cause": reason and reason.cause,
            "reason": reason and reason.words,
            "model_fits": all(lack.fits for lack in found.lacks),
        }
        yield row
        if name == "half_track" and found.tells_effective_track:
            yield {**row, **_told(value, half_width), "parameter": EFFECTIVE}
        if name == "turning_resistance" and found.tells_resisted:
            yield {**row, **_told(*found.resisted), "parameter": MOMENT, "unit": "N m"}


def _told(value: float, half_width: float) -> dict[str, Any]:
    numbers = {"estimate": float(value), "half_width": float(half_width)}
    return {**numbers, "known": True, "cause": None, "reason": None}


def table(found: Identified, assumed: Climber) -> str:
    """The rows as a Markdown table."""
    cells = []
    for row in rows(found, assumed):
        digits = {"estimate": 5, "half_width": 2, "nodes_now": 5}
        numbers = [("" if row[key] is None else f"{row[key]:.{n}g}") for key, n in digits.items()]
        why = f"cannot be told: {row['reason']}" if row["reason"] else ""
        cells.append((row["parameter"], *numbers[:2], row["unit"], numbers[2], why))
    return markdown(COLUMNS, cells)


def remarks(found: Identified) -> Iterator[str]:
    """Sentences on the fit: windows, test of fit, delay, and what the parameters mean."""
    windows, extent = len(found.windows["drive"]), found.extent
    rubs = "the seal rubs" if found.site.has_seal else "rolling is resisted"
    rubs += f" with {found.friction:.4g} N at {extent.speed:.3g} m/s"
    yield f"{windows} windows in motion; {rubs}"
    if found.left_out:
        yield f"{found.left_out} windows more that fit much worse than these were left out"
    ratios = ", ".join(f"{lack.kind} {lack.ratio:.3g}" for lack in found.lacks)
    yield f"test of fit, χ² by the number of windows, about 1 for a model that fits: {ratios}"
    for lack in found.lacks:
        if not lack.fits:
            yield f"the model does not fit: {lack.words}; intervals are as much wider"
    if found.late != IN_TIME:
        delay, lag = (1e3 * late for late in found.late)
        yield f"torques act {delay:.2g} ms later than assumed, and with a lag of {lag:.2g} ms"
    if "viscous_friction" in found.reasons:
        other = "the seal's" if found.site.has_seal else "rolling friction"
        yield f"viscous friction cannot be told apart from {other}: drive at different speeds"
    elif found.is_clear("viscous_friction") and found.site.has_seal:
        yield "the controller knows no viscous friction: it gets that of this speed as the seal's"
    is_clear = found.is_clear("turning_friction") or found.is_clear("turning_resistance")
    if found.tells_resisted or is_clear:
        whole = found.resisted[0] if found.tells_resisted else found.turning_moment
        moment = f"{whole:.3g} N m at {extent.yaw_rate:.3g} rad/s"
        yield f"turning is resisted, by {moment}: it is left to the controller's observer"
    if found.has_effective_track:
        yield "inertia and what resists turning are those of the nodes' half track"
    if "wheel_radius" in found.reasons:
        yield f"radius and track are taken as they are: {found.reasons['wheel_radius'].words}"
    else:
        yield "radius and track are those of odometry that does not come from the wheels itself"


def missing(found: Identified) -> Iterator[str]:
    """Sentences on parameters that are not determined, and how to drive so that they are."""
    for group, advice in ADVICE.items():
        reasons = {name: found.reasons[name] for name in group if name in found.reasons}
        causes = {
            name: reason.cause for name, reason in reasons.items() if reason.cause != "absent"
        }
        if not causes:
            continue
        labels = [label_of(name, found.site)[0].replace("_", " ") for name in causes]
        apart = " apart" if len(labels) > 1 and "collinear" in causes.values() else ""
        begin = f"{' and '.join(labels)} cannot be told{apart} from this bag: "
        if set(causes.values()) <= {"misfit", "torques"}:
            yield begin + next(reasons[name].words for name in causes)
        else:
            yield f"{begin}{advice} (see --plan)"


def changes(found: Identified, assumed: Climber) -> dict[str, dict[str, Any]]:
    """Parameters to change, by node: those that are determined."""
    known = {row["parameter"]: row["estimate"] for row in rows(found, assumed) if row["known"]}
    climber = {name: value for name, value in known.items() if hasattr(assumed, name)}
    controller, plant = dict(climber), dict(climber)
    if found.site.has_seal and _friction_is_known(found):
        controller[COULOMB] = max(0.0, found.friction / found.extent.load)
        plant |= _law(found, controller[COULOMB])
    if EFFECTIVE in known:
        plant[EFFECTIVE] = known[EFFECTIVE]  # of odometry that is made of the wheels
    return {CONTROLLER: _rounded(controller), PLANT: _rounded(plant)}


def _friction_is_known(found: Identified) -> bool:
    """Whether the sum of Coulomb and viscous friction is determined."""
    reasons = [found.reasons.get(name) for name in (COULOMB, "viscous_friction")]
    return all(reason is None or reason.cause == "absent" for reason in reasons)


def _law(found: Identified, whole: float) -> dict[str, Any]:
    """Parameters of the plant's friction law; `whole` is the controller's coefficient."""
    viscous, load = found["viscous_friction"], found.extent.load
    coulomb = found[COULOMB] * load
    apart = not {COULOMB, "viscous_friction"} & set(found.reasons)
    if apart and viscous > 0 and found.is_clear("viscous_friction"):
        law = {"ratio": 1.0, "viscous": viscous / coulomb}
        return {"friction": "stribeck", **{f"stribeck.{name}": v for name, v in law.items()}}
    return {"friction": "coulomb", COULOMB: whole}


def _rounded(values: dict[str, Any]) -> dict[str, Any]:
    return {k: v if isinstance(v, str) else float(f"{v:.{DIGITS}g}") for k, v in values.items()}
