"""Warnings about implausible values: most are in another unit than the parameter's."""

import dataclasses
import math
from typing import Any

DEGREE = math.pi / 180
TURN_A_MINUTE = 2 * math.pi / 60
OTHER_UNITS = {
    "m": {"mm": 1e-3, "cm": 1e-2},
    "m²": {"mm²": 1e-6, "cm²": 1e-4},
    "kg": {"g": 1e-3},
    "kg m²": {"kg mm²": 1e-6, "kg cm²": 1e-4, "g m²": 1e-3},
    "s": {"ms": 1e-3},
    "m/s": {"mm/s": 1e-3, "cm/s": 1e-2},
    "deg": {"rad": 1 / DEGREE},
    "rad": {"deg": DEGREE},
    "rad/s": {"turns a minute": TURN_A_MINUTE, "deg/s": DEGREE},
    "N m": {"N mm": 1e-3},
    "Pa": {"kPa": 1e3, "mbar": 1e2, "bar": 1e5},
}
"""Units that a number may be in by mistake, each in the unit that is meant."""

USUAL = {
    "m": (0.0, 1000.0),
    "kg": (0.0, 1000.0),
    "s": (0.0, 1000.0),
    "m/s": (0.0, 50.0),
    "rad": (0.0, 2.1 * math.pi),
    "rad/s": (0.0, 1000.0),
    "Pa": (0.0, 1.2e5),
}
"""Lowest and highest size by unit, for parameters without `plausible`."""


def doubt(field: "dataclasses.Field[Any]", value: Any) -> str:
    """Message that `value` is implausible for a field made by `parameter`; empty if it is not.

    0 is plausible: it switches off.
    """
    unit = field.metadata["unit"]
    low, high = field.metadata["plausible"] or USUAL.get(unit, (0.0, math.inf))
    is_number = not isinstance(value, bool | str) and math.isfinite(value)
    if not is_number or value == 0 or low <= abs(value) <= high:
        return ""
    others = {
        other: value * factor
        for other, factor in OTHER_UNITS.get(unit, {}).items()
        if low <= abs(value * factor) <= high
    }
    number = f"{value:g} [{unit}]" if unit else f"{value:g}"
    said = f"{field.name}={number} is hardly meant (usual: {low:g} to {high:g})"
    if not others:
        return said
    meant, default = next(iter(others)), field.default
    if default:  # what is nearest to it, in ratio
        meant = min(others, key=lambda other: abs(math.log(abs(others[other] / default))))
    return f"{said}; if it is in {meant}, write {others[meant]:.4g}"
