"""Parameters as dataclass fields with unit, bounds and meaning, checked at construction."""

import dataclasses
import math
from collections.abc import Collection, Mapping
from functools import partial
from numbers import Real
from typing import Any, dataclass_transform

import numpy as np

SMALLEST, LARGEST = 1e-12, 1e12  # of any number that is divided by, or multiplied: see `check`
TYPE_WORDS = {bool: "true or false", int: "an integer", float: "a number", str: "a text"}
LONGEST_VALUE = 200  # [characters] of a value in a message
QOS = "qos_overrides."  # with which rclpy's own parameters begin


def parameter(
    default: Any,
    unit: str,
    description: str,
    *,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    nonzero: bool = False,
    choices: Collection[str] | None = None,
    plausible: tuple[float, float] | None = None,
    formerly: str = "",
    runtime: bool = False,
    is_path: bool = False,
) -> Any:
    """Declare a dataclass field as a parameter, with its unit and description.

    `above` is an exclusive lower bound, `at_least` and `at_most` are inclusive, a `nonzero` number
    may have either sign, as a radius seen from either side; a size out of the
    range `plausible` is doubted, not refused; a name that it had `formerly` is still taken;
    `runtime` marks what a running node may change, `is_path` the name of a file, which in a
    parameter file is relative to that. `parameters` makes the class.
    """
    return dataclasses.field(
        default=default,
        metadata={
            "unit": unit,
            "description": description,
            "above": above,
            "at_least": at_least,
            "at_most": at_most,
            "nonzero": nonzero,
            "choices": choices,
            "plausible": plausible,
            "formerly": formerly,
            "runtime": runtime,
            "is_path": is_path,
        },
    )


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field,))
def parameters(cls: type | None = None, *, slots: bool = False) -> Any:
    """Frozen dataclass that checks its `parameter` fields, before its own `__post_init__`."""
    if cls is None:
        return partial(parameters, slots=slots)
    and_then = vars(cls).get("__post_init__")

    def check_it(self: Any) -> None:
        check(self)
        if and_then:
            and_then(self)

    cls.__post_init__ = check_it  # type: ignore[attr-defined]
    return dataclasses.dataclass(frozen=True, slots=slots)(cls)


def check(instance: Any) -> None:
    """Raise `ValueError` naming field, value and bound unless all `parameter` fields are valid.

    No number is so large, or if it has to be positive so small, that its powers are none.
    """
    for field in dataclasses.fields(instance):
        if field.metadata:
            check_value(field, getattr(instance, field.name))


def check_value(field: "dataclasses.Field[Any]", value: Any) -> None:
    """Raise `ValueError` unless `field`, made by `parameter`, allows `value`.

    An array (N,) holds a value for each of many climbers; all must be allowed.
    """
    rule = field.metadata
    said = f"{field.name}={_shown(value)} must be"
    unit = f" [{rule['unit']}]" if rule["unit"] else ""
    if rule["choices"] is not None and not (isinstance(value, str) and value in rule["choices"]):
        raise ValueError(f"{said} one of {', '.join(rule['choices'])}")
    if isinstance(field.default, bool | str):
        if type(value) is not type(field.default):
            raise ValueError(f"{said} {TYPE_WORDS[type(field.default)]}")
        return
    # bounds are intervals: all are within if the extremes are, and these are nan if any is
    is_many = isinstance(value, np.ndarray)
    for number in (value.min().item(), value.max().item()) if is_many else (value,):
        said = f"{field.name}={_shown(number)} must be"
        _check_number(rule, said, number, unit)
        if isinstance(field.default, float):
            _check_size(rule, said, abs(float(number)), unit)
    if rule["nonzero"] and np.any(value == 0):
        raise ValueError(f"{field.name}=0.0 must not be 0{unit}")


def _shown(value: Any) -> str:
    """A value, with an end: what is behind it says what is wrong."""
    text = repr(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}…"


def bounds(rule: Mapping[str, Any]) -> list[str]:
    """Bounds of a `parameter`, in words."""
    signs = {"above": ">", "at_least": ">=", "at_most": "<="}
    said = [f"{sign} {rule[name]:g}" for name, sign in signs.items() if rule[name] is not None]
    return said + ["!= 0"] * rule["nonzero"]


def _check_number(rule: Mapping[str, Any], said: str, value: Any, unit: str) -> None:
    if isinstance(value, bool) or not (isinstance(value, Real) and math.isfinite(value)):
        raise ValueError(f"{said} a finite number{unit}")
    if rule["above"] is not None and not value > rule["above"]:
        raise ValueError(f"{said} > {rule['above']}{unit}")
    if rule["at_least"] is not None and not value >= rule["at_least"]:
        raise ValueError(f"{said} >= {rule['at_least']}{unit}")
    if rule["at_most"] is not None and not value <= rule["at_most"]:
        raise ValueError(f"{said} <= {rule['at_most']}{unit}")


def _check_size(rule: Mapping[str, Any], said: str, size: float, unit: str) -> None:
    if size > LARGEST or (rule["above"] is not None and size < SMALLEST):
        raise ValueError(f"{said} of a size from {SMALLEST:g} to {LARGEST:g}{unit}")
