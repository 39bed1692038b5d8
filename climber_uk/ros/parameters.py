"""Dataclasses made by `parameter` as ROS parameters: declared, described, bounded, checked."""

import dataclasses
import sys
from collections.abc import Callable, Sequence
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

from climber_uk.parameters.declaration import QOS, TYPE_WORDS, bounds, check_value
from climber_uk.parameters.parameter_files import ParameterFiles
from climber_uk.parameters.parameter_paths import located
from climber_uk.parameters.plausibility import doubt

T = TypeVar("T")
Field = dataclasses.Field[Any]


class NodeParameters:
    """The parameters of a node, kept as the dataclasses that they fill.

    All are read-only but those declared with `runtime=True`. A request to set some is checked,
    and done wholly or not at all; then `on_change` is called.
    """

    def __init__(
        self, node: Node, arguments: Sequence[str], on_change: Callable[[], None] = lambda: None
    ) -> None:
        self._node = node
        self._arguments = arguments
        self._on_change = on_change
        self.remarks: list[str] = []  # warnings for the log: renamed, doubtful or idle values
        self.origin = ""  # of the values that are given, for the log
        self._kept: dict[tuple[str, type], Any] = {}
        self._fields: dict[str, tuple[str, type, Field]] = {}
        node.add_pre_set_parameters_callback(self._as_declared)
        node.add_on_set_parameters_callback(self._set)

    @property
    def declared(self) -> list[tuple[str, type, Field]]:
        """Prefix, class and field of every parameter, in the order in which they were declared."""
        return list(self._fields.values())

    @property
    def values(self) -> dict[str, Any]:
        """Present value of every parameter, by its name."""
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
            if name in self._fields:
                raise ValueError(
                    f"{name} is a parameter of two parts: one must be called otherwise"
                )
            try:
                if (given := self._given(name, prefix, field)) is not None:
                    check_value(field, given)
                    self.remarks += [prefix + said for said in [doubt(field, given)] if said]
                self._node.declare_parameter(name, field.default, descriptor(field))
            except ValueError as error:
                raise ValueError(f"{prefix}{error}") from None
            except ParameterException:
                wanted = TYPE_WORDS[type(field.default)]
                raise ValueError(f"{name}={given!r} must be {wanted}") from None
            self._fields[name] = (prefix, kind, field)

    def _given(self, name: str, prefix: str, field: Field) -> Any:
        """Value that is given for a parameter, if one is; an integer will do for a float."""
        # private: rclpy tells only of what is declared, and only where the type is right
        overrides = self._node._parameter_overrides
        old = prefix + field.metadata["formerly"]
        if field.metadata["formerly"] and old in overrides:
            overrides.setdefault(name, Parameter(name, value=overrides.pop(old).value))
            self.remarks.append(f"{old} is called {name} now")
        if name not in overrides:
            return None
        if overrides[name].value is None:  # as rcl has an empty list
            raise ValueError(f"{field.name} has no value")
        overrides[name] = _as_float(overrides[name], field)
        return overrides[name].value

    def read(self, kind: type[T], prefix: str = "") -> T:
        """Present values of the fields of `kind`, which were declared with `prefix`.

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
        return self._kept[prefix, kind]

    def refuse_unknown(self, defaults: str = "") -> None:
        """Raise `ValueError` if a parameter was given that is not declared: it is misspelt.

        One that is given to nodes of any name is only remarked on. So is a file that has nothing
        for this node, unless `defaults` names what it would then run with, which must be asked for.
        """
        node, given = self._node, self._node._parameter_overrides
        files = ParameterFiles(self._arguments, node.get_fully_qualified_name())
        ours = [name for name in self._fields if name in given]
        unknown = [n for n in given if not (node.has_parameter(n) or n.startswith(QOS))]
        for name in unknown:
            if not files.is_shared(name):
                raise ValueError(f"{name} is not a parameter of {node.get_name()}{self.like(name)}")
        if unknown:
            said = ", ".join(unknown)
            self.remarks.append(f"given to all nodes, but no parameter of this one: {said}")
        if defaults and files.has_nothing_of(ours):
            raise ValueError(files.emptiness)
        self.remarks += files.idle
        self.origin = f"defaults: {defaults}" if defaults else "defaults"
        if ours:
            count = f"{len(ours)} of {len(self._fields)}"
            self.origin = f"{count} parameters given ({files.named(ours)})"

    def like(self, name: str) -> str:
        """' (did you mean …?)' with the nearest parameter of this node; empty if none is near."""
        from climber_uk.parameters.parameter_file import similar  # only where something is wrong

        return similar(name, self._node._parameters)

    def _as_declared(self, changes: list[Parameter]) -> list[Parameter]:
        """Changes with integers made floats where a float is declared."""
        return [
            _as_float(change, self._fields[change.name][2])
            if change.name in self._fields
            else change
            for change in changes
        ]

    def _set(self, changes: list[Parameter]) -> SetParametersResult:
        """Set parameters while the node runs: all of a request, or none."""
        kept, doubts = dict(self._kept), []
        try:
            for change in changes:
                if change.name in self._fields:
                    prefix, kind, field = self._fields[change.name]
                    check_value(field, change.value)
                    if (prefix, kind) in kept:
                        changed = {field.name: change.value}
                        kept[prefix, kind] = dataclasses.replace(kept[prefix, kind], **changed)
                    doubts += [prefix + said for said in [doubt(field, change.value)] if said]
        except ValueError as error:
            return SetParametersResult(successful=False, reason=f"{prefix}{error}")
        if kept != self._kept:
            self._kept = kept
            self._on_change()
        for said in doubts:
            self._node.get_logger().warning(said)  # rclpy tells no reason of what is done
        return SetParametersResult(successful=True)


def _as_float(given: Parameter, field: Field) -> Parameter:
    """`given`, its integer made a float where the field is one and the value stays the same."""
    value = given.value
    if isinstance(field.default, float) and type(value) is int and float(value) == value:
        return Parameter(given.name, value=float(value))
    return given


def descriptor(field: Field) -> ParameterDescriptor:
    """Descriptor with what `parameter` says of a field: description, unit, bounds, choices."""
    rule = field.metadata
    unit = f" [{rule['unit']}]" if rule["unit"] else ""
    choices = [f"one of {', '.join(rule['choices'])}"] if rule["choices"] else []
    told = ParameterDescriptor(
        description=rule["description"] + unit,
        read_only=not rule["runtime"],
        additional_constraints=" and ".join(choices + bounds(rule)),
    )
    lowest, highest = rule["at_least"], rule["at_most"]
    if lowest is None or highest is None:
        return told  # a range has two ends, both of them within
    if isinstance(field.default, int):
        told.integer_range = [IntegerRange(from_value=int(lowest), to_value=int(highest))]
    else:
        ends = FloatingPointRange(from_value=float(lowest), to_value=float(highest))
        told.floating_point_range = [ends]
    return told
