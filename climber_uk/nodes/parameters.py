"""Dataclasses made by `parameter` as ROS parameters: declared, described, bounded, checked."""

import dataclasses
import sys
from collections.abc import Callable
from typing import Any, TypeVar

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from climber_uk.mechanics.parameter import check_value
from climber_uk.nodes.parameter_paths import located

T = TypeVar("T")
Field = dataclasses.Field[Any]


class Parameters:
    """The parameters of a node, kept as the dataclasses that they fill.

    Every one is read-only but those declared with `runtime=True`: these are checked when they
    are set, all of a request or none, and `on_change` is called with nothing left half set.
    """

    def __init__(self, node: Node, on_change: Callable[[], None] = lambda: None) -> None:
        self._node = node
        self._on_change = on_change
        self._kept: dict[tuple[str, type], Any] = {}
        self._fields: dict[str, tuple[str, type, Field]] = {}
        node.add_on_set_parameters_callback(self._change)

    @property
    def declared(self) -> list[tuple[str, type, Field]]:
        """Prefix, class and field of every parameter, in the order in which they were declared."""
        return list(self._fields.values())

    @property
    def values(self) -> dict[str, Any]:
        """Every parameter as it is now, by its name."""
        return {
            name: getattr(self.read(kind, prefix), field.name)
            for name, (prefix, kind, field) in self._fields.items()
        }

    def declare(self, kind: type[T], prefix: str = "") -> None:
        """Declare the fields of `kind` as `prefix` + name.

        Raises `ValueError` naming parameter, value and bound.
        """
        for field in dataclasses.fields(kind):  # type: ignore[arg-type]
            name = prefix + field.name
            override = self._node._parameter_overrides.get(name)
            try:
                if override is not None:
                    check_value(field, override.value)
                self._node.declare_parameter(name, field.default, _descriptor(field))
            except ValueError as error:
                raise ValueError(f"{prefix}{error}") from None
            except ParameterException:
                wanted = type(field.default).__name__
                hint = f" (write {float(override.value)})" if wanted == "float" else ""
                raise ValueError(f"{name}={override.value!r} must be a {wanted}{hint}") from None
            self._fields[name] = (prefix, kind, field)

    def read(self, kind: type[T], prefix: str = "") -> T:
        """Instance of `kind`, of fields declared before, as it is now.

        Raises `ValueError` naming parameter, value and bound.
        """
        if (prefix, kind) not in self._kept:
            names = [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]
            values = {name: self._node.get_parameter(prefix + name).value for name in names}
            for field in dataclasses.fields(kind):  # type: ignore[arg-type]
                if field.metadata.get("is_path") and values[field.name]:
                    path, owner = values[field.name], self._node.get_fully_qualified_name()
                    values[field.name] = located(path, prefix + field.name, owner, sys.argv)
            try:
                self._kept[prefix, kind] = kind(**values)
            except ValueError as error:
                raise ValueError(f"{prefix}{error}") from None
        kept: T = self._kept[prefix, kind]
        return kept

    def refuse_unknown(self) -> None:
        """Raise `ValueError` if a parameter was given that no one declared: it is misspelt."""
        for name in self._node._parameter_overrides:
            if not (self._node.has_parameter(name) or name.startswith("qos_overrides.")):
                raise ValueError(f"{name} is not a parameter of {self._node.get_name()}")

    def _change(self, changes: list[Parameter]) -> SetParametersResult:
        kept = dict(self._kept)
        try:
            for change in changes:
                if change.name in self._fields:
                    prefix, kind, field = self._fields[change.name]
                    check_value(field, change.value)
                    if (prefix, kind) in kept:
                        changed = {field.name: change.value}
                        kept[prefix, kind] = dataclasses.replace(kept[prefix, kind], **changed)
        except ValueError as error:
            return SetParametersResult(successful=False, reason=f"{prefix}{error}")
        if kept != self._kept:
            self._kept = kept
            self._on_change()
        return SetParametersResult(successful=True)


def _descriptor(field: Field) -> ParameterDescriptor:
    rule = field.metadata
    unit = f" [{rule['unit']}]" if rule["unit"] else ""
    descriptor = ParameterDescriptor(
        description=rule["description"] + unit,
        read_only=not rule["runtime"],
        additional_constraints=f"one of {', '.join(rule['choices'])}" if rule["choices"] else "",
    )
    lowest = rule["at_least"] if rule["above"] is None else rule["above"]
    if lowest is None and rule["at_most"] is None:
        return descriptor
    if isinstance(field.default, int):
        highest = 2**31 - 1 if rule["at_most"] is None else rule["at_most"]
        descriptor.integer_range = [IntegerRange(from_value=int(lowest), to_value=int(highest))]
    else:
        most = sys.float_info.max
        least = -most if lowest is None else float(lowest)
        most = most if rule["at_most"] is None else float(rule["at_most"])
        descriptor.floating_point_range = [FloatingPointRange(from_value=least, to_value=most)]
    return descriptor
