"""What was identified, in words, numbers and parameters of the nodes."""

from collections.abc import Iterator
from typing import Any

from climber_uk.analysis.identification import NAMES, UNITS, Identified
from climber_uk.analysis.paper.table import markdown
from climber_uk.mechanics.climber import Climber

CONTROLLER, PLANT = "uk_torque_controller", "plant_simulator"
COLUMNS = ("parameter", "estimate", "± 95 %", "unit", "nodes now", "")
ADVICE = {
    ("mass", "seal_friction_coefficient"): "drive up, down and across the wall; on a floor, change "
    "speed",
    ("yaw_inertia",): "drive bends to both sides",
    ("wheel_radius", "half_track"): "drive further, and turn",
}
DIGITS = 6  # of a parameter that is written


def rows(found: Identified, believed: Climber) -> Iterator[dict[str, Any]]:
    """What is told of each parameter."""
    columns = (NAMES, found.values, found.half_widths, found.sought, found.known)
    for name, value, half_width, sought, known in zip(*columns, strict=True):
        yield {
            "parameter": name,
            "estimate": float(value) if sought else None,
            "half_width": float(half_width) if sought else None,
            "unit": UNITS[name],
            "nodes_now": float(getattr(believed, name, 0.0)),
            "known": bool(sought and known),
        }


def table(found: Identified, believed: Climber) -> str:
    """The same, as text."""
    cells = []
    for row in rows(found, believed):
        digits = {"estimate": 5, "half_width": 2, "nodes_now": 5}
        numbers = [("" if row[key] is None else f"{row[key]:.{n}g}") for key, n in digits.items()]
        unknown = "cannot be told" if row["estimate"] is not None else "not in this bag"
        remark = "" if row["known"] else unknown
        cells.append((row["parameter"], *numbers[:2], row["unit"], numbers[2], remark))
    return markdown(COLUMNS, cells)


def remarks(found: Identified) -> Iterator[str]:
    """Sentences on what the table does not say."""
    sought = dict(zip(NAMES, found.sought.tolist(), strict=True))
    yield (
        f"{len(found.windows)} windows in motion; the seal rubs with {found.friction:.4g} N at "
        f"{found.extent.speed:.3g} m/s"
    )
    if not sought["viscous_friction"]:
        yield "viscous friction cannot be told apart from the seal's: drive at different speeds"
    elif found.is_clear("viscous_friction"):
        yield "the controller knows no viscous friction: it gets that of this speed as the seal's"
    if found.is_clear("turning_resistance"):
        yield "turning is resisted, which the controller does not know: it is left to its observer"
    if not sought["wheel_radius"]:
        yield "joint_states has no wheel angles: radius and track are taken as they are"
    else:
        yield "radius and track are those of odometry that does not come from the wheels itself"


def missing(found: Identified) -> Iterator[str]:
    """Sentences on what cannot be told, and how to drive so that it can."""
    known = dict(zip(NAMES, (found.known | ~found.sought).tolist(), strict=True))
    for group, advice in ADVICE.items():
        names = [name.replace("_", " ") for name in group if not known[name]]
        if names:
            apart = " apart" if len(names) > 1 else ""
            yield (
                f"{' and '.join(names)} cannot be told{apart} from this bag: {advice} (see --plan)"
            )


def changes(found: Identified, believed: Climber) -> dict[str, dict[str, Any]]:
    """Parameters by node; what is not known stays as it is."""
    known = {row["parameter"]: row["estimate"] for row in rows(found, believed) if row["known"]}
    climber = {name: value for name, value in known.items() if hasattr(believed, name)}
    controller, plant = dict(climber), dict(climber)
    seal, viscous = climber.get("seal_friction_coefficient", 0.0), found["viscous_friction"]
    if seal > 0:
        controller["seal_friction_coefficient"] = max(0.0, found.friction / found.extent.load)
        if viscous > 0 and found.is_clear("viscous_friction"):
            law = {"ratio": 1.0, "viscous": viscous / (seal * found.extent.load)}
            plant |= {"friction": "stribeck", **{f"stribeck.{k}": v for k, v in law.items()}}
        else:
            plant |= {"friction": "coulomb", **controller}
    return {CONTROLLER: _rounded(controller), PLANT: _rounded(plant)}


def _rounded(values: dict[str, Any]) -> dict[str, Any]:
    return {k: v if isinstance(v, str) else float(f"{v:.{DIGITS}g}") for k, v in values.items()}
